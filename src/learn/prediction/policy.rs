//! The policies whose values are learned.

use crate::learn::Seen;
use crate::learn::greedy::pick_allowed;
use crate::mdp::Action;
use crate::mdp::streams::Stream;
use crate::shaping::ActionSet;

/// A policy that is given, not learned.
#[derive(Debug, Clone)]
pub enum GivenPolicy {
    /// Every action that is allowed with the same probability.
    Random {
        /// Number of actions.
        n_actions: usize,
        /// Its randomness.
        stream: Stream,
    },
    /// One action per state; the first that is allowed where a shield refuses it.
    Fixed(Vec<Action>),
}

impl GivenPolicy {
    /// The action in `s`.
    #[inline]
    pub fn choose<S: Seen>(&mut self, s: S) -> Action {
        match self {
            Self::Random { n_actions, stream } if S::SHIELDED => {
                pick_allowed(*n_actions, s, stream.uniform())
            }
            Self::Random { n_actions, stream } => stream.below(*n_actions),
            Self::Fixed(actions) => {
                let a = actions[s.cell()];
                if s.allows(a) { a } else { pick_allowed(ActionSet::CAPACITY, s, 0.0) }
            }
        }
    }
}
