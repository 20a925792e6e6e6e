//! Agents that learn action values step by step.

use super::shared::{ALPHA, EPSILON, GAMMA, INITIAL_Q};
use super::{AgentSpec, AnyAgent, Build, linear};
use crate::learn::{QLearning, Sarsa};

pub(super) const Q_LEARNING: AgentSpec = AgentSpec {
    name: "q_learning",
    doc: "Q-learning, ε-greedy (Watkins 1989; Sutton & Barto 6.5)",
    params: &[ALPHA, GAMMA, EPSILON, INITIAL_Q],
    build: Build::Learner(|c, mut setup| {
        AnyAgent::QLearning(QLearning::new(
            setup.table(c),
            c.float("gamma"),
            c.schedule("alpha"),
            c.schedule("epsilon"),
            setup.stream,
        ))
    }),
    linear: Some(linear::q_learning),
};

pub(super) const SARSA: AgentSpec = AgentSpec {
    name: "sarsa",
    doc: "SARSA, ε-greedy (Rummery & Niranjan 1994; Sutton & Barto 6.4)",
    params: &[ALPHA, GAMMA, EPSILON, INITIAL_Q],
    build: Build::Learner(|c, mut setup| {
        AnyAgent::Sarsa(Sarsa::new(
            setup.table(c),
            c.float("gamma"),
            c.schedule("alpha"),
            c.schedule("epsilon"),
            setup.stream,
        ))
    }),
    linear: Some(linear::sarsa),
};
