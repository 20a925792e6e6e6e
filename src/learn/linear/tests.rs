//! What learners on linear values must agree with: tables, where features are those of a table, the
//! equations written out, and theorems.

use super::{LinearLearner, LinearQ, LinearSetup, Target};
use crate::learn::control::{Trace, Traces};
use crate::learn::registry::{AGENTS, Build, Setup, find};
use crate::learn::{
    Agent, AgentConfig, Behaviour, Exploration, Last, Learn, ParamValue, QTable, Schedule,
};
use crate::mdp::math::cos;
use crate::mdp::streams::Stream;
use crate::shaping::{
    ActionSet, Dim, FeatureKind, FeatureSpec, Features, Fields, MAX_FIELDS, Shielded,
};

const ACTIONS: usize = 3;

fn features(kind: FeatureKind, dims: &[(f64, f64, usize)]) -> Features {
    let dims = dims.iter().enumerate();
    let dims = dims.map(|(field, &(lo, hi, n))| Dim { field, lo, hi, n }).collect();
    Features::new(&FeatureSpec { kind, dims }).unwrap()
}

fn fields(numbers: &[f64]) -> Fields {
    let mut values = [0.0; MAX_FIELDS];
    values[..numbers.len()].copy_from_slice(numbers);
    Fields { values, index: 0, allowed: ActionSet::ALL }
}

/// Greedy, with a constant step size.
fn greedy(q: LinearQ, target: Target, gamma: f64, alpha: f64) -> LinearLearner {
    let none = Schedule::constant(0.0);
    let behaviour =
        Behaviour::new(Exploration::EpsilonGreedy, none, [1, ACTIONS], Stream::new(0, "test"));
    LinearLearner::new(q, target, gamma, Schedule::constant(alpha), behaviour)
}

#[test]
fn a_step_by_hand() {
    // Two tilings of two tiles over 0..2; 0.25 lies in tiles 0 and 3, 0.75 in 0 and 4.
    let q = LinearQ::new(features(FeatureKind::Tiles(2), &[(0.0, 2.0, 2)]), ACTIONS, 1.0);
    for target in [Target::Max, Target::Sarsa, Target::Expected] {
        let mut agent = greedy(q.clone(), target, 0.9, 0.5);
        assert_eq!(agent.begin(fields(&[0.25])), 0);
        agent.step(10.0, fields(&[0.75]));
        // The error is 10 + 0.9 - 1 = 9.9, and α moves the value by half of it: a quarter each.
        let weight = |i, a| agent.weights().unwrap().get(i, a);
        for (i, a, w) in [(0, 0, 2.975), (3, 0, 2.975), (4, 0, 0.5), (0, 1, 0.5), (3, 2, 0.5)] {
            assert!((weight(i, a) - w).abs() < 1e-15, "{target:?} {i} {a}: {}", weight(i, a));
        }
    }
}

#[test]
fn q_learning_chooses_by_the_values_after_the_update_and_sarsa_by_those_before() {
    let start = || {
        let shape = features(FeatureKind::Tiles(2), &[(0.0, 2.0, 2)]);
        LinearQ::new(shape, ACTIONS, 0.0)
    };
    // The punishment of action 0 at 0.25 is felt at 0.75, which shares a tile.
    let mut agent = greedy(start(), Target::Max, 1.0, 0.5);
    assert_eq!(agent.begin(fields(&[0.25])), 0);
    assert_eq!(agent.step(-1.0, fields(&[0.75])), 1);
    let mut agent = greedy(start(), Target::Sarsa, 1.0, 0.5);
    assert_eq!(agent.begin(fields(&[0.25])), 0);
    assert_eq!(agent.step(-1.0, fields(&[0.75])), 0);
}

#[test]
fn termination_cuts_the_target_and_truncation_does_not() {
    let value = |last: Last<Fields>, target| {
        let q = LinearQ::new(features(FeatureKind::Fourier, &[(0.0, 1.0, 2)]), ACTIONS, 4.0);
        let mut agent = greedy(q, target, 0.5, 1.0);
        agent.begin(fields(&[0.3]));
        agent.end(1.0, last);
        agent.weights().unwrap().get(0, 0) - 4.0
    };
    for target in [Target::Max, Target::Watkins, Target::Sarsa, Target::Expected] {
        assert_eq!(value(Last::Terminated, target), -3.0);
        assert_eq!(value(Last::Truncated(fields(&[0.8])), target), -1.0);
    }
}

