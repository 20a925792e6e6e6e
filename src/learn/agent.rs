//! What an agent is.

use super::QTable;
use crate::mdp::Action;

/// The last state of an episode, as far as learning is concerned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Last {
    /// The state is terminal: nothing is bootstrapped from it.
    Terminated,
    /// The time limit cut the episode off in this state, which still has a value.
    Truncated(usize),
}

/// A learner over states `0..n_states`.
///
/// The loop calls [`Self::begin`] once per episode, [`Self::step`] after every step that goes on,
/// and [`Self::end`] after the last one. The agent remembers its own (s, a).
pub trait Agent {
    /// Starts an episode in state `s` and returns the first action.
    fn begin(&mut self, s: usize) -> Action;

    /// Learns from `reward` and the arrival in `next`; returns the action to play there.
    fn step(&mut self, reward: f64, next: usize) -> Action;

    /// Learns from the last `reward` of the episode.
    fn end(&mut self, reward: f64, last: Last);

    /// The discount factor γ: shaping uses the agent's own.
    fn gamma(&self) -> f64;

    /// Whether the agent bootstraps from the state in which an episode was truncated. If so the
    /// potential of that state is kept, else it counts as 0 (Pardo et al. 2018).
    fn bootstraps_when_truncated(&self) -> bool;

    /// The exploration rate used at present; 0 for an agent that does not explore.
    fn epsilon(&self) -> f64;

    /// The action values learned so far, if the agent keeps any.
    fn q(&self) -> Option<&QTable>;
}
