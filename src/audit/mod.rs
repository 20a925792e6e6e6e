//! Exact statements about shaping, on finite models.
//!
//! - [`Pair`]: a model with its native and its learned rewards, both solved; what follows is asked
//!   of it
//! - [`preservation`], [`Preservation`]: does the shaped model have the same optimal policies as the
//!   plain one, and is it shaped by a potential alone?
//! - [`PolicyChange`]: what is lost in native return
//! - [`Critical`]: how far the shaping could be scaled before the policy changes
//! - [`Hacking`]: the loop that pays better than the task
//! - [`SspCheck`]: are values without discounting what they should be?

mod critical;
mod cycle;
mod gap;
mod graph;
mod hacking;
mod pair;
mod payoff;
mod policy_change;
mod preservation;
mod ssp;

pub use critical::Critical;
pub use cycle::Cycle;
pub use hacking::Hacking;
pub use pair::{Pair, Unsolved};
pub use policy_change::{Endings, PolicyChange};
pub use preservation::{Preservation, Verdict, preservation};
pub use ssp::{NotSsp, SspCheck};