/// One tiling is a table: every agent that learns linear values learns the table's own bits, and
/// plays the same.
#[test]
fn one_tiling_is_a_table() {
    const ROWS: usize = 12;
    let mut compared = Vec::new();
    for spec in AGENTS.iter().filter(|spec| spec.linear.is_some()) {
        for traces in ["accumulating", "replacing", "dutch"] {
            let mut config = AgentConfig::new(find(spec.name).unwrap());
            if config.params.contains_key("traces") {
                config.params.insert("traces", ParamValue::Word(traces));
            } else if traces != "dutch" {
                continue;
            }
            if config.params.contains_key("epsilon") {
                let epsilon = ParamValue::Schedule(Schedule::constant(0.3));
                config.params.insert("epsilon", epsilon);
                config.params.insert("initial_q", ParamValue::Float(0.7));
            }
            let stream = || Stream::new(4, "agent");
            let build = match spec.build {
                Build::Learner(build)
                | Build::OnPolicy { build, .. }
                | Build::OneStep { build, .. } => build,
                Build::Predictor(_) | Build::Planner(_) => panic!("{}", spec.name),
            };
            let setup = Setup {
                n_states: ROWS,
                n_actions: ACTIONS,
                seed: 4,
                stream: stream(),
                initial_q: None,
                initial_v: None,
                policy: None,
            };
            let mut table = build(&config, setup).boxed();
            let shape = features(FeatureKind::Tiles(1), &[(0.0, 4.0, 4), (0.0, 3.0, 3)]);
            let setup = LinearSetup { features: shape, n_actions: ACTIONS, stream: stream() };
            let mut linear = spec.linear.unwrap()(&config, setup);
            same_play(&mut table, &mut linear);
            let values = table.q().map(QTable::values);
            assert_eq!(values, linear.weights().map(QTable::values), "{} {traces}", spec.name);
            compared.push(spec.name);
        }
    }
    for name in ["q_learning", "sarsa", "expected_sarsa", "sarsa_lambda", "q_lambda"] {
        assert!(compared.contains(&name), "{compared:?}");
    }
}

/// Both meet the same random states, shields, rewards and endings; both must play the same.
fn same_play<T: Learn<Shielded>>(table: &mut T, linear: &mut Box<dyn Learn<Fields>>) {
    let mut world = Stream::new(9, "world");
    let mut see = || {
        let (row, column) = (world.below(4), world.below(3));
        // Never empty: the first bit stands in for nothing.
        let allowed = ActionSet(world.below(7) as u64 + 1);
        let seen = Shielded { cell: 3 * row + column, allowed };
        let (x, y) = (row as f64 + 0.2 + 0.6 * world.uniform(), column as f64 + 0.5);
        (seen, Fields { allowed, ..fields(&[x, y]) }, world.uniform())
    };
    for _ in 0..300 {
        let (cell, state, _) = see();
        assert_eq!(table.begin(cell), linear.begin(state));
        loop {
            let (cell, state, reward) = see();
            if reward < 0.05 {
                table.end(reward, Last::Terminated);
                linear.end(reward, Last::Terminated);
                break;
            }
            if reward < 0.1 {
                table.end(reward, Last::Truncated(cell));
                linear.end(reward, Last::Truncated(state));
                break;
            }
            assert_eq!(table.step(reward, cell), linear.step(reward, state));
            assert_eq!(table.epsilon(), linear.epsilon());
        }
    }
}

