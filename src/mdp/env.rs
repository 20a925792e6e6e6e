//! What an environment is: dynamics, and how its states are named for scripts.

use std::sync::Arc;

use super::numpy::NumpyRng;
use super::{FiniteMdp, math};

/// A discrete action: an index below [`Env::n_actions`].
pub type Action = usize;

/// How an episode ended. Kept apart everywhere: a terminated state has no future, a truncated
/// one merely was not played on (Pardo et al. 2018).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Ending {
    /// The environment reached a terminal state: its value is 0.
    Terminated,
    /// The time limit cut the episode off: the last state still has a value.
    Truncated,
}

impl Ending {
    /// The word used in files: `terminated` or `truncated`.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Terminated => "terminated",
            Self::Truncated => "truncated",
        }
    }
}

/// What actions an environment takes: Gymnasium's `action_space`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ActionSpace {
    /// `Discrete(n)`: `0..n`.
    Discrete(usize),
    /// `Box(low, high, float32)`: a list of real numbers, with the bounds of each.
    Box {
        /// The least value of each component; what is below is clipped.
        low: &'static [f32],
        /// The greatest value of each component; what is above is clipped.
        high: &'static [f32],
    },
}

/// What one action brought.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step<O> {
    /// The next observation, s′.
    pub obs: O,
    /// The native reward, as the environment pays it.
    pub reward: f64,
    /// Whether s′ is terminal. Truncation is not the environment's business: the loop applies
    /// the time limit.
    pub terminated: bool,
}

/// Pure dynamics: no time limit, no shaping, no logging, infallible.
///
/// All randomness comes from the generator that is passed in, which stands for Gymnasium's
/// `np_random`; the same seed therefore gives Gymnasium's own trajectory.
pub trait Env: Send + Sync {
    /// An observation: an array of float32 as Gymnasium returns it, or a state index.
    type Obs: Copy + Send + Sync + std::fmt::Debug + 'static;

    /// Whether states have indices: [`Self::n_states`] is not `None`. Known when compiling, so that
    /// no loop is compiled that cannot run.
    const INDEXED: bool = false;

    /// Number of actions that an agent chooses among; valid ones are `0..n_actions`. Where actions
    /// are real numbers, each stands for an entry of a table.
    fn n_actions(&self) -> usize;

    /// What actions Gymnasium's environment takes.
    fn action_space(&self) -> ActionSpace {
        ActionSpace::Discrete(self.n_actions())
    }

    /// Starts an episode and returns its first observation.
    fn reset(&mut self, rng: &mut NumpyRng) -> Self::Obs;

    /// Plays `action` (below [`Self::n_actions`]; the caller has checked).
    fn step(&mut self, action: Action, rng: &mut NumpyRng) -> Step<Self::Obs>;

    /// Plays a real-valued action: one finite number per component of the `Box` that
    /// [`Self::action_space`] is (the caller has checked).
    ///
    /// # Panics
    /// If the action space is discrete.
    fn step_box(&mut self, _action: &[f32], _rng: &mut NumpyRng) -> Step<Self::Obs> {
        unreachable!("the actions of this environment are integers")
    }

    /// The exact model, if there is a finite one: for every state and action, the probability of
    /// everything that [`Self::step`] may do.
    fn finite(&self) -> Option<&Arc<FiniteMdp>> {
        None
    }

    /// Number of states, if they are finite. There may be finitely many states without a model:
    /// where something that the observation does not show changes the dynamics.
    fn n_states(&self) -> Option<usize> {
        self.finite().map(|mdp| mdp.n_states())
    }

    /// The index of the state, below [`Self::n_states`]; `None` on continuous environments.
    fn state_index(&self, _obs: &Self::Obs) -> Option<usize> {
        None
    }

    /// The observation of state `index`, as after a reset; `None` on continuous environments.
    fn state(&self, _index: usize) -> Option<Self::Obs> {
        None
    }

    /// Puts the environment into state `index`, as if an episode had started there, and returns its
    /// observation: for exploring starts (Sutton & Barto 2018, section 5.3) and for audits.
    ///
    /// What the observation does not show stays as the last reset drew it, so that an episode that
    /// may start anywhere is [`Self::reset`] and this. `None`, and nothing changes, on continuous
    /// environments and where there is no such state to act in.
    fn set_index(&mut self, _index: usize) -> Option<Self::Obs> {
        None
    }

