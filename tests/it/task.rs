//! Tasks given by their tables, for tests of learners on the examples of books.

use std::sync::Arc;

use runner::mdp::numpy::NumpyRng;
use runner::mdp::{Action, Env, FiniteEnv, FiniteMdp, FiniteState, Outcome, Schema, Step};

/// A finite task that starts in one state.
#[derive(Clone)]
pub(crate) struct Task(FiniteEnv);

impl Task {
    /// `table[s][a]` lists the outcomes of action `a` in state `s`.
    pub(crate) fn new(table: &[Vec<Vec<Outcome>>], start: usize) -> Self {
        let mut initial = vec![0.0; table.len()];
        initial[start] = 1.0;
        Self(FiniteEnv::new(Arc::new(FiniteMdp::new(table, initial).unwrap())))
    }

    pub(crate) fn mdp(&self) -> &FiniteMdp {
        self.0.mdp()
    }
}

impl Env for Task {
    type Obs = FiniteState;

    const INDEXED: bool = true;

    fn n_actions(&self) -> usize {
        self.0.mdp().n_actions()
    }

    fn reset(&mut self, rng: &mut NumpyRng) -> FiniteState {
        self.0.reset(rng)
    }

    fn step(&mut self, action: Action, rng: &mut NumpyRng) -> Step<FiniteState> {
        let (obs, outcome) = self.0.step(action, rng);
        Step { obs, reward: outcome.reward, terminated: outcome.terminated }
    }

    fn finite(&self) -> Option<&Arc<FiniteMdp>> {
        Some(self.0.mdp())
    }

    fn state_index(&self, obs: &FiniteState) -> Option<usize> {
        Some(obs.index as usize)
    }

    fn schema(&self) -> Schema {
        Schema { fields: Vec::new(), facts: Vec::new(), actions: Vec::new(), grid: None }
    }

    fn fields(&self, _obs: &FiniteState, _out: &mut [f64]) {}
}
