//! Policy iteration with exact evaluation (Howard 1960; Sutton & Barto 2018, section 4.3).

use super::evaluation::{PolicyValueError, policy_value};
use super::q_from_v;
use crate::learn::QTable;
use crate::mdp::FiniteMdp;

/// Policy iteration: exact up to rounding, with nothing to tune.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PolicyIteration {
    /// Discount factor γ.
    pub gamma: f64,
}

impl PolicyIteration {
    /// The optimal action values of `mdp`.
    ///
    /// An action replaces the current one only if it is better by more than rounding can explain,
    /// else ties would make the iteration run in circles.
    ///
    /// # Errors
    /// If a policy met on the way has no value (γ = 1 and it may never end).
    pub fn solve(&self, mdp: &FiniteMdp) -> Result<QTable, PolicyValueError> {
        let mut policy = vec![0; mdp.n_states()];
        let rewards = mdp.outcomes().iter().map(|o| o.reward.abs());
        let largest_reward = rewards.fold(0.0, f64::max);
        loop {
            let v = policy_value(mdp, self.gamma, &policy)?;
            let q = q_from_v(mdp, self.gamma, &v);
            let scale = v.iter().fold(largest_reward, |m, x| m.max(x.abs()));
            let mut improved = false;
            for (s, current) in policy.iter_mut().enumerate() {
                let row = q.row(s);
                let mut best = *current;
                for a in 0..row.len() {
                    if row[a] > row[best] + 1e-12 * scale {
                        best = a;
                    }
                }
                improved |= best != *current;
                *current = best;
            }
            if !improved {
                return Ok(q);
            }
        }
    }
}
