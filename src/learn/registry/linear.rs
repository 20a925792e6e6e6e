//! How agents on linear values are built from the parameters of their tabular kin.

use crate::learn::linear::{LinearLearner, LinearQ, LinearSetup, Target};
use crate::learn::{AgentConfig, Learn};
use crate::shaping::Fields;

/// A one-step learner.
fn learner(c: &AgentConfig, setup: LinearSetup, target: Target) -> LinearLearner {
    let LinearSetup { features, n_actions, stream } = setup;
    let q = LinearQ::new(features, n_actions, c.float("initial_q"));
    let (alpha, epsilon) = (c.schedule("alpha"), c.schedule("epsilon"));
    LinearLearner::new(q, target, c.float("gamma"), alpha, epsilon, stream)
}

pub(super) fn q_learning(c: &AgentConfig, setup: LinearSetup) -> Box<dyn Learn<Fields>> {
    Box::new(learner(c, setup, Target::Max))
}

pub(super) fn sarsa(c: &AgentConfig, setup: LinearSetup) -> Box<dyn Learn<Fields>> {
    Box::new(learner(c, setup, Target::Sarsa))
}
