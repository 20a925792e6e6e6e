//! The training loop, as `runner exec` compiles it.

use std::sync::atomic::AtomicBool;

use divan::Bencher;
use divan::counter::ItemsCount;
use runner::env::cart_pole::CartPole;
use runner::experiment::{Limits, World, train};
use runner::learn::{Learn, QLearning, QTable, Sarsa, Schedule};
use runner::mdp::numpy::NumpyRng;
use runner::mdp::streams::Stream;
use runner::mdp::{Env, FiniteMdp};
use runner::shaping::{
    CellPotential, Discretiser, NativeReward, NoPotential, Potential, RewardModel, StateIndex,
    TabulatedReward,
};

use super::{cart_pole_bins, lake};

pub(crate) const ALPHA: f64 = 0.1;
pub(crate) const GAMMA: f64 = 0.99;
pub(crate) const EPSILON: f64 = 0.1;
pub(crate) const LAKE_EPISODES: u32 = 1000;
pub(crate) const CART_POLE_EPISODES: u32 = 1000;

const LAKE: Limits = Limits { episodes: LAKE_EPISODES, max_steps: Some(200), ..Limits::EPISODE };
const CART_POLE: Limits =
    Limits { episodes: CART_POLE_EPISODES, max_steps: Some(500), ..Limits::EPISODE };

type Learner<A> = fn(QTable, f64, Schedule, Schedule, Stream) -> A;

/// Trains a fresh learner from seed 0; the number of steps.
fn run<E, D, P, R, A>(world: &mut World<E, D, P, R>, learner: Learner<A>, limits: Limits) -> u64
where
    E: Env,
    D: Discretiser<E>,
    P: Potential<E>,
    R: RewardModel<E>,
    A: Learn<D::State>,
{
    let table = QTable::new(world.discretiser.n_cells(), world.env.n_actions(), 0.0);
    let (alpha, epsilon) = (Schedule::constant(ALPHA), Schedule::constant(EPSILON));
    let mut agent = learner(table, GAMMA, alpha, epsilon, Stream::new(0, "agent"));
    let mut steps = 0;
    let mut rng = NumpyRng::from_u64(0);
    train(world, &mut agent, limits, &mut rng, &AtomicBool::new(false), |row, _| {
        steps += u64::from(row.steps);
    })
    .expect("nothing here can fail");
    steps
}

fn measure<E, D, P, R, A>(
    bencher: Bencher,
    mut world: World<E, D, P, R>,
    learner: Learner<A>,
    limits: Limits,
) where
    E: Env,
    D: Discretiser<E>,
    P: Potential<E>,
    R: RewardModel<E>,
    A: Learn<D::State>,
{
    // Every run is the same: its steps can be counted beforehand.
    let steps = run(&mut world, learner, limits);
    bencher.counter(ItemsCount::new(steps)).bench_local(|| run(&mut world, learner, limits));
}

fn distance_potential() -> CellPotential {
    let phi = |cell| 1.0 - 0.05 * ((7 - cell / 8) as f64 + (7 - cell % 8) as f64);
    CellPotential::new(64, Box::new(move |cell| Ok(phi(cell))))
}

fn step_cost(mdp: &FiniteMdp) -> TabulatedReward {
    TabulatedReward::new(mdp, 0, |_, _, i, _, _| Ok(mdp.outcomes()[i].reward - 0.01))
        .expect("nothing here can fail")
}

const STATES: StateIndex = StateIndex { n_states: 64 };

#[divan::bench]
fn frozen_lake_plain(bencher: Bencher) {
    let (potential, reward) = (NoPotential, NativeReward);
    let world = World { env: lake(), discretiser: STATES, potential, reward };
    measure(bencher, world, QLearning::new, LAKE);
}

#[divan::bench]
fn frozen_lake_shaped(bencher: Bencher) {
    let (potential, reward) = (distance_potential(), NativeReward);
    let world = World { env: lake(), discretiser: STATES, potential, reward };
    measure(bencher, world, QLearning::new, LAKE);
}

#[divan::bench]
fn frozen_lake_rewarded(bencher: Bencher) {
    let env = lake();
    let reward = step_cost(env.finite().expect("FrozenLake has a model"));
    let world = World { env, discretiser: STATES, potential: NoPotential, reward };
    measure(bencher, world, QLearning::new, LAKE);
}

#[divan::bench]
fn frozen_lake_sarsa(bencher: Bencher) {
    let (potential, reward) = (NoPotential, NativeReward);
    let world = World { env: lake(), discretiser: STATES, potential, reward };
    measure(bencher, world, Sarsa::new, LAKE);
}

#[divan::bench]
fn cart_pole_plain(bencher: Bencher) {
    let (env, discretiser) = (CartPole::new(false), cart_pole_bins());
    let world = World { env, discretiser, potential: NoPotential, reward: NativeReward };
    measure(bencher, world, QLearning::new, CART_POLE);
}

#[divan::bench]
fn cart_pole_shaped(bencher: Bencher) {
    let (env, discretiser) = (CartPole::new(false), cart_pole_bins());
    // Of the cell, as a script's potential is evaluated: once, then read from its table.
    let cells = 12 * 12 * 24 * 24;
    let potential = CellPotential::new(cells, Box::new(|cell| Ok(-((cell % 576) as f64))));
    let world = World { env, discretiser, potential, reward: NativeReward };
    measure(bencher, world, QLearning::new, CART_POLE);
}

#[divan::bench]
fn cart_pole_sarsa(bencher: Bencher) {
    let (env, discretiser) = (CartPole::new(false), cart_pole_bins());
    let world = World { env, discretiser, potential: NoPotential, reward: NativeReward };
    measure(bencher, world, Sarsa::new, CART_POLE);
}
