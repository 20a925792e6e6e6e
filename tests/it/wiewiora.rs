//! Shaping by a potential is the same as starting from it (Wiewiora 2003): a learner with the
//! shaping reward and Q = 0 and one without it and Q = Φ make the same choices for ever, and
//! `Q₁ + Φ = Q₂` all along. Holds for the whole training loop, or something in it is wrong.

use std::sync::atomic::AtomicBool;

use runner::env::frozen_lake::FrozenLake;
use runner::env::{AnyEnv, make};
use runner::experiment::{EpisodeRow, Limits, World, train};
use runner::learn::{Learn, QLearning, QTable, Sarsa, Schedule};
use runner::mdp::Env;
use runner::mdp::numpy::NumpyRng;
use runner::mdp::streams::Stream;
use runner::shaping::{
    CellPotential, NativeReward, NoPotential, Potential, RewardModel, StateIndex, Transition,
};
use serde_json::json;

const GAMMA: f64 = 0.99;
const STATES: usize = 64;
const ACTIONS: usize = 4;

fn lake() -> FrozenLake {
    let kwargs = json!({ "map_name": "8x8" });
    match make("FrozenLake-v1", kwargs.as_object().unwrap()).unwrap() {
        AnyEnv::FrozenLake(env) => env,
        _ => unreachable!("the id says so"),
    }
}

fn phi(s: usize) -> f64 {
    1.0 - 0.05 * ((7 - s / 8) + (7 - s % 8)) as f64
}

/// Plays 60,000 steps or so; returns what was played and learned.
fn learn<P, R, A>(potential: P, reward: R, mut agent: A) -> (Vec<(u32, f64)>, QTable)
where
    P: Potential<FrozenLake>,
    R: RewardModel<FrozenLake>,
    A: Learn<usize>,
{
    let discretiser = StateIndex { n_states: STATES };
    let mut world = World { env: lake(), discretiser, potential, reward };
    let limits = Limits { episodes: 1500, max_steps: Some(100), ..Limits::EPISODE };
    let mut played = Vec::new();
    let each = |row: EpisodeRow, _: &A| played.push((row.steps, row.native));
    let stop = AtomicBool::new(false);
    assert!(train(&mut world, &mut agent, limits, &mut NumpyRng::from_u64(5), &stop, each).is_ok());
    (played, agent.q().unwrap().clone())
}

fn zero() -> QTable {
    QTable::new(STATES, ACTIONS, 0.0)
}

fn from_phi() -> QTable {
    QTable::from_values(ACTIONS, (0..STATES * ACTIONS).map(|i| phi(i / ACTIONS)).collect())
}

fn q_learning(q: QTable) -> QLearning {
    let (alpha, epsilon) = (Schedule::constant(0.1), Schedule::constant(0.2));
    QLearning::new(q, GAMMA, alpha, epsilon, Stream::new(9, "agent"))
}

fn sarsa(q: QTable) -> Sarsa {
    let (alpha, epsilon) = (Schedule::constant(0.1), Schedule::constant(0.2));
    Sarsa::new(q, GAMMA, alpha, epsilon, Stream::new(9, "agent"))
}

fn potential() -> CellPotential {
    CellPotential::new(STATES, Box::new(|cell| Ok(phi(cell))))
}

/// `max |Q₁ + Φ − Q₂|`.
fn drift(shaped: &QTable, initialised: &QTable) -> f64 {
    let pairs = shaped.values().iter().zip(initialised.values()).enumerate();
    pairs.map(|(i, (a, b))| (a + phi(i / ACTIONS) - b).abs()).fold(0.0, f64::max)
}

#[test]
fn shaping_is_initialisation_for_q_learning() {
    let (played, shaped) = learn(potential(), NativeReward, q_learning(zero()));
    let (same, initialised) = learn(NoPotential, NativeReward, q_learning(from_phi()));
    assert!(played.iter().map(|(steps, _)| steps).sum::<u32>() > 30_000);
    assert_eq!(played, same, "both learners play the same episodes");
    assert!(drift(&shaped, &initialised) < 1e-12, "{}", drift(&shaped, &initialised));
}

#[test]
fn shaping_is_initialisation_for_sarsa() {
    let (played, shaped) = learn(potential(), NativeReward, sarsa(zero()));
    let (same, initialised) = learn(NoPotential, NativeReward, sarsa(from_phi()));
    assert_eq!(played, same);
    assert!(drift(&shaped, &initialised) < 1e-12, "{}", drift(&shaped, &initialised));
}

/// A shaping reward computed as tutorials do: with a γ of its own, or Φ kept at terminal states.
struct Wrong {
    gamma: f64,
    keeps_terminal: bool,
}

impl RewardModel<FrozenLake> for Wrong {
    fn reward(
        &mut self,
        env: &FrozenLake,
        t: &Transition<'_, <FrozenLake as Env>::Obs>,
        _: &mut [f64],
    ) -> Result<f64, runner::shaping::Fault> {
        let at = |obs| phi(env.state_index(obs).unwrap());
        let next = if t.terminated && !self.keeps_terminal { 0.0 } else { at(t.next_state) };
        Ok(t.reward + self.gamma * next - at(t.state))
    }
}

#[test]
fn wrong_shapings_are_not() {
    let (same, initialised) = learn(NoPotential, NativeReward, q_learning(from_phi()));
    let right = Wrong { gamma: GAMMA, keeps_terminal: false };
    let (played, shaped) = learn(NoPotential, right, q_learning(zero()));
    assert_eq!(played, same, "the control: this one is right");
    assert!(drift(&shaped, &initialised) < 1e-12);
    for wrong in
        [Wrong { gamma: 1.0, keeps_terminal: false }, Wrong { gamma: GAMMA, keeps_terminal: true }]
    {
        let (played, shaped) = learn(NoPotential, wrong, q_learning(zero()));
        assert!(drift(&shaped, &initialised) > 1e-3);
        assert_ne!(played, same);
    }
}
