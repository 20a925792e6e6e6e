//! Agents that learn action values from the returns of whole episodes.

use super::shared::{ALPHA, EPSILON, GAMMA, INITIAL_Q, VISITS};
use super::{AgentSpec, AnyAgent, Build};
use crate::learn::{
    AlphaSource, MonteCarlo, OffPolicyMonteCarlo, ParamKind, ParamSpec, ParamValue, Visits,
};
use crate::mdp::streams::Stream;

/// The switch that makes episodes start anywhere.
pub(super) const EXPLORING_STARTS: ParamSpec = ParamSpec {
    name: "exploring_starts",
    kind: ParamKind::Bool,
    function: None,
    default: ParamValue::Bool(false),
    doc: "start in any state that can be reached, with any action; needs a finite model",
};

pub(super) const MONTE_CARLO: AgentSpec = AgentSpec {
    name: "monte_carlo",
    doc: "on-policy Monte Carlo control, ε-greedy (Sutton & Barto 5.3, 5.4)",
    params: &[ALPHA, GAMMA, EPSILON, VISITS, EXPLORING_STARTS, INITIAL_Q],
    build: Build::Learner(|c, mut setup| {
        let table = setup.table(c);
        // A stream of their own: the behaviour's must not depend on how episodes start.
        let starts = c.is_on(EXPLORING_STARTS.name).then(|| {
            let mut behaviour = setup.stream.clone();
            Stream::new(behaviour.next_u64(), "first actions")
        });
        let agent = MonteCarlo::new(
            table,
            c.float("gamma"),
            AlphaSource::Schedule(c.schedule("alpha")),
            c.schedule("epsilon"),
            Visits::of_word(c.word("visits")),
            setup.stream,
        );
        AnyAgent::tabular(match starts {
            Some(starts) => agent.with_exploring_starts(starts),
            None => agent,
        })
    }),
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
};
