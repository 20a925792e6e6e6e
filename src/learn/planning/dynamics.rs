//! The transition probabilities of a model, packed for solving.

use super::PlanError;
use super::chain::Chain;
use super::evaluation::{Policy, PolicyValue};
use crate::mdp::FiniteMdp;

/// Which states of a model take part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Over {
    /// All, whether an episode can be in them or not.
    Every,
    /// Those that an episode can be in. Tables hold junk elsewhere, which may have no solution.
    Reachable,
}

/// The dynamics of a [`FiniteMdp`] without its rewards: many tasks on one model share them.
///
/// States are numbered anew, without gaps, in the model's order. Shapes: there are
/// `len() * n_actions()` pairs (s, a), row-major; the next states of pair `i` are
/// `next[offsets[i]..offsets[i + 1]]`, each once. What ends the episode is not in the list.
#[derive(Debug, Clone, PartialEq)]
pub struct Dynamics {
    n_actions: usize,
    states: Vec<u32>,
    places: Vec<u32>,
    offsets: Vec<u32>,
    next: Vec<u32>,
    probabilities: Vec<f64>,
    ends: Vec<bool>,
}

/// The transitions of [`Dynamics`] backwards.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sources {
    offsets: Vec<u32>,
    pairs: Vec<u32>,
}

impl Sources {
    /// The pairs that may lead to `place`, in order.
    pub fn of(&self, place: usize) -> &[u32] {
        &self.pairs[self.offsets[place] as usize..self.offsets[place + 1] as usize]
    }
}

/// The place of a state that takes no part.
const NONE: u32 = u32::MAX;

impl Dynamics {
    /// Packs the transitions of positive probability (and those whose probability is none).
    pub fn new(mdp: &FiniteMdp, over: Over) -> Self {
        let taking_part = match over {
            Over::Every => vec![true; mdp.n_states()],
            Over::Reachable => mdp.reachable(),
        };
        let states: Vec<u32> =
            (0..mdp.n_states()).filter(|&s| taking_part[s]).map(|s| s as u32).collect();
        let mut places = vec![NONE; mdp.n_states()];
        for (place, &s) in states.iter().enumerate() {
            places[s as usize] = place as u32;
        }
        let pairs = states.len() * mdp.n_actions();
        let (mut offsets, mut ends) = (Vec::with_capacity(pairs + 1), Vec::with_capacity(pairs));
        let (mut next, mut probabilities) = (Vec::new(), Vec::<f64>::new());
        // Where in the present list a state stands: outcomes that lead to the same are one.
        let mut listed = vec![NONE; states.len()];
        offsets.push(0);
        for &s in &states {
            for a in 0..mdp.n_actions() {
                let first = next.len();
                let mut may_end = false;
                for o in mdp.of(s as usize, a) {
                    let place = places[o.next_state as usize];
                    if o.terminated {
                        may_end |= o.probability > 0.0;
                    } else if o.probability != 0.0 && place != NONE {
                        let at = listed[place as usize];
                        if at != NONE && at as usize >= first {
                            probabilities[at as usize] += o.probability;
                        } else {
                            listed[place as usize] = next.len() as u32;
                            next.push(place);
                            probabilities.push(o.probability);
                        }
                    }
                }
                ends.push(may_end);
                offsets.push(next.len() as u32);
            }
        }
        Self { n_actions: mdp.n_actions(), states, places, offsets, next, probabilities, ends }
    }

    /// Number of states that take part.
    pub fn len(&self) -> usize {
        self.states.len()
    }

    /// Whether no state takes part: nowhere an episode could start.
    pub fn is_empty(&self) -> bool {
        self.states.is_empty()
    }

    /// Number of actions.
    pub fn n_actions(&self) -> usize {
        self.n_actions
    }

    /// The state of the model at `place`.
    #[inline]
    pub fn state(&self, place: usize) -> usize {
        self.states[place] as usize
    }

    /// Number of states of the model, taking part or not.
    pub fn n_model_states(&self) -> usize {
        self.places.len()
    }

    /// The place of the model's state `s`; `None` if it takes no part.
    #[inline]
    pub fn place(&self, s: usize) -> Option<usize> {
        (self.places[s] != NONE).then_some(self.places[s] as usize)
    }

    /// The places that pair `i` = `place * n_actions + a` may lead to, and with what probability.
    #[inline]
    pub fn next(&self, i: usize) -> (&[u32], &[f64]) {
        let range = self.offsets[i] as usize..self.offsets[i + 1] as usize;
        (&self.next[range.clone()], &self.probabilities[range])
    }