    /// Puts the environment into the state that has these `fields` (all that [`Self::schema`] names,
    /// in its order), as if an episode had started there, and returns its observation.
    ///
    /// `None`, and nothing changes, where the observation does not determine the state, and if an
    /// episode cannot be there and go on: numbers that are not finite or out of their range, and
    /// terminal states. A float32 of an observation is never out of its range; of a cosine and a
    /// sine only the direction counts.
    fn set_state(&mut self, _fields: &[f64]) -> Option<Self::Obs> {
        None
    }

    /// Which outcome of [`Self::finite`]'s model led to `obs`; `None` after a reset and without a
    /// model.
    fn outcome_index(&self, _obs: &Self::Obs) -> Option<usize> {
        None
    }

    /// What of the native reward is shaping already and no potential's, in words, with a way to do
    /// without; `None` if there is nothing of the kind.
    fn own_shaping(&self) -> Option<&'static str> {
        None
    }

    /// The names of the state's numbers, in the order of [`Self::fields`]' output.
    fn schema(&self) -> Schema;

    /// Writes the numbers that [`Self::schema`] names into `out` (length `schema().fields.len()`):
    /// what scripts see as `s.name` and `s[i]`.
    fn fields(&self, obs: &Self::Obs, out: &mut [f64]);
}

/// The largest number of fields a state may have: lets the step use a buffer on the stack.
pub const MAX_FIELDS: usize = 16;

/// How a field appears in a script.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FieldKind {
    /// A float.
    Float,
    /// An integer (stored exactly in an f64).
    Int,
    /// A one-letter string; the f64 holds its Unicode scalar value.
    Letter,
}

/// One named number of a state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Field {
    /// Its name in scripts, for example `theta_dot`.
    pub name: &'static str,
    /// Its type in scripts.
    pub kind: FieldKind,
    /// One line: what it is, with its unit.
    pub doc: &'static str,
    /// The smallest value the observation space admits (may be infinite).
    pub low: f64,
    /// The largest value the observation space admits (may be infinite).
    pub high: f64,
}

impl Field {
    /// An integer from `low` to `high`.
    pub const fn int(name: &'static str, doc: &'static str, low: usize, high: usize) -> Self {
        Self { name, kind: FieldKind::Int, doc, low: low as f64, high: high as f64 }
    }

    /// A real number of a `Box` of float32, whose bounds are float32 themselves.
    pub const fn float(name: &'static str, doc: &'static str, low: f64, high: f64) -> Self {
        let (low, high) = (low as f32 as f64, high as f32 as f64);
        Self { name, kind: FieldKind::Float, doc, low, high }
    }

    /// The same from `-bound` to `bound`.
    pub const fn symmetric(name: &'static str, doc: &'static str, bound: f64) -> Self {
        Self::float(name, doc, -bound, bound)
    }
}

/// Writes an array of float32 into `out`: [`Env::fields`] where the observation is the state.
#[inline]
pub fn widen<const N: usize>(obs: &[f32; N], out: &mut [f64]) {
    for (out, &x) in out.iter_mut().zip(obs) {
        *out = f64::from(x);
    }
}

/// `x` between `low` and `high`, if its float32 is between theirs: the inverse of [`widen`] for a
/// field that is bounded in float64, whose bounds may have been rounded outwards. `None` for NaN.
pub fn within(x: f64, low: f64, high: f64) -> Option<f64> {
    (low as f32..=high as f32).contains(&(x as f32)).then(|| x.clamp(low, high))
}

/// The angle of a cosine and a sine that need not be normalised exactly, in radians from -π to π.
/// `None` if they have no direction.
pub fn angle(cos: f64, sin: f64) -> Option<f64> {
    let directed = cos.is_finite() && sin.is_finite() && (cos != 0.0 || sin != 0.0);
    directed.then(|| math::atan2(sin, cos))
}

/// The fields of an environment's states, and the facts that are the same in all of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Schema {
    /// Per-state numbers: `s.name`, or `s[i]` by position.
    pub fields: Vec<Field>,
    /// Facts about this instance, readable as `s.name` too: `rows`, `goal_col`, ….
    pub facts: Vec<(&'static str, FieldKind, f64)>,
    /// What each action is called, in order: `["left", "down", "right", "up"]`.
    pub actions: Vec<String>,
    /// The map, if the environment is a grid world whose state index is `row * cols + col`.
    pub grid: Option<Grid>,
}

/// A grid world's map, for drawing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Grid {
    /// The tiles, one string of equal length per row.
    pub rows: Vec<String>,
    /// An arrow per action, in action order: `←↓→↑`.
    pub arrows: &'static [char],
}
