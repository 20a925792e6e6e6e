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
    /// `span(A_F) / (1 − γ)`, A_F being the advantages of the added reward under the uniformly
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

/// The best and the worst of the policies that are greedy for the learned reward.
pub(super) struct Extremes {
    /// Their native values, by place.
    pub(super) best: Vec<f64>,
    pub(super) worst: Vec<f64>,
    /// The worst policy.
    pub(super) policy: Vec<Action>,
}

impl Pair {
    /// What the shaping costs.
    ///
    /// # Errors
    /// If a value is not finite.
    pub fn policy_change(&self) -> Result<PolicyChange, Unsolved> {
        let extremes = self.extremes()?;
        let v = &self.native.optimum.v;
        let losses = v.iter().zip(&extremes.worst).map(|(v, worst)| v - worst);
        let (place, largest_loss) = losses
            .enumerate()
            .fold((0, 0.0), |most, (i, loss)| if loss > most.1 { (i, loss) } else { most });
        Ok(PolicyChange {
            optimal: self.at_start(v),
            best: self.at_start(&extremes.best),
            worst: self.at_start(&extremes.worst),
            largest_loss,
            worst_state: self.dynamics.state(place),
            bound: self.bound()?,
            smallest_gap: self.smallest_gap(),
            optimal_endings: self.endings(&self.native.optimum.policy)?,
            worst_endings: self.endings(&extremes.policy)?,
        })
    }

    /// Solves the native task among the actions that are greedy for the learned reward, for the
    /// largest and for the smallest return.
    pub(super) fn extremes(&self) -> Result<Extremes, PlanError> {
        let n_actions = self.dynamics.n_actions();
        let learned = &self.learned.optimum;
        let mut greedy = Scale::new(&self.learned, 0.0).tied(&learned.q, n_actions);
        for (place, a) in learned.policy.iter().enumerate() {
            greedy[place * n_actions + a] = true;
        }
        let solve = |rewards: &[f64]| -> Result<Optimum, PlanError> {
            self.problem(rewards, Some(&greedy)).optimum(Start::Policy(&learned.policy))
        };
        let losses: Vec<f64> = self.native.rewards.iter().map(|r| -r).collect();
        let worst = solve(&losses)?;
        Ok(Extremes {
            best: solve(&self.native.rewards)?.v,
            worst: worst.v.into_iter().map(|v| 0.0 - v).collect(),
            policy: worst.policy,
        })
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
