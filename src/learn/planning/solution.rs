//! What planners have in common.

use super::PlanError;
use crate::learn::QTable;
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

/// What a sweep over the states, or an iteration over policies, changed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    /// The largest change of a value.
    pub change: f64,
    /// No value is further than this from the optimum; `None` where that is not known.
    pub bound: Option<f64>,
    /// How many states it gave another action; `None` where policies are not what is iterated.
    pub switched: Option<usize>,
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

impl Solution {
    /// How the planner, which discounts by `gamma`, came closer to it: sweep by sweep. After a sweep
    /// of value iteration the values are within `change · γ / (1 − γ)` of the optimum.
    pub fn sweeps(&self, gamma: f64) -> Vec<Sweep> {
        let last = self.changes.len().saturating_sub(1);
        let sweep = |(i, &change): (usize, &f64)| {
            let switched = self.switched.get(i).copied();
            let bound = match switched {
                None => (gamma < 1.0).then(|| change * gamma / (1.0 - gamma)),
                Some(_) => self.bound.filter(|_| i == last),
            };
            Sweep { change, bound, switched }
        };
        self.changes.iter().enumerate().map(sweep).collect()
    }
}
