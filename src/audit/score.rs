//! How much a potential promises, before anything is trained.
//!
//! Learning with `γΦ(s′) − Φ(s)` is learning from initial values Φ (Wiewiora 2003), and value iteration
//! from `V₀ = Φ` is that without noise. What counts is how good its greedy policies are, and how
//! soon; how near Φ is to V\* in other respects is shown beside it.
//!
//! All scores need the solved model. They tell why one potential helped and another did not, not
//! which to take for a task that nobody has solved; and they were compared on small grids.

mod rank;
mod shift;
#[cfg(test)]
mod tests;

use serde::Serialize;

pub use rank::spearman;
pub use shift::{DeathAttraction, Shift};

use crate::learn::planning::{Dynamics, Over, PlanError, Policy, Problem, Start};
use crate::mdp::FiniteMdp;

/// Sweeps of value iteration that are judged.
pub const SCORED_SWEEPS: usize = 30;

/// Values within this, relative to the scale, are tied.
const TIE: f64 = 1e-9;

/// What is known of a model, to score potentials by.
#[derive(Debug)]
pub struct Scorer<'a> {
    mdp: &'a FiniteMdp,
    gamma: f64,
    dynamics: Dynamics,
    rewards: Vec<f64>,
    /// V\*, one per place.
    v: Vec<f64>,
    /// Q\*, one per pair.
    q: Vec<f64>,
    /// The largest |Q\*|.
    scale: f64,
    /// The probability of starting in each place.
    starts: Vec<f64>,
    optimal: f64,
    random: f64,
}

/// The scores of one potential, the best first.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Score {
    /// VI-AUC: the mean value of the greedy policies of [`SCORED_SWEEPS`] sweeps from `V₀ = Φ`, at
    /// the starts; 1 is an optimal policy's, 0 the uniformly random one's. `None` if these are equal.
    pub vi_auc: Option<f64>,
    /// The same as a discounted return.
    pub vi_value: f64,
    /// After how many sweeps the greedy policy is within 10 % of the optimal return, from 1. `None`
    /// if after [`SCORED_SWEEPS`] it is not.
    pub sweeps: Option<usize>,
    /// The mean of |V\* − Φ| over the states.
    pub mean_error: f64,
    /// The largest |V\* − Φ|.
    pub largest_error: f64,
    /// How often an action that is greedy one step ahead of Φ is optimal: the mean over the states,
    /// tied actions being equally likely.
    pub agreement: f64,
    /// Spearman's rank correlation of Φ and V\* over the states; `None` if either is constant.
    pub rank_correlation: Option<f64>,
    /// Whether ending badly pays.
    pub death: DeathAttraction,
}

impl<'a> Scorer<'a> {
    /// Solves `mdp` for the learner's `gamma`.
    ///
    /// # Errors
    /// If γ = 1 and a policy may never end, the uniformly random one included; or if a value is not
    /// finite.
    pub fn new(mdp: &'a FiniteMdp, gamma: f64) -> Result<Self, PlanError> {
        let dynamics = Dynamics::new(mdp, Over::Reachable);
        let rewards = dynamics.rewards(mdp);
        let problem = Problem { dynamics: &dynamics, rewards: &rewards, gamma, allowed: None };
        let optimum = problem.optimum(Start::Values(&vec![0.0; dynamics.len()]))?;
        let random = problem.value(Policy::Uniform)?.v;
        let mut starts: Vec<f64> =
            (0..dynamics.len()).map(|place| mdp.initial()[dynamics.state(place)]).collect();
        let total: f64 = starts.iter().sum();
        if total > 0.0 {
            for p in &mut starts {
                *p /= total;
            }
        } else {
            // An episode then starts in state 0, which is the first place.
            starts.fill(0.0);
            starts[0] = 1.0;
        }
        let scale = optimum.q.iter().fold(0.0f64, |m, q| m.max(q.abs()));
        let mut scorer = Self {
            mdp,
            gamma,
            rewards,
            v: optimum.v,
            q: optimum.q,
            scale,
            starts,
            optimal: 0.0,
            random: 0.0,
            dynamics,
        };
        scorer.optimal = scorer.at_starts(&scorer.v);
        scorer.random = scorer.at_starts(&random);
        Ok(scorer)
    }

