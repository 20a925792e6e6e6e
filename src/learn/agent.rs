//! What an agent is.

use super::QTable;
use super::dqn::Dqn;
use crate::mdp::Action;
pub use crate::shaping::Seen;

/// The last state of an episode, as far as learning is concerned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Last<S = usize> {
    /// The state is terminal: nothing is bootstrapped from it.
    Terminated,
    /// The time limit cut the episode off in this state, which still has a value.
    Truncated(S),
}

/// What there is to know of an agent besides how it acts.
pub trait Agent {
    /// The discount factor γ: shaping uses the agent's own.
    fn gamma(&self) -> f64;

    /// Whether the agent bootstraps from the state in which an episode was truncated. If so the
    /// potential of that state is kept, else it counts as 0 (Pardo et al. 2018).
    fn bootstraps_when_truncated(&self) -> bool;

    /// The exploration rate used at present; 0 for an agent that does not explore.
    fn epsilon(&self) -> f64;

    /// The action values learned so far, if the agent keeps any.
    fn q(&self) -> Option<&QTable>;

    /// The weights learned so far, shape `[n_features, n_actions]`, if the agent's action values are
    /// linear in features.
    fn weights(&self) -> Option<&QTable> {
        None
    }

    /// The state values learned so far, one per state, if that is what the agent learns.
    fn v(&self) -> Option<&[f64]> {
        None
    }

    /// The agent, if it learns a network.
    fn dqn(&self) -> Option<&Dqn> {
        None
    }

    /// What the agent itself added to its rewards, summed over the episode that has ended: the
    /// part of a shaping that needs to know which action is bootstrapped from, or what has been
    /// learned so far.
    fn shaping(&self) -> f64 {
        0.0
    }
}

/// Playing and learning, over states of type `S`.
///
/// The loop calls [`Self::begin`] once per episode, [`Self::step`] after every step that goes on,
/// and [`Self::end`] after the last one. The agent remembers its own (s, a).
///
/// Tabular agents implement it for `usize`, a row of the table, and for
/// [`Shielded`](crate::shaping::Shielded), a row and the actions allowed there, by one generic
/// implementation over [`Seen`]; function approximators for [`Fields`](crate::shaping::Fields).
pub trait Learn<S: Seen>: Agent {
    /// Starts an episode in state `s` and returns the first action.
    fn begin(&mut self, s: S) -> Action;

    /// Learns from `reward` and the arrival in `next`; returns the action to play there.
    fn step(&mut self, reward: f64, next: S) -> Action;

    /// Learns from the last `reward` of the episode.
    fn end(&mut self, reward: f64, last: Last<S>);
}

impl<T: Agent + ?Sized> Agent for Box<T> {
    fn gamma(&self) -> f64 {
        (**self).gamma()
    }

    fn bootstraps_when_truncated(&self) -> bool {
        (**self).bootstraps_when_truncated()
    }

    fn epsilon(&self) -> f64 {
        (**self).epsilon()
    }

    fn q(&self) -> Option<&QTable> {
        (**self).q()
    }

    fn weights(&self) -> Option<&QTable> {
        (**self).weights()
    }

    fn v(&self) -> Option<&[f64]> {
        (**self).v()
    }

    fn dqn(&self) -> Option<&Dqn> {
        (**self).dqn()
    }

    fn shaping(&self) -> f64 {
        (**self).shaping()
    }
}

impl<S: Seen, T: Learn<S> + ?Sized> Learn<S> for Box<T> {
    #[inline]
    fn begin(&mut self, s: S) -> Action {
        (**self).begin(s)
    }

    #[inline]
    fn step(&mut self, reward: f64, next: S) -> Action {
        (**self).step(reward, next)
    }

    #[inline]
    fn end(&mut self, reward: f64, last: Last<S>) {
        (**self).end(reward, last);
    }
}
