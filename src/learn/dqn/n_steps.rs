//! Targets that look several rewards ahead (Sutton & Barto 2018, section 7.1; Hessel et al. 2018).

use super::replay::Experience;
use crate::mdp::Action;
use crate::shaping::ActionSet;

/// The steps that are still waiting for rewards.
#[derive(Debug, Clone)]
pub struct NSteps {
    n: usize,
    gamma: f64,
    n_kept: usize,
    /// What is kept of the state of each step, a ring `[n, n_kept]`.
    states: Vec<f32>,
    /// The action, the discounted sum of rewards so far, and what the next one is multiplied by.
    steps: Vec<(Action, f64, f64)>,
    /// The oldest, and how many there are.
    first: usize,
    len: usize,
}

/// The state to which the last step has led.
#[derive(Debug, Clone, Copy)]
pub struct Arrival<'a> {
    /// What is kept of it; anything if it is terminal.
    pub kept: &'a [f32],
    /// What is allowed in it.
    pub allowed: ActionSet,
    /// Whether it is terminal.
    pub terminated: bool,
}

impl NSteps {
    /// Looks `n` rewards ahead.
    ///
    /// # Panics
    /// If `n` is 0.
    pub fn new(n: usize, gamma: f64, n_kept: usize) -> Self {
        assert!(n > 0, "at least one reward");
        let (states, steps) = (vec![0.0; n * n_kept], vec![(0, 0.0, 0.0); n]);
        Self { n, gamma, n_kept, states, steps, first: 0, len: 0 }
    }

    /// Action `a` was played in a state of which `s` is kept and brought `reward`. Every transition
    /// that is complete by that is handed to `each`; all of them if the episode has ended.
    #[inline]
    pub fn step(
        &mut self,
        s: &[f32],
        a: Action,
        reward: f64,
        arrival: Arrival<'_>,
        ended: bool,
        mut each: impl FnMut(&Experience<'_>),
    ) {
        let slot = (self.first + self.len) % self.n;
        self.states[slot * self.n_kept..][..self.n_kept].copy_from_slice(s);
        self.steps[slot] = (a, 0.0, 1.0);
        self.len += 1;
        for i in 0..self.len {
            let (_, sum, discount) = &mut self.steps[(self.first + i) % self.n];
            *sum += *discount * reward;
            *discount *= self.gamma;
        }
        while self.len == self.n || (ended && self.len > 0) {
            let (a, sum, discount) = self.steps[self.first];
            each(&Experience {
                s: &self.states[self.first * self.n_kept..][..self.n_kept],
                a,
                reward: sum as f32,
                discount: if arrival.terminated { 0.0 } else { discount as f32 },
                next: arrival.kept,
                allowed: arrival.allowed,
            });
            self.first = (self.first + 1) % self.n;
            self.len -= 1;
        }
    }
}
