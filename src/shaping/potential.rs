//! Potentials Φ(s), and the shaping term they give (Ng, Harada & Russell 1999).

use super::{Fault, MAX_FIELDS};
use crate::mdp::{Env, FiniteMdp};

/// The potential-based shaping term `F = γΦ(s′) − Φ(s)`.
///
/// `phi_next` must already be 0 where the episode has ended for the learner: on termination, and
/// on truncation if the learner does not bootstrap there (Grześ 2017; Pardo et al. 2018).
#[inline]
pub fn potential_term(gamma: f64, phi: f64, phi_next: f64) -> f64 {
    gamma * phi_next - phi
}

/// `mdp` with `γΦ(s′) − Φ(s)` added to every reward, Φ being 0 beyond a terminal transition.
///
/// `phi` holds one value per state.
pub fn shaped_model(mdp: &FiniteMdp, gamma: f64, phi: &[f64]) -> FiniteMdp {
    mdp.with_rewards(|s, _, o| {
        let next = if o.terminated { 0.0 } else { phi[o.next_state as usize] };
        o.reward + potential_term(gamma, phi[s], next)
    })
}

/// A potential over states. Evaluated once per visited state: the loop carries Φ(s′) on to the
/// next step, where it is Φ(s).
pub trait Potential<E: Env> {
    /// Whether there is a potential at all: lets the step leave the term out.
    const ACTIVE: bool = true;

    /// Φ of the non-terminal state `obs`, which lies in `cell`.
    ///
    /// # Errors
    /// If a scripted potential fails.
    fn phi(&mut self, env: &E, cell: usize, obs: &E::Obs) -> Result<f64, Fault>;
}

/// Φ = 0 everywhere.
#[derive(Debug, Clone, Copy)]
pub struct NoPotential;

impl<E: Env> Potential<E> for NoPotential {
    const ACTIVE: bool = false;

    #[inline]
    fn phi(&mut self, _env: &E, _cell: usize, _obs: &E::Obs) -> Result<f64, Fault> {
        Ok(0.0)
    }
}

/// A function giving Φ of a cell (by its representative).
pub type CellPhiFn = Box<dyn FnMut(usize) -> Result<f64, Fault>>;

/// A potential that is constant on each cell, which the equivalence of shaping and initialisation
/// needs (Wiewiora 2003): evaluated at most once per cell, then read from a table.
pub struct CellPotential {
    /// Φ per cell; NaN where not yet evaluated (a callback that returns NaN is an error).
    table: Vec<f64>,
    evaluate: CellPhiFn,
}

impl CellPotential {
    /// Over `n_cells` cells; `evaluate` is called when a cell is first visited.
    pub fn new(n_cells: usize, evaluate: CellPhiFn) -> Self {
        Self { table: vec![f64::NAN; n_cells], evaluate }
    }

    /// From a table, one value per cell; NaN where `evaluate` is still to be asked.
    pub fn partial(table: Vec<f64>, evaluate: CellPhiFn) -> Self {
        Self { table, evaluate }
    }

    #[inline]
    fn at(&mut self, cell: usize) -> Result<f64, Fault> {
        let phi = self.table[cell];
        if phi.is_nan() { self.first_visit(cell) } else { Ok(phi) }
    }

    #[cold]
    fn first_visit(&mut self, cell: usize) -> Result<f64, Fault> {
        let phi = (self.evaluate)(cell)?;
        self.table[cell] = phi;
        Ok(phi)
    }
}

impl<E: Env> Potential<E> for CellPotential {
    #[inline]
    fn phi(&mut self, _env: &E, cell: usize, _obs: &E::Obs) -> Result<f64, Fault> {
        self.at(cell)
    }
}

/// A function from the state's fields to Φ.
pub type PhiFn = Box<dyn FnMut(&[f64]) -> Result<f64, Fault>>;

/// A function from the state's fields and an action to a number.
pub type ActionFn = Box<dyn FnMut(&[f64], usize) -> Result<f64, Fault>>;

/// A potential of the raw observation, evaluated at every visited state.
pub struct RawPotential {
    n_fields: usize,
    phi: PhiFn,
}

impl RawPotential {
    /// `phi` receives the state's `n_fields` fields.
    pub fn new(n_fields: usize, phi: PhiFn) -> Self {
        Self { n_fields, phi }
    }
}

impl<E: Env> Potential<E> for RawPotential {
    #[inline]
    fn phi(&mut self, env: &E, _cell: usize, obs: &E::Obs) -> Result<f64, Fault> {
        let mut fields = [0.0; MAX_FIELDS];
        env.fields(obs, &mut fields);
        (self.phi)(&fields[..self.n_fields])
    }
}

/// Any of the potentials, chosen per run: for combinations too rare to compile one by one.
pub enum AnyPotential {
    /// None.
    No(NoPotential),
    /// Constant on cells.
    Cell(CellPotential),
    /// Of the raw state.
    Raw(RawPotential),
}

impl<E: Env> Potential<E> for AnyPotential {
    #[inline]
    fn phi(&mut self, env: &E, cell: usize, obs: &E::Obs) -> Result<f64, Fault> {
        match self {
            Self::No(p) => p.phi(env, cell, obs),
            Self::Cell(p) => p.phi(env, cell, obs),
            Self::Raw(p) => p.phi(env, cell, obs),
        }
    }
}
