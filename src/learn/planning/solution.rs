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
