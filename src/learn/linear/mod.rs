//! Action values that are linear in features, `q(s, a) = Σᵢ wᵢₐ xᵢ(s)` (Sutton & Barto 2018,
//! chapters 9, 10 and 12): for states too many or too fine for a table.
//!
//! - [`LinearQ`]: features and weights
//! - [`LinearLearner`]: Q-learning, SARSA and expected SARSA, Q(λ) and SARSA(λ)
//! - [`LinearSetup`]: what a learner is built for
//!
//! Sums over features are taken in the order in which [`Features`] lists them, so that results have
//! the same bits everywhere. A step allocates nothing.

mod learner;
mod linear_q;

#[cfg(test)]
mod tests;

pub use learner::{LinearLearner, LinearSetup, Target};
pub use linear_q::LinearQ;

#[cfg(doc)]
use crate::shaping::Features;
