//! Policy iteration with exact evaluation (Howard 1960; Sutton & Barto 2018, section 4.3).
//!
//! With γ = 1 it starts from a policy that is sure to end the episode, and every better one is
//! again (Bertsekas & Tsitsiklis 1991), unless some loop pays.

use super::problem::Problem;
use super::{Dynamics, Over, PlanError, Planner, Solution};
use crate::learn::{QTable, argmax_tol};
use crate::mdp::{Action, FiniteMdp};

/// Sweeps of value iteration that find the first policy, at most.
const SWEEPS: usize = 100;
/// Improvements, at most; far fewer are ever needed.
const IMPROVEMENTS: usize = 1_000;
/// From this many states on, policies are evaluated roughly until the rough values like them.
const LARGE: usize = 1_000;

/// Policy iteration: exact up to rounding, with nothing to tune.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PolicyIteration {
    /// Discount factor γ.
    pub gamma: f64,
}

/// What policy iteration starts from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Start<'a> {
    /// A policy that is greedy after a few sweeps from these values.
    Values(&'a [f64]),
    /// A policy, with γ = 1 one that is sure to end; and a guess at its values.
    Policy(&'a [Action], &'a [f64]),
}

/// An optimal policy and its values, by place.
#[derive(Debug, Clone, PartialEq)]
pub struct Optimum {
    /// State values.
    pub v: Vec<f64>,
    /// Action values, one per pair (s, a); those of forbidden pairs too.
    pub q: Vec<f64>,
    /// An optimal action per state.
    pub policy: Vec<Action>,
    /// The largest change of a value in each iteration.
    pub changes: Vec<f64>,
    /// How many states each iteration gave another action.
    pub switched: Vec<usize>,
    /// No value is further than this from the optimum; `None` with γ = 1.
    pub bound: Option<f64>,
}

