//! A table of action values.

use serde::{Deserialize, Serialize};

/// Q(s, a), shape `[n_states, n_actions]`, row-major.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct QTable {
    n_actions: usize,
    values: Vec<f64>,
}

impl QTable {
    /// `initial` everywhere.
    pub fn new(n_states: usize, n_actions: usize, initial: f64) -> Self {
        Self { n_actions, values: vec![initial; n_states * n_actions] }
    }

    /// From values of shape `[n_states, n_actions]`.
    ///
    /// # Panics
    /// If the length is not a multiple of `n_actions`.
    pub fn from_values(n_actions: usize, values: Vec<f64>) -> Self {
        assert_eq!(values.len() % n_actions, 0, "a Q table holds n_states * n_actions values");
        Self { n_actions, values }
    }

    /// Number of states.
    pub fn n_states(&self) -> usize {
        self.values.len() / self.n_actions
    }

    /// Number of actions.
    pub fn n_actions(&self) -> usize {
        self.n_actions
    }

    /// All values, row-major.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The values of state `s`, one per action.
    #[inline]
    pub fn row(&self, s: usize) -> &[f64] {
        &self.values[s * self.n_actions..(s + 1) * self.n_actions]
    }

    /// Q(s, a).
    #[inline]
    pub fn get(&self, s: usize, a: usize) -> f64 {
        self.values[s * self.n_actions + a]
    }

    /// Q(s, a), to change it.
    #[inline]
    pub fn get_mut(&mut self, s: usize, a: usize) -> &mut f64 {
        &mut self.values[s * self.n_actions + a]
    }

    /// The place of (s, a) among [`Self::values`].
    #[inline]
    pub fn pair(&self, s: usize, a: usize) -> usize {
        s * self.n_actions + a
    }

    /// All values, row-major, to change them.
    #[inline]
    pub(super) fn values_mut(&mut self) -> &mut [f64] {
        &mut self.values
    }

    /// max over a of Q(s, a).
    #[inline]
    pub fn max(&self, s: usize) -> f64 {
        max(self.row(s))
    }
}

/// The largest value of a row.
#[inline]
pub(super) fn max(row: &[f64]) -> f64 {
    let mut best = row[0];
    for &q in &row[1..] {
        if q > best {
            best = q;
        }
    }
    best
}
