//! Dyna-Q (Sutton 1990; Sutton & Barto 2018, section 8.2).
//!
//! After every step: (a) the update of Q-learning; (b) `Model(S, A) ← R, S′`; (c) `planning_steps`
//! times, a state seen before and an action taken there before, each with the same probability,
//! and the update of Q-learning with what the model says of them. Then the next action is chosen.
//!
//! The model is the book's for deterministic environments: what happened last. In others it is a
//! sample that lags behind.
//!
//! Deviation 1: with step sizes by visits, planning uses the pair's present one, and is no visit.

use super::Tabular;
use super::tabular::agent_of_table;
use super::td_error;
use crate::learn::{Last, Learn, Seen, max_allowed};
use crate::mdp::Action;
use crate::mdp::streams::Stream;
use crate::shaping::{ActionSet, Shielded};

/// What followed a pair the last time.
#[derive(Debug, Clone, Copy)]
struct Outcome {
    reward: f64,
    /// `None` if the episode terminated.
    next: Option<Shielded>,
}

/// The pairs seen so far and what followed them.
#[derive(Debug, Clone)]
struct Model {
    n_actions: usize,
    /// Per pair; anything where it was never tried.
    outcomes: Vec<Outcome>,
    /// The actions tried in each state, the first `n_tried[s]` of its row.
    tried: Vec<u32>,
    n_tried: Vec<u32>,
    /// The states in which some action was tried.
    states: Vec<u32>,
    is_tried: Vec<bool>,
}

impl Model {
    fn new(n_states: usize, n_actions: usize) -> Self {
        let n_pairs = n_states * n_actions;
        Self {
            n_actions,
            outcomes: vec![Outcome { reward: 0.0, next: None }; n_pairs],
            tried: vec![0; n_pairs],
            n_tried: vec![0; n_states],
            states: Vec::new(),
            is_tried: vec![false; n_pairs],
        }
    }

    #[inline]
    fn remember(&mut self, s: usize, a: Action, outcome: Outcome) {
        let pair = s * self.n_actions + a;
        self.outcomes[pair] = outcome;
        if !self.is_tried[pair] {
            self.is_tried[pair] = true;
            if self.n_tried[s] == 0 {
                self.states.push(s as u32);
            }
            self.tried[s * self.n_actions + self.n_tried[s] as usize] = a as u32;
            self.n_tried[s] += 1;
        }
    }

    /// A pair seen before: any state, then any of the actions tried in it.
    #[inline]
    fn sample(&self, stream: &mut Stream) -> usize {
        let s = self.states[stream.below(self.states.len())] as usize;
        let row = s * self.n_actions;
        row + self.tried[row + stream.below(self.n_tried[s] as usize)] as usize
    }
}

/// Tabular Dyna-Q.
#[derive(Debug, Clone)]
pub struct DynaQ {
    table: Tabular,
    planning_steps: u64,
    model: Model,
    /// What is planned draws from a stream of its own.
    stream: Stream,
}

impl DynaQ {
    /// A learner with this table and behaviour that makes `planning_steps` updates from its model
    /// after every step; which, is drawn from `stream`.
    pub fn new(table: Tabular, planning_steps: u64, stream: Stream) -> Self {
        let model = Model::new(table.q.n_states(), table.q.n_actions());
        Self { table, planning_steps, model, stream }
    }

    /// (a), (b) and (c); `next` is `None` where the episode has terminated.
    #[inline]
    fn learn<S: Seen>(&mut self, reward: f64, next: Option<S>) {
        let max_next = next.map_or(0.0, |next| max_allowed(self.table.q.row(next.cell()), next));
        self.table.update(reward, max_next);
        let next = next.map(|next| Shielded { cell: next.cell(), allowed: next.allowed() });
        self.model.remember(self.table.s, self.table.a, Outcome { reward, next });
        let Tabular { q, gamma, alpha, .. } = &mut self.table;
        for _ in 0..self.planning_steps {
            let pair = self.model.sample(&mut self.stream);
            let Outcome { reward, next } = self.model.outcomes[pair];
            let max_next = match next {
                None => 0.0,
                Some(next) if next.allowed == ActionSet::ALL => q.max(next.cell),
                Some(next) => max_allowed(q.row(next.cell), next),
            };
            let alpha = alpha.of(pair);
            let q = &mut q.values_mut()[pair];
            *q += alpha * td_error(*q, reward, *gamma, max_next);
        }
    }
}

agent_of_table!(DynaQ, table);

impl<S: Seen> Learn<S> for DynaQ {
    fn begin(&mut self, s: S) -> Action {
        let a = self.table.choose(s);
        self.table.play(s, a)
    }

    fn step(&mut self, reward: f64, next: S) -> Action {
        self.learn(reward, Some(next));
        self.begin(next)
    }

    fn end(&mut self, reward: f64, last: Last<S>) {
        self.learn(
            reward,
            match last {
                Last::Terminated => None,
                Last::Truncated(next) => Some(next),
            },
        );
        self.table.end_episode();
    }
}
