//! Watkins's Q(λ) (Watkins 1989; Sutton & Barto 2018, section 12.10, for a table).
//!
//! `δ = R + γ max_a Q(S′, a) − Q(S, A)`; e(S, A) rises; `Q ← Q + α δ e` for every pair; then
//! `e ← γ λ e` if A′ is greedy, else `e ← 0`: what follows an exploratory action says nothing
//! about the greedy policy.
//!
//! The order of the algorithm: A′ is chosen before the update, and whether it is greedy is seen by
//! the values before it too. Any of several tied actions is greedy. Traces are 0 at the start of
//! an episode.

use super::tabular::agent_of_table;
use super::{Tabular, Traces};
use crate::learn::greedy::is_greedy;
use crate::learn::{Last, Learn, Seen, max_allowed};
use crate::mdp::Action;

/// Tabular Q(λ), off-policy.
#[derive(Debug, Clone)]
pub struct QLambda {
    table: Tabular,
    traces: Traces,
}

impl QLambda {
    /// A learner with this table and behaviour; the traces decay by γ λ.
    pub fn new(table: Tabular, traces: Traces) -> Self {
        Self { table, traces }
    }
}

agent_of_table!(QLambda, table);

impl<S: Seen> Learn<S> for QLambda {
    fn begin(&mut self, s: S) -> Action {
        let a = self.table.choose(s);
        self.table.play(s, a)
    }

    fn step(&mut self, reward: f64, next: S) -> Action {
        let a_next = self.table.choose(next);
        let row = self.table.q.row(next.cell());
        let (max_next, greedy) = (max_allowed(row, next), is_greedy(row, next, a_next));
        self.traces.update(&mut self.table, reward, max_next);
        if !greedy {
            self.traces.clear();
        }
        self.table.play(next, a_next)
    }

    fn end(&mut self, reward: f64, last: Last<S>) {
        let max_next = match last {
            Last::Terminated => 0.0,
            Last::Truncated(next) => max_allowed(self.table.q.row(next.cell()), next),
        };
        self.traces.update(&mut self.table, reward, max_next);
        self.traces.clear();
        self.table.end_episode();
    }
}
