//! Value iteration (Bellman 1957; Sutton & Barto 2018, section 4.4).
//!
//! `V(s) ← max_a Σ p(s′, r | s, a) [r + γ V(s′)]`, sweeping the states in order and in place
//! (Gauss–Seidel), until no value changes by more than θ.
//!
//! When it stops, every value is within `θ γ / (1 − γ)` of the optimum (γ < 1): the sweep is a
//! contraction by γ (Puterman 1994, section 6.3).

use super::problem::Problem;
use super::{Dynamics, Over, PlanError, Planner, Solution};
use crate::learn::{QTable, argmax_tol};
use crate::mdp::FiniteMdp;

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

impl Planner for ValueIteration {
    fn solve(&self, mdp: &FiniteMdp, v0: &[f64]) -> Result<Solution, PlanError> {
        let dynamics = Dynamics::new(mdp, Over::Every);
        let rewards = dynamics.rewards(mdp);
        let problem =
            Problem { dynamics: &dynamics, rewards: &rewards, gamma: self.gamma, allowed: None };
        let mut v = v0.to_vec();
        let mut changes = Vec::new();
        let mut converged = false;
        while !converged && changes.len() < self.max_sweeps {
            let change = problem.sweep_in_place(&mut v);
            changes.push(change);
            converged = change <= self.theta;
        }
        let q = dynamics.q_from_v(&rewards, self.gamma, &v);
        let q = QTable::from_values(mdp.n_actions(), q);
        let policy = (0..mdp.n_states()).map(|s| argmax_tol(q.row(s))).collect();
        let bound = changes
            .last()
            .filter(|_| self.gamma < 1.0)
            .map(|change| change * self.gamma / (1.0 - self.gamma));
        Ok(Solution { v, q, policy, changes, switched: Vec::new(), converged, bound })
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
        let solution = vi.solve(&model(), &[0.0; 2]).unwrap();
        assert!(solution.converged);
        assert_eq!(solution.v, [1.8, 2.0]);
        assert_eq!(solution.q.values(), [1.0, 1.8, 2.0, 2.0]);
    }

    #[test]
    fn a_sweep_limit_is_reported_as_not_converged() {
        let vi = ValueIteration { gamma: 0.9, theta: 1e-12, max_sweeps: 1 };
        assert!(!vi.solve(&model(), &[0.0; 2]).unwrap().converged);
    }

    #[test]
    fn every_sweep_leaves_a_bound() {
        let (gamma, max_sweeps) = (0.9, 100);
        let exact = ValueIteration { gamma, theta: 0.0, max_sweeps }.solve(&model(), &[0.0; 2]);
        let exact = exact.unwrap().v;
        for max_sweeps in 1..5 {
            let vi = ValueIteration { gamma, theta: 1e-12, max_sweeps };
            let solution = vi.solve(&model(), &[0.0; 2]).unwrap();
            let sweeps = solution.sweeps(gamma);
            assert_eq!(sweeps.len(), solution.changes.len());
            let last = sweeps[sweeps.len() - 1];
            assert_eq!((last.bound, last.switched), (solution.bound, None));
            let pairs = solution.v.iter().zip(&exact);
            let error = pairs.map(|(v, exact)| (v - exact).abs()).fold(0.0, f64::max);
            assert!(error <= last.bound.unwrap());
        }
        let undiscounted = ValueIteration { gamma: 1.0, theta: 0.0, max_sweeps };
        let solution = undiscounted.solve(&model(), &[0.0; 2]).unwrap();
        assert!(solution.sweeps(1.0).iter().all(|sweep| sweep.bound.is_none()));
    }
}
