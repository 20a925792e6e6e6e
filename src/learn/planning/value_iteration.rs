//! Value iteration (Bellman 1957; Sutton & Barto 2018, section 4.4).
//!
//! `V(s) ← max_a Σ p(s′, r | s, a) [r + γ V(s′)]`, sweeping the states in order and in place
//! (Gauss–Seidel), until no value changes by more than θ.
//!
//! When it stops, every value is within `θ γ / (1 − γ)` of the optimum (γ < 1).

use crate::learn::QTable;
use crate::mdp::FiniteMdp;

/// Solves a model.
pub trait Planner {
    /// The optimal values of `mdp`, starting from `v0` (one value per state).
    ///
    /// Shaped models should start from −Φ: sweep by sweep the values then equal those of the plain
    /// model from 0, minus Φ.
    fn solve(&self, mdp: &FiniteMdp, v0: &[f64]) -> Solution;

    /// The discount factor.
    fn gamma(&self) -> f64;
}

/// What a planner found.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// State values, one per state.
    pub v: Vec<f64>,
    /// Action values.
    pub q: QTable,
    /// The largest change of each sweep.
    pub changes: Vec<f64>,
    /// Whether the last change was at most θ.
    pub converged: bool,
}

/// Value iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ValueIteration {
    /// Discount factor γ.
    pub gamma: f64,
    /// Stop when no value changes by more than this.
    pub theta: f64,
    /// Stop after this many sweeps in any case.
    pub max_sweeps: usize,
}

/// `Σ p (r + γ V(s′))` over the outcomes of (s, a); V is 0 beyond a terminal transition.
#[inline]
fn backup(mdp: &FiniteMdp, gamma: f64, v: &[f64], s: usize, a: usize) -> f64 {
    let mut sum = 0.0;
    for o in mdp.of(s, a) {
        let next = if o.terminated { 0.0 } else { v[o.next_state as usize] };
        sum += o.probability * (o.reward + gamma * next);
    }
    sum
}

/// `Q(s, a) = Σ p(s′, r | s, a) [r + γ V(s′)]`; `v` has one value per state.
pub fn q_from_v(mdp: &FiniteMdp, gamma: f64, v: &[f64]) -> QTable {
    let n_actions = mdp.n_actions();
    let mut values = Vec::with_capacity(mdp.n_states() * n_actions);
    for s in 0..mdp.n_states() {
        values.extend((0..n_actions).map(|a| backup(mdp, gamma, v, s, a)));
    }
    QTable::from_values(n_actions, values)
}

impl Planner for ValueIteration {
    fn solve(&self, mdp: &FiniteMdp, v0: &[f64]) -> Solution {
        let mut v = v0.to_vec();
        let mut changes = Vec::new();
        let mut converged = false;
        while !converged && changes.len() < self.max_sweeps {
            let mut change = 0.0f64;
            for s in 0..mdp.n_states() {
                let best = (0..mdp.n_actions())
                    .map(|a| backup(mdp, self.gamma, &v, s, a))
                    .fold(f64::NEG_INFINITY, f64::max);
                change = change.max((best - v[s]).abs());
                v[s] = best;
            }
            changes.push(change);
            converged = change <= self.theta;
        }
        let q = q_from_v(mdp, self.gamma, &v);
        Solution { v, q, changes, converged }
    }

    fn gamma(&self) -> f64 {
        self.gamma
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mdp::Outcome;

    /// s0: action 0 exits with 1; action 1 costs nothing and leads to s1, whose both actions exit
    /// with 2. V(1) = 2, Q(0, ·) = (1, 2γ).
    fn model() -> FiniteMdp {
        let go = |next_state, reward, terminated| {
            vec![Outcome { probability: 1.0, next_state, reward, terminated }]
        };
        FiniteMdp::new(
            &[vec![go(0, 1.0, true), go(1, 0.0, false)], vec![go(1, 2.0, true), go(0, 2.0, true)]],
            vec![1.0, 0.0],
        )
        .unwrap()
    }

    #[test]
    fn values_by_hand() {
        let vi = ValueIteration { gamma: 0.9, theta: 1e-12, max_sweeps: 100 };
        let solution = vi.solve(&model(), &[0.0; 2]);
        assert!(solution.converged);
        assert_eq!(solution.v, [1.8, 2.0]);
        assert_eq!(solution.q.values(), [1.0, 1.8, 2.0, 2.0]);
    }

    #[test]
    fn a_sweep_limit_is_reported_as_not_converged() {
        let vi = ValueIteration { gamma: 0.9, theta: 1e-12, max_sweeps: 1 };
        assert!(!vi.solve(&model(), &[0.0; 2]).converged);
    }
}
