//! Agents that learn action values step by step.

use super::shared::{EPSILON, EXPLORATION, GAMMA, INITIAL_Q, STEP_SIZE, UNIT};
use super::{AgentSpec, AnyAgent, Build, Setup, linear};
use crate::learn::control::{
    Backup, DoubleQLearning, DynaQ, ExpectedSarsa, NStepSarsa, QLambda, SarsaLambda, SoftQLearning,
    Tabular, Trace, Traces,
};
use crate::learn::{
    AgentConfig, AlphaSource, Exploration, ParamKind, ParamSpec, ParamValue, QLearning, Sarsa,
    Schedule,
};
use crate::mdp::streams::Stream;

/// With any behaviour and step size.
pub(super) fn table(c: &AgentConfig, mut setup: Setup) -> Tabular {
    let behaviour = (c.exploration(), c.schedule("epsilon"));
    Tabular::new(setup.table(c), c.float("gamma"), c.alpha(), behaviour, setup.stream)
}

/// The schedules of α and ε, where that is all there is: such agents have a loop of their own.
fn schedules(c: &AgentConfig) -> Option<(Schedule, Schedule)> {
    match (c.alpha(), c.exploration()) {
        (AlphaSource::Schedule(alpha), Exploration::EpsilonGreedy) => {
            Some((alpha, c.schedule("epsilon")))
        }
        _ => None,
    }
}

/// The traces of `n_entries`.
pub(super) fn traces(c: &AgentConfig, n_entries: usize) -> Traces {
    let kind = match c.word("traces") {
        "replacing" => Trace::Replacing,
        "dutch" => Trace::Dutch,
        _ => Trace::Accumulating,
    };
    let decay = c.float("gamma") * c.float("lambda");
    Traces::new(kind, decay, c.float("trace_cutoff"), n_entries)
}

const ONE_STEP: &[ParamSpec] = &[STEP_SIZE, GAMMA, EPSILON, EXPLORATION, INITIAL_Q];

pub(super) const LAMBDA: ParamSpec = ParamSpec {
    name: "lambda",
    kind: UNIT,
    function: None,
    default: ParamValue::Float(0.9),
    doc: "decay of the traces: 0 looks one step ahead, 1 to the end of the episode",
};
pub(super) const TRACES: ParamSpec = ParamSpec {
    name: "traces",
    kind: ParamKind::Word(&["accumulating", "replacing", "dutch"]),
    function: None,
    default: ParamValue::Word("accumulating"),
    doc: "what a visit does to a trace e: adds 1, sets it to 1, or adds 1 − αe",
};
pub(super) const TRACE_CUTOFF: ParamSpec = ParamSpec {
    name: "trace_cutoff",
    kind: UNIT,
    function: None,
    default: ParamValue::Float(1e-3),
    doc: "traces below this count as 0; 0 keeps all",
};
const WITH_TRACES: &[ParamSpec] =
    &[STEP_SIZE, GAMMA, LAMBDA, TRACES, TRACE_CUTOFF, EPSILON, EXPLORATION, INITIAL_Q];

pub(super) const Q_LEARNING: AgentSpec = AgentSpec {
    name: "q_learning",
    doc: "Q-learning (Watkins 1989; Sutton & Barto 6.5)",
    params: ONE_STEP,
    build: Build::OneStep {
        backup: Backup::Best,
        build: |c, mut setup| match schedules(c) {
            Some((alpha, epsilon)) => {
                let q = setup.table(c);
                let agent = QLearning::new(q, c.float("gamma"), alpha, epsilon, setup.stream);
                AnyAgent::QLearning(agent)
            }
            None => AnyAgent::tabular(QLearning::of(table(c, setup))),
        },
    },
    aliases: &[],
    linear: Some(linear::q_learning),
};

pub(super) const SARSA: AgentSpec = AgentSpec {
    name: "sarsa",
    doc: "SARSA (Rummery & Niranjan 1994; Sutton & Barto 6.4)",
    params: ONE_STEP,
    build: Build::OneStep {
        backup: Backup::Played,
        build: |c, mut setup| match schedules(c) {
            Some((alpha, epsilon)) => {
                let q = setup.table(c);
                AnyAgent::Sarsa(Sarsa::new(q, c.float("gamma"), alpha, epsilon, setup.stream))
            }
            None => AnyAgent::tabular(Sarsa::of(table(c, setup))),
        },
    },
    aliases: &[],
    linear: Some(linear::sarsa),
};

