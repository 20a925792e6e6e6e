//! What a step costs, and what of it belongs to whom: `cargo bench --bench hot_path`.
//!
//! - `env`: an environment alone, with random actions, resets included
//! - `parts`: one generator draw, one bin lookup, one ε-greedy choice
//! - [`learner`]: the training loop as `runner exec` runs it, and hand-written [`floor`]s of the
//!   same work: the product may not be far above them
//! - [`script`]: a call of a script's function, and the opening of a script
//!
//! Loops are measured in steps per second (Mitem/s); single calls in nanoseconds.

mod floor;
mod learner;
mod script;

use divan::{Bencher, black_box};
use runner::env::cart_pole::CartPole;
use runner::env::frozen_lake::{FrozenLake, Ice};
use runner::env::mountain_car::MountainCar;
use runner::learn::{EpsilonGreedy, Explore, Schedule};
use runner::mdp::Env;
use runner::mdp::numpy::NumpyRng;
use runner::mdp::streams::Stream;
use runner::shaping::{Bins, Dim};

fn main() {
    divan::main();
}

/// FrozenLake's 8x8 map.
fn lake() -> FrozenLake {
    const MAP: [&str; 8] = [
        "SFFFFFFF", "FFFFFFFF", "FFFHFFFF", "FFFFFHFF", "FFFHFFFF", "FHHFFFHF", "FHFFHFHF",
        "FFFHFFFG",
    ];
    FrozenLake::new(&MAP.map(String::from), &Ice::default()).expect("the map is Gymnasium's")
}

/// CartPole's bins of `scripts/cartpole.rhai`.
fn cart_pole_bins() -> Bins {
    let dim = |field, lo, hi, n| Dim { field, lo, hi, n };
    Bins::new(&[
        dim(0, -2.4, 2.4, 12),
        dim(1, -3.0, 3.0, 12),
        dim(2, -0.5, 0.5, 24),
        dim(3, -2.0, 2.0, 24),
    ])
    .expect("every dimension is sound")
}

/// Steps an environment with random actions; a time limit of 500 as the loop's own.
fn walk<E: Env>(bencher: Bencher, mut env: E) {
    let mut rng = NumpyRng::from_u64(0);
    let mut actions = Stream::new(0, "bench");
    let n = env.n_actions();
    let mut steps = 0;
    env.reset(&mut rng);
    bencher.bench_local(|| {
        let step = env.step(actions.below(n), &mut rng);
        steps += 1;
        if step.terminated || steps == 500 {
            steps = 0;
            black_box(env.reset(&mut rng));
        }
        step
    });
}

#[divan::bench]
fn env_cart_pole(bencher: Bencher) {
    walk(bencher, CartPole::new(false));
}

#[divan::bench]
fn env_mountain_car(bencher: Bencher) {
    walk(bencher, MountainCar::new(0.0));
}

#[divan::bench]
fn env_frozen_lake(bencher: Bencher) {
    walk(bencher, lake());
}

#[divan::bench]
fn parts_numpy_random(bencher: Bencher) {
    let mut rng = NumpyRng::from_u64(0);
    bencher.bench_local(|| rng.random());
}

#[divan::bench]
fn parts_bins_of_four(bencher: Bencher) {
    let bins = cart_pole_bins();
    let mut stream = Stream::new(0, "bench");
    let states: Vec<[f64; 4]> = (0..1024)
        .map(|_| [2.4, 3.0, 0.3, 2.0].map(|bound| bound * (2.0 * stream.uniform() - 1.0)))
        .collect();
    let mut i = 0;
    bencher.bench_local(|| {
        i = (i + 1) % states.len();
        bins.index(&states[i])
    });
}

#[divan::bench(args = [2, 4])]
fn parts_epsilon_greedy(bencher: Bencher, n: usize) {
    let mut behaviour = EpsilonGreedy::new(Schedule::constant(0.1), Stream::new(0, "agent"));
    let mut stream = Stream::new(0, "bench");
    let values: Vec<f64> = (0..1024 * n).map(|_| stream.uniform()).collect();
    let mut i = 0;
    bencher.bench_local(|| {
        i = (i + 1) % 1024;
        behaviour.choose(&values[i * n..(i + 1) * n], i)
    });
}
