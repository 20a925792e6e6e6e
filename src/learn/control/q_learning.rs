//! Q-learning (Watkins 1989; Sutton & Barto 2018, section 6.5).
//!
//! `Q(S, A) ← Q(S, A) + α [R + γ max_a Q(S′, a) − Q(S, A)]`
//!
//! The book's order: choose A from S, observe R and S′, update, and only then choose the next
//! action, from the updated values.

use super::Tabular;
use super::tabular::agent_of_table;
use crate::learn::{
    EpsilonGreedy, Explore, Last, Learn, QTable, Rate, Schedule, ScheduleState, Seen, max_allowed,
};
use crate::mdp::Action;
use crate::mdp::streams::Stream;

/// Tabular Q-learning, off-policy; ε-greedy unless the behaviour says otherwise.
#[derive(Debug, Clone)]
pub struct QLearning<B = EpsilonGreedy, A = ScheduleState>(Tabular<B, A>);

impl QLearning {
    /// A learner with the table `q`; exploration draws from `stream`.
    pub fn new(q: QTable, gamma: f64, alpha: Schedule, epsilon: Schedule, stream: Stream) -> Self {
        Self(Tabular::scheduled(q, gamma, alpha, epsilon, stream))
    }
}

impl<B: Explore, A: Rate> QLearning<B, A> {
    /// A learner with this table and behaviour.
    pub fn of(table: Tabular<B, A>) -> Self {
        Self(table)
    }
}

agent_of_table!(QLearning<B, A>, 0, B: Explore, A: Rate);

impl<S: Seen, B: Explore, A: Rate> Learn<S> for QLearning<B, A> {
    #[inline]
    fn begin(&mut self, s: S) -> Action {
        let a = self.0.choose(s);
        self.0.play(s, a)
    }

    #[inline(always)]
    #[expect(
        clippy::inline_always,
        reason = "with so many loops to put it into, the compiler prefers a call, which costs a third of the step"
    )]
    fn step(&mut self, reward: f64, next: S) -> Action {
        let max_next = max_allowed(self.0.q.row(next.cell()), next);
        self.0.update(reward, max_next);
        self.begin(next)
    }

    fn end(&mut self, reward: f64, last: Last<S>) {
        let max_next = match last {
            Last::Terminated => 0.0,
            Last::Truncated(next) => max_allowed(self.0.q.row(next.cell()), next),
        };
        self.0.update(reward, max_next);
        self.0.end_episode();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn greedy_learner() -> QLearning {
        let q = QTable::from_values(2, vec![0.0, 1.0, 4.0, 2.0]);
        let (alpha, epsilon) = (Schedule::constant(0.5), Schedule::constant(0.0));
        QLearning::new(q, 0.9, alpha, epsilon, Stream::new(0, "test"))
    }

    #[test]
    fn a_step_by_hand() {
        let mut agent = greedy_learner();
        assert_eq!(agent.begin(0), 1);
        // 1 + 0.5 (10 + 0.9 * 4 - 1) = 7.3; then greedy in state 1.
        assert_eq!(agent.step(10.0, 1), 0);
        assert_eq!(agent.0.q.get(0, 1), 1.0 + 0.5 * (10.0 + 0.9 * 4.0 - 1.0));
    }

    #[test]
    fn the_next_action_is_chosen_after_the_update() {
        let mut agent = greedy_learner();
        assert_eq!(agent.begin(1), 0);
        // Back to state 1: Q(1, 0) falls to 4 + 0.5 (-20 + 3.6 - 4) = -6.2 first.
        assert_eq!(agent.step(-20.0, 1), 1);
    }

    #[test]
    fn termination_cuts_the_target_and_truncation_does_not() {
        let mut agent = greedy_learner();
        agent.begin(0);
        agent.end(2.0, Last::<usize>::Terminated);
        assert_eq!(agent.0.q.get(0, 1), 1.0 + 0.5 * (2.0 - 1.0));
        let mut agent = greedy_learner();
        agent.begin(0);
        agent.end(2.0, Last::Truncated(1));
        assert_eq!(agent.0.q.get(0, 1), 1.0 + 0.5 * (2.0 + 0.9 * 4.0 - 1.0));
    }
}