/// SARSA(λ) with every trace kept, against the equations with a dense vector z.
#[test]
fn traces_are_those_of_the_equations() {
    let (gamma, lambda, alpha) = (0.9, 0.8, 0.2);
    let tiles = features(FeatureKind::Tiles(4), &[(0.0, 1.0, 3), (0.0, 1.0, 2)]);
    let fourier = features(FeatureKind::Fourier, &[(0.0, 1.0, 3), (0.0, 1.0, 2)]);
    for (shape, kind) in [
        (&tiles, Trace::Accumulating),
        (&tiles, Trace::Replacing),
        (&tiles, Trace::Dutch),
        (&fourier, Trace::Accumulating),
        (&fourier, Trace::Dutch),
    ] {
        let n = shape.n_features() * ACTIONS;
        let traces = Traces::new(kind, gamma * lambda, 0.0, n);
        let mut agent =
            greedy(LinearQ::new(shape.clone(), ACTIONS, 0.0), Target::Sarsa, gamma, alpha)
                .with_traces(traces);
        let (mut w, mut z) = (vec![0.0; n], vec![0.0; n]);
        // ∇q(s, a), every feature times its share of the step size, and z's equation.
        let gradient = |s: &Fields, a: usize| {
            let mut active = shape.active();
            shape.see(&s.values, &mut active);
            let mut x = vec![0.0; n];
            for (i, value) in active.index.iter().zip(active.value) {
                x[*i as usize * ACTIONS + a] = value;
            }
            x
        };
        let share = |i: usize| shape.share(i / ACTIONS);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut world = Stream::new(3, "world");
        let mut state = || fields(&[world.uniform(), world.uniform()]);
        let mut s = state();
        let mut a = agent.begin(s);
        for step in 0..400 {
            let (next, reward) = (state(), f64::from(step % 7) - 3.0);
            let a_next = agent.step(reward, next);
            let x = gradient(&s, a);
            let delta = reward + gamma * dot(&w, &gradient(&next, a_next)) - dot(&w, &x);
            let scaled: Vec<f64> = (0..n).map(|i| alpha * share(i) * x[i]).collect();
            let product = dot(&z, &scaled);
            for i in 0..n {
                z[i] = match kind {
                    Trace::Accumulating => z[i] + x[i],
                    Trace::Replacing => {
                        if x[i] == 1.0 {
                            1.0
                        } else {
                            z[i]
                        }
                    }
                    Trace::Dutch => z[i] + (1.0 - product) * x[i],
                };
                w[i] += alpha * delta * share(i) * z[i];
                z[i] *= gamma * lambda;
            }
            (s, a) = (next, a_next);
        }
        let learned = agent.weights().unwrap().values();
        let scale = w.iter().fold(1.0f64, |m, w| m.max(w.abs()));
        for (learned, w) in learned.iter().zip(&w) {
            assert!((learned - w).abs() < 1e-10 * scale, "{kind:?}: {learned} {w}");
        }
    }
}

/// A potential that is a weighted sum of the features equals initial weights, step by step (the
/// proof of Wiewiora 2003: both learners have the same errors); another potential does not.
#[test]
fn a_potential_equals_initial_weights_if_it_is_linear_in_the_features() {
    let shape = features(FeatureKind::Fourier, &[(0.0, 1.0, 3)]);
    let c = [0.4, -1.5, 0.0, 0.7];
    let linear = |x: f64| (0..4).map(|i| c[i] * cos(std::f64::consts::PI * i as f64 * x)).sum();
    let bent = |x: f64| -> f64 { x * x };
    let drift = |phi: &dyn Fn(f64) -> f64| {
        let (gamma, alpha) = (0.9, 0.05);
        let initial = c.iter().flat_map(|c| [*c; ACTIONS]).collect();
        let start = LinearQ::from_weights(shape.clone(), QTable::from_values(ACTIONS, initial));
        let zero = LinearQ::new(shape.clone(), ACTIONS, 0.0);
        let mut shaped = greedy(zero, Target::Max, gamma, alpha);
        let mut raised = greedy(start, Target::Max, gamma, alpha);
        let mut world = Stream::new(5, "world");
        let mut x = world.uniform();
        assert_eq!(shaped.begin(fields(&[x])), raised.begin(fields(&[x])));
        for _ in 0..2_000 {
            let (next, reward) = (world.uniform(), world.uniform());
            let f = gamma * phi(next) - phi(x);
            let a = shaped.step(reward + f, fields(&[next]));
            if a != raised.step(reward, fields(&[next])) {
                return f64::INFINITY;
            }
            x = next;
        }
        let (shaped, raised) = (shaped.weights().unwrap(), raised.weights().unwrap());
        let mut worst = 0.0f64;
        for (i, c) in c.iter().enumerate() {
            for a in 0..ACTIONS {
                worst = worst.max((shaped.get(i, a) + c - raised.get(i, a)).abs());
            }
        }
        worst
    };
    assert!(drift(&linear) < 1e-12, "{}", drift(&linear));
    assert!(drift(&bent) > 1e-2, "{}", drift(&bent));
}
