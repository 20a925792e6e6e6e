//! What every registered environment must do, whichever it is.

use proptest::prelude::*;
use runner::env::{AnyEnv, EnvVisitor, Observation, Session, find, specs};
use runner::mdp::numpy::{NumpyRng, Seed};
use runner::mdp::streams::Stream;
use runner::mdp::{Env, FieldKind};
use serde_json::Map;

/// Plays one trajectory and checks the contract of [`Env`] in every step.
struct Contract {
    id: &'static str,
    seed: u64,
    actions: Vec<u8>,
}

/// Everything that a trajectory shows: the fields and the bits of each reward.
type Trace = Vec<(Vec<f64>, f64, bool)>;

impl EnvVisitor for Contract {
    type Out = Trace;

    fn visit<E: Env + Clone + 'static>(self, mut env: E) -> Trace {
        let schema = env.schema();
        let n = env.n_actions();
        assert_eq!(E::INDEXED, env.n_states().is_some(), "{}", self.id);
        assert_eq!(schema.actions.len(), n, "{}: a name for every action", self.id);
        let mut rng = NumpyRng::from_u64(self.seed);
        let (mut twin, mut twin_rng) = (env.clone(), rng.clone());
        // A disturber of the same type, with its own stream: instances must not share state.
        let (mut other, mut other_rng) = (env.clone(), NumpyRng::from_u64(!self.seed));
        let mut trace = Trace::new();
        let mut fields = vec![f64::NAN; schema.fields.len()];

        let mut obs = env.reset(&mut rng);
        twin.reset(&mut twin_rng);
        other.reset(&mut other_rng);
        env.fields(&obs, &mut fields);
        trace.push((fields.clone(), 0.0, false));
        assert_eq!(env.outcome_index(&obs), None, "{}: a reset is no outcome", self.id);
        for &action in &self.actions {
            let action = usize::from(action) % n;
            let before = env.state_index(&obs);
            let step = env.step(action, &mut rng);
            let again = twin.step(action, &mut twin_rng);
            if other.step(n - 1 - action, &mut other_rng).terminated {
                other.reset(&mut other_rng);
            }
            assert_eq!(format!("{step:?}"), format!("{again:?}"), "{}: same seed", self.id);
            assert_eq!(rng, twin_rng);
            assert!(step.reward.is_finite());

            fields.fill(f64::NAN);
            env.fields(&step.obs, &mut fields);
            for (field, &x) in schema.fields.iter().zip(&fields) {
                assert!(
                    field.low <= x && x <= field.high,
                    "{}: {} = {x} is outside [{}, {}]",
                    self.id,
                    field.name,
                    field.low,
                    field.high
                );
                if field.kind != FieldKind::Float {
                    assert_eq!(x, x.trunc(), "{}: {} is an integer", self.id, field.name);
                }
            }
            if let Some(mdp) = env.finite() {
                let outcome = env.outcome_index(&step.obs).unwrap();
                assert!(mdp.range(before.unwrap(), action).contains(&outcome));
                let outcome = mdp.outcomes()[outcome];
                assert_eq!(env.state_index(&step.obs), Some(outcome.next_state as usize));
                assert_eq!((outcome.reward, outcome.terminated), (step.reward, step.terminated));
            } else {
                assert_eq!(env.outcome_index(&step.obs), None);
            }
            match (env.state_index(&step.obs), env.n_states()) {
                (Some(index), Some(n)) => assert!(index < n),
                (index, n) => assert_eq!((index, n), (None, None)),
            }
            trace.push((fields.clone(), step.reward, step.terminated));
            obs = step.obs;
            if step.terminated {
                obs = env.reset(&mut rng);
                twin.reset(&mut twin_rng);
            }
        }
        trace
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(24) })]

    #[test]
    fn every_environment_keeps_the_contract(
        seed: u64,
        actions in proptest::collection::vec(any::<u8>(), 1..400),
    ) {
        for spec in specs() {
            let play = |seed| {
                let env = spec.make(&Map::new()).unwrap();
                env.visit(Contract { id: spec.id, seed, actions: actions.clone() })
            };
            prop_assert_eq!(play(seed), play(seed), "{}", spec.id);
        }
    }

    #[test]
    fn sessions_truncate_at_the_limit_and_play_what_the_environment_plays(
        seed: u64,
        actions in proptest::collection::vec(any::<u8>(), 600),
    ) {
        for spec in specs() {
            let mut session = Session::new(spec.id, &Map::new()).unwrap();
            let n = session.schema().actions.len();
            session.reset(Some(&Seed::from(seed)), None).unwrap();
            let mut played = 0;
            for action in actions.iter().map(|&a| usize::from(a) % n) {
                let step = session.step(&session.action(action)).unwrap();
                played += 1;
                let limit = spec.max_steps.is_some_and(|limit| played >= limit);
                prop_assert_eq!(step.truncated, limit, "{} after {} steps", spec.id, played);
                if step.terminated || step.truncated {
                    session.reset(None, None).unwrap();
                    played = 0;
                }
            }
        }
    }
}

