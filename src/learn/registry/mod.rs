//! The one place where an agent is registered: its name, its parameters with their defaults and
//! ranges, and how it is built. The script host, `list agents`, suggestions and the docs read it.
//!
//! A family of agents has a file of its own with a constant per agent, which [`AGENTS`] lists.

mod control;
mod linear;
mod monte_carlo;
mod network;
mod planners;
mod prediction;
mod shared;

pub use self::linear::BuildLinear;
use super::control::{Advised, Backup};
use super::dqn::{Dqn, NetworkSetup};
use super::params::{AgentConfig, ParamSpec};
use super::planning::Planner;
use super::prediction::GivenPolicy;
use super::{Learn, QLearning, QTable, Sarsa};
use crate::mdp::Action;
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
    /// Initial state values, shape `[n_states]`, where a script gives them.
    pub initial_v: Option<Vec<f64>>,
    /// What a predictor plays in each state, shape `[n_states]`; anything if there is nothing.
    pub policy: Option<Vec<Action>>,
}

impl Setup {
    /// The table to start from.
    fn table(&mut self, config: &AgentConfig) -> QTable {
        match self.initial_q.take() {
            Some(values) => QTable::from_values(self.n_actions, values),
            None => QTable::new(self.n_states, self.n_actions, config.float("initial_q")),
        }
    }

    /// What a predictor plays.
    fn given_policy(self) -> GivenPolicy {
        match self.policy {
            Some(actions) => GivenPolicy::Fixed(actions),
            None => GivenPolicy::Random { n_actions: self.n_actions, stream: self.stream },
        }
    }
}

/// Makes a learner.
pub type BuildFn = fn(&AgentConfig, Setup) -> AnyAgent;

/// How an agent comes to be.
#[derive(Debug, Clone, Copy)]
pub enum Build {
    /// A learner.
    Learner(BuildFn),
    /// A learner of the state values of a policy that is given.
    Predictor(BuildFn),
    /// A learner of the values of the policy that it plays.
    OnPolicy {
        /// How it is built.
        build: BuildFn,
        /// Whether it bootstraps, or waits for whole returns.
        bootstraps: bool,
    },
    /// A learner of action values with one-step targets.
    OneStep {
        /// How it is built.
        build: BuildFn,
        /// What its target bootstraps from.
        backup: Backup,
    },
    /// A learner of a network.
    Network(fn(&AgentConfig, NetworkSetup) -> Dqn),
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
    /// What others call its parameters, each with the name here: for suggestions.
    pub aliases: &'static [(&'static str, &'static str)],
    /// How it is built where values are linear in features, if it can learn such.
    pub linear: Option<BuildLinear>,
}

impl AgentSpec {
    /// Whether it takes look-ahead advice, and can be shaped by its own values.
    pub fn is_one_step(&self) -> bool {
        matches!(self.build, Build::OneStep { .. })
    }

    /// Whether it takes look-back advice: it learns the values of the policy it plays.
    pub fn is_on_policy(&self) -> bool {
        match self.build {
            Build::OnPolicy { .. } => true,
            Build::OneStep { backup, .. } => backup != Backup::Best,
            Build::Learner(_) | Build::Predictor(_) | Build::Network(_) | Build::Planner(_) => {
                false
            }
        }
    }

    /// Whether it learns from whole returns of the policy that it plays.
    pub fn learns_from_returns(&self) -> bool {
        matches!(self.build, Build::OnPolicy { bootstraps: false, .. })
    }

    /// The agent as it is with look-ahead advice `phi`, shape `[n_states, n_actions]`; `None` if it
    /// takes none.
    pub fn advised(&self, config: &AgentConfig, setup: Setup, phi: QTable) -> Option<AnyAgent> {
        let Build::OneStep { backup, .. } = self.build else { return None };
        let table = control::table(config, setup);
        Some(AnyAgent::tabular(Advised::new(backup, table, phi)))
    }
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
    monte_carlo::MONTE_CARLO,
    monte_carlo::OFF_POLICY_MONTE_CARLO,
    prediction::MC_PREDICTION,
    prediction::TD0,
    prediction::TD_LAMBDA,
    prediction::N_STEP_TD,
    control::EXPECTED_SARSA,
    control::DOUBLE_Q_LEARNING,
    control::N_STEP_SARSA,
    control::SARSA_LAMBDA,
    control::Q_LAMBDA,
    control::DYNA_Q,
    control::SOFT_Q_LEARNING,
    network::DQN,
    network::DOUBLE_DQN,
    planners::VALUE_ITERATION,
    planners::POLICY_ITERATION,
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
