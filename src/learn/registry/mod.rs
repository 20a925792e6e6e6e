//! The one place where an agent is registered: its name, its parameters with their defaults and
//! ranges, and how it is built. The script host, `list agents`, suggestions and the docs read it.
//!
//! A family of agents has a file of its own with a constant per agent, which [`AGENTS`] lists.

mod control;
mod linear;
mod planners;
mod shared;

pub use self::linear::BuildLinear;
use super::params::{AgentConfig, ParamSpec};
use super::planning::Planner;
use super::{Learn, QLearning, QTable, Sarsa};
use crate::mdp::streams::Stream;
use crate::shaping::Shielded;

/// What a learner is built for.
#[derive(Debug)]
pub struct Setup {
    /// Number of rows of its table.
    pub n_states: usize,
    /// Number of actions.
    pub n_actions: usize,
    /// The run's seed, for randomness that is not its behaviour's.
    pub seed: u64,
    /// The randomness of its behaviour.
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
    /// How it is built where values are linear in features, if it can learn such.
    pub linear: Option<BuildLinear>,
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

/// Every agent, in the order in which they are listed.
pub static AGENTS: &[AgentSpec] = &[
    control::Q_LEARNING,
    control::SARSA,
    control::EXPECTED_SARSA,
    control::DOUBLE_Q_LEARNING,
    control::N_STEP_SARSA,
    control::SARSA_LAMBDA,
    control::Q_LAMBDA,
    control::DYNA_Q,
    control::SOFT_Q_LEARNING,
    planners::VALUE_ITERATION,
    planners::RANDOM_AGENT,
];

/// The agent called `name`.
pub fn find(name: &str) -> Option<&'static AgentSpec> {
    AGENTS.iter().find(|spec| spec.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::{ParamKind, ParamValue, Schedule};

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
