//! The one place where an agent is registered: its name, its parameters with their defaults and
//! ranges, and how it is built. The script host, `list agents`, suggestions and the docs read it.

use super::params::{AgentConfig, ParamKind, ParamSpec, ParamValue, Signature};
use super::planning::{Planner, ValueIteration};
use super::{Learn, QLearning, QTable, RandomAgent, Sarsa, Schedule};
use crate::mdp::streams::Stream;
use crate::shaping::Shielded;

/// What a learner is built for.
#[derive(Debug)]
pub struct Setup {
    /// Number of rows of its table.
    pub n_states: usize,
    /// Number of actions.
    pub n_actions: usize,
    /// Its randomness.
    pub stream: Stream,
    /// Initial action values, shape `[n_states, n_actions]`, where a script gives them.
    pub initial_q: Option<Vec<f64>>,
}

impl Setup {
    /// The table to start from.
    fn table(&mut self, config: &AgentConfig) -> QTable {
        match self.initial_q.take() {
            Some(values) => QTable::from_values(self.n_actions, values),
            None => QTable::new(self.n_states, self.n_actions, config.float("initial_q")),
        }
    }
}

/// How an agent comes to be.
#[derive(Debug, Clone, Copy)]
pub enum Build {
    /// A learner.
    Learner(fn(&AgentConfig, Setup) -> AnyAgent),
    /// A planner, which needs the environment's finite model.
    Planner(fn(&AgentConfig) -> Box<dyn Planner>),
}

/// An agent that scripts can name.
#[derive(Debug)]
pub struct AgentSpec {
    /// The builder's name in scripts.
    pub name: &'static str,
    /// One line: what it is, and where it comes from.
    pub doc: &'static str,
    /// Its parameters, in the order of the docs.
    pub params: &'static [ParamSpec],
    /// How it is built.
    pub build: Build,
}

/// Any agent whose states are the rows of a table, with a shield or without.
pub trait TabularAgent: Learn<usize> + Learn<Shielded> {}

impl<T: Learn<usize> + Learn<Shielded>> TabularAgent for T {}

/// Does something with an agent of any type: one instance per type, so that the training loop is
/// compiled for each.
pub trait AgentVisitor {
    /// What comes of it.
    type Out;
    /// Called with the concrete agent.
    fn visit<A: Learn<usize>>(self, agent: A) -> Self::Out;
}

/// Any registered agent. The loop is compiled for the commonest; the others are called through a
/// pointer, which costs about 2 ns a step, and not a loop of their own for every environment.
pub enum AnyAgent {
    /// Tabular Q-learning.
    QLearning(QLearning),
    /// Tabular SARSA.
    Sarsa(Sarsa),
    /// Any other tabular agent.
    Tabular(Box<dyn TabularAgent>),
}

impl AnyAgent {
    /// Any tabular agent.
    pub fn tabular(agent: impl TabularAgent + 'static) -> Self {
        Self::Tabular(Box::new(agent))
    }

    /// Whether the loop is compiled for it.
    pub fn is_fast(&self) -> bool {
        !matches!(self, Self::Tabular(_))
    }

    /// Hands the concrete agent to `visitor`.
    pub fn visit<V: AgentVisitor>(self, visitor: V) -> V::Out {
        match self {
            Self::QLearning(agent) => visitor.visit(agent),
            Self::Sarsa(agent) => visitor.visit(agent),
            Self::Tabular(agent) => visitor.visit(agent),
        }
    }

    /// The agent behind a pointer, whatever it is.
    pub fn boxed(self) -> Box<dyn TabularAgent> {
        match self {
            Self::QLearning(agent) => Box::new(agent),
            Self::Sarsa(agent) => Box::new(agent),
            Self::Tabular(agent) => agent,
        }
    }
}

const UNIT: ParamKind = ParamKind::Float { min: 0.0, max: 1.0, open: false };
const ANY: ParamKind = ParamKind::Float { min: f64::NEG_INFINITY, max: f64::INFINITY, open: false };

const ALPHA: ParamSpec = ParamSpec {
    name: "alpha",
    kind: ParamKind::Rate { open: true },
    function: None,
    default: ParamValue::Schedule(Schedule::Constant { value: 0.1 }),
    doc: "step size: a number or a schedule",
};
const GAMMA: ParamSpec = ParamSpec {
    name: "gamma",
    kind: UNIT,
    function: None,
    default: ParamValue::Float(0.99),
    doc: "discount factor, of the learner and of potential-based shaping",
};
const EPSILON: ParamSpec = ParamSpec {
    name: "epsilon",
    kind: ParamKind::Rate { open: false },
    function: None,
    default: ParamValue::Schedule(Schedule::Constant { value: 0.1 }),
    doc: "exploration rate: a number or a schedule",
};
const INITIAL_Q: ParamSpec = ParamSpec {
    name: "initial_q",
    kind: ANY,
    function: Some(Signature { text: "(s) -> number or (s, a) -> number", arities: &[1, 2] }),
    default: ParamValue::Float(0.0),
    doc: "initial action value: a number (optimistic if above what can be reached) or a function",
};

/// Every agent, in the order in which they are listed.
pub static AGENTS: &[AgentSpec] = &[
    AgentSpec {
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
    },
    AgentSpec {
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
    },
    AgentSpec {
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
    },
    AgentSpec {
        name: "random_agent",
        doc: "every action with the same probability; learns nothing",
        params: &[GAMMA],
        build: Build::Learner(|c, setup| {
            AnyAgent::tabular(RandomAgent::new(setup.n_actions, c.float("gamma"), setup.stream))
        }),
    },
];

/// The agent called `name`.
pub fn find(name: &str) -> Option<&'static AgentSpec> {
    AGENTS.iter().find(|spec| spec.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_default_is_what_its_parameter_admits() {
        for spec in AGENTS {
            for p in spec.params {
                assert!(p.kind.accept(p.default).is_some(), "{}.{}", spec.name, p.name);
            }
            assert!(
                spec.params.iter().any(|p| p.name == "gamma"),
                "{}: shaping needs γ",
                spec.name
            );
        }
    }

    #[test]
    fn rates_stay_in_their_range() {
        let rate = ParamKind::Rate { open: true };
        assert!(rate.accept(ParamValue::Float(0.0)).is_none());
        assert!(rate.accept(ParamValue::Float(f64::NAN)).is_none());
        assert_eq!(
            rate.accept(ParamValue::Int(1)),
            Some(ParamValue::Schedule(Schedule::constant(1.0)))
        );
    }
}
