//! What these agents share: the table, the step size, the behaviour, and (S, A).

use crate::learn::{
    AlphaSource, Behaviour, EpsilonGreedy, Exploration, Explore, QTable, Rate, Schedule,
    ScheduleState, Seen, StepSize,
};
use crate::mdp::Action;
use crate::mdp::streams::Stream;

/// The temporal-difference error of a one-step target, `R + γ v(S′) − Q(S, A)` (Sutton & Barto
/// 2018, section 6.1); `next_value` is what the algorithm bootstraps from, 0 where S′ is terminal.
#[inline]
pub fn td_error(q: f64, reward: f64, gamma: f64, next_value: f64) -> f64 {
    reward + gamma * next_value - q
}

/// A table of action values being learned, a behaviour policy, and the last state and action.
#[derive(Debug, Clone)]
pub struct Tabular<B = Behaviour, A = StepSize> {
    pub(super) q: QTable,
    pub(super) gamma: f64,
    pub(super) alpha: A,
    pub(super) behaviour: B,
    pub(super) s: usize,
    pub(super) a: Action,
}

impl Tabular<EpsilonGreedy, ScheduleState> {
    /// ε-greedy, with the same step size for every pair: the common case, compiled by itself.
    pub fn scheduled(
        q: QTable,
        gamma: f64,
        alpha: Schedule,
        epsilon: Schedule,
        stream: Stream,
    ) -> Self {
        let behaviour = EpsilonGreedy::new(epsilon, stream);
        Self { q, gamma, alpha: ScheduleState::new(alpha), behaviour, s: 0, a: 0 }
    }
}

impl Tabular {
    /// With any step size and behaviour; `epsilon` is of use to ε-greedy behaviour only.
    pub fn new(
        q: QTable,
        gamma: f64,
        alpha: AlphaSource,
        (exploration, epsilon): (Exploration, Schedule),
        stream: Stream,
    ) -> Self {
        let shape = [q.n_states(), q.n_actions()];
        let behaviour = Behaviour::new(exploration, epsilon, shape, stream);
        let alpha = StepSize::new(alpha, q.values().len());
        Self { q, gamma, alpha, behaviour, s: 0, a: 0 }
    }
}

impl<B: Explore, A: Rate> Tabular<B, A> {
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
        self.behaviour.played(self.s, a);
        a
    }

    /// `Q(S, A) ← Q(S, A) + α δ`.
    #[inline]
    pub(super) fn update(&mut self, reward: f64, next_value: f64) {
        let alpha = self.alpha.visit(self.q.pair(self.s, self.a));
        let q = self.q.get_mut(self.s, self.a);
        *q += alpha * td_error(*q, reward, self.gamma, next_value);
    }

    pub(super) fn end_episode(&mut self) {
        self.alpha.end_episode();
        self.behaviour.end_episode();
    }
}

/// Implements [`Agent`](crate::learn::Agent) for an agent whose [`Tabular`] is the field `$table`.
macro_rules! agent_of_table {
    ($agent:ty, $table:tt $(, $($generics:tt)+)?) => {
        impl $(<$($generics)+>)? $crate::learn::Agent for $agent {
            fn gamma(&self) -> f64 {
                self.$table.gamma
            }

            fn bootstraps_when_truncated(&self) -> bool {
                true
            }

            fn epsilon(&self) -> f64 {
                $crate::learn::Explore::epsilon(&self.$table.behaviour)
            }

            fn q(&self) -> Option<&$crate::learn::QTable> {
                Some(&self.$table.q)
            }
        }
    };
}
pub(super) use agent_of_table;
