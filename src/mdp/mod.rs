//! The vocabulary everything else is written in: actions, steps, endings, environments, finite
//! models, random streams and the pinned mathematics.
//!
//! - [`Env`]: pure dynamics, no time limit and no shaping
//! - [`FiniteMdp`], [`FiniteEnv`]: one transition table for planning *and* for stepping
//! - [`numpy`]: NumPy's generator, bit for bit, for the environments
//! - [`streams`]: every other stream of random numbers, derived from (seed, purpose)
//! - [`math`]: correctly rounded transcendental functions, the same on every platform

mod env;
mod finite;
mod finite_env;
pub mod math;
pub mod numpy;
pub mod streams;

pub use env::{
    Action, ActionSpace, Ending, Env, Field, FieldKind, Grid, MAX_FIELDS, Schema, Step, angle,
    widen, within,
};
pub use finite::{FiniteMdp, FiniteMdpError, Outcome};
pub use finite_env::{FiniteEnv, FiniteState};
