//! The one place where an agent is registered: its name, its parameters with their defaults and
//! ranges, and how it is built. The script host, `list agents`, suggestions and the docs read it.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::planning::{PlannedAgent, Planner, ValueIteration};
use super::{Agent, QLearning, QTable, RandomAgent, Sarsa, Schedule, Unit};
use crate::mdp::streams::Stream;

/// The value of an agent's parameter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum ParamValue {
    /// A whole number.
    Int(u64),
    /// A real number.
    Float(f64),
    /// A schedule.
    Schedule(Schedule),
}

impl std::fmt::Display for ParamValue {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Int(n) => write!(f, "{n}"),
            Self::Float(x) => write!(f, "{x:?}"),
            Self::Schedule(Schedule::Constant { value }) => write!(f, "{value:?}"),
            Self::Schedule(Schedule::Linear { start, end, over, unit }) => {
                write!(f, "linear({start:?}, {end:?}, {over}{})", steps(*unit))
            }
            Self::Schedule(Schedule::Exponential { start, factor, min, unit }) => {
                write!(f, "exponential({start:?}, {factor:?}, {min:?}{})", steps(*unit))
            }
        }
    }
}

/// The option of a schedule that goes by steps.
fn steps(unit: Unit) -> &'static str {
    match unit {
        Unit::Episode => "",
        Unit::Step => ", #{ steps: true }",
    }
}

/// What a parameter admits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ParamKind {
    /// A finite real number in `min..=max`; `min` itself excluded if `open`.
    Float {
        /// Lower limit.
        min: f64,
        /// Upper limit.
        max: f64,
        /// Whether the lower limit is excluded.
        open: bool,
    },
    /// A whole number of at least `min`.
    Int {
        /// Lower limit.
        min: u64,
    },
    /// A number or a schedule whose values stay in `0..=1`; 0 excluded if `open`.
    Rate {
        /// Whether 0 is excluded.
        open: bool,
    },
}

impl ParamKind {
    /// What is allowed, in words.
    pub fn allowed(&self) -> String {
        match *self {
            Self::Float { min, max, open } => match (min.is_finite(), max.is_finite()) {
                (true, true) if open => format!("a number above {min} and at most {max}"),
                (true, true) => format!("a number from {min} to {max}"),
                (true, false) if open => format!("a number above {min}"),
                (true, false) => format!("a number of at least {min}"),
                _ => "a finite number".into(),
            },
            Self::Int { min } => format!("a whole number of at least {min}"),
            Self::Rate { open: false } => "a number from 0 to 1, or a schedule of such".into(),
            Self::Rate { open: true } => {
                "a number above 0 and at most 1, or a schedule of such".into()
            }
        }
    }

    /// Whether `value` is allowed; turns a plain number into what the parameter stores.
    pub fn accept(&self, value: ParamValue) -> Option<ParamValue> {
        let number = match value {
            ParamValue::Int(n) => n as f64,
            ParamValue::Float(x) => x,
            ParamValue::Schedule(_) => f64::NAN,
        };
        match (*self, value) {
            (Self::Float { min, max, open }, _) => {
                let above = if open { number > min } else { number >= min };
                (above && number <= max && number.is_finite()).then_some(ParamValue::Float(number))
            }
            (Self::Int { min }, ParamValue::Int(n)) => (n >= min).then_some(value),
            (Self::Int { .. }, _) => None,
            (Self::Rate { open }, _) => {
                let schedule = match value {
                    ParamValue::Schedule(schedule) => schedule,
                    _ => Schedule::constant(number),
                };
                let (low, high) = schedule.range();
                let above = if open { low > 0.0 } else { low >= 0.0 };
                (above && high <= 1.0).then_some(ParamValue::Schedule(schedule))
            }
        }
    }
}

/// A parameter of an agent.
#[derive(Debug, Clone, PartialEq)]
pub struct ParamSpec {
    /// Its key in the agent's map.
    pub name: &'static str,
    /// What it admits.
    pub kind: ParamKind,
    /// Its value when the key is left out.
    pub default: ParamValue,
    /// One line: what it does.
    pub doc: &'static str,
}

/// How an agent comes to be.
#[derive(Debug, Clone, Copy)]
pub enum Build {
    /// A learner over `n_states` × `n_actions`, exploring with the stream.
    Learner(fn(&AgentConfig, usize, usize, Stream) -> AnyAgent),
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

/// An agent and its resolved parameters, defaults filled in.
#[derive(Debug, Clone)]
pub struct AgentConfig {
    /// Which agent.
    pub spec: &'static AgentSpec,
    /// Every parameter of the spec.
    pub params: BTreeMap<&'static str, ParamValue>,
}

impl AgentConfig {
    /// The agent with its defaults.
    pub fn new(spec: &'static AgentSpec) -> Self {
        Self { spec, params: spec.params.iter().map(|p| (p.name, p.default)).collect() }
    }