    /// The optimal discounted return.
    pub fn optimal_return(&self) -> f64 {
        self.optimal
    }

    /// The discounted return of uniformly random actions.
    pub fn random_return(&self) -> f64 {
        self.random
    }

    /// Scores `phi`, one value per state of the model.
    ///
    /// # Errors
    /// If γ = 1 and a greedy policy on the way may never end, or a value is not finite.
    pub fn score(&self, phi: &[f64]) -> Result<Score, PlanError> {
        let phi = self.pack(phi);
        let returns = self.greedy_returns(&phi)?;
        let vi_value = returns.iter().sum::<f64>() / returns.len() as f64;
        let near = |value: &f64| *value >= self.optimal - 0.1 * self.optimal.abs();
        let errors = || self.v.iter().zip(&phi).map(|(v, phi)| (v - phi).abs());
        let scale = phi.iter().fold(self.scale, |m, x| m.max(x.abs()));
        Ok(Score {
            vi_auc: self.share(vi_value),
            vi_value,
            sweeps: returns.iter().position(near).map(|k| k + 1),
            mean_error: errors().sum::<f64>() / phi.len() as f64,
            largest_error: errors().fold(0.0, f64::max),
            agreement: self.agreement(&phi, scale),
            rank_correlation: spearman(&phi, &self.v, TIE * scale),
            death: self.death(&phi),
        })
    }

    fn pack(&self, phi: &[f64]) -> Vec<f64> {
        (0..self.dynamics.len()).map(|place| phi[self.dynamics.state(place)]).collect()
    }

    fn at_starts(&self, v: &[f64]) -> f64 {
        self.starts.iter().zip(v).map(|(p, v)| p * v).sum()
    }

    /// A return between the random policy's, 0, and the optimal one, 1.
    fn share(&self, value: f64) -> Option<f64> {
        let range = self.optimal - self.random;
        (range > TIE * self.scale).then(|| (value - self.random) / range)
    }

    /// The returns of the greedy policies of each sweep; tied actions are equally likely.
    fn greedy_returns(&self, phi: &[f64]) -> Result<Vec<f64>, PlanError> {
        let n_actions = self.dynamics.n_actions();
        let mut v = phi.to_vec();
        let mut returns = Vec::with_capacity(SCORED_SWEEPS);
        let mut last: Option<(Vec<f64>, f64)> = None;
        for _ in 0..SCORED_SWEEPS {
            let q = self.dynamics.q_from_v(&self.rewards, self.gamma, &v);
            let scale = q.iter().chain(&v).fold(0.0f64, |m, q| m.max(q.abs()));
            let policy = greedy(&q, n_actions, scale);
            for (v, row) in v.iter_mut().zip(q.chunks_exact(n_actions)) {
                *v = row.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            }
            // Sooner or later the policy stays the same.
            let value = match last {
                Some((same, value)) if same == policy => value,
                _ => {
                    let policy = Policy::Stochastic(&policy);
                    self.at_starts(&self.dynamics.value(&self.rewards, self.gamma, policy)?.v)
                }
            };
            returns.push(value);
            last = Some((policy, value));
        }
        Ok(returns)
    }

    fn agreement(&self, phi: &[f64], scale: f64) -> f64 {
        let n_actions = self.dynamics.n_actions();
        let ahead = self.dynamics.q_from_v(&self.rewards, self.gamma, phi);
        let chosen = greedy(&ahead, n_actions, scale);
        let optimal = greedy(&self.q, n_actions, self.scale);
        let both = chosen.iter().zip(&optimal).filter(|&(_, &optimal)| optimal > 0.0);
        both.map(|(chosen, _)| chosen).sum::<f64>() / phi.len() as f64
    }
}

/// The greedy policy for action values: π(a | s), the tied actions equally likely.
fn greedy(q: &[f64], n_actions: usize, scale: f64) -> Vec<f64> {
    let mut policy = Vec::with_capacity(q.len());
    for row in q.chunks_exact(n_actions) {
        let best = row.iter().copied().fold(f64::NEG_INFINITY, f64::max) - TIE * scale;
        let tied = row.iter().filter(|&&q| q >= best).count();
        policy.extend(row.iter().map(|&q| if q >= best { 1.0 / tied as f64 } else { 0.0 }));
    }
    policy
}
