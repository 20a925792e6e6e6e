//! n-step TD prediction (Sutton & Barto 2018, section 7.1).
//!
//! `V(Sₜ) ← V(Sₜ) + α [Gₜ:ₜ₊ₙ − V(Sₜ)]` n steps later, where
//! `Gₜ:ₜ₊ₙ = Rₜ₊₁ + γ Rₜ₊₂ + … + γⁿ⁻¹ Rₜ₊ₙ + γⁿ V(Sₜ₊ₙ)`; what the episode's end leaves short of n steps
//! is learned then, the earliest state first.

use std::collections::VecDeque;

use super::{Estimate, Rule};
use crate::learn::Last;

/// n-step temporal-difference prediction.
///
/// Deviation 1: where an episode is truncated, the returns that are still open bootstrap from the
/// value that its last state has by then.
#[derive(Debug, Clone)]
pub struct NStepTd {
    n: usize,
    /// The last states, at most n, each with the reward that followed.
    window: VecDeque<(usize, f64)>,
    /// Returns that the end of an episode leaves.
    returns: Vec<f64>,
}

impl NStepTd {
    /// Looking `n` steps ahead, at least 1.
    pub fn new(n: usize) -> Self {
        Self { n, window: VecDeque::new(), returns: Vec::new() }
    }

    fn reward(&mut self, reward: f64) {
        if let Some(last) = self.window.back_mut() {
            last.1 = reward;
        }
    }
}

impl Rule for NStepTd {
    const BOOTSTRAPS: bool = true;

    fn begin(&mut self, _estimate: &mut Estimate, s: usize) {
        self.window.clear();
        self.window.push_back((s, 0.0));
    }

    fn step(&mut self, estimate: &mut Estimate, reward: f64, next: usize) {
        self.reward(reward);
        if self.window.len() == self.n {
            let rewards = self.window.iter().rev().map(|&(_, reward)| reward);
            let g = rewards.fold(estimate.v[next], |g, reward| reward + estimate.gamma * g);
            if let Some((s, _)) = self.window.pop_front() {
                estimate.learn(s, g);
            }
        }
        self.window.push_back((next, 0.0));
    }

    fn end(&mut self, estimate: &mut Estimate, reward: f64, last: Last) {
        self.reward(reward);
        let mut g = estimate.after(last);
        self.returns.clear();
        for &(_, reward) in self.window.iter().rev() {
            g = reward + estimate.gamma * g;
            self.returns.push(g);
        }
        for (&(s, _), &g) in self.window.iter().zip(self.returns.iter().rev()) {
            estimate.learn(s, g);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Td0;
    use super::super::tests::{HALF, after};
    use super::*;

    fn play(n: usize, last: Last) -> Vec<f64> {
        after(NStepTd::new(n), &[1.0, 4.0, 9.0], HALF, &[0, 1, 0], &[2.0, 4.0, 8.0], last)
    }

    #[test]
    fn two_steps_by_hand() {
        // After two steps G = 2 + 4/2 + 1/4 = 4.25: 1 + (4.25 - 1) / 2 = 2.625. At the end first
        // state 1: 4 + (4 + 8/2 - 4) / 2 = 6, then state 0: 2.625 + (8 - 2.625) / 2.
        assert_eq!(play(2, Last::Terminated), [5.3125, 6.0, 9.0]);
        // V = 9 behind the last step: G = 12.5 and 4 + 12.5 / 2.
        assert_eq!(play(2, Last::Truncated(2)), [7.5625, 7.125, 9.0]);
    }

    #[test]
    fn one_step_is_td0_and_many_are_the_return() {
        for last in [Last::Terminated, Last::Truncated(2)] {
            let states = [0, 1, 0];
            let td0 =
                after(Td0::default(), &[1.0, 4.0, 9.0], HALF, &states, &[2.0, 4.0, 8.0], last);
            assert_eq!(play(1, last), td0);
        }
        // Returns 6, 8, 8, the first visit of state 0 first: 3.5, then 3.5 + (8 - 3.5) / 2.
        assert_eq!(play(9, Last::Terminated), [5.75, 6.0, 9.0]);
    }
}
