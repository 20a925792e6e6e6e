//! A potential of η times the learner's own values (Adamczyk et al. 2025): where they settle, and
//! when they do.

use std::sync::atomic::AtomicBool;

use runner::env::frozen_lake::FrozenLake;
use runner::env::{AnyEnv, make};
use runner::experiment::{Limits, World, train};
use runner::learn::{Agent, Bootstrapped, QLearning, QTable, Schedule, stability_bound};
use runner::mdp::numpy::NumpyRng;
use runner::mdp::streams::Stream;
use runner::mdp::{FiniteMdp, Outcome};
use runner::shaping::{NativeReward, NoPotential, StateIndex};
use serde_json::json;

use super::{model, reachable, solve};

const GAMMA: f64 = 0.9;

fn dry() -> FrozenLake {
    let kwargs = json!({ "is_slippery": false });
    match make("FrozenLake-v1", kwargs.as_object().unwrap()).unwrap() {
        AnyEnv::FrozenLake(env) => env,
        _ => unreachable!("the id says so"),
    }
}

/// The learner itself, on dry land, where a long enough random walk is exact.
#[test]
fn what_is_learned_is_q_less_a_share_of_v() {
    let mdp = model("FrozenLake-v1", &json!({ "is_slippery": false }));
    let q = solve(&mdp, GAMMA, &[0.0; 16]);
    for eta in [-0.5, 0.3, 0.9, 1.5, 3.0] {
        let (alpha, epsilon) = (Schedule::constant(0.1), Schedule::constant(1.0));
        let zero = QTable::new(16, 4, 0.0);
        let learner = QLearning::new(zero, GAMMA, alpha, epsilon, Stream::new(1, "agent"));
        let mut agent = Bootstrapped::new(Box::new(learner), eta);
        let mut world = World {
            env: dry(),
            discretiser: StateIndex { n_states: 16 },
            potential: NoPotential,
            reward: NativeReward,
        };
        let limits = Limits { episodes: 60_000, max_steps: Some(100), ..Limits::EPISODE };
        let (stop, mut rng) = (AtomicBool::new(false), NumpyRng::from_u64(0));
        assert!(train(&mut world, &mut agent, limits, &mut rng, &stop, |_, _| {}).is_ok());
        let learned = agent.q().unwrap();
        for s in reachable(&mdp) {
            for a in 0..4 {
                let expected = q.get(s, a) - eta / (1.0 + eta) * q.max(s);
                let error = (learned.get(s, a) - expected).abs();
                assert!(error < 1e-6, "η = {eta}: Q({s}, {a}) off by {error}");
            }
        }
    }
}

/// Two states that take turns, for a reward of 1 and −2: the slowest to settle, and the first to
/// run away. Values of the whole table are updated at once, by expectation.
#[test]
fn it_settles_below_the_bound_and_runs_away_above() {
    let go = |next_state, reward| {
        vec![vec![Outcome { probability: 1.0, next_state, reward, terminated: false }]]
    };
    let turns = FiniteMdp::new(&[go(1, 1.0), go(0, -2.0)], vec![1.0, 0.0]).unwrap();
    for gamma in [0.5, 0.9, 0.99] {
        let v = solve(&turns, gamma, &[0.0; 2]);
        for eta in [-0.5, 0.3, 0.9, 1.5, 3.0] {
            let settles = |share: f64| {
                let alpha = share * stability_bound(gamma) / (1.0 + eta);
                let mut q = [0.0f64; 2];
                for _ in 0..400_000 {
                    let target = |s: usize, r: f64| {
                        let f = eta * (gamma * q[1 - s] - q[s]);
                        q[s] + alpha * (r + f + gamma * q[1 - s] - q[s])
                    };
                    q = [target(0, 1.0), target(1, -2.0)];
                    if q[0].abs() > 1e9 {
                        return false;
                    }
                }
                let expected = |s: usize| v.get(s, 0) * (1.0 - eta / (1.0 + eta));
                (q[0] - expected(0)).abs() < 1e-9 && (q[1] - expected(1)).abs() < 1e-9
            };
            assert!(settles(0.3) && settles(0.999), "γ = {gamma}, η = {eta}");
            assert!(!settles(1.001) && !settles(1.5), "γ = {gamma}, η = {eta}");
        }
    }
}
