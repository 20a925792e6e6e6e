//! Deep Q-learning: action values by a network, learned from replayed experience.
//!
//! - [`Dqn`], [`DqnConfig`], [`NetworkSetup`]: the agent
//! - [`Replay`], [`SumTree`], [`NSteps`]: what it learns from
//! - [`bootstrap`], [`td_error`]: what it learns
//! - [`LogRow`]: what is written down of it
//! - [`Snapshot`]: everything needed to go on
//!
//! A step allocates nothing once the log has room.

mod agent;
mod config;
mod log;
mod n_steps;
mod replay;
mod resume;
mod snapshot;
mod sum_tree;
#[cfg(test)]
mod tests;
mod update;

pub use agent::{Dqn, NetworkSetup};
pub use config::{DqnConfig, Priorities};
pub use log::LogRow;
pub use n_steps::{Arrival, NSteps};
pub use replay::{Experience, Replay};
pub use snapshot::Snapshot;
pub use sum_tree::SumTree;
pub use update::{best, bootstrap, td_error};
