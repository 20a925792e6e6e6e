//! How agents on linear values are built from the parameters of their tabular kin.

use super::control::traces;
use crate::learn::linear::{LinearLearner, LinearQ, LinearSetup, Target};
use crate::learn::{AgentConfig, Behaviour, Learn};
use crate::shaping::Fields;

/// Builds an agent on linear values.
pub type BuildLinear = fn(&AgentConfig, LinearSetup) -> Box<dyn Learn<Fields>>;

/// A one-step learner.
fn learner(c: &AgentConfig, setup: LinearSetup, target: Target) -> LinearLearner {
    let LinearSetup { features, n_actions, stream } = setup;
    let q = LinearQ::new(features, n_actions, c.float("initial_q"));
    // Nothing is counted per state: there is one for all.
    let shape = [1, n_actions];
    let behaviour = Behaviour::new(c.exploration(), c.schedule("epsilon"), shape, stream);
    LinearLearner::new(q, target, c.float("gamma"), c.schedule("alpha"), behaviour)
}

/// The same with eligibility traces.
fn with_traces(c: &AgentConfig, setup: LinearSetup, target: Target) -> Box<dyn Learn<Fields>> {
    let n_weights = setup.features.n_features() * setup.n_actions;
    Box::new(learner(c, setup, target).with_traces(traces(c, n_weights)))
}

pub(super) fn q_learning(c: &AgentConfig, setup: LinearSetup) -> Box<dyn Learn<Fields>> {
    Box::new(learner(c, setup, Target::Max))
}

pub(super) fn sarsa(c: &AgentConfig, setup: LinearSetup) -> Box<dyn Learn<Fields>> {
    Box::new(learner(c, setup, Target::Sarsa))
}

pub(super) fn expected_sarsa(c: &AgentConfig, setup: LinearSetup) -> Box<dyn Learn<Fields>> {
    Box::new(learner(c, setup, Target::Expected))
}

pub(super) fn sarsa_lambda(c: &AgentConfig, setup: LinearSetup) -> Box<dyn Learn<Fields>> {
    with_traces(c, setup, Target::Sarsa)
}

pub(super) fn q_lambda(c: &AgentConfig, setup: LinearSetup) -> Box<dyn Learn<Fields>> {
    with_traces(c, setup, Target::Watkins)
}
