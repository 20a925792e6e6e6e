//! Playing what a planner found.

use super::Solution;
use crate::learn::greedy::argmax_allowed;
use crate::learn::{Agent, Last, Learn, QTable, Seen};
use crate::mdp::Action;

/// Plays a planner's policy and learns nothing; where a shield refuses its action, the best of those
/// that are allowed.
#[derive(Debug, Clone)]
pub struct PlannedAgent {
    solution: Solution,
    gamma: f64,
}

impl PlannedAgent {
    /// Plays the solution's policy.
    pub fn new(solution: Solution, gamma: f64) -> Self {
        Self { solution, gamma }
    }

    /// What is played.
    pub fn solution(&self) -> &Solution {
        &self.solution
    }
}

impl Agent for PlannedAgent {
    fn gamma(&self) -> f64 {
        self.gamma
    }

    fn bootstraps_when_truncated(&self) -> bool {
        true
    }

    fn epsilon(&self) -> f64 {
        0.0
    }

    fn q(&self) -> Option<&QTable> {
        Some(&self.solution.q)
    }

    fn v(&self) -> Option<&[f64]> {
        Some(&self.solution.v)
    }
}

impl<S: Seen> Learn<S> for PlannedAgent {
    #[inline]
    fn begin(&mut self, s: S) -> Action {
        let action = self.solution.policy[s.cell()];
        if s.allows(action) { action } else { argmax_allowed(self.solution.q.row(s.cell()), s) }
    }

    #[inline]
    fn step(&mut self, _reward: f64, next: S) -> Action {
        self.begin(next)
    }

    fn end(&mut self, _reward: f64, _last: Last<S>) {}
}
