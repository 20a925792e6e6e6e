//! Observation → what the agent sees: a row of a table, with the actions allowed there, or the
//! state's numbers.

use super::{Bins, CellFn, Fault, MAX_FIELDS, ShieldFn};
use crate::mdp::{Action, Env};

/// A state as an agent sees it.
pub trait Seen: Copy + 'static {
    /// Whether [`Self::allows`] may refuse an action. Known when compiling, so that learners without
    /// a shield do not ask.
    const SHIELDED: bool = false;

    /// The row of a table that stands for it; 0 where states are told apart by their numbers.
    fn cell(&self) -> usize;

    /// What may be taken.
    fn allowed(&self) -> ActionSet {
        ActionSet::ALL
    }

    /// Whether `action` may be taken.
    fn allows(&self, _action: Action) -> bool {
        true
    }
}

impl Seen for usize {
    #[inline]
    fn cell(&self) -> usize {
        *self
    }
}

/// A set of actions: bit `a` stands for action `a`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ActionSet(pub u64);

impl ActionSet {
    /// The largest number of actions that a shield can tell apart.
    pub const CAPACITY: usize = 64;

    /// Every action.
    pub const ALL: Self = Self(u64::MAX);

    /// Whether `action` belongs to it. Actions beyond [`Self::CAPACITY`] are never shielded.
    #[inline]
    pub fn contains(self, action: Action) -> bool {
        action >= Self::CAPACITY || self.0 >> action & 1 == 1
    }
}

/// A row of a table, and the actions that a shield allows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shielded {
    /// The row.
    pub cell: usize,
    /// What may be played.
    pub allowed: ActionSet,
}

impl Seen for Shielded {
    const SHIELDED: bool = true;

    #[inline]
    fn cell(&self) -> usize {
        self.cell
    }

    #[inline]
    fn allowed(&self) -> ActionSet {
        self.allowed
    }

    #[inline]
    fn allows(&self, action: Action) -> bool {
        self.allowed.contains(action)
    }
}

/// The state's numbers, for function approximation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fields {
    /// The numbers that the environment's schema names, then zeros.
    pub values: [f64; MAX_FIELDS],
    /// The state's index, where states have one and it is asked for; else 0.
    pub index: usize,
    /// What may be played.
    pub allowed: ActionSet,
}

impl Seen for Fields {
    const SHIELDED: bool = true;

    #[inline]
    fn cell(&self) -> usize {
        self.index
    }

    #[inline]
    fn allowed(&self) -> ActionSet {
        self.allowed
    }

    #[inline]
    fn allows(&self, action: Action) -> bool {
        self.allowed.contains(action)
    }
}

/// Maps observations to what the agent sees.
pub trait Discretiser<E: Env> {
    /// Whether a state costs next to nothing to see, so that the training loop is worth compiling
    /// for each kind of potential and reward; otherwise one loop serves all.
    const FAST: bool;

    /// What the agent sees.
    type State: Seen;

    /// Number of rows that a table needs.
    fn n_cells(&self) -> usize;

    /// The non-terminal state `obs`; its cell is below [`Self::n_cells`].
    ///
    /// # Errors
    /// If a scripted discretiser or shield fails.
    fn see(&mut self, env: &E, obs: &E::Obs) -> Result<Self::State, Fault>;
}

/// The identity, for environments whose observations are state indices.
#[derive(Debug, Clone, Copy)]
pub struct StateIndex {
    /// Number of states of the environment.
    pub n_states: usize,
}

impl<E: Env> Discretiser<E> for StateIndex {
    const FAST: bool = true;

    type State = usize;

    fn n_cells(&self) -> usize {
        self.n_states
    }

    #[inline]
    fn see(&mut self, env: &E, obs: &E::Obs) -> Result<usize, Fault> {
        Ok(env.state_index(obs).expect("StateIndex is given to finite states only"))
    }
}

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

    type State = usize;

    fn n_cells(&self) -> usize {
        self.n_cells
    }

    #[inline]
    fn see(&mut self, env: &E, obs: &E::Obs) -> Result<usize, Fault> {
        let mut fields = [0.0; MAX_FIELDS];
        env.fields(obs, &mut fields);
        self.cell.at(&fields[..self.n_fields])
    }
}

