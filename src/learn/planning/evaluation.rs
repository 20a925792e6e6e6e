//! Exact policy evaluation: solves `(I − γ P_π) V = R_π` by LU decomposition.

use nalgebra::{DMatrix, DVector};

use crate::mdp::{Action, FiniteMdp};

/// The linear system has no unique solution: with γ = 1, a policy that never ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PolicyValueError;

impl std::fmt::Display for PolicyValueError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("the policy's value is not defined: with gamma = 1 it may never end")
    }
}

impl std::error::Error for PolicyValueError {}

/// V^π of the policy that plays `policy[s]` in state s. Returns one value per state.
///
/// Dense: meant for models of up to a few thousand states.
///
/// # Errors
/// If the system is singular.
pub fn policy_value(
    mdp: &FiniteMdp,
    gamma: f64,
    policy: &[Action],
) -> Result<Vec<f64>, PolicyValueError> {
    let n = mdp.n_states();
    let mut system = DMatrix::<f64>::identity(n, n);
    let mut rewards = DVector::<f64>::zeros(n);
    for s in 0..n {
        for o in mdp.of(s, policy[s]) {
            rewards[s] += o.probability * o.reward;
            if !o.terminated {
                system[(s, o.next_state as usize)] -= gamma * o.probability;
            }
        }
    }
    let v = system.lu().solve(&rewards).ok_or(PolicyValueError)?;
    if v.iter().all(|x| x.is_finite()) { Ok(v.as_slice().to_vec()) } else { Err(PolicyValueError) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mdp::Outcome;

    #[test]
    fn a_two_state_chain_by_hand() {
        // Each state exits with reward 1 with probability 1/2, else moves to the other for 0:
        // V = 1/2 + γ/2 V, so V = 1 / (2 - γ).
        let half = |next_state, reward, terminated| Outcome {
            probability: 0.5,
            next_state,
            reward,
            terminated,
        };
        let mdp = FiniteMdp::new(
            &[
                vec![vec![half(0, 1.0, true), half(1, 0.0, false)]],
                vec![vec![half(1, 1.0, true), half(0, 0.0, false)]],
            ],
            vec![1.0, 0.0],
        )
        .unwrap();
        for v in policy_value(&mdp, 0.9, &[0, 0]).unwrap() {
            assert!((v - 1.0 / 1.1).abs() < 1e-15);
        }
    }

    #[test]
    fn an_endless_policy_has_no_undiscounted_value() {
        let stay = Outcome { probability: 1.0, next_state: 0, reward: -1.0, terminated: false };
        let mdp = FiniteMdp::new(&[vec![vec![stay]]], vec![1.0]).unwrap();
        assert!(policy_value(&mdp, 1.0, &[0]).is_err());
        assert!((policy_value(&mdp, 0.9, &[0]).unwrap()[0] + 10.0).abs() < 1e-12);
    }
}
