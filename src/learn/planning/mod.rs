//! Planning on a [`FiniteMdp`](crate::mdp::FiniteMdp).
//!
//! - [`ValueIteration`], [`PolicyIteration`]: the [`Planner`]s that can be asked for by name, and
//!   the [`Solution`] they find
//! - [`policy_value`]: the exact value of a [`Policy`], deterministic or stochastic
//! - [`Dynamics`], [`Problem`]: the same for many reward functions on one model, packed once
//! - [`Components`]: strongly connected components

mod chain;
mod components;
mod dynamics;
mod error;
mod evaluation;
mod linear;
mod planned_agent;
mod policy_iteration;
mod problem;
mod solution;
mod value_iteration;

pub use components::Components;
pub use dynamics::{Dynamics, Over, Sources};
pub use error::PlanError;
pub use evaluation::{Policy, PolicyValue, policy_value};
pub use planned_agent::PlannedAgent;
pub use policy_iteration::{Optimum, PolicyIteration, Start};
pub use problem::Problem;
pub use solution::{Planner, Solution, Sweep};
pub use value_iteration::ValueIteration;

#[cfg(test)]
mod tests;
