//! Exact statements about shaping, on finite models.
//!
//! - [`preservation`]: does the shaped model have the same optimal policies as the plain one, and
//!   is it shaped by a potential alone?
//! - [`strict`]: is it shaped by a potential, transition by transition? By which, or which two
//!   episodes prove that there is none ([`Certificate`])?

mod certificate;
mod preservation;
#[cfg(test)]
mod specimens;
mod strict;

pub use certificate::{Certificate, Walk, WalkStep};
pub use preservation::{Preservation, Verdict, preservation};
pub use strict::{Diagnosis, Difference, Finding, Strict, TerminalPotential, strict};
