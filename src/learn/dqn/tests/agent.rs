//! The agent as a whole.

use super::{Chance, N_ACTIONS, agent, config, fields, setup};
use crate::learn::dqn::{Dqn, DqnConfig, NetworkSetup, best};
use crate::learn::{Agent, Last, Learn, Schedule};
use crate::mdp::streams::Stream;
use crate::nn::{Activations, Kernels, Mlp, Shape};
use crate::shaping::{ActionSet, Fields, Inputs, MAX_FIELDS};

const HERE: [f64; 3] = [0.5, -0.5, 1.0];
const THERE: [f64; 3] = [-20.0, 5.0, 15.0];

fn values(q: &Mlp<f32>, s: &Fields) -> Vec<f32> {
    let x: Vec<f32> = s.values[..q.shape().n_inputs].iter().map(|x| *x as f32).collect();
    let mut out = Activations::new(q, 1);
    q.forward(Kernels::detect(), &x, x.len(), &mut out);
    out.q(0).to_vec()
}

/// Lives through the same step again and again, its target network never changing. Returns the
/// value of the action that was played, and what the target network says of the state that followed.
fn settled(n_steps: usize, double: bool, last: Last<ActionSet>) -> (f64, Vec<f32>, Vec<f32>) {
    let config = DqnConfig {
        epsilon: Schedule::constant(0.0),
        target_update_interval: 1 << 40,
        learning_rate: Schedule::Linear {
            start: 0.01,
            end: 0.0,
            over: 3000,
            unit: crate::learn::Unit::Step,
        },
        n_steps,
        double,
        ..config()
    };
    let mut agent = Dqn::new(config, setup(true, 3));
    let (here, there) = (fields(HERE, ActionSet(0b0100)), fields(THERE, ActionSet::ALL));
    for _ in 0..3000 {
        assert_eq!(agent.begin(here), 2, "nothing else is allowed");
        match last {
            Last::Terminated => agent.end(5.0, Last::Terminated),
            Last::Truncated(allowed) => {
                agent.end(5.0, Last::Truncated(Fields { allowed, ..there }));
            }
        }
    }
    let q = f64::from(values(&agent.q, &here)[2]);
    (q, values(&agent.target, &there), values(&agent.q, &there))
}

#[test]
fn termination_cuts_the_target_and_truncation_does_not() {
    for (n_steps, double) in [(1, false), (1, true), (3, false)] {
        let (q, ..) = settled(n_steps, double, Last::Terminated);
        assert!((q - 5.0).abs() < 1e-3, "{q}");
        // All of it, without the best action, and one action only.
        let mut far = 0;
        for allowed in [0b1111, 0b1101, 0b0111, 0b1110, 0b1011, 0b0001] {
            let allowed = ActionSet(allowed);
            let (q, target, online) = settled(n_steps, double, Last::Truncated(allowed));
            let chooser = if double { &online } else { &target };
            let wanted = 5.0 + 0.9 * f64::from(target[best(chooser, allowed)]);
            assert!((q - wanted).abs() < 5e-3, "{n_steps} {double} {allowed:?}: {q}, not {wanted}");
            far += u32::from((wanted - 5.0).abs() > 0.05);
        }
        assert!(far >= 3, "there is something to bootstrap from");
    }
}

#[test]
fn the_target_network_is_copied_at_its_interval() {
    let mut agent = agent(&DqnConfig { target_update_interval: 10, ..config() });
    let mut world = Chance::new(false);
    let (mut q_before, mut target_before) = (agent.q.clone(), agent.target.clone());
    let mut steps = 0;
    while steps < 100 {
        world.episode(&mut agent, |_, agent| {
            steps += 1;
            // The update comes before the step's training.
            let wanted = if steps % 10 == 0 { &q_before } else { &target_before };
            assert!(agent.target == *wanted, "step {steps}");
            (q_before, target_before) = (agent.q.clone(), agent.target.clone());
        });
    }
    assert_ne!(agent.q.params(), agent.target.params());
    assert_eq!(agent.steps(), steps);
}