impl Problem<'_> {
    /// Solves by policy iteration.
    ///
    /// An action replaces the current one only if it is better by more than rounding can explain,
    /// else ties would make the iteration run in circles.
    ///
    /// # Errors
    /// If γ = 1 and no policy is sure to end or a better one never does, or a value is not finite.
    pub fn optimum(&self, start: Start<'_>) -> Result<Optimum, PlanError> {
        self.iterate(start).map_err(|e| e.of_model(|place| self.dynamics.state(place)))
    }

    fn iterate(&self, start: Start<'_>) -> Result<Optimum, PlanError> {
        let (mut policy, mut v) = match start {
            Start::Policy(policy, guess) => (policy.to_vec(), guess.to_vec()),
            Start::Values(v0) => self.first_policy(v0)?,
        };
        let largest_reward = self.rewards.iter().fold(0.0f64, |m, r| m.max(r.abs()));
        let (mut changes, mut switched) = (Vec::new(), Vec::new());
        let mut rough = self.dynamics.len() >= LARGE;
        loop {
            let chain = self.chain(&policy);
            let (next, error) = if rough {
                (chain.solve_roughly(&v)?, 0.0)
            } else {
                let value = chain.solve(Some(&v))?;
                (value.v, value.bound)
            };
            let pairs = next.iter().zip(&v);
            changes.push(pairs.fold(0.0f64, |m, (a, b)| m.max((a - b).abs())));
            v = next;
            let scale = v.iter().fold(largest_reward, |m, x| m.max(x.abs()));
            let noise = if rough { 1e-6 } else { 1e-12 };
            let q = self.dynamics.q_from_v(self.rewards, self.gamma, &v);
            let better = self.improve(&mut policy, &q, (noise * scale).max(2.0 * error));
            switched.push(better);
            match (better == 0 || switched.len() >= IMPROVEMENTS, rough) {
                (true, true) => rough = false,
                (true, false) => {
                    let bound = self.bound(&v, &q);
                    return Ok(Optimum { v, q, policy, changes, switched, bound });
                }
                (false, _) => {}
            }
        }
    }

    /// Gives every state the best action, if it is better than the present one by more than
    /// `noise`. Returns for how many it was.
    fn improve(&self, policy: &mut [Action], q: &[f64], noise: f64) -> usize {
        let n_actions = self.dynamics.n_actions();
        let mut switched = 0;
        for (s, current) in policy.iter_mut().enumerate() {
            let (mut best, mut action) = (q[s * n_actions + *current] + noise, *current);
            for a in 0..n_actions {
                let i = s * n_actions + a;
                if q[i] > best && self.allows(i) {
                    (best, action) = (q[i], a);
                }
            }
            switched += usize::from(action != *current);
            *current = action;
        }
        switched
    }

    /// Sweeps to and fro until the greedy policy stays the same.
    fn first_policy(&self, v0: &[f64]) -> Result<(Vec<Action>, Vec<f64>), PlanError> {
        let n = self.dynamics.len();
        let (mut policy, mut v) = if self.gamma < 1.0 {
            (vec![usize::MAX; n], v0.to_vec())
        } else {
            // From the value of a proper policy the values only rise, and what is greedy on the way
            // is proper again.
            let policy = self.proper_policy().map_err(PlanError::NoProperPolicy)?;
            let v = self.chain(&policy).solve_roughly(v0)?;
            (policy, v)
        };
        for sweep in 0..SWEEPS {
            let mut changed = false;
            let mut visit = |s: usize| {
                let (best, action) = self.best(&v, s);
                v[s] = best;
                changed |= action != policy[s];
                policy[s] = action;
            };
            if sweep % 2 == 0 {
                (0..n).rev().for_each(&mut visit);
            } else {
                (0..n).for_each(&mut visit);
            }
            if !changed {
                break;
            }
        }
        Ok((policy, v))
    }

    /// `‖V* − v‖ ≤ ‖max_a Q − v‖ / (1 − γ)`, in the maximum norm.
    fn bound(&self, v: &[f64], q: &[f64]) -> Option<f64> {
        let n_actions = self.dynamics.n_actions();
        let mut residual = 0.0f64;
        for (s, v) in v.iter().enumerate() {
            let allowed = (s * n_actions..(s + 1) * n_actions).filter(|&i| self.allows(i));
            let best = allowed.fold(f64::NEG_INFINITY, |m, i| m.max(q[i]));
            residual = residual.max((best - v).abs() + f64::EPSILON * v.abs());
        }
        (self.gamma < 1.0).then(|| residual / (1.0 - self.gamma))
    }
}

impl Planner for PolicyIteration {
    /// Solves for the states that an episode can be in; the values of all others stay `v0`'s, and
    /// their action values are 0.
    fn solve(&self, mdp: &FiniteMdp, v0: &[f64]) -> Result<Solution, PlanError> {
        let dynamics = Dynamics::new(mdp, Over::Reachable);
        let rewards = dynamics.rewards(mdp);
        let problem =
            Problem { dynamics: &dynamics, rewards: &rewards, gamma: self.gamma, allowed: None };
        let start: Vec<f64> = (0..dynamics.len()).map(|place| v0[dynamics.state(place)]).collect();
        let optimum = problem.optimum(Start::Values(&start))?;
        let n_actions = mdp.n_actions();
        let mut q = QTable::new(mdp.n_states(), n_actions, 0.0);
        let (mut v, mut policy) = (v0.to_vec(), vec![0; mdp.n_states()]);
        for place in 0..dynamics.len() {
            let s = dynamics.state(place);
            v[s] = optimum.v[place];
            for a in 0..n_actions {
                *q.get_mut(s, a) = optimum.q[place * n_actions + a];
            }
            // Discounted, every greedy policy is optimal, and the first of the tied is taken
            // whatever the rewards' potential; else a greedy one may go round in circles.
            policy[s] = if self.gamma < 1.0 { argmax_tol(q.row(s)) } else { optimum.policy[place] };
        }
        Ok(Solution {
            v,
            q,
            policy,
            converged: optimum.switched.last() == Some(&0),
            changes: optimum.changes,
            switched: optimum.switched,
            bound: optimum.bound,
        })
    }

    fn gamma(&self) -> f64 {
        self.gamma
    }
}
