//! SARSA(λ) with eligibility traces (Rummery 1995; Sutton & Barto 2018, section 12.7, for a table).
//!
//! `δ = R + γ Q(S′, A′) − Q(S, A)`; e(S, A) rises; `Q ← Q + α δ e` and `e ← γ λ e` for every pair.
//!
//! The order of the book: A′ is chosen before the update, and is the action that is played. Traces
//! are 0 at the start of an episode.
//!
//! Deviation 1: where an episode is truncated, A′ is chosen in the last state, bootstrapped from,
//! and not played.

use super::tabular::agent_of_table;
use super::{Tabular, Traces};
use crate::learn::{Last, Learn, Seen};
use crate::mdp::Action;

/// Tabular SARSA(λ), on-policy.
#[derive(Debug, Clone)]
pub struct SarsaLambda {
    table: Tabular,
    traces: Traces,
}

impl SarsaLambda {
    /// A learner with this table and behaviour; the traces decay by γ λ.
    pub fn new(table: Tabular, traces: Traces) -> Self {
        Self { table, traces }
    }
}

agent_of_table!(SarsaLambda, table);

impl<S: Seen> Learn<S> for SarsaLambda {
    fn begin(&mut self, s: S) -> Action {
        let a = self.table.choose(s);
        self.table.play(s, a)
    }

    fn step(&mut self, reward: f64, next: S) -> Action {
        let a_next = self.table.choose(next);
        let q_next = self.table.q.get(next.cell(), a_next);
        self.traces.update(&mut self.table, reward, q_next);
        self.table.play(next, a_next)
    }

    fn end(&mut self, reward: f64, last: Last<S>) {
        let q_next = match last {
            Last::Terminated => 0.0,
            Last::Truncated(next) => {
                let a_next = self.table.choose(next);
                self.table.q.get(next.cell(), a_next)
            }
        };
        self.traces.update(&mut self.table, reward, q_next);
        self.traces.clear();
        self.table.end_episode();
    }
}
