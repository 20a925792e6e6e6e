//! Softmax over action values, with a fixed temperature τ (Sutton & Barto 2018, section 13.1).
//!
//! `π(a | s) = exp(Q(s, a) / τ) / Σ_b exp(Q(s, b) / τ)`, computed from the differences to the
//! largest value, so that no exponential overflows.

use super::Seen;
use super::behaviour::Explore;
use super::greedy::max_allowed;
use crate::mdp::Action;
use crate::mdp::math::{exp, ln_1p};
use crate::mdp::streams::Stream;

/// Softmax behaviour. Draws one 64-bit number per choice.
#[derive(Debug, Clone)]
pub struct Softmax {
    temperature: f64,
    stream: Stream,
    /// `exp((Q − max Q) / τ)` of each action, 0 for refused ones, of the row last weighed.
    weights: Vec<f64>,
    /// Their sum.
    sum: f64,
}

impl Softmax {
    /// Over `n_actions` actions; `temperature` is in units of the values.
    pub fn new(temperature: f64, n_actions: usize, stream: Stream) -> Self {
        Self { temperature, stream, weights: vec![0.0; n_actions], sum: 0.0 }
    }

    /// Weighs the actions that `s` allows; returns the largest value, whose weight is 1, and the sum
    /// of the other weights.
    #[inline]
    fn weigh<S: Seen>(&mut self, q: &[f64], s: S) -> (f64, f64) {
        let best = max_allowed(q, s);
        let (mut others, mut found) = (0.0, false);
        for (a, (weight, &value)) in self.weights.iter_mut().zip(q).enumerate() {
            if !s.allows(a) {
                *weight = 0.0;
            } else if value == best && !found {
                // exp(0), without the call: there is one in every row.
                (*weight, found) = (1.0, true);
            } else {
                *weight = exp((value - best) / self.temperature);
                others += *weight;
            }
        }
        self.sum = 1.0 + others;
        (best, others)
    }

    /// `τ ln Σ_a exp(Q(s, a) / τ)`, over the actions that `s` allows.
    #[inline]
    pub(super) fn log_sum_exp<S: Seen>(&mut self, q: &[f64], s: S) -> f64 {
        let (best, others) = self.weigh(q, s);
        // Not ln (1 + …): where one action outweighs the others that loses them, and close to 1 the
        // correctly rounded ln takes twenty times as long.
        best + self.temperature * ln_1p(others)
    }

    /// Chooses by the weights of the row last weighed, which must not have changed since.
    #[inline]
    pub(super) fn choose_weighed(&mut self) -> Action {
        let mut left = self.stream.uniform() * self.sum;
        let mut last = 0;
        for (a, &weight) in self.weights.iter().enumerate() {
            if weight > 0.0 {
                if left < weight {
                    return a;
                }
                left -= weight;
                last = a;
            }
        }
        // Rounding can leave a little of the sum; it belongs to the last action.
        last
    }
}

impl Explore for Softmax {
    #[inline]
    fn choose<S: Seen>(&mut self, q: &[f64], s: S) -> Action {
        self.weigh(q, s);
        self.choose_weighed()
    }

    #[inline]
    fn mean<S: Seen>(&mut self, q: &[f64], s: S, x: &[f64]) -> f64 {
        self.weigh(q, s);
        // From the differences, so that a value of 10⁹ costs the small ones nothing.
        let best = self.weights.iter().zip(x).find(|(weight, _)| **weight == 1.0);
        let best = best.map_or(0.0, |(_, x)| *x);
        let weighted = self.weights.iter().zip(x).filter(|(weight, _)| **weight > 0.0);
        best + weighted.map(|(weight, x)| weight * (x - best)).sum::<f64>() / self.sum
    }

    fn epsilon(&self) -> f64 {
        0.0
    }

    fn end_episode(&mut self) {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mdp::math::ln;
    use crate::shaping::{ActionSet, Shielded};

    fn softmax(temperature: f64) -> Softmax {
        Softmax::new(temperature, 3, Stream::new(4, "test"))
    }

    /// Weights e⁰ : e^(ln 2) : e^(ln 5) = 1 : 2 : 5 at τ = 0.5.
    fn row() -> [f64; 3] {
        [0.0, 0.5 * ln(2.0), 0.5 * ln(5.0)]
    }

    #[test]
    fn probabilities_by_hand() {
        let mut policy = softmax(0.5);
        let mut counts = [0u32; 3];
        for _ in 0..80_000 {
            counts[policy.choose(&row(), 0)] += 1;
        }
        // 1/8, 2/8, 5/8 of 80,000; the largest standard deviation is 137.
        for (count, expected) in counts.iter().zip([10_000u32, 20_000, 50_000]) {
            assert!(count.abs_diff(expected) < 820, "{counts:?}");
        }
        // (0 + 2 · 0.5 ln 2 + 5 · 0.5 ln 5) / 8 = (ln 2 + 2.5 ln 5) / 8.
        let expected = (ln(2.0) + 2.5 * ln(5.0)) / 8.0;
        assert!((policy.expected(&row(), 0) - expected).abs() < 1e-15);
        // 0.5 ln (1 + 2 + 5).
        assert!((policy.log_sum_exp(&row(), 0) - 0.5 * ln(8.0)).abs() < 1e-15);
    }

    #[test]
    fn a_small_chance_is_worth_something() {
        // 0.5 ln (1 + e^-80), though 1 + e^-80 is 1: 0.5 e^-80 to 35 digits.
        let value = softmax(0.5).log_sum_exp(&[0.0, -40.0, f64::NEG_INFINITY], 0);
        assert!((value / (0.5 * exp(-80.0)) - 1.0).abs() < 1e-15, "{value:e}");
    }

    #[test]
    fn refused_actions_have_no_weight() {
        let mut policy = softmax(0.5);
        let s = Shielded { cell: 0, allowed: ActionSet(0b011) };
        assert!((policy.log_sum_exp(&row(), s) - 0.5 * ln(3.0)).abs() < 1e-15);
        assert!((0..1000).all(|_| policy.choose(&row(), s) != 2));
    }

    #[test]
    fn large_values_neither_overflow_nor_lose_the_small_differences() {
        let mut policy = softmax(1e-3);
        assert_eq!(policy.choose(&[1e6, -1e6, 0.0], 0), 0);
        assert_eq!(policy.log_sum_exp(&[1e6, -1e6, 0.0], 0), 1e6);
        let shifted: Vec<f64> = row().iter().map(|q| q + 1024.0).collect();
        let mut policy = softmax(0.5);
        let difference = policy.expected(&shifted, 0) - policy.expected(&row(), 0) - 1024.0;
        assert!(difference.abs() < 1e-12);
    }
}
