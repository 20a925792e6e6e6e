//! SARSA (Rummery & Niranjan 1994; Sutton & Barto 2018, section 6.4).
//!
//! `Q(S, A) ← Q(S, A) + α [R + γ Q(S′, A′) − Q(S, A)]`
//!
//! The book's order: A′ is chosen from S′ *before* the update, and is the action that is played.

use super::{Agent, Behaviour, Last, QTable, Schedule, ScheduleState};
use crate::mdp::Action;
use crate::mdp::streams::Stream;

/// `R + γ Q(S′, A′) − Q(S, A)`; pass 0 as `q_next` where S′ is terminal.
#[inline]
pub fn sarsa_td_error(q: f64, reward: f64, gamma: f64, q_next: f64) -> f64 {
    reward + gamma * q_next - q
}

/// Tabular SARSA, ε-greedy.
///
/// Deviation 1: where an episode is truncated, the book has no rule; A′ is chosen from the last
/// state as anywhere else, bootstrapped from, and not played.
#[derive(Debug, Clone)]
pub struct Sarsa {
    q: QTable,
    gamma: f64,
    alpha: ScheduleState,
    behaviour: Behaviour,
    s: usize,
    a: Action,
}

impl Sarsa {
    /// A learner with the table `q`; exploration draws from `stream`.
    pub fn new(q: QTable, gamma: f64, alpha: Schedule, epsilon: Schedule, stream: Stream) -> Self {
        let behaviour = Behaviour::new(epsilon, stream);
        Self { q, gamma, alpha: ScheduleState::new(alpha), behaviour, s: 0, a: 0 }
    }

    #[inline]
    fn update(&mut self, reward: f64, q_next: f64) {
        let q = self.q.get_mut(self.s, self.a);
        *q += self.alpha.value() * sarsa_td_error(*q, reward, self.gamma, q_next);
        self.alpha.step();
    }
}

impl Agent for Sarsa {
    #[inline]
    fn begin(&mut self, s: usize) -> Action {
        self.s = s;
        self.a = self.behaviour.choose(self.q.row(s));
        self.a
    }

    #[inline]
    fn step(&mut self, reward: f64, next: usize) -> Action {
        let a_next = self.behaviour.choose(self.q.row(next));
        self.update(reward, self.q.get(next, a_next));
        (self.s, self.a) = (next, a_next);
        a_next
    }

    fn end(&mut self, reward: f64, last: Last) {
        let q_next = match last {
            Last::Terminated => 0.0,
            Last::Truncated(next) => {
                let a_next = self.behaviour.choose(self.q.row(next));
                self.q.get(next, a_next)
            }
        };
        self.update(reward, q_next);
        self.alpha.end_episode();
        self.behaviour.end_episode();
    }

    fn gamma(&self) -> f64 {
        self.gamma
    }

    fn bootstraps_when_truncated(&self) -> bool {
        true
    }

    fn epsilon(&self) -> f64 {
        self.behaviour.epsilon()
    }

    fn q(&self) -> Option<&QTable> {
        Some(&self.q)
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
        assert_eq!(agent.q.get(1, 0), 4.0 + 0.5 * (-20.0 + 0.9 * 4.0 - 4.0));
        agent.end(1.0, Last::Terminated);
        let q = 4.0 + 0.5 * (-20.0 + 0.9 * 4.0 - 4.0);
        assert_eq!(agent.q.get(1, 0), q + 0.5 * (1.0 - q));
    }
}
