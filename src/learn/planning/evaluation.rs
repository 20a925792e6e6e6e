//! Exact policy evaluation: solves `(I − γ P_π) V = R_π` (Sutton & Barto 2018, section 4.1).

use super::PlanError;
use super::dynamics::{Dynamics, Over};
use crate::mdp::{Action, FiniteMdp};

/// A stationary policy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Policy<'a> {
    /// Plays `policy[s]` in state s.
    Deterministic(&'a [Action]),
    /// Plays action a in state s with probability `policy[s * n_actions + a]`.
    Stochastic(&'a [f64]),
    /// Plays every action with the same probability.
    Uniform,
}

impl Policy<'_> {
    /// π(a | s).
    #[inline]
    pub fn share(&self, s: usize, a: usize, n_actions: usize) -> f64 {
        match self {
            Self::Deterministic(policy) => f64::from(u8::from(policy[s] == a)),
            Self::Stochastic(policy) => policy[s * n_actions + a],
            Self::Uniform => 1.0 / n_actions as f64,
        }
    }
}

/// The value of a policy.
#[derive(Debug, Clone, PartialEq)]
pub struct PolicyValue {
    /// V^π, one per state.
    pub v: Vec<f64>,
    /// No value is further than this from the exact one.
    pub bound: f64,
}

/// V^π of `policy` (by the model's states), one value per state; 0 for states that take no part.
///
/// Exact up to rounding: the equations are solved one strongly connected component after the other,
/// small ones by LU decomposition, large ones by a Krylov method.
///
/// # Errors
/// If γ = 1 and the policy may never end, or a value is not finite.
pub fn policy_value(
    mdp: &FiniteMdp,
    gamma: f64,
    policy: Policy<'_>,
    over: Over,
) -> Result<PolicyValue, PlanError> {
    let dynamics = Dynamics::new(mdp, over);
    let states = 0..dynamics.len();
    let rewards = dynamics.rewards(mdp);
    let value = match policy {
        Policy::Uniform => dynamics.value(&rewards, gamma, policy),
        Policy::Deterministic(policy) => {
            let policy: Vec<Action> = states.map(|place| policy[dynamics.state(place)]).collect();
            dynamics.value(&rewards, gamma, Policy::Deterministic(&policy))
        }
        Policy::Stochastic(policy) => {
            let n = mdp.n_actions();
            let row = |place| &policy[dynamics.state(place) * n..][..n];
            let policy: Vec<f64> = states.flat_map(row).copied().collect();
            dynamics.value(&rewards, gamma, Policy::Stochastic(&policy))
        }
    }?;
    Ok(PolicyValue { v: dynamics.unpack(&value.v), bound: value.bound })
}
