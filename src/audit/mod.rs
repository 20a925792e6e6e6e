//! What can be said about a shaping: exactly on finite models, and from samples elsewhere.
//!
//! On the rewards of a model:
//! - [`strict`]: is it shaped by a potential, transition by transition? By which, or which two
//!   episodes prove that there is none ([`Certificate`])?
//! - [`Advantages`]: is it in expectation? Is the learned reward a multiple of the native one, and
//!   how far are the two apart?
//! - [`broken_task`]: a task on the same dynamics whose optimal policy the shaping changes
//! - [`pattern`]: what kind of term is it, if it is no potential's?
//!
//! On the solutions, [`Pair`], of a model with its native and its learned rewards:
//! - [`preservation`], [`Preservation`]: are the same actions optimal?
//! - [`PolicyChange`]: what is lost in native return
//! - [`Critical`]: how far the shaping could be scaled before the policy changes
//! - [`Hacking`]: the loop that pays better than the task
//! - [`SspCheck`]: are values without discounting what they should be?
//!
//! Without a model:
//! - [`pathwise()`]: is every way from a state paid the same?
//! - [`query()`]: and is what is paid a difference of potentials for any two states?
//! - [`sampled()`]: a finite model of a discretised environment, from samples of each cell
//!
//! Before anything is trained: [`Scorer`], what a potential promises.

mod certificate;
mod critical;
mod cycle;
mod expected;
mod gap;
mod graph;
mod hacking;
mod necessity;
mod pair;
mod pathwise;
mod pattern;
mod payoff;
mod policy_change;
mod preservation;
mod query;
mod sampled;
mod scale;
mod score;
#[cfg(test)]
mod specimens;
mod ssp;
mod starc;
mod strict;

pub use certificate::{Certificate, Walk, WalkStep};
pub use critical::Critical;
pub use cycle::Cycle;
pub use expected::{Advantages, Expected};
pub use hacking::Hacking;
pub use necessity::{BrokenTask, broken_task};
pub use pair::{Pair, Unsolved};
pub use pathwise::{
    Divergence, Path, Pathwise, PathwiseSettings, StepDependence, pathwise, rule_of_three,
};
pub use pattern::{Pattern, pattern};
pub use policy_change::{Endings, PolicyChange};
pub use preservation::{Preservation, Verdict, preservation};
pub use query::{Leg, Query, QuerySettings, Witness, query};
pub use sampled::{Asked, CellOf, ExtraOf, PhiOf, Sampled, SampledSettings, cell_ranges, sampled};
pub use scale::Scaling;
pub use score::{DeathAttraction, SCORED_SWEEPS, Score, Scorer, Shift, spearman};
pub use ssp::{NotSsp, SspCheck};
pub use strict::{Diagnosis, Difference, Finding, Strict, TerminalPotential, strict};
