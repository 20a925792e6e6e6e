//! The agent that learns nothing: every comparison's baseline.

use super::greedy::pick_allowed;
use super::{Agent, Last, Learn, QTable, Seen};
use crate::mdp::Action;
use crate::mdp::streams::Stream;

/// Plays every action with the same probability.
#[derive(Debug, Clone)]
pub struct RandomAgent {
    n_actions: usize,
    gamma: f64,
    stream: Stream,
}

impl RandomAgent {
    /// Over `n_actions` actions; γ matters to the learned return of shaped rewards only.
    pub fn new(n_actions: usize, gamma: f64, stream: Stream) -> Self {
        Self { n_actions, gamma, stream }
    }
}

impl Agent for RandomAgent {
    fn gamma(&self) -> f64 {
        self.gamma
    }

    fn bootstraps_when_truncated(&self) -> bool {
        true
    }

    fn epsilon(&self) -> f64 {
        1.0
    }

    fn q(&self) -> Option<&QTable> {
        None
    }
}

impl<S: Seen> Learn<S> for RandomAgent {
    #[inline]
    fn begin(&mut self, s: S) -> Action {
        if S::SHIELDED {
            pick_allowed(self.n_actions, s, self.stream.uniform())
        } else {
            self.stream.below(self.n_actions)
        }
    }

    #[inline]
    fn step(&mut self, _reward: f64, next: S) -> Action {
        self.begin(next)
    }

    fn end(&mut self, _reward: f64, _last: Last<S>) {}
}