#[test]
fn learning_starts_when_it_should_and_until_then_actions_are_random() {
    for (learning_starts, train_freq, gradient_steps) in [(0, 1, 1), (3, 1, 2), (50, 4, 3)] {
        let config = DqnConfig {
            learning_starts,
            train_freq,
            gradient_steps,
            epsilon: Schedule::constant(0.0),
            ..config()
        };
        let mut agent = agent(&config);
        let mut world = Chance::new(false);
        let (mut steps, mut updates) = (0, 0);
        while steps < 120 {
            world.episode(&mut agent, |_, agent| {
                steps += 1;
                // A minibatch is 8.
                if steps >= 8 && steps > learning_starts && steps % train_freq == 0 {
                    updates += gradient_steps;
                }
                assert_eq!(agent.updates(), updates, "step {steps}");
            });
        }
    }
    let config = DqnConfig { learning_starts: 4000, epsilon: Schedule::constant(0.0), ..config() };
    let mut agent = agent(&config);
    let (here, mut counts) = (fields(HERE, ActionSet(0b1011)), [0u32; N_ACTIONS]);
    counts[agent.begin(here)] += 1;
    for _ in 1..4000 {
        counts[agent.step(0.0, here)] += 1;
    }
    // A third each: 1333, standard deviation 30.
    assert!([0, 1, 3].iter().all(|a| (1180..1490).contains(&counts[*a])), "{counts:?}");
    assert_eq!((counts[2], agent.updates()), (0, 0));
    for _ in 0..100 {
        let a = agent.step(0.0, here);
        assert_eq!(a, best(&values(&agent.q, &here), here.allowed));
    }
    assert!(agent.updates() > 0);
}

#[test]
fn polyak_averaging_moves_the_target_a_part_of_the_way() {
    let mut agent = agent(&DqnConfig { tau: 0.125, target_update_interval: 1, ..config() });
    let mut world = Chance::new(false);
    let (mut q, mut target) = (agent.q.clone(), agent.target.clone());
    for _ in 0..10 {
        world.episode(&mut agent, |_, agent| {
            for ((t, q), new) in target.params().iter().zip(q.params()).zip(agent.target.params()) {
                assert!((t + 0.125 * (q - t) - new).abs() < 1e-6);
            }
            (q, target) = (agent.q.clone(), agent.target.clone());
        });
    }
    assert_ne!(agent.q.params(), agent.target.params());
}

#[test]
fn refused_actions_are_never_played() {
    for epsilon in [0.0, 0.5, 1.0] {
        for learning_starts in [0, 200] {
            let epsilon = Schedule::constant(epsilon);
            let config = DqnConfig { learning_starts, epsilon, ..config() };
            let mut agent = Dqn::new(config, setup(true, 2));
            let mut world = Chance::new(true);
            let mut counts = [0u32; N_ACTIONS];
            for _ in 0..60 {
                world.episode(&mut agent, |step, _| {
                    assert!(step.s.allowed.contains(step.a));
                    counts[step.a] += 1;
                });
            }
            assert!(counts.iter().all(|n| *n > 0), "{counts:?}");
        }
    }
}

/// Gradients of any length leave Adam's steps about as long, but not the same.
#[test]
fn clipping_has_an_effect() {
    let learned = |max_grad_norm| {
        let mut agent = agent(&DqnConfig { max_grad_norm, ..config() });
        let mut world = Chance::new(false);
        (0..10).for_each(|_| world.episode(&mut agent, |_, _| {}));
        agent.q.params().to_vec()
    };
    assert_eq!(learned(None), learned(Some(1e9)));
    assert_ne!(learned(None), learned(Some(0.1)));
}

#[test]
fn states_without_numbers_have_an_input_each() {
    let inputs = Inputs::OneHot(5);
    let config = DqnConfig {
        epsilon: Schedule::constant(1.0),
        learning_rate: Schedule::constant(0.003),
        net_arch: vec![16],
        ..config()
    };
    let setup = NetworkSetup { inputs, n_actions: 2, shielded: false, seed: 1, model: None };
    let mut agent = Dqn::new(config, setup);
    assert_eq!(agent.network().shape().n_inputs, 5);
    let state = |index| Fields { values: [0.0; MAX_FIELDS], index, allowed: ActionSet::ALL };
    // An episode is one step; it brings s or -s.
    for i in 0..3000 {
        let s = i % 5;
        let a = agent.begin(state(s));
        agent.end(if a == 0 { s as f64 } else { -(s as f64) }, Last::Terminated);
    }
    for s in 0..5 {
        let mut one = state(0);
        one.values[s] = 1.0;
        let q = values(&agent.q, &one);
        let error = (q[0] - s as f32).abs().max((q[1] + s as f32).abs());
        assert!(error < 0.05, "{s}: {q:?}");
    }
}

