//! Upper confidence bounds as a behaviour policy (Auer et al. 2002; Sutton & Barto 2018, section
//! 2.7, per state).
//!
//! `A = argmax_a [Q(s, a) + c √(ln N(s) / N(s, a))]`, N counting what was played.
//!
//! Deviation 1: the bonus is added to whatever Q is learned, with a `c` in Q's units; the bound of
//! the bandit problem does not carry over to values that are still being learned.

use super::Seen;
use super::behaviour::Explore;
use super::greedy::argmax_allowed;
use crate::mdp::Action;
use crate::mdp::math::ln;

/// UCB behaviour. Draws nothing.
#[derive(Debug, Clone)]
pub struct Ucb {
    c: f64,
    n_actions: usize,
    /// N(s, a), shape `[n_states, n_actions]`.
    tries: Vec<u32>,
    /// N(s), shape `[n_states]`.
    visits: Vec<u32>,
    /// Value and bonus of each action: scratch space.
    bounds: Vec<f64>,
}

impl Ucb {
    /// For a table of `n_states` and `n_actions`; `c` is in units of the values.
    pub fn new(c: f64, n_states: usize, n_actions: usize) -> Self {
        Self {
            c,
            n_actions,
            tries: vec![0; n_states * n_actions],
            visits: vec![0; n_states],
            bounds: vec![0.0; n_actions],
        }
    }
}

impl Explore for Ucb {
    #[inline]
    fn choose<S: Seen>(&mut self, q: &[f64], s: S) -> Action {
        let tries = &self.tries[s.cell() * self.n_actions..][..self.n_actions];
        if let Some(untried) = (0..self.n_actions).find(|&a| tries[a] == 0 && s.allows(a)) {
            return untried;
        }
        let log = ln(f64::from(self.visits[s.cell()]));
        for ((bound, &value), &n) in self.bounds.iter_mut().zip(q).zip(tries) {
            // An action that is refused may be untried: its bound is not looked at.
            *bound = value + self.c * (log / f64::from(n)).sqrt();
        }
        argmax_allowed(&self.bounds, s)
    }

    #[inline]
    fn played(&mut self, s: usize, a: Action) {
        self.tries[s * self.n_actions + a] += 1;
        self.visits[s] += 1;
    }

    #[inline]
    fn mean<S: Seen>(&mut self, q: &[f64], s: S, x: &[f64]) -> f64 {
        x[self.choose(q, s)]
    }

    fn epsilon(&self) -> f64 {
        0.0
    }

    fn end_episode(&mut self) {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shaping::{ActionSet, Shielded};

    #[test]
    fn every_action_is_tried_first_and_then_the_bounds_decide() {
        let q = [5.0, 1.0, 0.0];
        let mut policy = Ucb::new(2.0, 2, 3);
        let play = |policy: &mut Ucb| {
            let a = policy.choose(&q, 1);
            policy.played(1, a);
            a
        };
        assert_eq!([play(&mut policy), play(&mut policy), play(&mut policy)], [0, 1, 2]);
        // N = 3, ln 3 = 1.0986, bonus 2 * 1.048 for each: 7.10, 3.10, 2.10.
        assert_eq!(play(&mut policy), 0);
        // It takes many tries of the first until the second's bonus 2 √ln N makes up for 4: with
        // n tries of it, 5 + 2 √(ln (n + 2) / n) < 1 + 2 √ln (n + 2).
        let mut n = 2;
        while play(&mut policy) == 0 {
            n += 1;
        }
        let bounds =
            |n: f64| (5.0 + 2.0 * (ln(n + 2.0) / n).sqrt(), 1.0 + 2.0 * ln(n + 2.0).sqrt());
        let (first, second) = bounds(f64::from(n));
        assert!(first < second, "{n}");
        let (first, second) = bounds(f64::from(n - 1));
        assert!(first > second, "{n}");
    }

    #[test]
    fn refused_actions_are_never_tried() {
        let mut policy = Ucb::new(2.0, 1, 3);
        let s = Shielded { cell: 0, allowed: ActionSet(0b110) };
        for _ in 0..100 {
            let a = policy.choose(&[9.0, 0.0, 0.0], s);
            assert_ne!(a, 0);
            policy.played(0, a);
        }
    }
}