/// Any of the discretisers, chosen per run: for combinations too rare to compile one by one.
pub enum AnyCells {
    /// State indices.
    Index(StateIndex),
    /// Uniform bins.
    Bins(Bins),
    /// A script's.
    Scripted(ScriptedCells),
}

impl<E: Env> Discretiser<E> for AnyCells {
    const FAST: bool = false;

    type State = usize;

    fn n_cells(&self) -> usize {
        match self {
            Self::Index(d) => Discretiser::<E>::n_cells(d),
            Self::Bins(d) => d.n_cells(),
            Self::Scripted(d) => Discretiser::<E>::n_cells(d),
        }
    }

    #[inline]
    fn see(&mut self, env: &E, obs: &E::Obs) -> Result<usize, Fault> {
        match self {
            Self::Index(d) => d.see(env, obs),
            Self::Bins(d) => d.see(env, obs),
            Self::Scripted(d) => d.see(env, obs),
        }
    }
}

/// A shield (Alshiekh et al. 2018): what it refuses is neither taken nor bootstrapped from. Asked
/// of the state itself, not of its cell's representative: what it refuses anywhere in a cell must
/// not happen there.
pub struct Shield {
    n_fields: usize,
    allowed: ShieldFn,
    /// Per state, where states have indices: asked once.
    known: Vec<Option<ActionSet>>,
}

impl Shield {
    /// `allowed` receives the state's `n_fields` fields; `n_states` is the number of states that
    /// have an index, 0 where they have none.
    pub fn new(n_fields: usize, n_states: usize, allowed: ShieldFn) -> Self {
        Self { n_fields, allowed, known: vec![None; n_states] }
    }

    /// What may be played in `obs`.
    ///
    /// # Errors
    /// If the function fails, or allows nothing.
    #[inline]
    pub fn allowed<E: Env>(&mut self, env: &E, obs: &E::Obs) -> Result<ActionSet, Fault> {
        let index = if E::INDEXED && !self.known.is_empty() { env.state_index(obs) } else { None };
        if let Some(known) = index.and_then(|index| self.known[index]) {
            return Ok(known);
        }
        let mut fields = [0.0; MAX_FIELDS];
        env.fields(obs, &mut fields);
        let allowed = self.allowed.at(&fields[..self.n_fields])?;
        if let Some(index) = index {
            self.known[index] = Some(allowed);
        }
        Ok(allowed)
    }
}

/// A discretiser behind a shield.
pub struct ShieldedCells {
    /// State → cell.
    pub cells: AnyCells,
    /// State → allowed actions.
    pub shield: Shield,
}

impl<E: Env> Discretiser<E> for ShieldedCells {
    const FAST: bool = false;

    type State = Shielded;

    fn n_cells(&self) -> usize {
        Discretiser::<E>::n_cells(&self.cells)
    }

    #[inline]
    fn see(&mut self, env: &E, obs: &E::Obs) -> Result<Shielded, Fault> {
        let cell = self.cells.see(env, obs)?;
        Ok(Shielded { cell, allowed: self.shield.allowed(env, obs)? })
    }
}

/// No discretisation: the agent sees the state's numbers.
pub struct RawFields {
    /// Number of states, where agents are to see their index; else 0.
    pub n_states: usize,
    /// State → allowed actions; every action without one.
    pub shield: Option<Shield>,
}

impl<E: Env> Discretiser<E> for RawFields {
    const FAST: bool = false;

    type State = Fields;

    fn n_cells(&self) -> usize {
        self.n_states.max(1)
    }

    #[inline]
    fn see(&mut self, env: &E, obs: &E::Obs) -> Result<Fields, Fault> {
        let mut values = [0.0; MAX_FIELDS];
        env.fields(obs, &mut values);
        let allowed = match &mut self.shield {
            Some(shield) => shield.allowed(env, obs)?,
            None => ActionSet::ALL,
        };
        let index = if E::INDEXED && self.n_states > 0 { env.state_index(obs) } else { None };
        Ok(Fields { values, index: index.unwrap_or(0), allowed })
    }
}