#[test]
fn different_seeds_differ() {
    for spec in specs() {
        let play = |seed| {
            let actions = (0..200).map(|i| (i * 7 % 11) as u8).collect();
            spec.make(&Map::new()).unwrap().visit(Contract { id: spec.id, seed, actions })
        };
        if is_deterministic(&spec.make(&Map::new()).unwrap()) {
            assert_eq!(play(1), play(2), "{}", spec.id);
        } else {
            assert_ne!(play(1), play(2), "{}", spec.id);
        }
    }
}

/// Whether there is a single start and a single outcome of everything, as on firm ground along
/// the cliff.
fn is_deterministic(env: &AnyEnv) -> bool {
    env.finite().is_some_and(|mdp| {
        mdp.outcomes().len() == mdp.n_states() * mdp.n_actions() && mdp.initial().contains(&1.0)
    })
}

#[test]
fn one_stream_runs_through_all_episodes() {
    // The second, unseeded reset continues the stream: it differs from the first, and repeats.
    for spec in specs().iter().filter(|spec| !spec.reset_options.is_empty()) {
        let play = || {
            let mut session = Session::new(spec.id, &Map::new()).unwrap();
            let first = session.reset(Some(&Seed::from(5)), None).unwrap();
            (first, session.reset(None, None).unwrap())
        };
        let (first, second) = play();
        assert_ne!(first, second, "{}", spec.id);
        assert_eq!((first, second), play(), "{}", spec.id);
    }
}

#[test]
fn every_spec_is_documented() {
    for spec in specs() {
        assert!(!spec.summary.is_empty() && !spec.summary.ends_with('.'), "{}", spec.id);
        for kwarg in spec.kwargs() {
            assert!(!kwarg.doc.is_empty(), "{} {}", spec.id, kwarg.name);
        }
        let schema = spec.make(&Map::new()).unwrap().schema();
        assert!(schema.fields.iter().all(|field| !field.doc.is_empty()), "{}", spec.id);
        if let Some(grid) = schema.grid {
            assert_eq!(grid.arrows.len(), schema.actions.len());
        }
    }
}

#[test]
fn huge_seeds_are_gymnasiums() {
    // Gymnasium: reset(seed=2**200) of CartPole-v1.
    let seed = "1606938044258990275541962092341162602522202993782792835301376".parse().unwrap();
    let mut session = Session::new(find("CartPole").unwrap().id, &Map::new()).unwrap();
    let Observation::Box(obs) = session.reset(Some(&seed), None).unwrap() else { unreachable!() };
    let printed = ["0.02453693", "0.03373969", "-0.00698495", "-0.00379939"];
    assert_eq!(obs.iter().map(|x| format!("{x:.8}")).collect::<Vec<_>>(), printed);
}

/// Plays random actions and counts the heap allocations of steps.
struct Allocations {
    limit: u32,
}

impl EnvVisitor for Allocations {
    type Out = u64;

    fn visit<E: Env + Clone + 'static>(self, mut env: E) -> u64 {
        let (mut rng, mut actions) = (NumpyRng::from_u64(1), Stream::new(1, "allocations"));
        env.reset(&mut rng);
        let (mut played, mut allocated) = (0, 0);
        for _ in 0..5000 {
            let action = actions.below(env.n_actions());
            let mut ended = false;
            let info = allocation_counter::measure(|| {
                ended = env.step(action, &mut rng).terminated;
            });
            played += 1;
            allocated += info.count_total;
            if ended || played >= self.limit {
                env.reset(&mut rng);
                played = 0;
            }
        }
        allocated
    }
}

#[test]
fn steps_do_not_allocate() {
    let seen = allocation_counter::measure(|| drop(std::hint::black_box(vec![1u8; 100])));
    assert!(seen.count_total > 0, "the counter counts");
    for spec in specs() {
        let limit = spec.max_steps.unwrap_or(u32::MAX);
        let count = spec.make(&Map::new()).unwrap().visit(Allocations { limit });
        assert_eq!(count, 0, "{}", spec.id);
    }
}
