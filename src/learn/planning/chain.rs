//! The Markov chain of a policy, and the value of its states: `(I − γ P_π) V = R_π`.
//!
//! The equations are solved one strongly connected component after the other, each when all that it
//! leads to is known: a state that never comes back to itself takes one line, and rounding errors do
//! not travel further than the dynamics do.

use super::PlanError;
use super::components::Components;
use super::dynamics::Dynamics;
use super::evaluation::{Policy, PolicyValue};
use super::linear::{Precision, System};

/// Rewards and discounted transition probabilities under a policy.
pub(super) struct Chain {
    gamma: f64,
    offsets: Vec<u32>,
    next: Vec<u32>,
    /// γ p, one per entry of `next`.
    weights: Vec<f64>,
    /// One per state.
    rewards: Vec<f64>,
    /// Whether an episode may end in the step from a state.
    ends: Vec<bool>,
}

impl Chain {
    pub(super) fn new(
        dynamics: &Dynamics,
        rewards: &[f64],
        gamma: f64,
        policy: Policy<'_>,
    ) -> Self {
        let n_actions = dynamics.n_actions();
        let mut chain = Self {
            gamma,
            offsets: vec![0],
            next: Vec::new(),
            weights: Vec::new(),
            rewards: Vec::with_capacity(dynamics.len()),
            ends: Vec::with_capacity(dynamics.len()),
        };
        // Where in the present list a state stands.
        let mut listed = vec![usize::MAX; dynamics.len()];
        for s in 0..dynamics.len() {
            let first = chain.next.len();
            let (mut reward, mut ends) = (0.0, false);
            for a in 0..n_actions {
                let share = policy.share(s, a, n_actions);
                if share == 0.0 {
                    continue;
                }
                let i = s * n_actions + a;
                reward += share * rewards[i];
                ends |= dynamics.ends(i);
                let (next, probabilities) = dynamics.next(i);
                for (&to, p) in next.iter().zip(probabilities) {
                    let (at, weight) = (listed[to as usize], gamma * share * p);
                    if at != usize::MAX && at >= first {
                        chain.weights[at] += weight;
                    } else {
                        listed[to as usize] = chain.next.len();
                        chain.next.push(to);
                        chain.weights.push(weight);
                    }
                }
            }
            chain.offsets.push(chain.next.len() as u32);
            chain.rewards.push(reward);
            chain.ends.push(ends);
        }
        chain
    }

    fn len(&self) -> usize {
        self.rewards.len()
    }

    fn next(&self, s: usize) -> &[u32] {
        &self.next[self.offsets[s] as usize..self.offsets[s + 1] as usize]
    }

    /// The next states of `s` with their discounted probabilities.
    fn entries(&self, s: usize) -> impl Iterator<Item = (usize, f64)> {
        let range = self.offsets[s] as usize..self.offsets[s + 1] as usize;
        let next = self.next[range.clone()].iter().map(|&to| to as usize);
        next.zip(self.weights[range].iter().copied())
    }

    /// Its strongly connected components.
    pub(super) fn components(&self) -> Components {
        Components::new(self.len(), |s| self.next(s))
    }

    /// Whether nothing leads out of component `c`, not even the end of the episode.
    pub(super) fn closed(&self, components: &Components, c: usize) -> bool {
        components.nodes(c).iter().all(|&s| {
            let s = s as usize;
            !self.ends[s] && self.next(s).iter().all(|&to| components.of(to as usize) == c)
        })
    }

    /// The values to rounding level, with a bound on their error. `guess` speeds the search up.
    pub(super) fn solve(&self, guess: Option<&[f64]>) -> Result<PolicyValue, PlanError> {
        let components = self.components();
        self.refuse_endless(&components)?;
        let v = self.values(&components, &self.rewards, guess, Precision::Rounding)?;
        let bound = self.bound(&components, &v)?;
        Ok(PolicyValue { v, bound })
    }

    /// The values, about as good as improving the policy needs.
    pub(super) fn solve_roughly(&self, guess: &[f64]) -> Result<Vec<f64>, PlanError> {
        let components = self.components();
        self.refuse_endless(&components)?;
        self.values(&components, &self.rewards, Some(guess), Precision::Rough)
    }

    /// The same with the value 0 for states from which the episode never ends: the probability of
    /// an end, for the probability of ending in this step as the reward.
    pub(super) fn solve_ending(&self) -> Result<Vec<f64>, PlanError> {
        self.values(&self.components(), &self.rewards, None, Precision::Rounding)
    }

    /// The closed components, in order.
    pub(super) fn recurrent(&self) -> Vec<Vec<usize>> {
        let components = self.components();
        let closed = (0..components.len()).filter(|&c| self.closed(&components, c));
        let mut sets: Vec<Vec<usize>> = closed
            .map(|c| {
                let mut set: Vec<usize> = components.nodes(c).iter().map(|&s| s as usize).collect();
                set.sort_unstable();
                set
            })
            .collect();
        sets.sort_unstable();
        sets
    }

