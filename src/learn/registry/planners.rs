//! Planners, and the agent that learns nothing.

use super::shared::GAMMA;
use super::{AgentSpec, AnyAgent, Build};
use crate::learn::planning::{PolicyIteration, ValueIteration};
use crate::learn::{ParamKind, ParamSpec, ParamValue, RandomAgent};

pub(super) const VALUE_ITERATION: AgentSpec = AgentSpec {
    name: "value_iteration",
    doc: "value iteration on the environment's model, then greedy play (Sutton & Barto 4.4)",
    params: &[
        GAMMA,
        ParamSpec {
            name: "theta",
            kind: ParamKind::Float { min: 0.0, max: f64::INFINITY, open: true },
            function: None,
            default: ParamValue::Float(1e-12),
            doc: "stop when no value changes by more than this in a sweep",
        },
        ParamSpec {
            name: "max_sweeps",
            kind: ParamKind::Int { min: 1 },
            function: None,
            default: ParamValue::Int(100_000),
            doc: "stop after this many sweeps in any case",
        },
    ],
    build: Build::Planner(|c| {
        Box::new(ValueIteration {
            gamma: c.float("gamma"),
            theta: c.float("theta"),
            max_sweeps: c.int("max_sweeps") as usize,
        })
    }),
    aliases: &[],
    linear: None,
};

pub(super) const POLICY_ITERATION: AgentSpec = AgentSpec {
    name: "policy_iteration",
    doc: "policy iteration with exact evaluation, then greedy play (Sutton & Barto 4.3)",
    params: &[GAMMA],
    build: Build::Planner(|c| Box::new(PolicyIteration { gamma: c.float("gamma") })),
    aliases: &[],
    linear: None,
};

pub(super) const RANDOM_AGENT: AgentSpec = AgentSpec {
    name: "random_agent",
    doc: "every action with the same probability; learns nothing",
    params: &[GAMMA],
    build: Build::Learner(|c, setup| {
        AnyAgent::tabular(RandomAgent::new(setup.n_actions, c.float("gamma"), setup.stream))
    }),
    aliases: &[],
    linear: Some(|c, setup| {
        Box::new(RandomAgent::new(setup.n_actions, c.float("gamma"), setup.stream))
    }),
};
