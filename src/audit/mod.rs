//! What can be said about a shaping: exactly on finite models, and from samples elsewhere.
//!
//! - [`preservation`]: does the shaped model have the same optimal policies as the plain one, and
//!   is it shaped by a potential alone?
//! - [`strict`]: is it shaped by a potential, transition by transition? By which, or which two
//!   episodes prove that there is none ([`Certificate`])?
//! - [`Advantages`]: is it in expectation? Is the learned reward a multiple of the native one, and
//!   how far are the two apart?
//! - [`broken_task`]: a task on the same dynamics whose optimal policy the shaping changes
//! - [`Scorer`]: what a potential promises, before anything is trained
//! - [`pattern`]: what kind of term is it, if it is no potential's?
//! - [`pathwise()`]: without a model, is every way from a state paid the same?
//! - [`query()`]: and is what is paid a difference of potentials for any two states?
//! - [`sampled()`]: a finite model of a discretised environment, from samples of each cell

mod certificate;
mod expected;
mod necessity;
mod pathwise;
mod pattern;
mod preservation;
mod query;
mod sampled;
mod scale;
mod score;
#[cfg(test)]
mod specimens;
mod starc;
mod strict;

pub use certificate::{Certificate, Walk, WalkStep};
pub use expected::{Advantages, Expected};
pub use necessity::{BrokenTask, broken_task};
pub use pathwise::{
    Divergence, Path, Pathwise, PathwiseSettings, StepDependence, pathwise, rule_of_three,
};
pub use pattern::{Pattern, pattern};
pub use preservation::{Preservation, Verdict, preservation};
pub use query::{Leg, Query, QuerySettings, Witness, query};
pub use sampled::{Asked, CellOf, ExtraOf, PhiOf, Sampled, SampledSettings, cell_ranges, sampled};
pub use scale::Scaling;
pub use score::{DeathAttraction, SCORED_SWEEPS, Score, Scorer, Shift, spearman};
pub use strict::{Diagnosis, Difference, Finding, Strict, TerminalPotential, strict};
