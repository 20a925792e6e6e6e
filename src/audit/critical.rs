//! How much of a shaping the optimal policy withstands: the largest k for which it is optimal for
//! R + kF.
//!
//! The k for which a policy π is optimal are an interval, as all values are linear in k. From a k
//! beyond its end, the policy π′ that is optimal there gives a smaller one, at which π and π′ draw
//! level in some state; the same from there finds the end after a few turns (Newton's method on a
//! convex function of straight pieces; Dinkelbach 1967).

use serde::Serialize;

use super::gap::{Gap, Scale};
use super::pair::{Pair, Solved, Unsolved};
use crate::learn::planning::{PlanError, Start};
use crate::mdp::Action;

/// Values this close, relative to their size, are level.
const LEVEL: f64 = 1e-11;
/// A policy that withstands this much withstands all but rounding.
const LARGEST: f64 = 1e15;
/// Turns, at most: each finds another policy.
const TURNS: usize = 1_000;

/// How far the added reward can be scaled before something is lost.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Critical {
    /// Below this factor k, what is optimal for R + kF is optimal for R; at k itself there may be
    /// ties with what is not. `None` if for all.
    pub k: Option<f64>,
    /// Whether F, however small, tells actions apart that are equally good for R: nothing is lost
    /// by that, but the greedy sets are smaller.
    pub breaks_ties: bool,
}

impl Pair {
    /// The largest factor of the added reward by which nothing is lost.
    ///
    /// # Errors
    /// If a value is not finite.
    pub fn critical(&self) -> Result<Critical, Unsolved> {
        let (policy, breaks_ties) = self.favourite()?;
        let value =
            Line { at_zero: self.native.optimum.v.clone(), slope: self.value(&self.f, &policy)? };
        let k = if self.favours(&value.slope) {
            None
        } else {
            let last = self.native.optimum.v.clone();
            Search { pair: self, value, policy, last }.run()?
        };
        Ok(Critical { k, breaks_ties })
    }

    /// Of the optimal policies the one that F likes best, and whether F tells them apart: solves for
    /// F alone among the optimal actions.
    fn favourite(&self) -> Result<(Vec<Action>, bool), PlanError> {
        let policy = &self.native.optimum.policy;
        let n_actions = self.dynamics.n_actions();
        let mut optimal = Scale::new(&self.native, 0.0).tied(&self.native.optimum.q, n_actions);
        for (place, a) in policy.iter().enumerate() {
            optimal[place * n_actions + a] = true;
        }
        let zero = vec![0.0; self.dynamics.len()];
        let start = Start::Policy(policy, &zero);
        let optimum = self.problem(&self.f, Some(&optimal)).optimum(start)?;
        let solved = Solved { rewards: Vec::new(), largest: self.largest_f, optimum };
        let scale = Scale::new(&solved, 0.0);
        let rows = solved.optimum.q.chunks_exact(n_actions).zip(optimal.chunks_exact(n_actions));
        let mut apart = false;
        for (row, optimal) in rows {
            let tied = || row.iter().zip(optimal).filter(|(_, optimal)| **optimal).map(|(q, _)| *q);
            let best = tied().fold(f64::NEG_INFINITY, f64::max);
            apart |= tied().any(|q| scale.judge(best - q) == Gap::Real);
        }
        Ok((solved.optimum.policy, apart))
    }

    /// Whether no action is better for F alone than what has the value `v`.
    fn favours(&self, v: &[f64]) -> bool {
        let size = v.iter().fold(self.largest_f, |m, v| m.max(v.abs()));
        let q = self.dynamics.q_from_v(&self.f, self.gamma, v);
        q.iter().enumerate().all(|(i, q)| q - v[i / self.dynamics.n_actions()] <= 1e-10 * size)
    }
}

/// Values as functions of k: `at_zero + k slope`.
struct Line {
    at_zero: Vec<f64>,
    slope: Vec<f64>,
}

/// Whether the policy is beyond what it withstands.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Beyond {
    Not,
    /// It is; some other policy draws level with it at this factor.
    By(f64),
    /// With γ = 1, a loop pays for ever.
    Endless,
}

struct Search<'a> {
    pair: &'a Pair,
    /// Of the policy that is optimal for R.
    value: Line,
    /// The policy found last, to start from.
    policy: Vec<Action>,
    /// Its values.
    last: Vec<f64>,
}

impl Search<'_> {
    /// The end of the interval; `None` if none is found that is not rounding's.
    fn run(&mut self) -> Result<Option<f64>, PlanError> {
        let (mut low, mut high) = (0.0, 1.0);
        let mut found = self.beyond(high)?;
        while found == Beyond::Not {
            (low, high) = (high, 2.0 * high);
            if high > LARGEST {
                return Ok(None);
            }
            found = self.beyond(high)?;
        }
        for _ in 0..TURNS {
            let next = match found {
                Beyond::Not => break,
                Beyond::By(level) => level,
                // Something pays without end: the end of the interval is between.
                Beyond::Endless => 0.5 * (low + high),
            };
            if next >= high * (1.0 - 1e-13) || high - low <= 1e-13 * high {
                break;
            }
            let endless = found == Beyond::Endless;
            found = self.beyond(next)?;
            if endless && found == Beyond::Not {
                (low, found) = (next, Beyond::Endless);
            } else {
                high = next;
            }
        }
        Ok(Some(high))
    }

    fn beyond(&mut self, k: f64) -> Result<Beyond, PlanError> {
        let pair = self.pair;
        let native = &pair.native.rewards;
        let rewards: Vec<f64> = native.iter().zip(&pair.f).map(|(r, f)| r + k * f).collect();
        let start = Start::Policy(&self.policy, &self.last);
        let optimum = match pair.problem(&rewards, None).optimum(start) {
            Ok(optimum) => optimum,
            Err(PlanError::Endless(_)) => return Ok(Beyond::Endless),
            Err(e) => return Err(e),
        };
        (self.policy, self.last) = (optimum.policy, optimum.v);
        let slope = pair.value(&pair.f, &self.policy)?;
        let at_zero = self.last.iter().zip(&slope).map(|(v, slope)| v - k * slope).collect();
        let other = Line { at_zero, slope };
        let own = &self.value;
        let (mut size, mut level) = (pair.native.largest + k * pair.largest_f, f64::INFINITY);
        for (v, slope) in own.at_zero.iter().zip(&own.slope) {
            size = size.max(v.abs() + k * slope.abs());
        }
        for s in 0..own.at_zero.len() {
            let lost = own.at_zero[s] - other.at_zero[s];
            let rise = other.slope[s] - own.slope[s];
            if k * rise - lost > LEVEL * size && rise > 0.0 {
                level = level.min((lost / rise).max(0.0));
            }
        }
        Ok(if level < f64::INFINITY { Beyond::By(level) } else { Beyond::Not })
    }
}
