//! What planners have in common, and the agent that plays what they found.

use super::PlanError;
use crate::learn::{Agent, Last, QTable};
use crate::mdp::{Action, FiniteMdp};

/// Solves a model.
pub trait Planner {
    /// The optimal values of `mdp`, starting from `v0` (one value per state).
    ///
    /// Shaped models should start from −Φ: sweep by sweep the values then equal those of the plain
    /// model from 0, minus Φ.
    ///
    /// # Errors
    /// If the model has no solution: γ = 1 and episodes that never end, or values that are not
    /// finite.
    fn solve(&self, mdp: &FiniteMdp, v0: &[f64]) -> Result<Solution, PlanError>;

    /// The discount factor.
    fn gamma(&self) -> f64;
}

/// What a planner found.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// State values, one per state.
    pub v: Vec<f64>,
    /// Action values.
    pub q: QTable,
    /// The action to play, one per state.
    pub policy: Vec<Action>,
    /// The largest change of a value in each sweep or iteration.
    pub changes: Vec<f64>,
    /// How many states each iteration gave another action; empty where policies are not what is
    /// iterated.
    pub switched: Vec<usize>,
    /// Whether it stopped because there was nothing left to do.
    pub converged: bool,
    /// No value is further than this from the optimum; `None` with γ = 1, where no such bound is
    /// known.
    pub bound: Option<f64>,
}

/// Plays a planner's policy and learns nothing.
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
    #[inline]
    fn begin(&mut self, s: usize) -> Action {
        self.solution.policy[s]
    }

    #[inline]
    fn step(&mut self, _reward: f64, next: usize) -> Action {
        self.begin(next)
    }

    fn end(&mut self, _reward: f64, _last: Last) {}

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
}
