//! Potentials Φ(s), and the shaping term they give (Ng, Harada & Russell 1999).

use super::{Fault, MAX_FIELDS, PhiFn};
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

/// A potential over states. Evaluated once per visited state, on arrival: the loop carries Φ(s′) on
/// to the next step, where it is Φ(s). The discounted terms of an episode then telescope even if the
/// potential changes while it lasts (Devlin & Kudenko 2012); evaluated anew, they would not.
pub trait Potential<E: Env> {
    /// Whether there is a potential at all: lets the step leave the term out.
    const ACTIVE: bool = true;

    /// Episode `episode` begins, counted from 1. Until the next one begins, Φ stays as it is.
    fn begin_episode(&mut self, _episode: u32) {}

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

/// A function giving Φ of a cell (by its representative) in an episode, counted from 1.
pub type CellEpisodeFn = Box<dyn FnMut(usize, u32) -> Result<f64, Fault>>;

/// A potential that is constant on each cell and changes from episode to episode (Devlin & Kudenko
/// 2012): evaluated at most once per cell and episode.
pub struct EpisodePotential {
    /// Φ per cell, and the episode in which it was that; 0 for none.
    table: Vec<(u32, f64)>,
    episode: u32,
    evaluate: CellEpisodeFn,
}

impl EpisodePotential {
    /// Over `n_cells` cells; `evaluate` is called when a cell is first visited in an episode.
    pub fn new(n_cells: usize, evaluate: CellEpisodeFn) -> Self {
        Self { table: vec![(0, 0.0); n_cells], episode: 0, evaluate }
    }
}

impl<E: Env> Potential<E> for EpisodePotential {
    fn begin_episode(&mut self, episode: u32) {
        self.episode = episode;
    }

    fn phi(&mut self, _env: &E, cell: usize, _obs: &E::Obs) -> Result<f64, Fault> {
        let (episode, phi) = self.table[cell];
        if episode == self.episode {
            return Ok(phi);
        }
        let phi = (self.evaluate)(cell, self.episode)?;
        self.table[cell] = (self.episode, phi);
        Ok(phi)
    }
}

/// A function from the state's fields and an action to a number.
pub type ActionFn = Box<dyn FnMut(&[f64], usize) -> Result<f64, Fault>>;

/// A potential of the raw observation, evaluated at every visited state.
pub struct RawPotential {
    n_fields: usize,
    episode: u32,
    phi: PhiFn,
}

impl RawPotential {
    /// `phi` receives the state's `n_fields` fields.
    pub fn new(n_fields: usize, phi: PhiFn) -> Self {
        Self { n_fields, episode: 0, phi }
    }
}

impl<E: Env> Potential<E> for RawPotential {
    fn begin_episode(&mut self, episode: u32) {
        self.episode = episode;
    }

    #[inline]
    fn phi(&mut self, env: &E, _cell: usize, obs: &E::Obs) -> Result<f64, Fault> {
        let mut fields = [0.0; MAX_FIELDS];
        env.fields(obs, &mut fields);
        self.phi.at(&fields[..self.n_fields], self.episode)
    }
}

/// Any of the potentials, chosen per run: for combinations too rare to compile one by one.
pub enum AnyPotential {
    /// None.
    No(NoPotential),
    /// Constant on cells.
    Cell(CellPotential),
    /// Constant on cells for an episode.
    Episode(EpisodePotential),
    /// Of the raw state.
    Raw(RawPotential),
}

impl<E: Env> Potential<E> for AnyPotential {
    fn begin_episode(&mut self, episode: u32) {
        match self {
            Self::No(_) | Self::Cell(_) => {}
            Self::Episode(p) => Potential::<E>::begin_episode(p, episode),
            Self::Raw(p) => Potential::<E>::begin_episode(p, episode),
        }
    }

    #[inline]
    fn phi(&mut self, env: &E, cell: usize, obs: &E::Obs) -> Result<f64, Fault> {
        match self {
            Self::No(p) => p.phi(env, cell, obs),
            Self::Cell(p) => p.phi(env, cell, obs),
            Self::Episode(p) => p.phi(env, cell, obs),
            Self::Raw(p) => p.phi(env, cell, obs),
        }
    }
}
