//! The loop that an agent exploits instead of doing its task.
//!
//! A cycle with positive shaping proves nothing: a correct potential has such cycles too, and going
//! round is still worse than going on. What is reported is a loop that a policy which is optimal for
//! the learned reward never leaves, where that is worth more than the truly optimal policy (both in
//! learned reward), and worth less in native reward.

use serde::Serialize;

use super::cycle::Cycle;
use super::gap::Scale;
use super::pair::{Pair, Unsolved};
use super::policy_change::{Extreme, PolicyChange};
use crate::learn::planning::Policy;

/// A loop that pays better than the task.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Hacking {
    /// The loop: of several, the one that episodes are likeliest to come to.
    pub cycle: Cycle,
    /// How many such loops the policy has.
    pub loops: usize,
    /// The probability that an episode comes to one of them under that policy.
    pub reached: f64,
    /// The value of going round for ever, from the loop's first state, in learned reward.
    pub learned: f64,
    /// The value of the truly optimal policy there, in learned reward.
    pub learned_optimal: f64,
    /// The value of going round for ever there, in native reward.
    pub native: f64,
    /// The value of the truly optimal policy there, in native reward.
    pub native_optimal: f64,
}

impl Pair {
    /// The loop that pays better than the task, if there is one, where `change` is what
    /// [`Self::policy_change`] said.
    ///
    /// # Errors
    /// If a value is not finite.
    pub fn hacking(&self, change: &PolicyChange) -> Result<Option<Hacking>, Unsolved> {
        let Extreme { policy, v } = &change.extreme;
        let mut sets = self.dynamics.recurrent(Policy::Deterministic(policy));
        if sets.is_empty() {
            return Ok(None);
        }
        let learned = self.value(&self.learned.rewards, policy)?;
        let learned_optimal = self.value(&self.learned.rewards, &self.native.optimum.policy)?;
        let native_optimal = &self.native.optimum.v;
        let real = Scale::new(&self.learned, 0.0).real();
        let real_native = Scale::new(&self.native, 0.0).real();
        sets.retain(|set| {
            let s = set[0];
            learned[s] - learned_optimal[s] > real && native_optimal[s] - v[s] > real_native
        });
        let (mut likeliest, mut most) = (None, -1.0);
        for set in &sets {
            let reached = self.chance_to_reach(policy, set)?;
            if reached > most {
                (likeliest, most) = (Some(set), reached);
            }
        }
        let Some(set) = likeliest else { return Ok(None) };
        let s = set[0];
        Ok(Some(Hacking {
            cycle: Cycle::new(
                &self.dynamics,
                [&self.learned.rewards, &self.native.rewards],
                policy,
                set,
            )?,
            loops: sets.len(),
            reached: self.chance_to_reach(policy, &sets.concat())?,
            learned: learned[s],
            learned_optimal: learned_optimal[s],
            native: v[s],
            native_optimal: native_optimal[s],
        }))
    }

    /// The probability that an episode comes to one of the states of recurrent sets.
    fn chance_to_reach(&self, policy: &[usize], set: &[usize]) -> Result<f64, Unsolved> {
        let mut inside = vec![false; self.dynamics.len()];
        for &place in set {
            inside[place] = true;
        }
        // Stepping in is an ending; whoever is in stays, and steps in no more.
        let n_actions = self.dynamics.n_actions();
        let mut entering = vec![0.0; self.dynamics.len() * n_actions];
        for (i, entering) in entering.iter_mut().enumerate() {
            if !inside[i / n_actions] {
                let (next, probabilities) = self.dynamics.next(i);
                let into = next.iter().zip(probabilities).filter(|(to, _)| inside[**to as usize]);
                *entering = into.map(|(_, p)| p).sum();
            }
        }
        let chances = self.dynamics.chances(&entering, Policy::Deterministic(policy))?;
        let starts = set.iter().map(|&place| self.start[place]).sum::<f64>();
        Ok((starts + self.at_start(&chances)).min(1.0))
    }
}
