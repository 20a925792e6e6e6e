//! What is written down of a network's learning.

/// What happened since the last entry, and how things stand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LogRow {
    /// Steps of the agent so far.
    pub step: u64,
    /// The episode it is in, counted from 1.
    pub episode: u32,
    /// Gradient steps so far.
    pub updates: u64,
    /// Mean loss of the minibatches since the last entry; `None` if there were none.
    pub loss: Option<f64>,
    /// Mean action value of what was learned from since then.
    pub q: Option<f64>,
    /// Mean size of the error of those.
    pub td_error: Option<f64>,
    /// Exploration rate.
    pub epsilon: f64,
    /// Step size of the optimiser.
    pub learning_rate: f64,
    /// Transitions in the replay buffer.
    pub buffer: u64,
    /// Mean over the episodes that ended since the last entry: the value that the best action was
    /// believed to have in their first state.
    pub start_value: Option<f64>,
    /// The mean discounted return that those episodes then brought, of the learned reward. What is
    /// believed beyond it is overestimation (van Hasselt, Guez & Silver 2016), as long as the
    /// agent seldom explores.
    pub start_return: Option<f64>,
}

/// Sums since the last entry.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Sums {
    /// Of losses, of action values and of errors, and of how many minibatches.
    pub(super) loss: f64,
    pub(super) q: f64,
    pub(super) td_error: f64,
    pub(super) batches: u64,
    /// Of first states' values and of returns, and of how many episodes.
    pub(super) start_value: f64,
    pub(super) start_return: f64,
    pub(super) episodes: u64,
}

impl Sums {
    /// As numbers; they need not be finite.
    pub(super) fn numbers(&self) -> [f64; 7] {
        let (batches, episodes) = (self.batches as f64, self.episodes as f64);
        let [value, sum] = [self.start_value, self.start_return];
        [self.loss, self.q, self.td_error, batches, value, sum, episodes]
    }

    /// What had these [`Self::numbers`].
    pub(super) fn of([loss, q, td_error, batches, value, sum, episodes]: [f64; 7]) -> Self {
        Self {
            loss,
            q,
            td_error,
            batches: batches as u64,
            start_value: value,
            start_return: sum,
            episodes: episodes as u64,
        }
    }

    /// The means, and starts anew: loss, action value, error, value and return of first states.
    pub(super) fn take(&mut self) -> [Option<f64>; 5] {
        let s = std::mem::take(self);
        let mean = |sum: f64, n: u64| (n > 0).then(|| sum / n as f64);
        [
            mean(s.loss, s.batches),
            mean(s.q, s.batches),
            mean(s.td_error, s.batches),
            mean(s.start_value, s.episodes),
            mean(s.start_return, s.episodes),
        ]
    }
}
