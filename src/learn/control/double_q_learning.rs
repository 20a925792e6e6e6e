//! Double Q-learning (van Hasselt 2010; Sutton & Barto 2018, section 6.7).
//!
//! With probability 1/2 each
//!
//! `Q₁(S, A) ← Q₁(S, A) + α [R + γ Q₂(S′, argmax_a Q₁(S′, a)) − Q₁(S, A)]`
//!
//! or the same with Q₁ and Q₂ exchanged; then the next action is chosen, from the mean of both
//! (greedily the same as from the sum, which the book uses; a temperature and a confidence bound
//! keep the meaning they have for one table).

use super::Tabular;
use super::tabular::agent_of_table;
use super::td_error;
use crate::learn::{AlphaSource, Last, Learn, QTable, Rate, Seen, StepSize, argmax_allowed};
use crate::mdp::Action;
use crate::mdp::streams::Stream;

/// Tabular double Q-learning. Its values are the mean of both tables.
#[derive(Debug, Clone)]
pub struct DoubleQLearning {
    /// Its table is the mean of the two.
    mean: Tabular,
    tables: [QTable; 2],
    /// One step size per pair and table: visits are counted for each table.
    alpha: StepSize,
    /// Which table learns.
    coin: Stream,
}

impl DoubleQLearning {
    /// Both tables start as that of `table`; which one learns is decided by `coin`.
    pub fn new(table: Tabular, alpha: AlphaSource, coin: Stream) -> Self {
        let tables = [table.q.clone(), table.q.clone()];
        let alpha = StepSize::new(alpha, 2 * table.q.values().len());
        Self { mean: table, tables, alpha, coin }
    }

    /// Lets one table learn; `next` is `None` where the episode has terminated.
    fn update<S: Seen>(&mut self, reward: f64, next: Option<S>) {
        let Tabular { gamma, s, a, .. } = self.mean;
        let learning = (self.coin.next_u64() >> 63) as usize;
        let pair = self.mean.q.pair(s, a);
        let alpha = self.alpha.visit(learning * self.mean.q.values().len() + pair);
        let value = next.map_or(0.0, |next| {
            let best = argmax_allowed(self.tables[learning].row(next.cell()), next);
            self.tables[1 - learning].get(next.cell(), best)
        });
        let q = self.tables[learning].get_mut(s, a);
        *q += alpha * td_error(*q, reward, gamma, value);
        let sum = self.tables[0].get(s, a) + self.tables[1].get(s, a);
        *self.mean.q.get_mut(s, a) = 0.5 * sum;
    }
}

agent_of_table!(DoubleQLearning, mean);

impl<S: Seen> Learn<S> for DoubleQLearning {
    fn begin(&mut self, s: S) -> Action {
        let a = self.mean.choose(s);
        self.mean.play(s, a)
    }

    fn step(&mut self, reward: f64, next: S) -> Action {
        self.update(reward, Some(next));
        self.begin(next)
    }

    fn end(&mut self, reward: f64, last: Last<S>) {
        self.update(
            reward,
            match last {
                Last::Terminated => None,
                Last::Truncated(next) => Some(next),
            },
        );
        self.alpha.end_episode();
        self.mean.end_episode();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::control::tests::greedy;
    use crate::learn::{Agent, Schedule};

    #[test]
    fn steps_by_hand() {
        let alpha = AlphaSource::Schedule(Schedule::constant(0.5));
        // Row 0: (0, 1), row 1: (4, 2).
        let coin = Stream::new(0, "coin");
        let mut agent = DoubleQLearning::new(greedy(0.5), alpha, coin.clone());
        agent.tables[1] = QTable::from_values(2, vec![0.0, 1.0, -3.0, 8.0]);
        let first = {
            let mut coin = coin;
            (coin.next_u64() >> 63) as usize
        };
        assert_eq!(agent.begin(0), 1);
        agent.step(10.0, 1);
        // The learning table says which action, the other one what it is worth:
        // Q₁: 0 at best, worth Q₂(1, 0) = -3; Q₂: 1 at best, worth Q₁(1, 1) = 2.
        let value = [-3.0, 2.0][first];
        let learned = 1.0 + 0.5 * (10.0 + 0.9 * value - 1.0);
        assert_eq!(agent.tables[first].get(0, 1), learned);
        assert_eq!(agent.tables[1 - first].get(0, 1), 1.0, "the other one has not changed");
        assert_eq!(agent.q().unwrap().get(0, 1), 0.5 * (learned + 1.0));
    }

    #[test]
    fn both_tables_learn_about_equally_often() {
        let alpha = AlphaSource::VisitCount { omega: 1.0 };
        let mut agent = DoubleQLearning::new(greedy(0.5), alpha, Stream::new(1, "coin"));
        for _ in 0..1000 {
            agent.begin(0);
            agent.end(1.0, Last::<usize>::Terminated);
        }
        let StepSize::VisitCount { visits, .. } = &agent.alpha else { unreachable!("as given") };
        // Both tables count (0, 1), at 1 and 4 + 1; the standard deviation is 16.
        assert_eq!(visits[1] + visits[5], 1000);
        assert!(visits[1].abs_diff(500) < 95, "{visits:?}");
    }
}