pub(super) const EXPECTED_SARSA: AgentSpec = AgentSpec {
    name: "expected_sarsa",
    doc: "expected SARSA (van Seijen et al. 2009; Sutton & Barto 6.6)",
    params: ONE_STEP,
    build: Build::OneStep {
        backup: Backup::Expected,
        build: |c, setup| AnyAgent::tabular(ExpectedSarsa::new(table(c, setup))),
    },
    aliases: &[],
    linear: Some(linear::expected_sarsa),
};

pub(super) const DOUBLE_Q_LEARNING: AgentSpec = AgentSpec {
    name: "double_q_learning",
    doc: "double Q-learning, two tables; its Q is their mean (van Hasselt 2010; Sutton & Barto 6.7)",
    params: ONE_STEP,
    build: Build::Learner(|c, setup| {
        let coin = Stream::new(setup.seed, "double Q-learning");
        AnyAgent::tabular(DoubleQLearning::new(table(c, setup), c.alpha(), coin))
    }),
    aliases: &[],
    linear: None,
};

pub(super) const N_STEP_SARSA: AgentSpec = AgentSpec {
    name: "n_step_sarsa",
    doc: "n-step SARSA (Sutton & Barto 7.2)",
    params: &[
        STEP_SIZE,
        GAMMA,
        ParamSpec {
            name: "n",
            kind: ParamKind::Int { min: 1 },
            function: None,
            default: ParamValue::Int(4),
            doc: "how many rewards an update looks ahead",
        },
        EPSILON,
        EXPLORATION,
        INITIAL_Q,
    ],
    build: Build::OnPolicy {
        bootstraps: true,
        build: |c, setup| AnyAgent::tabular(NStepSarsa::new(table(c, setup), c.int("n") as usize)),
    },
    aliases: &[],
    linear: None,
};

pub(super) const SARSA_LAMBDA: AgentSpec = AgentSpec {
    name: "sarsa_lambda",
    doc: "SARSA(λ) with eligibility traces (Rummery 1995; Sutton & Barto 12.7)",
    params: WITH_TRACES,
    build: Build::OnPolicy {
        bootstraps: true,
        build: |c, setup| {
            let traces = traces(c, setup.n_states * setup.n_actions);
            AnyAgent::tabular(SarsaLambda::new(table(c, setup), traces))
        },
    },
    aliases: &[],
    linear: Some(linear::sarsa_lambda),
};

pub(super) const Q_LAMBDA: AgentSpec = AgentSpec {
    name: "q_lambda",
    doc: "Watkins's Q(λ): traces are cut after exploration (Watkins 1989; Sutton & Barto 12.10)",
    params: WITH_TRACES,
    build: Build::Learner(|c, setup| {
        let traces = traces(c, setup.n_states * setup.n_actions);
        AnyAgent::tabular(QLambda::new(table(c, setup), traces))
    }),
    aliases: &[],
    linear: Some(linear::q_lambda),
};

pub(super) const DYNA_Q: AgentSpec = AgentSpec {
    name: "dyna_q",
    doc: "Dyna-Q: Q-learning that also learns from a model of what it has seen (Sutton & Barto 8.2)",
    params: &[
        STEP_SIZE,
        GAMMA,
        ParamSpec {
            name: "planning_steps",
            kind: ParamKind::Int { min: 0 },
            function: None,
            default: ParamValue::Int(5),
            doc: "updates from the model after each real one",
        },
        EPSILON,
        EXPLORATION,
        INITIAL_Q,
    ],
    build: Build::Learner(|c, setup| {
        let stream = Stream::new(setup.seed, "Dyna-Q");
        AnyAgent::tabular(DynaQ::new(table(c, setup), c.int("planning_steps"), stream))
    }),
    aliases: &[],
    linear: None,
};

pub(super) const SOFT_Q_LEARNING: AgentSpec = AgentSpec {
    name: "soft_q_learning",
    doc: "soft Q-learning: rewards plus temperature times entropy, softmax (Haarnoja et al. 2017)",
    params: &[
        STEP_SIZE,
        GAMMA,
        ParamSpec {
            name: "temperature",
            kind: ParamKind::Float { min: 0.0, max: f64::INFINITY, open: true },
            function: None,
            default: ParamValue::Float(0.1),
            doc: "what a nat of entropy is worth, and the temperature of the softmax behaviour",
        },
        INITIAL_Q,
    ],
    build: Build::Learner(|c, mut setup| {
        AnyAgent::tabular(SoftQLearning::new(
            setup.table(c),
            c.float("gamma"),
            c.alpha(),
            c.float("temperature"),
            setup.stream,
        ))
    }),
    aliases: &[],
    linear: None,
};
