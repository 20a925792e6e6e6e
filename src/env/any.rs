//! [`AnyEnv`]'s methods: the environment behind a vtable, for everything that is not a step of a
//! training loop.

use std::sync::Arc;

use serde_json::{Map, Value};

use super::actions::{ActionTable, PlayedAction};
use super::error::EnvError;
use super::registered::{ActionMask, Observation, Registered, Seen};
use super::registry::AnyEnv;
use super::scene::{Draw, Scene, TextPicture};
use crate::mdp::numpy::NumpyRng;
use crate::mdp::{ActionSpace, Env, FiniteMdp, Schema, Step};

/// An environment, seen through a vtable: for sessions, which are dynamic in every step.
pub(super) trait Dynamic {
    fn reset(&mut self, rng: &mut NumpyRng) -> (Observation, Seen, Option<ActionMask>);
    fn step(&mut self, action: usize, rng: &mut NumpyRng) -> DynamicStep;
    fn step_box(&mut self, action: &[f32], rng: &mut NumpyRng) -> DynamicStep;
    fn set_attribute(&mut self, name: &str, value: &Value) -> Result<(), EnvError>;
    fn set_reset_options(&mut self, options: &Map<String, Value>) -> Result<(), EnvError>;
    fn action_table(&self) -> Option<&ActionTable>;
    fn set_action_table(&mut self, table: ActionTable);
    fn n_actions(&self) -> usize;
    fn action_space(&self) -> ActionSpace;
    fn schema(&self) -> Schema;
    fn finite(&self) -> Option<&Arc<FiniteMdp>>;
    fn scene(&self, last: Option<&PlayedAction>) -> Scene;
    fn text(&self, last: Option<&PlayedAction>) -> Option<TextPicture>;
    fn n_states(&self) -> Option<usize>;
}

/// What [`Dynamic::step`] returns.
pub(super) struct DynamicStep {
    pub(super) obs: Observation,
    pub(super) seen: Seen,
    pub(super) reward: f64,
    pub(super) terminated: bool,
    /// The probability of the outcome, on finite environments.
    pub(super) probability: Option<f64>,
    /// Which actions can do anything next, where Gymnasium says so.
    pub(super) mask: Option<ActionMask>,
}

impl DynamicStep {
    fn new<E: Registered>(env: &E, step: Step<E::Obs>) -> Self {
        let (probability, mask) = (env.probability(&step.obs), env.action_mask(&step.obs));
        let (reward, terminated) = (step.reward, step.terminated);
        let seen = Seen::of(env, &step.obs);
        Self { obs: step.obs.into(), seen, reward, terminated, probability, mask }
    }
}

impl<E: Registered> Dynamic for E {
    fn reset(&mut self, rng: &mut NumpyRng) -> (Observation, Seen, Option<ActionMask>) {
        let obs = Env::reset(self, rng);
        let mask = self.action_mask(&obs);
        (obs.into(), Seen::of(self, &obs), mask)
    }

    fn step(&mut self, action: usize, rng: &mut NumpyRng) -> DynamicStep {
        let step = Env::step(self, action, rng);
        DynamicStep::new(self, step)
    }

    fn step_box(&mut self, action: &[f32], rng: &mut NumpyRng) -> DynamicStep {
        let step = Env::step_box(self, action, rng);
        DynamicStep::new(self, step)
    }

    fn set_attribute(&mut self, name: &str, value: &Value) -> Result<(), EnvError> {
        Registered::set_attribute(self, name, value)
    }

    fn set_reset_options(&mut self, options: &Map<String, Value>) -> Result<(), EnvError> {
        Registered::set_reset_options(self, options)
    }

    fn action_table(&self) -> Option<&ActionTable> {
        Registered::action_table(self)
    }

    fn set_action_table(&mut self, table: ActionTable) {
        Registered::set_action_table(self, table);
    }

    fn action_space(&self) -> ActionSpace {
        Env::action_space(self)
    }

    fn n_actions(&self) -> usize {
        Env::n_actions(self)
    }

    fn schema(&self) -> Schema {
        Env::schema(self)
    }

    fn finite(&self) -> Option<&Arc<FiniteMdp>> {
        Env::finite(self)
    }

    fn n_states(&self) -> Option<usize> {
        Env::n_states(self)
    }

    fn scene(&self, last: Option<&PlayedAction>) -> Scene {
        Draw::scene(self, last)
    }

    fn text(&self, last: Option<&PlayedAction>) -> Option<TextPicture> {
        Draw::text(self, last)
    }
}

impl AnyEnv {
    /// Number of actions that an agent chooses among.
    pub fn n_actions(&self) -> usize {
        self.dynamic().n_actions()
    }

    /// What actions Gymnasium's environment takes.
    pub fn action_space(&self) -> ActionSpace {
        self.dynamic().action_space()
    }

    /// Where actions are real numbers: the ones that agents choose among.
    pub fn action_table(&self) -> Option<&ActionTable> {
        self.dynamic().action_table()
    }

    /// How scripts name its states.
    pub fn schema(&self) -> Schema {
        self.dynamic().schema()
    }

    /// Its model, if it has a finite one.
    pub fn finite(&self) -> Option<&Arc<FiniteMdp>> {
        self.dynamic().finite()
    }

    /// Number of its states, if they are finite (with a model or without).
    pub fn n_states(&self) -> Option<usize> {
        self.dynamic().n_states()
    }

    /// What its present state looks like; `last` is the action that led to it.
    pub fn scene(&self, last: Option<&PlayedAction>) -> Scene {
        self.dynamic().scene(last)
    }

    /// Its present state in characters, if it is a world for them.
    pub fn text(&self, last: Option<&PlayedAction>) -> Option<TextPicture> {
        self.dynamic().text(last)
    }
}
