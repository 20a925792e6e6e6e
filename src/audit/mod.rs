//! Exact statements about shaping, on finite models.
//!
//! - [`preservation`]: does the shaped model have the same optimal policies as the plain one, and
//!   is it shaped by a potential alone?
//! - [`pathwise()`]: without a model, is every way from a state paid the same?
//! - [`query()`]: and is what is paid a difference of potentials for any two states?
//! - [`sampled()`]: a finite model of a discretised environment, from samples of each cell

mod pathwise;
mod preservation;
mod query;
mod sampled;

pub use pathwise::{
    Divergence, Path, Pathwise, PathwiseSettings, StepDependence, pathwise, rule_of_three,
};
pub use preservation::{Preservation, Verdict, preservation};
pub use query::{Leg, Query, QuerySettings, Witness, query};
pub use sampled::{Asked, CellOf, ExtraOf, PhiOf, Sampled, SampledSettings, cell_ranges, sampled};
