//! Agents that learn by playing, and planners that solve a model.
//!
//! - [`Agent`], [`Learn`]: chooses actions and learns from rewards
//! - [`control`]: agents that learn a table of action values step by step; [`RandomAgent`]
//! - [`linear`]: agents whose action values are linear in features; [`dqn`]: networks
//! - [`MonteCarlo`], [`OffPolicyMonteCarlo`]: from the returns of whole episodes
//! - [`prediction`]: the state values of a policy that is given
//! - [`planning`]: value iteration, policy iteration, exact policy evaluation on a [`FiniteMdp`]
//! - [`registry`]: the one place where an agent is registered; [`AgentConfig`] is its configuration
//! - [`Behaviour`], [`StepSize`], [`Schedule`], [`QTable`], [`argmax_tol`], [`greedy_set`]: what
//!   they are made of
//!
//! Agents never log, never see a clock, and know nothing of shaping: they learn from the reward
//! they are handed. The exceptions are shapings that need what only an agent knows: [`Advised`](control::Advised),
//! [`LookBack`], [`Bootstrapped`].
//!
//! [`FiniteMdp`]: crate::mdp::FiniteMdp

mod agent;
mod behaviour;
mod bootstrapped;
pub mod control;
pub mod dqn;
mod episode;
mod greedy;
pub mod linear;
mod look_back;
mod monte_carlo;
mod off_policy_monte_carlo;
mod params;
pub mod planning;
pub mod prediction;
mod q_table;
mod random_agent;
pub mod registry;
mod schedule;
mod softmax;
mod step_size;
mod ucb;

pub use agent::{Agent, Last, Learn, Seen};
pub use behaviour::{Behaviour, EpsilonGreedy, Exploration, Explore};
pub use bootstrapped::{Bootstrapped, stability_bound};
pub use control::{QLearning, Sarsa, td_error};
pub use episode::Visits;
pub use greedy::{
    argmax_allowed, argmax_tol, greedy_set, greedy_sets, max_allowed, pick_allowed, tied,
};
pub use linear::{LinearLearner, LinearQ, LinearSetup};
pub use look_back::LookBack;
pub use monte_carlo::MonteCarlo;
pub use off_policy_monte_carlo::OffPolicyMonteCarlo;
pub use params::{AgentConfig, ParamKind, ParamSpec, ParamValue, Signature, Widths};
pub use q_table::QTable;
pub use random_agent::RandomAgent;
pub use registry::{AgentSpec, AnyAgent};
pub use schedule::{Schedule, ScheduleState, Unit};
pub use softmax::Softmax;
pub use step_size::{AlphaSource, Rate, StepSize};
pub use ucb::Ucb;
