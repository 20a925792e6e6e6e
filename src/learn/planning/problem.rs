//! What is to be solved: dynamics, rewards, a discount factor; and the steps of solving it.

use super::chain::Chain;
use super::dynamics::Dynamics;
use super::evaluation::Policy;
use super::{PlanError, PolicyValue};
use crate::mdp::Action;

/// A task on packed dynamics. States go by their places in them.
#[derive(Debug, Clone, Copy)]
pub struct Problem<'a> {
    /// The transition probabilities.
    pub dynamics: &'a Dynamics,
    /// Expected rewards, one per pair (s, a).
    pub rewards: &'a [f64],
    /// Discount factor γ.
    pub gamma: f64,
    /// Which pairs may be played: all, or those marked, at least one a state.
    pub allowed: Option<&'a [bool]>,
}

impl Problem<'_> {
    /// Whether pair `i` may be played.
    #[inline]
    pub(super) fn allows(&self, i: usize) -> bool {
        self.allowed.is_none_or(|allowed| allowed[i])
    }

    /// `r + γ Σ p V(s′)` of pair `i`.
    #[inline]
    pub(super) fn backup(&self, v: &[f64], i: usize) -> f64 {
        self.dynamics.backup(self.rewards, self.gamma, v, i)
    }

    /// The best backup of state `s`, and the first action that has it.
    #[inline]
    pub(super) fn best(&self, v: &[f64], s: usize) -> (f64, Action) {
        let n_actions = self.dynamics.n_actions();
        let (mut best, mut action) = (f64::NEG_INFINITY, 0);
        for a in 0..n_actions {
            let i = s * n_actions + a;
            if self.allows(i) {
                let q = self.backup(v, i);
                if q > best {
                    (best, action) = (q, a);
                }
            }
        }
        (best, action)
    }

    /// One sweep of value iteration over all states at once (Jacobi): every value is backed up
    /// from `v` as it was.
    pub fn sweep(&self, v: &[f64]) -> Vec<f64> {
        (0..self.dynamics.len()).map(|s| self.best(v, s).0).collect()
    }

    /// One sweep in place (Gauss–Seidel), the states in order; returns the largest change.
    pub(super) fn sweep_in_place(&self, v: &mut [f64]) -> f64 {
        let mut change = 0.0f64;
        for s in 0..self.dynamics.len() {
            let (best, _) = self.best(v, s);
            change = change.max((best - v[s]).abs());
            v[s] = best;
        }
        change
    }

    /// The value of playing `policy`.
    ///
    /// # Errors
    /// If γ = 1 and the policy may never end, or a value is not finite.
    pub fn value(&self, policy: Policy<'_>) -> Result<PolicyValue, PlanError> {
        self.dynamics.value(self.rewards, self.gamma, policy)
    }

    pub(super) fn chain(&self, policy: &[Action]) -> Chain {
        Chain::new(self.dynamics, self.rewards, self.gamma, Policy::Deterministic(policy))
    }

    /// A policy that is sure to end the episode from everywhere: one that from every state may come
    /// a step closer to an end (Bertsekas & Tsitsiklis 1991).
    ///
    /// # Errors
    /// The place of a state from which no end can be reached.
    pub fn proper_policy(&self) -> Result<Vec<Action>, usize> {
        let (n, n_actions) = (self.dynamics.len(), self.dynamics.n_actions());
        let sources = self.dynamics.sources();
        let mut policy = vec![None; n];
        let mut queue = std::collections::VecDeque::new();
        let reach = |i: usize, policy: &mut Vec<Option<Action>>| {
            let first = policy[i / n_actions].is_none();
            if first {
                policy[i / n_actions] = Some(i % n_actions);
            }
            first.then_some(i / n_actions)
        };
        for i in (0..n * n_actions).filter(|&i| self.allows(i) && self.dynamics.ends(i)) {
            queue.extend(reach(i, &mut policy));
        }
        while let Some(s) = queue.pop_front() {
            for &i in sources.of(s).iter().filter(|&&i| self.allows(i as usize)) {
                queue.extend(reach(i as usize, &mut policy));
            }
        }
        policy.iter().enumerate().map(|(s, action)| action.ok_or(s)).collect()
    }
}
