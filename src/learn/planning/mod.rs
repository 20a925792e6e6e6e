//! Planning on a [`FiniteMdp`](crate::mdp::FiniteMdp): value iteration, policy iteration, exact
//! policy evaluation, Q from V.

mod evaluation;
mod planned_agent;
mod policy_iteration;
mod value_iteration;

pub use evaluation::{PolicyValueError, policy_value};
pub use planned_agent::PlannedAgent;
pub use policy_iteration::PolicyIteration;
pub use value_iteration::{Planner, Solution, ValueIteration, q_from_v};