    /// A numeric parameter.
    ///
    /// # Panics
    /// If the agent has no such parameter: the registry's own mistake.
    pub fn float(&self, name: &str) -> f64 {
        match self.params[name] {
            ParamValue::Float(x) => x,
            ParamValue::Int(n) => n as f64,
            ParamValue::Schedule(_) => unreachable!("{name} is not a schedule"),
        }
    }

    /// A whole-number parameter.
    ///
    /// # Panics
    /// If the agent has no such parameter: the registry's own mistake.
    pub fn int(&self, name: &str) -> u64 {
        match self.params[name] {
            ParamValue::Int(n) => n,
            _ => unreachable!("{name} is a whole number"),
        }
    }

    /// A schedule.
    ///
    /// # Panics
    /// If the agent has no such parameter: the registry's own mistake.
    pub fn schedule(&self, name: &str) -> Schedule {
        match self.params[name] {
            ParamValue::Schedule(s) => s,
            ParamValue::Float(x) => Schedule::constant(x),
            ParamValue::Int(n) => Schedule::constant(n as f64),
        }
    }

    /// Whether it plans on a model instead of learning from steps.
    pub fn is_planner(&self) -> bool {
        matches!(self.spec.build, Build::Planner(_))
    }
}

/// Does something with an agent of any type: one instance per type, so that the training loop is
/// compiled for each.
pub trait AgentVisitor {
    /// What comes of it.
    type Out;
    /// Called with the concrete agent.
    fn visit<A: Agent>(self, agent: A) -> Self::Out;
}

/// Any registered agent.
#[derive(Debug, Clone)]
pub enum AnyAgent {
    /// Tabular Q-learning.
    QLearning(QLearning),
    /// Tabular SARSA.
    Sarsa(Sarsa),
    /// Uniformly random.
    Random(RandomAgent),
    /// A planner's greedy policy.
    Planned(PlannedAgent),
}

impl AnyAgent {
    /// Hands the concrete agent to `visitor`.
    pub fn visit<V: AgentVisitor>(self, visitor: V) -> V::Out {
        match self {
            Self::QLearning(agent) => visitor.visit(agent),
            Self::Sarsa(agent) => visitor.visit(agent),
            Self::Random(agent) => visitor.visit(agent),
            Self::Planned(agent) => visitor.visit(agent),
        }
    }
}

const UNIT: ParamKind = ParamKind::Float { min: 0.0, max: 1.0, open: false };
const ANY: ParamKind = ParamKind::Float { min: f64::NEG_INFINITY, max: f64::INFINITY, open: false };

const ALPHA: ParamSpec = ParamSpec {
    name: "alpha",
    kind: ParamKind::Rate { open: true },
    default: ParamValue::Schedule(Schedule::Constant { value: 0.1 }),
    doc: "step size: a number or a schedule",
};
const GAMMA: ParamSpec = ParamSpec {
    name: "gamma",
    kind: UNIT,
    default: ParamValue::Float(0.99),
    doc: "discount factor, of the learner and of potential-based shaping",
};
const EPSILON: ParamSpec = ParamSpec {
    name: "epsilon",
    kind: ParamKind::Rate { open: false },
    default: ParamValue::Schedule(Schedule::Constant { value: 0.1 }),
    doc: "exploration rate: a number or a schedule",
};
const INITIAL_Q: ParamSpec = ParamSpec {
    name: "initial_q",
    kind: ANY,
    default: ParamValue::Float(0.0),
    doc: "initial action value everywhere; above what can be reached it is optimistic",
};

fn table(c: &AgentConfig, n_states: usize, n_actions: usize) -> QTable {
    QTable::new(n_states, n_actions, c.float("initial_q"))
}

/// Every agent, in the order in which they are listed.
pub static AGENTS: &[AgentSpec] = &[
    AgentSpec {
        name: "q_learning",
        doc: "Q-learning, ε-greedy (Watkins 1989; Sutton & Barto 6.5)",
        params: &[ALPHA, GAMMA, EPSILON, INITIAL_Q],
        build: Build::Learner(|c, n_states, n_actions, stream| {
            AnyAgent::QLearning(QLearning::new(
                table(c, n_states, n_actions),
                c.float("gamma"),
                c.schedule("alpha"),
                c.schedule("epsilon"),
                stream,
            ))
        }),
    },
    AgentSpec {
        name: "sarsa",
        doc: "SARSA, ε-greedy (Rummery & Niranjan 1994; Sutton & Barto 6.4)",
        params: &[ALPHA, GAMMA, EPSILON, INITIAL_Q],
        build: Build::Learner(|c, n_states, n_actions, stream| {
            AnyAgent::Sarsa(Sarsa::new(
                table(c, n_states, n_actions),
                c.float("gamma"),
                c.schedule("alpha"),
                c.schedule("epsilon"),
                stream,
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
                default: ParamValue::Float(1e-12),
                doc: "stop when no value changes by more than this in a sweep",
            },
            ParamSpec {
                name: "max_sweeps",
                kind: ParamKind::Int { min: 1 },
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
        build: Build::Learner(|c, _, n_actions, stream| {
            AnyAgent::Random(RandomAgent::new(n_actions, c.float("gamma"), stream))
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
