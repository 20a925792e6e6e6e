//! Expected SARSA (van Seijen et al. 2009; Sutton & Barto 2018, section 6.6).
//!
//! `Q(S, A) ← Q(S, A) + α [R + γ Σ_a π(a | S′) Q(S′, a) − Q(S, A)]`
//!
//! π is what the behaviour policy would do in S′ by the values before the update. As in
//! Q-learning, the next action is chosen after the update.

use super::Tabular;
use super::tabular::agent_of_table;
use crate::learn::{Explore, Last, Learn, Seen};
use crate::mdp::Action;

/// Tabular expected SARSA, on-policy.
#[derive(Debug, Clone)]
pub struct ExpectedSarsa(Tabular);

impl ExpectedSarsa {
    /// A learner with this table and behaviour.
    pub fn new(table: Tabular) -> Self {
        Self(table)
    }

    fn expected<S: Seen>(&mut self, s: S) -> f64 {
        self.0.behaviour.expected(self.0.q.row(s.cell()), s)
    }
}

agent_of_table!(ExpectedSarsa, 0);

impl<S: Seen> Learn<S> for ExpectedSarsa {
    fn begin(&mut self, s: S) -> Action {
        let a = self.0.choose(s);
        self.0.play(s, a)
    }

    fn step(&mut self, reward: f64, next: S) -> Action {
        let expected = self.expected(next);
        self.0.update(reward, expected);
        self.begin(next)
    }

    fn end(&mut self, reward: f64, last: Last<S>) {
        let expected = match last {
            Last::Terminated => 0.0,
            Last::Truncated(next) => self.expected(next),
        };
        self.0.update(reward, expected);
        self.0.end_episode();
    }
}
