//! Observation → cell: what a tabular learner's table is indexed by.

use super::{Fault, MAX_FIELDS};
use crate::mdp::Env;

/// Maps observations to cells `0..n_cells`.
pub trait Discretiser<E: Env> {
    /// Whether a cell costs next to nothing, so that the training loop is worth compiling for each
    /// kind of potential and reward; otherwise one loop serves all.
    const FAST: bool;

    /// Number of cells.
    fn n_cells(&self) -> usize;

    /// The cell of `obs`, below [`Self::n_cells`].
    ///
    /// # Errors
    /// If a scripted discretiser fails.
    fn cell(&mut self, env: &E, obs: &E::Obs) -> Result<usize, Fault>;
}

/// The identity, for environments whose observations are state indices.
#[derive(Debug, Clone, Copy)]
pub struct StateIndex {
    /// Number of states of the environment.
    pub n_states: usize,
}

impl<E: Env> Discretiser<E> for StateIndex {
    const FAST: bool = true;

    fn n_cells(&self) -> usize {
        self.n_states
    }

    #[inline]
    fn cell(&mut self, env: &E, obs: &E::Obs) -> Result<usize, Fault> {
        Ok(env.state_index(obs).expect("StateIndex is given to finite states only"))
    }
}

/// A function from the state's fields to a cell.
pub type CellFn = Box<dyn FnMut(&[f64]) -> Result<usize, Fault>>;

/// A scripted discretiser. The function itself refuses indices outside the table.
pub struct ScriptedCells {
    n_cells: usize,
    n_fields: usize,
    cell: CellFn,
}

impl ScriptedCells {
    /// Cells `0..n_cells` given by `cell`, which receives the state's `n_fields` fields.
    pub fn new(n_cells: usize, n_fields: usize, cell: CellFn) -> Self {
        Self { n_cells, n_fields, cell }
    }
}

impl<E: Env> Discretiser<E> for ScriptedCells {
    const FAST: bool = false;

    fn n_cells(&self) -> usize {
        self.n_cells
    }

    #[inline]
    fn cell(&mut self, env: &E, obs: &E::Obs) -> Result<usize, Fault> {
        let mut fields = [0.0; MAX_FIELDS];
        env.fields(obs, &mut fields);
        (self.cell)(&fields[..self.n_fields])
    }
}
