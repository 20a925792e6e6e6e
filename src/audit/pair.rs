//! A model with its true and with its learned rewards, both solved exactly.

use super::ssp::SspCheck;
use crate::learn::planning::{Dynamics, Optimum, Over, PlanError, Policy, Problem, Start};
use crate::mdp::FiniteMdp;

/// Why there is nothing to compare.
#[derive(Debug, Clone, PartialEq)]
pub enum Unsolved {
    /// γ = 1, and the native rewards leave no optimal values.
    Native(SspCheck),
    /// γ = 1, and the learned rewards leave none. If a loop pays, that is a verdict: every
    /// policy that ends is worse.
    Learned(SspCheck),
    /// There are no values for another reason.
    Plan(PlanError),
}

impl std::fmt::Display for Unsolved {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Native(check) => write!(f, "the native reward: {check}"),
            Self::Learned(check) => write!(f, "the learned reward: {check}"),
            Self::Plan(e) => e.fmt(f),
        }
    }
}

impl std::error::Error for Unsolved {}

impl From<PlanError> for Unsolved {
    fn from(e: PlanError) -> Self {
        Self::Plan(e)
    }
}

/// One dynamics, two rewards: the native R and the learned R + F, over the states that an episode
/// can be in.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    pub(super) dynamics: Dynamics,
    pub(super) gamma: f64,
    pub(super) native: Solved,
    pub(super) learned: Solved,
    /// E[F | s, a], one per pair (s, a).
    pub(super) f: Vec<f64>,
    /// The largest |F| of an outcome.
    pub(super) largest_f: f64,
    /// The probability that an episode starts in each place.
    pub(super) start: Vec<f64>,
    /// The probability that an episode ends with each pair (s, a).
    pub(super) ending: Vec<f64>,
    /// The same, in the best way there is: with the largest native reward that a last step brings.
    pub(super) goal: Vec<f64>,
}

/// A task and its solution.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Solved {
    /// Expected rewards, one per pair (s, a).
    pub(super) rewards: Vec<f64>,
    /// The largest reward of an outcome.
    pub(super) largest: f64,
    pub(super) optimum: Optimum,
}

impl Pair {
    /// Solves `mdp` with its own rewards and with `f` (one number per outcome: the learned minus
    /// the native reward) added.
    ///
    /// # Errors
    /// If γ = 1 and either is no stochastic shortest path problem, or a value is not finite.
    pub fn new(mdp: &FiniteMdp, f: &[f64], gamma: f64) -> Result<Self, Unsolved> {
        let learned = |i: usize| mdp.outcomes()[i].reward + f[i];
        Self::solve(mdp, gamma, |i| f[i], learned)
    }

    /// Solves two models that differ in their rewards only.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn of_models(
        native: &FiniteMdp,
        learned: &FiniteMdp,
        gamma: f64,
    ) -> Result<Self, Unsolved> {
        let reward = |i: usize| learned.outcomes()[i].reward;
        Self::solve(native, gamma, |i| reward(i) - native.outcomes()[i].reward, reward)
    }

    fn solve(
        mdp: &FiniteMdp,
        gamma: f64,
        f: impl Fn(usize) -> f64,
        learned: impl Fn(usize) -> f64,
    ) -> Result<Self, Unsolved> {
        let dynamics = Dynamics::new(mdp, Over::Reachable);
        let rewards = dynamics.rewards(mdp);
        let shaped = dynamics.expect(mdp, &learned);
        if gamma == 1.0 {
            match SspCheck::new(&dynamics, &rewards, &rewards) {
                SspCheck::Fine => {}
                check => return Err(Unsolved::Native(check)),
            }
            match SspCheck::new(&dynamics, &shaped, &rewards) {
                SspCheck::Fine => {}
                check => return Err(Unsolved::Learned(check)),
            }
        }
        let zero = vec![0.0; dynamics.len()];
        let problem = Problem { dynamics: &dynamics, rewards: &rewards, gamma, allowed: None };
        let native = problem.optimum(Start::Values(&zero))?;
        let optimum = Problem { rewards: &shaped, ..problem }
            .optimum(Start::Policy(&native.policy, &native.v))?;
        let outcome = |i: usize| &mdp.outcomes()[i];
        let goal = goal(&dynamics, mdp);
        let chance = |ends: &dyn Fn(usize) -> bool| {
            dynamics.expect(mdp, |i| f64::from(u8::from(outcome(i).terminated && ends(i))))
        };
        Ok(Self {
            ending: chance(&|_| true),
            goal: chance(&|i| outcome(i).reward == goal),
            native: Solved {
                rewards,
                largest: largest(&dynamics, mdp, |i| mdp.outcomes()[i].reward),
                optimum: native,
            },
            learned: Solved {
                rewards: shaped,
                largest: largest(&dynamics, mdp, &learned),
                optimum,
            },
            f: dynamics.expect(mdp, &f),
            largest_f: largest(&dynamics, mdp, &f),
            start: start(&dynamics, mdp),
            gamma,
            dynamics,
        })
    }

    /// The native task, with all actions or those in `allowed`.
    pub(super) fn problem<'a>(
        &'a self,
        rewards: &'a [f64],
        allowed: Option<&'a [bool]>,
    ) -> Problem<'a> {
        Problem { dynamics: &self.dynamics, rewards, gamma: self.gamma, allowed }
    }

    /// V^π for `rewards`.
    pub(super) fn value(&self, rewards: &[f64], policy: &[usize]) -> Result<Vec<f64>, PlanError> {
        Ok(self.problem(rewards, None).value(Policy::Deterministic(policy))?.v)
    }

    /// The expectation of `v` where episodes start.
    pub(super) fn at_start(&self, v: &[f64]) -> f64 {
        self.start.iter().zip(v).map(|(p, v)| p * v).sum()
    }
}

/// The largest absolute `value` of an outcome that is possible in a state that takes part.
fn largest(dynamics: &Dynamics, mdp: &FiniteMdp, value: impl Fn(usize) -> f64) -> f64 {
    let mut largest = 0.0f64;
    for place in 0..dynamics.len() {
        for a in 0..mdp.n_actions() {
            let range = mdp.range(dynamics.state(place), a);
            let possible = range.filter(|&i| mdp.outcomes()[i].probability != 0.0);
            largest = possible.fold(largest, |m, i| m.max(value(i).abs()));
        }
    }
    largest
}

/// The largest native reward that can come with the end of an episode.
fn goal(dynamics: &Dynamics, mdp: &FiniteMdp) -> f64 {
    let places = 0..dynamics.len();
    let pairs = places.flat_map(|place| (0..mdp.n_actions()).map(move |a| (place, a)));
    pairs
        .flat_map(|(place, a)| mdp.of(dynamics.state(place), a))
        .filter(|o| o.terminated && o.probability > 0.0)
        .fold(f64::NEG_INFINITY, |m, o| m.max(o.reward))
}

/// The initial distribution by place; the probabilities of a model need not add up to 1.
fn start(dynamics: &Dynamics, mdp: &FiniteMdp) -> Vec<f64> {
    let probability = |place| mdp.initial()[dynamics.state(place)].max(0.0);
    let mut start: Vec<f64> = (0..dynamics.len()).map(probability).collect();
    let total: f64 = start.iter().sum();
    if total > 0.0 && total.is_finite() {
        for p in &mut start {
            *p /= total;
        }
    } else {
        // Sampling falls back to state 0, which is the first place then.
        start.fill(0.0);
        start[0] = 1.0;
    }
    start
}
