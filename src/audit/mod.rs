//! Exact statements about shaping, on finite models.
//!
//! - [`preservation`]: does the shaped model have the same optimal policies as the plain one, and
//!   is it shaped by a potential alone?
//! - [`strict`]: is it shaped by a potential, transition by transition? By which, or which two
//!   episodes prove that there is none ([`Certificate`])?
//! - [`Advantages`]: is it in expectation? Is the learned reward a multiple of the native one, and
//!   how far are the two apart?
//! - [`broken_task`]: a task on the same dynamics whose optimal policy the shaping changes
//! - [`Scorer`]: what a potential promises, before anything is trained

mod certificate;
mod expected;
mod necessity;
mod preservation;
mod scale;
mod score;
#[cfg(test)]
mod specimens;
mod starc;
mod strict;

pub use certificate::{Certificate, Walk, WalkStep};
pub use expected::{Advantages, Expected};
pub use necessity::{BrokenTask, broken_task};
pub use preservation::{Preservation, Verdict, preservation};
pub use scale::Scaling;
pub use score::{DeathAttraction, SCORED_SWEEPS, Score, Scorer, Shift, spearman};
pub use strict::{Diagnosis, Difference, Finding, Strict, TerminalPotential, strict};
