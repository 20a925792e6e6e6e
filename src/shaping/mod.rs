//! What stands between an environment and a learner: rewards, potentials and discretisers.
//!
//! - [`Discretiser`]: observation → what the agent sees. [`StateIndex`], [`Bins`],
//!   [`ScriptedCells`], [`RawFields`]; [`Shield`]: the actions allowed there
//! - [`Features`]: the state's numbers → features, for linear values; [`Tiles`], [`Fourier`]
//! - [`Inputs`]: the state's numbers → the inputs of a network
//! - [`Potential`]: Φ(s). [`NoPotential`], [`CellPotential`], [`EpisodePotential`], [`RawPotential`]
//! - [`Scale`]: observation normalisation
//! - [`RewardModel`]: the reward the agent learns from. [`NativeReward`], [`TabulatedReward`],
//!   [`ScriptedReward`]
//! - [`potential_term`]: `γΦ(s′) − Φ(s)`, with Φ(terminal) = 0, in the one place where it is computed
//!
//! The training loop is generic over all three, so that the step compiles to straight code; scripts
//! implement them through [`CellFn`], [`PhiFn`] and [`StepFn`]: machine code, or the interpreter.

mod bins;
mod discretiser;
mod features;
mod inputs;
mod potential;
mod reward;
mod scale;
mod scripted;

pub use crate::mdp::MAX_FIELDS;
pub use bins::{Bins, BinsError, Dim, MAX_CELLS};
pub use discretiser::{
    ActionSet, AnyCells, Discretiser, Fields, RawFields, ScriptedCells, Seen, Shield, Shielded,
    ShieldedCells, StateIndex,
};
pub use features::{Active, FeatureKind, FeatureSpec, Features, Fourier, MAX_WEIGHTS, Tiles};
pub use inputs::Inputs;
pub use potential::{
    ActionFn, AnyPotential, CellEpisodeFn, CellPhiFn, CellPotential, EpisodePotential, NoPotential,
    Potential, RawPotential, potential_term, shaped_model,
};
pub use reward::{
    AnyReward, NativeReward, RewardModel, ScriptedReward, TabulatedReward, Transition,
};
pub use scale::Scale;
pub use scripted::{CellFn, PhiFn, ShieldFn, StepFn, StepLayout};

/// A callback failed while training. Carries the script's own error, so that the floors above can
/// show its place.
#[derive(Debug)]
pub struct Fault(pub Box<dyn std::error::Error + Send + Sync>);

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

impl std::error::Error for Fault {}
