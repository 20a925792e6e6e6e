//! Agents that learn by playing, and planners that solve a model.
//!
//! - [`Agent`], [`Learn`]: chooses actions and learns from rewards; [`QLearning`], [`Sarsa`],
//!   [`RandomAgent`]
//! - [`linear`]: agents whose action values are linear in features
//! - [`planning`]: value iteration, exact policy evaluation, Q from V on a [`FiniteMdp`]
//! - [`registry`]: the one place where an agent is registered; [`AgentConfig`] is its configuration
//! - [`Schedule`], [`QTable`], [`argmax_tol`], [`greedy_set`]: what they are made of
//!
//! Agents never log, never see a clock, and know nothing of shaping: they learn from the reward
//! they are handed.
//!
//! [`FiniteMdp`]: crate::mdp::FiniteMdp

mod agent;
mod greedy;
pub mod linear;
mod params;
pub mod planning;
mod q_learning;
mod q_table;
mod random_agent;
pub mod registry;
mod sarsa;
mod schedule;
mod tabular;

pub use agent::{Agent, Last, Learn, Seen};
pub use greedy::{
    Behaviour, argmax_allowed, argmax_tol, greedy_set, greedy_sets, max_allowed, pick_allowed,
};
pub use linear::{LinearLearner, LinearQ, LinearSetup};
pub use params::{AgentConfig, ParamKind, ParamSpec, ParamValue, Signature};
pub use q_learning::QLearning;
pub use q_table::QTable;
pub use random_agent::RandomAgent;
pub use registry::{AgentSpec, AnyAgent};
pub use sarsa::Sarsa;
pub use schedule::{Schedule, ScheduleState, Unit};
pub use tabular::td_error;
