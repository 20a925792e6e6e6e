//! The theory of shaping, checked on the models of all finite environments and on random ones, with
//! controls that must fail.

use runner::env::make;
use runner::learn::QTable;
use runner::learn::planning::{Planner, PolicyIteration};
use runner::mdp::streams::Stream;
use runner::mdp::{FiniteMdp, Outcome};
use serde_json::json;

mod advice;
mod exact;
mod learned;
mod truncation;

/// A model with its name, and whether every policy ends or pays for ever, so that γ may be 1.
struct Model {
    name: String,
    mdp: FiniteMdp,
    undiscounted: bool,
}

fn model(id: &str, kwargs: &serde_json::Value) -> FiniteMdp {
    (**make(id, kwargs.as_object().unwrap()).unwrap().finite().unwrap()).clone()
}

fn lake(is_slippery: bool) -> FiniteMdp {
    model("FrozenLake-v1", &json!({ "map_name": "8x8", "is_slippery": is_slippery }))
}

/// Minus the distance to the lower right corner of the 8x8 lake.
fn minus_distance() -> Vec<f64> {
    (0..64).map(|s| -f64::from((7 - s / 8) + (7 - s % 8))).collect()
}

/// Every kind of finite environment.
fn environments() -> Vec<Model> {
    [
        ("FrozenLake-v1", json!({}), false),
        ("FrozenLake-v1", json!({ "is_slippery": false }), false),
        ("FrozenLake8x8-v1", json!({}), false),
        ("FrozenLake8x8-v1", json!({ "is_slippery": false }), false),
        ("CliffWalking-v1", json!({}), true),
        ("CliffWalkingSlippery-v1", json!({}), true),
        ("Taxi-v4", json!({}), true),
        ("Taxi-v4", json!({ "is_rainy": true }), true),
        ("Blackjack-v1", json!({}), true),
    ]
    .into_iter()
    .map(|(id, kwargs, undiscounted)| Model {
        name: format!("{id} {kwargs}"),
        mdp: model(id, &kwargs),
        undiscounted,
    })
    .collect()
}

/// A random model of `n` states: two actions, each with up to three outcomes, and a chance of 1 in
/// 20 that the episode ends.
fn random_model(seed: u64, n: usize) -> FiniteMdp {
    let mut stream = Stream::new(seed, "a model");
    let mut list = || {
        let k = 1 + stream.below(3);
        let mut outcomes = vec![Outcome {
            probability: 0.05,
            next_state: stream.below(n) as u32,
            reward: 2.0 * stream.uniform() - 1.0,
            terminated: true,
        }];
        for _ in 0..k {
            outcomes.push(Outcome {
                probability: 0.95 / k as f64,
                next_state: stream.below(n) as u32,
                reward: 2.0 * stream.uniform() - 1.0,
                terminated: false,
            });
        }
        outcomes
    };
    let table: Vec<_> = (0..n).map(|_| vec![list(), list()]).collect();
    FiniteMdp::new(&table, vec![1.0 / n as f64; n]).unwrap()
}

/// `n` numbers from −`size` to `size`.
fn random_numbers(seed: u64, n: usize, size: f64) -> Vec<f64> {
    let mut stream = Stream::new(seed, "numbers");
    (0..n).map(|_| size * (2.0 * stream.uniform() - 1.0)).collect()
}

/// Optimal action values; a shaped model is started from −Φ.
fn solve(mdp: &FiniteMdp, gamma: f64, phi: &[f64]) -> QTable {
    let minus: Vec<f64> = phi.iter().map(|phi| -phi).collect();
    PolicyIteration { gamma }.solve(mdp, &minus).unwrap().q
}

/// The states in which an episode can be.
fn reachable(mdp: &FiniteMdp) -> Vec<usize> {
    let flags = mdp.reachable();
    (0..flags.len()).filter(|&s| flags[s]).collect()
}

/// max(1, max |x|).
fn scale(values: &[f64]) -> f64 {
    values.iter().fold(1.0, |m, x| m.max(x.abs()))
}

/// The states of `states` whose greedy sets differ, with a tolerance for numbers of size `scale`.
fn wrong(states: &[usize], a: &QTable, b: &QTable, scale: f64) -> Vec<usize> {
    let set = |q: &QTable, s| runner::learn::greedy_set(q.row(s), scale);
    states.iter().copied().filter(|&s| set(a, s) != set(b, s)).collect()
}
