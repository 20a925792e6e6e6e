//! Exploring starts (Sutton & Barto 2018, section 5.3): episodes begin in any state.

use crate::mdp::Env;
use crate::mdp::streams::Stream;

/// Draws the first state of every episode, each that an episode can be in with the same
/// probability.
pub(super) struct Starts {
    states: Vec<usize>,
    stream: Stream,
}

impl Starts {
    /// Over the states of `env`'s model; `None` if it has none.
    pub(super) fn new<E: Env>(env: &E, seed: u64) -> Option<Self> {
        let reachable = env.finite()?.reachable();
        let states = (0..reachable.len()).filter(|&s| reachable[s]).collect();
        Some(Self { states, stream: Stream::new(seed, "starts") })
    }

    /// Puts `env`, just reset, into a state, and returns its observation.
    ///
    /// Out of line, so that the loop of an episode stays what the compiler makes of it without.
    #[cold]
    #[inline(never)]
    pub(super) fn place<E: Env>(&mut self, env: &mut E) -> E::Obs {
        let s = self.states[self.stream.below(self.states.len())];
        env.set_index(s).expect("an episode can be in a state that is reachable, and act")
    }
}
