//! Agents that learn action values from the returns of whole episodes.

use super::shared::{EPSILON, EXPLORATION, GAMMA, INITIAL_Q, MEAN, VISITS};
use super::{AgentSpec, AnyAgent, Build};
use crate::learn::{MonteCarlo, OffPolicyMonteCarlo, ParamKind, ParamSpec, ParamValue, Visits};
use crate::mdp::streams::Stream;

/// The switch that makes episodes start anywhere.
const EXPLORING_STARTS: ParamSpec = ParamSpec {
    name: "exploring_starts",
    kind: ParamKind::Bool,
    function: None,
    default: ParamValue::Bool(false),
    doc: "start in any state that can be reached, with any action; needs a finite model",
};

pub(super) const MONTE_CARLO: AgentSpec = AgentSpec {
    name: "monte_carlo",
    doc: "on-policy Monte Carlo control (Sutton & Barto 5.3, 5.4)",
    params: &[MEAN, GAMMA, EPSILON, EXPLORATION, VISITS, EXPLORING_STARTS, INITIAL_Q],
    build: Build::OnPolicy {
        bootstraps: false,
        build: |c, mut setup| {
            let table = setup.table(c);
            let agent = MonteCarlo::new(
                table,
                c.float("gamma"),
                c.alpha(),
                (c.exploration(), c.schedule("epsilon")),
                Visits::of_word(c.word("visits")),
                setup.stream,
            );
            AnyAgent::tabular(if c.is_on(EXPLORING_STARTS.name) {
                agent.with_exploring_starts(Stream::new(setup.seed, "first actions"))
            } else {
                agent
            })
        },
    },
    aliases: &[],
    linear: None,
};

pub(super) const OFF_POLICY_MONTE_CARLO: AgentSpec = AgentSpec {
    name: "off_policy_monte_carlo",
    doc: "off-policy Monte Carlo control, weighted importance sampling (Sutton & Barto 5.7)",
    params: &[GAMMA, EPSILON, INITIAL_Q],
    build: Build::Learner(|c, mut setup| {
        AnyAgent::tabular(OffPolicyMonteCarlo::new(
            setup.table(c),
            c.float("gamma"),
            c.schedule("epsilon"),
            setup.stream,
        ))
    }),
    aliases: &[],
    linear: None,
};
