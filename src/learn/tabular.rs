//! What tabular one-step learners share: the table, the step size, the behaviour, and (S, A).

use super::{Behaviour, QTable, Schedule, ScheduleState, Seen};
use crate::mdp::Action;
use crate::mdp::streams::Stream;

/// The temporal-difference error of a one-step target, `R + γ v(S′) − Q(S, A)` (Sutton & Barto
/// 2018, section 6.1); `next_value` is what the algorithm bootstraps from, 0 where S′ is terminal.
#[inline]
pub fn td_error(q: f64, reward: f64, gamma: f64, next_value: f64) -> f64 {
    reward + gamma * next_value - q
}

/// A table of action values being learned, ε-greedy behaviour, and the last state and action.
#[derive(Debug, Clone)]
pub(super) struct Tabular {
    pub(super) q: QTable,
    pub(super) gamma: f64,
    alpha: ScheduleState,
    behaviour: Behaviour,
    s: usize,
    a: Action,
}

impl Tabular {
    pub(super) fn new(
        q: QTable,
        gamma: f64,
        alpha: Schedule,
        epsilon: Schedule,
        stream: Stream,
    ) -> Self {
        let behaviour = Behaviour::new(epsilon, stream);
        Self { q, gamma, alpha: ScheduleState::new(alpha), behaviour, s: 0, a: 0 }
    }

    /// Chooses an action in `s` by the present values.
    #[inline(always)]
    #[expect(
        clippy::inline_always,
        reason = "with so many loops to put it into, the compiler prefers a call, which costs a third of the step"
    )]
    pub(super) fn choose<S: Seen>(&mut self, s: S) -> Action {
        self.behaviour.choose(self.q.row(s.cell()), s)
    }

    /// `a` is what is played in `s`.
    #[inline]
    pub(super) fn play<S: Seen>(&mut self, s: S, a: Action) -> Action {
        (self.s, self.a) = (s.cell(), a);
        a
    }

    /// `Q(S, A) ← Q(S, A) + α δ`.
    #[inline]
    pub(super) fn update(&mut self, reward: f64, next_value: f64) {
        let q = self.q.get_mut(self.s, self.a);
        *q += self.alpha.value() * td_error(*q, reward, self.gamma, next_value);
        self.alpha.step();
    }

    pub(super) fn end_episode(&mut self) {
        self.alpha.end_episode();
        self.behaviour.end_episode();
    }

    pub(super) fn epsilon(&self) -> f64 {
        self.behaviour.epsilon()
    }
}
