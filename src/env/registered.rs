//! What an environment provides beyond its dynamics to stand in the registry.

use std::fmt;

use serde::{Serialize, Serializer};
use serde_json::{Map, Value};

use super::actions::ActionTable;
use super::error::EnvError;
use super::kwargs::{KwargSpec, Kwargs};
use super::scene::Draw;
use crate::mdp::{Env, FiniteState, MAX_FIELDS};

/// An observation whose type is known at run time only. Serialises as Gymnasium's would: a bare
/// integer, a list of float32 in the shortest decimal that reads back as the same float32, or a
/// list of integers.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Observation {
    /// A state index (`Discrete`).
    Index(i64),
    /// An array of float32 (`Box`).
    Box(Vec<f32>),
    /// Several integers (`Tuple` of `Discrete`).
    Tuple(Vec<i64>),
}

impl<const N: usize> From<[f32; N]> for Observation {
    fn from(obs: [f32; N]) -> Self {
        Self::Box(obs.to_vec())
    }
}

impl From<FiniteState> for Observation {
    fn from(obs: FiniteState) -> Self {
        Self::Index(obs.index.into())
    }
}

/// A state as scripts and discretisers see it, whatever the type of its observation.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Seen {
    /// Its index in the model, on finite environments.
    pub(super) index: Option<usize>,
    /// The numbers that the schema names, and zeros.
    pub(super) fields: [f64; MAX_FIELDS],
}

impl Seen {
    /// What `env` says of `obs`.
    pub(super) fn of<E: Env>(env: &E, obs: &E::Obs) -> Self {
        let mut fields = [0.0; MAX_FIELDS];
        env.fields(obs, &mut fields);
        Self { index: env.state_index(obs), fields }
    }
}

/// Which actions can do anything in a state, one flag per action: Gymnasium's
/// `info["action_mask"]`. Displayed and serialised as one character per action, `1` for those that
/// can: `110000`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ActionMask(pub Vec<bool>);

impl fmt::Display for ActionMask {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|&can| f.write_str(if can { "1" } else { "0" }))
    }
}

impl Serialize for ActionMask {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// What `runner new` writes, and suggestions show: sensible, not tuned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Example {
    /// The body of a potential `|s|` that helps a tabular learner.
    pub potential: &'static str,
    /// The map for `bins`, empty on finite environments.
    pub bins: &'static str,
}

/// An environment that can be made from an id and arguments.
pub trait Registered: Env<Obs: Into<Observation>> + Draw + Clone + 'static {
    /// One line for `list`.
    const SUMMARY: &'static str;

    /// The constructor's arguments.
    const KWARGS: &'static [KwargSpec];

    /// What a first script for it may say.
    const EXAMPLE: Example;

    /// The reset options it knows.
    const RESET_OPTIONS: &'static [&'static str] = &[];

    /// The attributes that may be set before the first reset.
    const ATTRIBUTES: &'static [&'static str] = &[];

    /// Builds it from checked arguments.
    ///
    /// # Errors
    /// If a value is out of its range.
    fn from_kwargs(kwargs: &Kwargs) -> Result<Self, EnvError>;

    /// Sets Gymnasium's reset `options` for the resets to come: those given, all of them in
    /// [`Self::RESET_OPTIONS`], and the defaults of the others. Changes nothing if they are wrong.
    ///
    /// # Errors
    /// If an option's value is not allowed.
    fn set_reset_options(&mut self, _options: &Map<String, Value>) -> Result<(), EnvError> {
        Ok(())
    }

    /// The probability of the outcome that led to `obs`: Gymnasium's `info["prob"]`. `None` after a
    /// reset and where there is no table of outcomes.
    fn probability(&self, obs: &Self::Obs) -> Option<f64> {
        let (mdp, outcome) = self.finite().zip(self.outcome_index(obs))?;
        Some(mdp.outcomes()[outcome].probability)
    }

    /// Which actions can do anything after `obs`, in environments for which Gymnasium says so.
    fn action_mask(&self, _obs: &Self::Obs) -> Option<ActionMask> {
        None
    }

    /// Where actions are real numbers: the ones that agents choose among.
    fn action_table(&self) -> Option<&ActionTable> {
        None
    }

    /// Replaces [`Self::action_table`]; only called where there is one, with a table for its box.
    fn set_action_table(&mut self, _table: ActionTable) {}

    /// Sets an attribute, one of [`Self::ATTRIBUTES`].
    ///
    /// # Errors
    /// If the value is not allowed.
    fn set_attribute(&mut self, _name: &str, _value: &Value) -> Result<(), EnvError> {
        Ok(())
    }
}
