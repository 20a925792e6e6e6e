//! Features and weights.

use crate::learn::QTable;
use crate::learn::control::{Trace, Traces};
use crate::mdp::Action;
use crate::shaping::{Active, Features};

/// Action values that are linear in features.
#[derive(Debug, Clone)]
pub struct LinearQ {
    features: Features,
    /// Shape `[n_features, n_actions]`.
    weights: QTable,
}

impl LinearQ {
    /// The value `initial` in every state, spread over its features.
    pub fn new(features: Features, n_actions: usize, initial: f64) -> Self {
        let levels = (0..features.n_features()).map(|i| features.level(i, initial));
        let weights = levels.flat_map(|w| std::iter::repeat_n(w, n_actions)).collect();
        Self { weights: QTable::from_values(n_actions, weights), features }
    }

    /// With weights that were learned before, shape `[n_features, n_actions]`.
    ///
    /// # Panics
    /// If there are more or fewer weights than features.
    pub fn from_weights(features: Features, weights: QTable) -> Self {
        assert_eq!(weights.n_states(), features.n_features(), "a row of weights for each feature");
        Self { features, weights }
    }

    /// The features.
    pub fn features(&self) -> &Features {
        &self.features
    }

    /// The weights, shape `[n_features, n_actions]`.
    pub fn weights(&self) -> &QTable {
        &self.weights
    }

    /// q(s, a).
    #[inline]
    pub fn value(&self, s: &Active, a: Action) -> f64 {
        let mut sum = 0.0;
        for (&i, x) in s.index.iter().zip(&s.value) {
            sum += x * self.weights.get(i as usize, a);
        }
        sum
    }

    /// q(s, a) of every action, into `row`; the same bits as [`Self::value`].
    #[inline]
    pub fn values(&self, s: &Active, row: &mut [f64]) {
        row.fill(0.0);
        for (&i, x) in s.index.iter().zip(&s.value) {
            for (sum, w) in row.iter_mut().zip(self.weights.row(i as usize)) {
                *sum += x * w;
            }
        }
    }

    /// The values at `states`, each given by its fields: a row each.
    pub fn table(&self, states: &[Vec<f64>]) -> QTable {
        let mut active = self.features.active();
        let n_actions = self.weights.n_actions();
        let mut values = vec![0.0; states.len() * n_actions];
        for (row, state) in values.chunks_exact_mut(n_actions).zip(states) {
            self.features.see(state, &mut active);
            self.values(&active, row);
        }
        QTable::from_values(n_actions, values)
    }

    /// Moves the weights by `size` along the gradient of q(s, a), each by its feature's share of
    /// the step size.
    #[inline]
    pub(super) fn learn(&mut self, s: &Active, a: Action, size: f64) {
        for (&i, step) in s.index.iter().zip(&s.step) {
            *self.weights.get_mut(i as usize, a) += size * step;
        }
    }

    /// Raises the traces of (s, a), whose values are learned with step size `alpha`.
    #[inline]
    pub(super) fn raise(&self, traces: &mut Traces, s: &Active, a: Action, alpha: f64) {
        let mut factor = 1.0;
        if traces.kind() == Trace::Dutch {
            // zᵀ(αx), where each feature has its own share of α.
            let mut product = 0.0;
            for (&i, step) in s.index.iter().zip(&s.step) {
                product += traces.get(self.weights.pair(i as usize, a)) * step;
            }
            factor = 1.0 - alpha * product;
        }
        for (&i, x) in s.index.iter().zip(&s.value) {
            traces.raise(self.weights.pair(i as usize, a), factor * x);
        }
    }

    /// Moves the weights by `size` along the traces, which then fade.
    #[inline]
    pub(super) fn learn_along(&mut self, traces: &mut Traces, size: f64) {
        let Self { features, weights } = self;
        let n_actions = weights.n_actions();
        let values = weights.values_mut();
        traces.spread(size, |pair, change| {
            values[pair] += change * features.share(pair / n_actions);
        });
    }
}
