//! A potential that is the learner's own estimate (Adamczyk, Makarenko, Tiomkin & Kulkarni 2025).
//!
//! `Φ_n(s) = η V_n(s)` with `V_n(s) = max_a Q_n(s, a)`: before its n-th update the learner is paid
//! `γ Φ_n(S′) − Φ_n(S)`, with Φ = 0 where S′ is terminal. Both terms speak of the same n, so that
//! nothing telescopes, but where the values settle, they settle at
//! `Q − η / (1 + η) · V`, which has the greedy actions of Q.
//!
//! With `x = α (1 + η)`, an error of the state values that all successors share is multiplied by
//! `1 − x + γ x` in an update, one that changes its sign from state to state by `1 − x − γ x`: both
//! shrink if and only if `0 < x < 2 / (1 + γ)`.

use super::greedy::max_allowed;
use super::registry::TabularAgent;
use super::{Agent, Last, Learn, QTable, Seen};
use crate::mdp::Action;
use crate::shaping::potential_term;

/// The bound below which `α (1 + η)` must stay.
pub fn stability_bound(gamma: f64) -> f64 {
    2.0 / (1.0 + gamma)
}

/// A one-step learner of action values with `Φ = η V`.
pub struct Bootstrapped {
    agent: Box<dyn TabularAgent>,
    eta: f64,
    /// `V_n(S)`.
    v: f64,
    /// The sum of the terms over the episode.
    shaping: f64,
}

impl Bootstrapped {
    /// `agent`, which keeps a table of action values, shaped by η times its own state values.
    pub fn new(agent: Box<dyn TabularAgent>, eta: f64) -> Self {
        Self { agent, eta, v: 0.0, shaping: 0.0 }
    }

    fn value<S: Seen>(&self, s: S) -> f64 {
        let q = self.agent.q().expect("one-step learners keep a table");
        max_allowed(q.row(s.cell()), s)
    }

    fn term(&mut self, v_next: f64) -> f64 {
        let f = self.eta * potential_term(self.agent.gamma(), self.v, v_next);
        self.shaping += f;
        f
    }
}

impl Agent for Bootstrapped {
    fn gamma(&self) -> f64 {
        self.agent.gamma()
    }

    fn bootstraps_when_truncated(&self) -> bool {
        self.agent.bootstraps_when_truncated()
    }

    fn epsilon(&self) -> f64 {
        self.agent.epsilon()
    }

    fn q(&self) -> Option<&QTable> {
        self.agent.q()
    }

    fn shaping(&self) -> f64 {
        self.shaping + self.agent.shaping()
    }
}

impl<S: Seen> Learn<S> for Bootstrapped
where
    Box<dyn TabularAgent>: Learn<S>,
{
    fn begin(&mut self, s: S) -> Action {
        (self.v, self.shaping) = (self.value(s), 0.0);
        self.agent.begin(s)
    }

    fn step(&mut self, reward: f64, next: S) -> Action {
        let f = self.term(self.value(next));
        let a = self.agent.step(reward + f, next);
        // After the update: the next one's n.
        self.v = self.value(next);
        a
    }

    fn end(&mut self, reward: f64, last: Last<S>) {
        let v_next = match last {
            Last::Truncated(next) if self.bootstraps_when_truncated() => self.value(next),
            _ => 0.0,
        };
        let f = self.term(v_next);
        self.agent.end(reward + f, last);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::{QLearning, Schedule};
    use crate::mdp::streams::Stream;

    #[test]
    fn a_step_by_hand() {
        let q = QTable::from_values(2, vec![0.0, 1.0, 4.0, 2.0]);
        let (alpha, epsilon) = (Schedule::constant(0.5), Schedule::constant(0.0));
        let learner = QLearning::new(q, 0.9, alpha, epsilon, Stream::new(0, "test"));
        let mut agent = Bootstrapped::new(Box::new(learner), 2.0);
        assert_eq!(agent.begin(0usize), 1);
        // V = 1 and 4: 2 (0.9 * 4 - 1) = 5.2; Q = 1 + 0.5 (10 + 5.2 + 0.9 * 4 - 1).
        assert_eq!(agent.step(10.0, 1usize), 0);
        let f = 2.0 * (0.9 * 4.0 - 1.0);
        assert_eq!(agent.shaping(), f);
        assert_eq!(agent.q().unwrap().get(0, 1), 1.0 + 0.5 * (10.0 + f + 0.9 * 4.0 - 1.0));
        // V(1) = 4 still; nothing beyond the end: -8.
        agent.end(0.0, Last::<usize>::Terminated);
        assert_eq!(agent.q().unwrap().get(1, 0), 4.0 + 0.5 * (-8.0 - 4.0));
    }

    #[test]
    fn both_terms_speak_of_the_values_before_the_update() {
        let q = QTable::from_values(1, vec![2.0]);
        let (alpha, epsilon) = (Schedule::constant(0.5), Schedule::constant(0.0));
        let learner = QLearning::new(q, 0.5, alpha, epsilon, Stream::new(0, "test"));
        let mut agent = Bootstrapped::new(Box::new(learner), 1.0);
        agent.begin(0usize);
        // Q: 2 + 0.5 (0.5 * 2 - 2 + 0.5 * 2 - 2) = 1, then 1 + 0.5 (0.5 - 1 + 0.5 - 1) = 0.5.
        agent.step(0.0, 0usize);
        assert_eq!(agent.q().unwrap().get(0, 0), 1.0);
        agent.step(0.0, 0usize);
        assert_eq!(agent.q().unwrap().get(0, 0), 0.5);
    }
}
