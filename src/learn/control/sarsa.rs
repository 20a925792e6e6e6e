//! SARSA (Rummery & Niranjan 1994; Sutton & Barto 2018, section 6.4).
//!
//! `Q(S, A) ← Q(S, A) + α [R + γ Q(S′, A′) − Q(S, A)]`
//!
//! The book's order: A′ is chosen from S′ *before* the update, and is the action that is played.

use super::Tabular;
use super::tabular::agent_of_table;
use crate::learn::{
    EpsilonGreedy, Explore, Last, Learn, QTable, Rate, Schedule, ScheduleState, Seen,
};
use crate::mdp::Action;
use crate::mdp::streams::Stream;

/// Tabular SARSA, on-policy; ε-greedy unless the behaviour says otherwise.
///
/// Deviation 1: where an episode is truncated, the book has no rule; A′ is chosen from the last
/// state as anywhere else, bootstrapped from, and not played.
#[derive(Debug, Clone)]
pub struct Sarsa<B = EpsilonGreedy, A = ScheduleState>(Tabular<B, A>);

impl Sarsa {
    /// A learner with the table `q`; exploration draws from `stream`.
    pub fn new(q: QTable, gamma: f64, alpha: Schedule, epsilon: Schedule, stream: Stream) -> Self {
        Self(Tabular::scheduled(q, gamma, alpha, epsilon, stream))
    }
}

impl<B: Explore, A: Rate> Sarsa<B, A> {
    /// A learner with this table and behaviour.
    pub fn of(table: Tabular<B, A>) -> Self {
        Self(table)
    }
}

agent_of_table!(Sarsa<B, A>, 0, B: Explore, A: Rate);

impl<S: Seen, B: Explore, A: Rate> Learn<S> for Sarsa<B, A> {
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
        let a_next = self.0.choose(next);
        self.0.update(reward, self.0.q.get(next.cell(), a_next));
        self.0.play(next, a_next)
    }

    fn end(&mut self, reward: f64, last: Last<S>) {
        let q_next = match last {
            Last::Terminated => 0.0,
            Last::Truncated(next) => {
                let a_next = self.0.choose(next);
                self.0.q.get(next.cell(), a_next)
            }
        };
        self.0.update(reward, q_next);
        self.0.end_episode();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_next_action_is_chosen_before_the_update_and_played() {
        let q = QTable::from_values(2, vec![0.0, 1.0, 4.0, 2.0]);
        let (alpha, epsilon) = (Schedule::constant(0.5), Schedule::constant(0.0));
        let mut agent = Sarsa::new(q, 0.9, alpha, epsilon, Stream::new(0, "test"));
        assert_eq!(agent.begin(1), 0);
        // Back to state 1: A' = 0 by the old values (4 > 2), though Q(1, 0) then falls to
        // 4 + 0.5 (-20 + 0.9 * 4 - 4) = -6.2.
        assert_eq!(agent.step(-20.0, 1), 0);
        assert_eq!(agent.0.q.get(1, 0), 4.0 + 0.5 * (-20.0 + 0.9 * 4.0 - 4.0));
        agent.end(1.0, Last::<usize>::Terminated);
        let q = 4.0 + 0.5 * (-20.0 + 0.9 * 4.0 - 4.0);
        assert_eq!(agent.0.q.get(1, 0), q + 0.5 * (1.0 - q));
    }
}