    /// The average reward per step in a closed component: what is collected until the first state
    /// is met again, by the time that takes (renewal reward theorem).
    pub(super) fn average(&self, closed: &[usize]) -> Result<f64, PlanError> {
        let mut position = vec![0; self.len()];
        for (i, &s) in closed.iter().enumerate() {
            position[s] = i;
        }
        let mut totals = [0.0; 2];
        for (total, reward) in totals.iter_mut().zip([None, Some(1.0)]) {
            let mut system = System::new(closed.len());
            for &s in closed {
                let entries = self.entries(s).map(|(to, p)| (position[to], p));
                entries.filter(|(to, _)| *to != 0).for_each(|(to, p)| system.push(to, p));
                system.end_row(reward.unwrap_or(self.rewards[s]));
            }
            let mut x = vec![0.0; closed.len()];
            if !system.solve(&mut x, Precision::Rounding) {
                return Err(PlanError::NotSolved(closed.len()));
            }
            *total = x[0];
        }
        let average = totals[0] / totals[1];
        if average.is_finite() { Ok(average) } else { Err(PlanError::NotFinite) }
    }

    /// Without discounting a policy that may never end has no value.
    fn refuse_endless(&self, components: &Components) -> Result<(), PlanError> {
        if self.gamma < 1.0 {
            return Ok(());
        }
        match (0..components.len()).find(|&c| self.closed(components, c)) {
            Some(c) => {
                Err(PlanError::Endless(components.nodes(c).iter().map(|&s| s as usize).collect()))
            }
            None => Ok(()),
        }
    }

    fn values(
        &self,
        components: &Components,
        rewards: &[f64],
        guess: Option<&[f64]>,
        precision: Precision,
    ) -> Result<Vec<f64>, PlanError> {
        let mut v = guess.map_or_else(|| vec![0.0; self.len()], <[f64]>::to_vec);
        let mut position = vec![0; self.len()];
        for (c, nodes) in components.iter().enumerate() {
            if self.gamma == 1.0 && self.closed(components, c) {
                for &s in nodes {
                    v[s as usize] = 0.0;
                }
                continue;
            }
            let inside = |to: usize| components.of(to) == c;
            if let &[s] = nodes {
                let s = s as usize;
                let (mut known, mut stay) = (rewards[s], 0.0);
                for (to, weight) in self.entries(s) {
                    if to == s {
                        stay += weight;
                    } else {
                        known += weight * v[to];
                    }
                }
                v[s] = known / (1.0 - stay);
                continue;
            }
            for (i, &s) in nodes.iter().enumerate() {
                position[s as usize] = i;
            }
            let mut system = System::new(nodes.len());
            let mut x = Vec::with_capacity(nodes.len());
            for &s in nodes {
                let s = s as usize;
                let mut known = rewards[s];
                for (to, weight) in self.entries(s) {
                    if inside(to) {
                        system.push(position[to], weight);
                    } else {
                        known += weight * v[to];
                    }
                }
                system.end_row(known);
                x.push(v[s]);
            }
            if !system.solve(&mut x, precision) {
                return Err(PlanError::NotSolved(nodes.len()));
            }
            for (&s, x) in nodes.iter().zip(x) {
                v[s as usize] = x;
            }
        }
        if v.iter().all(|x| x.is_finite()) { Ok(v) } else { Err(PlanError::NotFinite) }
    }

    /// How far `v` may be from the solution, given how far it is from solving the equations:
    /// `‖V − v‖ ≤ ‖(I − γP)⁻¹‖ ‖r + γPv − v‖` in the maximum norm. The matrix has no negative
    /// entries, its norm is the largest expected discounted number of steps: at most `1 / (1 − γ)`.
    fn bound(&self, components: &Components, v: &[f64]) -> Result<f64, PlanError> {
        let mut residual = 0.0f64;
        for s in 0..self.len() {
            let (mut sum, mut size) = (self.rewards[s] - v[s], self.rewards[s].abs() + v[s].abs());
            let mut terms = 2.0;
            for (to, weight) in self.entries(s) {
                sum += weight * v[to];
                size += (weight * v[to]).abs();
                terms += 1.0;
            }
            residual = residual.max(sum.abs() + terms * f64::EPSILON * size);
        }
        let steps = if self.gamma < 1.0 {
            1.0 / (1.0 - self.gamma)
        } else {
            let ones = vec![1.0; self.len()];
            let steps = self.values(components, &ones, None, Precision::Rounding)?;
            steps.into_iter().fold(0.0, f64::max)
        };
        Ok(residual * steps)
    }
}
