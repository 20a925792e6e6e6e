//! n-step SARSA (Sutton & Barto 2018, section 7.2).
//!
//! `G = R_{τ+1} + γ R_{τ+2} + … + γ^{n−1} R_{τ+n} + γ^n Q(S_{τ+n}, A_{τ+n})`,
//! `Q(S_τ, A_τ) ← Q(S_τ, A_τ) + α [G − Q(S_τ, A_τ)]`
//!
//! The book's order: `A_{τ+n}` is chosen before the update of `(S_τ, A_τ)`, and is what is played. At
//! the end of an episode the pairs that still wait are updated in turn, with the rewards there
//! are.
//!
//! Deviation 1: where an episode is truncated, the book has no rule; an action is chosen in the
//! last state as anywhere else, every waiting pair bootstraps from it, and it is not played.

use std::collections::VecDeque;

use super::Tabular;
use super::tabular::agent_of_table;
use crate::learn::{Last, Learn, Rate, Seen};
use crate::mdp::Action;

/// Tabular n-step SARSA, on-policy.
#[derive(Debug, Clone)]
pub struct NStepSarsa {
    table: Tabular,
    n: usize,
    /// The pairs that wait to be updated, each with the reward that followed it; the oldest first.
    waiting: VecDeque<(usize, f64)>,
}

impl NStepSarsa {
    /// A learner with this table and behaviour that looks `n` steps ahead, 1 or more.
    pub fn new(table: Tabular, n: usize) -> Self {
        Self { table, n, waiting: VecDeque::new() }
    }

    /// Updates the pair that has waited longest; `bootstrap` is the value of the state and action
    /// after the last reward.
    #[inline]
    fn update(&mut self, bootstrap: f64) {
        let Tabular { q, gamma, alpha, .. } = &mut self.table;
        let g = self.waiting.iter().rev().fold(bootstrap, |g, (_, reward)| reward + *gamma * g);
        if let Some((pair, _)) = self.waiting.pop_front() {
            let alpha = alpha.visit(pair);
            let q = &mut q.values_mut()[pair];
            *q += alpha * (g - *q);
        }
    }

    /// The reward that followed the last pair.
    fn receive(&mut self, reward: f64) {
        let Tabular { q, s, a, .. } = &self.table;
        self.waiting.push_back((q.pair(*s, *a), reward));
    }
}

agent_of_table!(NStepSarsa, table);

impl<S: Seen> Learn<S> for NStepSarsa {
    fn begin(&mut self, s: S) -> Action {
        let a = self.table.choose(s);
        self.table.play(s, a)
    }

    fn step(&mut self, reward: f64, next: S) -> Action {
        self.receive(reward);
        let a_next = self.table.choose(next);
        if self.waiting.len() == self.n {
            self.update(self.table.q.get(next.cell(), a_next));
        }
        self.table.play(next, a_next)
    }

    fn end(&mut self, reward: f64, last: Last<S>) {
        self.receive(reward);
        let after = match last {
            Last::Terminated => None,
            Last::Truncated(next) => {
                let a_next = self.table.choose(next);
                Some(self.table.q.pair(next.cell(), a_next))
            }
        };
        while !self.waiting.is_empty() {
            self.update(after.map_or(0.0, |pair| self.table.q.values()[pair]));
        }
        self.table.end_episode();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::control::tests::greedy;

    #[test]
    fn two_steps_by_hand() {
        // Row 0: (0, 1), row 1: (4, 2); γ = 0.9, α = 0.5, greedy.
        let mut agent = NStepSarsa::new(greedy(0.5), 2);
        assert_eq!(agent.begin(0), 1);
        assert_eq!(agent.step(10.0, 1), 0);
        assert_eq!(agent.table.q.get(0, 1), 1.0, "nothing is known two steps ahead yet");
        // Back in 0, where 1 is greedy by the old values:
        // G = 10 + 0.9 * -2 + 0.81 * Q(0, 1) = 8.2 + 0.81 = 9.01; Q(0, 1) = 1 + 0.5 * 8.01.
        assert_eq!(agent.step(-2.0, 0), 1);
        let q01 = 5.005;
        assert!((agent.table.q.get(0, 1) - q01).abs() < 1e-15);
        // The end pays 3. (1, 0): G = -2 + 0.9 * 3 = 0.7; then (0, 1): G = 3.
        agent.end(3.0, Last::<usize>::Terminated);
        assert!((agent.table.q.get(1, 0) - (4.0 + 0.5 * (0.7 - 4.0))).abs() < 1e-15);
        assert!((agent.table.q.get(0, 1) - (q01 + 0.5 * (3.0 - q01))).abs() < 1e-15);
        assert!(agent.waiting.is_empty());
    }

    #[test]
    fn episodes_shorter_than_n_and_truncated_ones() {
        let mut agent = NStepSarsa::new(greedy(0.5), 5);
        agent.begin(0);
        agent.step(1.0, 1);
        // Truncated in 0, where 1 is greedy and worth 1 at first:
        // (0, 1): G = 1 + 0.9 * 2 + 0.81 * 1 = 3.61, so Q(0, 1) = 1 + 0.5 * 2.61 = 2.305;
        // (1, 0): G = 2 + 0.9 * 2.305 = 4.0745 by the new value, Q(1, 0) = 4 + 0.5 * 0.0745.
        agent.end(2.0, Last::Truncated(0));
        assert!((agent.table.q.get(0, 1) - 2.305).abs() < 1e-15);
        assert!((agent.table.q.get(1, 0) - 4.037_25).abs() < 1e-15);
    }
}
