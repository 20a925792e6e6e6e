//! Models and rewards for the tests of the audit.

use serde_json::{Value, json};

use crate::env::make;
use crate::mdp::streams::Stream;
use crate::mdp::{FiniteMdp, Outcome};

/// One of the environments' own models.
pub(super) fn model(id: &str, kwargs: &Value) -> FiniteMdp {
    let env = make(id, kwargs.as_object().unwrap()).unwrap();
    (**env.finite().unwrap()).clone()
}

/// The 8x8 lake.
pub(super) fn lake(is_slippery: bool) -> FiniteMdp {
    model("FrozenLake8x8-v1", &json!({ "is_slippery": is_slippery }))
}

/// Steps to the goal of the 8x8 lake.
pub(super) fn lake_distance(s: usize) -> f64 {
    (14 - s / 8 - s % 8) as f64
}

/// One reward per outcome: `reward(s, a, outcome)`.
pub(super) fn rewards(
    mdp: &FiniteMdp,
    mut reward: impl FnMut(usize, usize, &Outcome) -> f64,
) -> Vec<f64> {
    let with = mdp.with_rewards(|s, a, o| reward(s, a, o));
    with.outcomes().iter().map(|o| o.reward).collect()
}

/// `γΦ(s′) − Φ(s)`, Φ being 0 at the end.
pub(super) fn potential_rewards(mdp: &FiniteMdp, gamma: f64, phi: &[f64]) -> Vec<f64> {
    rewards(mdp, |s, _, o| {
        let next = if o.terminated { 0.0 } else { phi[o.next_state as usize] };
        gamma * next - phi[s]
    })
}

/// Uniform in [-1, 1).
pub(super) fn symmetric(stream: &mut Stream) -> f64 {
    2.0 * stream.uniform() - 1.0
}

/// A random model that starts in state 0. Outcomes end the episode with probability `ends`.
pub(super) fn random_model(stream: &mut Stream, n_states: usize, ends: f64) -> FiniteMdp {
    let n_actions = 1 + stream.below(3);
    let mut table = Vec::new();
    for _ in 0..n_states {
        let mut row = Vec::new();
        for _ in 0..n_actions {
            let outcomes: Vec<Outcome> = (0..=stream.below(3))
                .map(|_| Outcome {
                    probability: 0.1 + stream.uniform(),
                    next_state: stream.below(n_states) as u32,
                    reward: symmetric(stream),
                    terminated: stream.uniform() < ends,
                })
                .collect();
            let total: f64 = outcomes.iter().map(|o| o.probability).sum();
            row.push(
                outcomes
                    .into_iter()
                    .map(|o| Outcome { probability: o.probability / total, ..o })
                    .collect(),
            );
        }
        table.push(row);
    }
    let mut initial = vec![0.0; n_states];
    initial[0] = 1.0;
    FiniteMdp::new(&table, initial).unwrap()
}
