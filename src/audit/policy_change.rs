//! What a shaping costs: the true return of the policies that are optimal for the learned reward.

use serde::Serialize;

use super::gap::{Gap, Scale, best};
use super::pair::{Pair, Unsolved};
use crate::learn::planning::{Optimum, PlanError, Policy, Start};
use crate::mdp::Action;

/// What is lost by optimising the learned reward instead of the native one.
///
/// Returns are discounted, in native reward, expected over the initial distribution.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PolicyChange {
    /// Of an optimal policy.
    pub optimal: f64,
    /// Of the best policy that is optimal for the learned reward.
    pub best: f64,
    /// Of the worst.
    pub worst: f64,
    /// The largest loss of the worst policy over the reachable states.
    pub largest_loss: f64,
    /// The state in which that is.
    pub worst_state: usize,
    /// No policy that is optimal for the learned reward loses more than this anywhere:
    /// `span(A_F) / (1 − γ)`, `A_F` being the advantages of the added reward under the uniformly
    /// random policy. `None` with γ = 1.
    pub bound: Option<f64>,
    /// The smallest difference in action value between a best action and one that is not;
    /// `None` if all actions are equally good everywhere. Where `bound` is smaller, no action that
    /// is optimal for the learned reward is worse than another.
    pub smallest_gap: Option<f64>,
    /// How episodes end under an optimal policy.
    pub optimal_endings: Endings,
    /// How they end under the worst policy that is optimal for the learned reward.
    pub worst_endings: Endings,
    /// That policy and its native values, by place.
    #[serde(skip)]
    pub(super) extreme: Extreme,
}

/// How episodes without a time limit end.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Endings {
    /// The probability that they end.
    pub terminated: f64,
    /// The probability that they end in the best way there is: with the largest native reward that
    /// any last step can bring.
    pub goal: f64,
}

/// The worst policy that is optimal for the learned reward.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Extreme {
    pub(super) policy: Vec<Action>,
    /// Its native values.
    pub(super) v: Vec<f64>,
}

impl Pair {
    /// What the shaping costs.
    ///
    /// # Errors
    /// If a value is not finite.
    pub fn policy_change(&self) -> Result<PolicyChange, Unsolved> {
        let (best, extreme) = self.extremes()?;
        let v = &self.native.optimum.v;
        let losses = v.iter().zip(&extreme.v).map(|(v, worst)| v - worst);
        let (place, largest_loss) = losses
            .enumerate()
            .fold((0, 0.0), |most, (i, loss)| if loss > most.1 { (i, loss) } else { most });
        Ok(PolicyChange {
            optimal: self.at_start(v),
            best: self.at_start(&best),
            worst: self.at_start(&extreme.v),
            largest_loss,
            worst_state: self.dynamics.state(place),
            bound: self.bound()?,
            smallest_gap: self.smallest_gap(),
            optimal_endings: self.endings(&self.native.optimum.policy)?,
            worst_endings: self.endings(&extreme.policy)?,
            extreme,
        })
    }

    /// Solves the native task among the actions that are greedy for the learned reward, for the
    /// largest and for the smallest return. Returns the values of the best policy, and the worst.
    fn extremes(&self) -> Result<(Vec<f64>, Extreme), PlanError> {
        let n_actions = self.dynamics.n_actions();
        let policy = &self.learned.optimum.policy;
        let mut greedy = Scale::new(&self.learned, 0.0).tied(&self.learned.optimum.q, n_actions);
        for (place, a) in policy.iter().enumerate() {
            greedy[place * n_actions + a] = true;
        }
        let v = self.value(&self.native.rewards, policy)?;
        if greedy.iter().filter(|greedy| **greedy).count() == policy.len() {
            return Ok((v.clone(), Extreme { policy: policy.clone(), v }));
        }
        let solve = |rewards: &[f64], v: &[f64]| -> Result<Optimum, PlanError> {
            self.problem(rewards, Some(&greedy)).optimum(Start::Policy(policy, v))
        };
        // 0 - v, so that no 0 gets a sign.
        let negative = |v: &[f64]| -> Vec<f64> { v.iter().map(|v| 0.0 - v).collect() };
        let worst = solve(&negative(&self.native.rewards), &negative(&v))?;
        let extreme = Extreme { policy: worst.policy, v: negative(&worst.v) };
        Ok((solve(&self.native.rewards, &v)?.v, extreme))
    }

    fn bound(&self) -> Result<Option<f64>, PlanError> {
        if self.gamma == 1.0 {
            return Ok(None);
        }
        let problem = self.problem(&self.f, None);
        let v = problem.value(Policy::Uniform)?.v;
        let q = self.dynamics.q_from_v(&self.f, self.gamma, &v);
        let n_actions = self.dynamics.n_actions();
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for (i, q) in q.iter().enumerate() {
            let advantage = q - v[i / n_actions];
            (low, high) = (low.min(advantage), high.max(advantage));
        }
        Ok(Some((high - low) / (1.0 - self.gamma)))
    }

    fn smallest_gap(&self) -> Option<f64> {
        let scale = Scale::new(&self.native, 0.0);
        let rows = self.native.optimum.q.chunks_exact(self.dynamics.n_actions());
        rows.flat_map(|row| row.iter().map(|q| best(row) - q))
            .filter(|&gap| scale.judge(gap) == Gap::Real)
            .min_by(f64::total_cmp)
    }

    fn endings(&self, policy: &[Action]) -> Result<Endings, PlanError> {
        let chance = |ending: &[f64]| -> Result<f64, PlanError> {
            let chances = self.dynamics.chances(ending, Policy::Deterministic(policy))?;
            Ok(self.at_start(&chances).min(1.0))
        };
        Ok(Endings { terminated: chance(&self.ending)?, goal: chance(&self.goal)? })
    }
}
