//! Agents that learn the state values of a policy that is given.

use super::control::{LAMBDA, TRACE_CUTOFF, TRACES, traces};
use super::shared::{ANY, GAMMA, MEAN, STEP_SIZE, VISITS};
use super::{AgentSpec, AnyAgent, Build, Setup};
use crate::learn::prediction::{
    Estimate, MonteCarloPrediction, NStepTd, Prediction, Rule, Td0, TdLambda,
};
use crate::learn::registry::TabularAgent;
use crate::learn::{AgentConfig, ParamKind, ParamSpec, ParamValue, Signature, Visits};

const POLICY: ParamSpec = ParamSpec {
    name: "policy",
    kind: ParamKind::Word(&["random", "greedy"]),
    function: Some(Signature { text: "(s) -> action", arities: &[1] }),
    default: ParamValue::Word("random"),
    doc: "what is played; greedy is optimal for the learned reward and needs a finite model",
};
const INITIAL_V: ParamSpec = ParamSpec {
    name: "initial_v",
    kind: ANY,
    function: Some(Signature { text: "(s) -> number", arities: &[1] }),
    default: ParamValue::Float(0.0),
    doc: "initial state value: a number or a function",
};

/// A predictor with the rule that `rule` makes for a number of states.
fn predictor<R>(c: &AgentConfig, mut setup: Setup, rule: impl Fn(usize) -> R) -> AnyAgent
where
    R: Rule + 'static,
    Prediction<R>: TabularAgent,
{
    let v = setup.initial_v.take().unwrap_or_else(|| vec![c.float("initial_v"); setup.n_states]);
    let estimate = Estimate::new(v, c.float("gamma"), c.alpha());
    let rule = rule(setup.n_states);
    AnyAgent::tabular(Prediction::new(estimate, setup.given_policy(), rule))
}

pub(super) const MC_PREDICTION: AgentSpec = AgentSpec {
    name: "mc_prediction",
    doc: "V of a given policy by Monte Carlo (Sutton & Barto 5.1)",
    params: &[POLICY, MEAN, GAMMA, VISITS, INITIAL_V],
    build: Build::Predictor(|c, setup| {
        let visits = Visits::of_word(c.word("visits"));
        predictor(c, setup, |n_states| MonteCarloPrediction::new(visits, n_states))
    }),
    aliases: &[],
    linear: None,
};

pub(super) const TD0: AgentSpec = AgentSpec {
    name: "td0",
    doc: "V of a given policy by TD(0) (Sutton 1988; Sutton & Barto 6.1)",
    params: &[POLICY, STEP_SIZE, GAMMA, INITIAL_V],
    build: Build::Predictor(|c, setup| predictor(c, setup, |_| Td0::default())),
    aliases: &[],
    linear: None,
};

pub(super) const TD_LAMBDA: AgentSpec = AgentSpec {
    name: "td_lambda",
    doc: "V of a given policy by TD(λ) (Sutton 1988; Sutton & Barto 12.2)",
    params: &[POLICY, STEP_SIZE, GAMMA, LAMBDA, TRACES, TRACE_CUTOFF, INITIAL_V],
    build: Build::Predictor(|c, setup| {
        predictor(c, setup, |n_states| TdLambda::new(traces(c, n_states)))
    }),
    aliases: &[],
    linear: None,
};

pub(super) const N_STEP_TD: AgentSpec = AgentSpec {
    name: "n_step_td",
    doc: "V of a given policy by n-step TD (Sutton & Barto 7.1)",
    params: &[
        POLICY,
        STEP_SIZE,
        GAMMA,
        ParamSpec {
            name: "n",
            kind: ParamKind::Int { min: 1 },
            function: None,
            default: ParamValue::Int(4),
            doc: "number of rewards before bootstrapping",
        },
        INITIAL_V,
    ],
    build: Build::Predictor(|c, setup| {
        let n = c.int("n") as usize;
        predictor(c, setup, |_| NStepTd::new(n))
    }),
    aliases: &[],
    linear: None,
};
