//! Planning on a [`FiniteMdp`](crate::mdp::FiniteMdp): value iteration, policy iteration, exact
//! policy evaluation, Q from V.

mod evaluation;
mod policy_iteration;
mod value_iteration;

pub use evaluation::{PolicyValueError, policy_value};
pub use policy_iteration::PolicyIteration;
pub use value_iteration::{PlannedAgent, Planner, Solution, ValueIteration, q_from_v};