#[test]
fn a_loss_that_is_not_finite_ends_learning_and_nothing_else() {
    let mut agent = agent(&DqnConfig { double: true, log_interval: 1, ..config() });
    let mut world = Chance::new(false);
    (0..5).for_each(|_| world.episode(&mut agent, |_, _| {}));
    assert_eq!(agent.failed_at(), None);
    let (steps, updates) = (agent.steps(), agent.updates());
    assert!(updates > 10);
    // It is drawn sooner or later.
    let here = fields(HERE, ActionSet::ALL);
    agent.begin(here);
    agent.end(1e300, Last::Truncated(here));
    (0..20).for_each(|_| world.episode(&mut agent, |_, _| {}));
    let failed = agent.failed_at().expect("1e300 is no float32");
    assert!((steps + 1..steps + 40).contains(&failed), "{failed}");
    assert!(agent.updates() < updates + 40 && agent.steps() > failed);
    assert!(agent.q.params().iter().all(|w| w.is_finite()));
    let (q, updates) = (agent.q.clone(), agent.updates());
    (0..5).for_each(|_| world.episode(&mut agent, |_, _| {}));
    assert!((agent.updates(), &agent.q) == (updates, &q));
    let log = agent.log();
    assert!(log.iter().all(|row| row.loss.is_none_or(f64::is_finite)));
    assert!(log.last().unwrap().loss.is_none());
}

#[test]
fn a_step_allocates_nothing() {
    let seen = allocation_counter::measure(|| drop(std::hint::black_box(vec![1u8; 100])));
    assert!(seen.count_total > 0, "the counter counts");
    for config in super::shadow::configs() {
        for shielded in [false, true] {
            let mut agent = Dqn::new(config.clone(), setup(shielded, 1));
            let world = Chance::new(shielded);
            let mut play = |episodes: u32| {
                let mut world = world.clone();
                allocation_counter::measure(|| {
                    (0..episodes).for_each(|_| world.episode(&mut agent, |_, _| {}));
                })
            };
            play(5);
            let seen = play(20);
            assert_eq!(seen.count_total, 0, "{config:?}");
        }
    }
}

#[test]
fn every_instruction_set_plays_and_learns_the_same() {
    for config in super::shadow::configs() {
        let mut played = Kernels::all().into_iter().map(|kernels| {
            let mut agent = Dqn::new(config.clone(), setup(false, 6)).with_kernels(kernels);
            let mut world = Chance::new(false);
            let mut actions = Vec::new();
            for _ in 0..15 {
                world.episode(&mut agent, |step, _| actions.push(step.a));
            }
            (actions, agent.q)
        });
        let first = played.next().unwrap();
        assert!(played.all(|other| other == first), "{config:?}");
    }
}

#[test]
fn the_seed_and_the_model_decide_where_it_starts() {
    let network = |seed| Dqn::new(config(), setup(false, seed)).network().clone();
    assert!(network(1) == network(1) && network(1) != network(2));
    let shape = Shape { n_inputs: 3, hidden: vec![9, 5], n_actions: N_ACTIONS, dueling: false };
    let model = Mlp::new(shape, &mut Stream::new(8, "another"));
    let agent = Dqn::new(config(), NetworkSetup { model: Some(model.clone()), ..setup(false, 1) });
    assert!(agent.q == model && agent.target == model);
}

/// What is written down, by hand.
#[test]
fn the_log_says_how_learning_goes() {
    let config = DqnConfig {
        log_interval: 4,
        batch_size: 2,
        epsilon: Schedule::Linear {
            start: 1.0,
            end: 0.0,
            over: 4,
            unit: crate::learn::Unit::Episode,
        },
        ..config()
    };
    let mut agent = agent(&config);
    let here = fields(HERE, ActionSet::ALL);
    let believed = values(&agent.q, &here).into_iter().fold(f32::MIN, f32::max);
    agent.begin(here);
    agent.step(1.0, here);
    agent.end(1.0, Last::Terminated);
    let later = values(&agent.q, &here).into_iter().fold(f32::MIN, f32::max);
    agent.begin(here);
    for _ in 0..6 {
        agent.step(2.0, here);
    }
    agent.end(2.0, Last::Truncated(here));
    let [first, second] = agent.log() else { panic!("{:?}", agent.log()) };
    assert_eq!((first.step, first.episode, first.updates, first.buffer), (4, 2, 3, 4));
    assert_eq!((second.step, second.episode, second.updates, second.buffer), (8, 2, 7, 8));
    assert_eq!(first.start_value, Some(f64::from(believed)));
    // 1 + 0.9.
    assert_eq!((first.start_return, first.epsilon), (Some(1.9), 0.75));
    assert!(first.loss.unwrap() > 0.0 && first.td_error.unwrap() > 0.0 && first.q.is_some());
    assert_eq!((second.start_value, second.start_return), (None, None));
    assert_ne!(believed, later);
    assert_eq!(agent.epsilon(), 0.5);
    assert!(agent.bootstraps_when_truncated());
}