    /// Whether pair `i` may end the episode.
    #[inline]
    pub fn ends(&self, i: usize) -> bool {
        self.ends[i]
    }

    /// The pairs that may lead to each state.
    pub fn sources(&self) -> Sources {
        let mut offsets = vec![0u32; self.len() + 2];
        for &to in &self.next {
            offsets[to as usize + 2] += 1;
        }
        for s in 2..offsets.len() {
            offsets[s] += offsets[s - 1];
        }
        let mut pairs = vec![0u32; self.next.len()];
        for i in 0..self.len() * self.n_actions {
            for &to in self.next(i).0 {
                let at = &mut offsets[to as usize + 1];
                pairs[*at as usize] = i as u32;
                *at += 1;
            }
        }
        Sources { offsets, pairs }
    }

    /// The expectation of `per_outcome`, a function of the index into [`FiniteMdp::outcomes`] of
    /// the `mdp` that was packed: one number per pair.
    pub fn expect(&self, mdp: &FiniteMdp, per_outcome: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut expected = Vec::with_capacity(self.len() * self.n_actions);
        for &s in &self.states {
            for a in 0..self.n_actions {
                let outcomes = mdp.range(s as usize, a).zip(mdp.of(s as usize, a));
                let possible = outcomes.filter(|(_, o)| o.probability != 0.0);
                expected.push(possible.map(|(i, o)| o.probability * per_outcome(i)).sum());
            }
        }
        expected
    }

    /// The expected rewards of the `mdp` that was packed, one per pair.
    pub fn rewards(&self, mdp: &FiniteMdp) -> Vec<f64> {
        self.expect(mdp, |i| mdp.outcomes()[i].reward)
    }

    /// `r + γ Σ p V(s′)` of pair `i`.
    #[inline]
    pub fn backup(&self, rewards: &[f64], gamma: f64, v: &[f64], i: usize) -> f64 {
        let (next, probabilities) = self.next(i);
        let mut sum = 0.0;
        for (&to, p) in next.iter().zip(probabilities) {
            sum += p * v[to as usize];
        }
        rewards[i] + gamma * sum
    }

    /// The same of every pair: Q from V.
    pub fn q_from_v(&self, rewards: &[f64], gamma: f64, v: &[f64]) -> Vec<f64> {
        (0..rewards.len()).map(|i| self.backup(rewards, gamma, v, i)).collect()
    }

    /// The value of `policy` (by place) for `rewards` (one per pair).
    ///
    /// # Errors
    /// If γ = 1 and the policy may never end, or a value is not finite.
    pub fn value(
        &self,
        rewards: &[f64],
        gamma: f64,
        policy: Policy<'_>,
    ) -> Result<PolicyValue, PlanError> {
        Chain::new(self, rewards, gamma, policy)
            .solve(None)
            .map_err(|e| e.of_model(|place| self.state(place)))
    }

    /// The sets of places that `policy` (by place) never leaves once it is in one, and in which it
    /// comes everywhere again and again; in order.
    pub fn recurrent(&self, policy: Policy<'_>) -> Vec<Vec<usize>> {
        let none = vec![0.0; self.len() * self.n_actions];
        Chain::new(self, &none, 1.0, policy).recurrent()
    }

    /// The average of `rewards` (one per pair) per step of `policy` in one of its recurrent sets.
    ///
    /// # Errors
    /// If it cannot be computed.
    pub fn average(
        &self,
        rewards: &[f64],
        policy: Policy<'_>,
        recurrent: &[usize],
    ) -> Result<f64, PlanError> {
        Chain::new(self, rewards, 1.0, policy).average(recurrent)
    }

    /// The probability that an episode under `policy` (by place) ends in a certain way, where
    /// `ending` (one per pair) is the probability that it does so in this very step. Episodes that
    /// go on for ever do not end.
    ///
    /// # Errors
    /// If a probability is not finite.
    pub fn chances(&self, ending: &[f64], policy: Policy<'_>) -> Result<Vec<f64>, PlanError> {
        Chain::new(self, ending, 1.0, policy)
            .solve_ending()
            .map_err(|e| e.of_model(|place| self.state(place)))
    }

    /// One value per state of the model from one per place; 0 for states that take no part.
    pub fn unpack(&self, values: &[f64]) -> Vec<f64> {
        let mut unpacked = vec![0.0; self.places.len()];
        for (&s, &value) in self.states.iter().zip(values) {
            unpacked[s as usize] = value;
        }
        unpacked
    }
}
