//! A finite model of a discretised environment, from samples of every cell.
//!
//! From each cell k states are drawn uniformly, and from each of them every action is played. What
//! comes of (cell, action) is collected by the next cell and by whether the episode ended: the share
//! of the samples is the outcome's probability, and their mean rewards are its rewards. That is the
//! model of *state aggregation* with uniform weights (Bertsekas & Tsitsiklis 1996, section 6.7): a
//! learner's own weights are those of the states it visits, and a discretised environment has no
//! Markov property. Whatever is found about this model is true of the sampled aggregated model, and
//! of nothing else.
//!
//! Every cell has its own stream of random numbers, so the model depends on the seed only: not on
//! the number of threads.

mod collect;
#[cfg(test)]
mod tests;

use crate::mdp::numpy::NumpyRng;
use crate::mdp::{Env, FiniteMdp, Outcome};
use crate::shaping::{Dim, Fault, Transition};
use collect::{Chunk, collect};

/// What [`sampled`] draws.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampledSettings {
    /// Number of cells.
    pub n_cells: usize,
    /// States that are drawn from each cell, 1 or more.
    pub samples: usize,
    /// Episodes whose first state is looked at, 1 or more: the model's initial distribution.
    pub starts: usize,
    /// The learner's discount factor γ.
    pub gamma: f64,
    /// How many steps of the environment an action is repeated, 1 or more.
    pub frame_skip: u32,
    /// The seed of everything that is drawn.
    pub seed: u64,
    /// Number of threads, 1 or more.
    pub threads: usize,
}

/// The discretiser and what shapes the reward, as one thread asks them.
pub struct Asked<'a, E: Env> {
    /// Observation → cell.
    pub cell: CellOf<'a, E>,
    /// Φ of an observation in a cell; 0 if there is no potential. Asked once for each state, but not
    /// beyond a terminal transition.
    pub phi: PhiOf<'a, E>,
    /// The reward learned from less the native one, without the potential's part.
    pub extra: ExtraOf<'a, E>,
}

/// See [`Asked::cell`].
pub type CellOf<'a, E> = Box<dyn FnMut(&E, &<E as Env>::Obs) -> Result<usize, Fault> + 'a>;

/// See [`Asked::phi`].
pub type PhiOf<'a, E> = Box<dyn FnMut(&E, usize, &<E as Env>::Obs) -> Result<f64, Fault> + 'a>;

/// See [`Asked::extra`].
pub type ExtraOf<'a, E> =
    Box<dyn FnMut(&E, &Transition<'_, <E as Env>::Obs>) -> Result<f64, Fault> + 'a>;

/// A sampled aggregated model.
#[derive(Debug, Clone, PartialEq)]
pub struct Sampled {
    /// The model with native rewards: a state for every cell.
    ///
    /// An excluded cell ends the episode, for nothing.
    pub mdp: FiniteMdp,
    /// The mean of what shaping adds to the reward, the potential's part included, for each of
    /// [`FiniteMdp::outcomes`].
    pub shaping: Vec<f64>,
    /// The mean Φ of each cell's samples; 0 for excluded cells.
    pub phi: Vec<f64>,
    /// Whether no state was found in a cell from which an episode could go on, one flag per cell.
    pub excluded: Vec<bool>,
    /// Number of transitions sampled.
    pub transitions: usize,
    /// How many of them lead into an excluded cell although the episode goes on there: the model is
    /// wrong about those.
    pub lost: usize,
}

impl Sampled {
    /// The model with the rewards that are learned from.
    #[must_use]
    pub fn shaped(&self) -> FiniteMdp {
        let mut outcome = 0;
        self.mdp.with_rewards(|_, _, o| {
            outcome += 1;
            o.reward + self.shaping[outcome - 1]
        })
    }

    /// Number of excluded cells.
    pub fn n_excluded(&self) -> usize {
        self.excluded.iter().filter(|&&excluded| excluded).count()
    }
}

/// The ranges of the fields in a cell of bins: `ranges(cell, out)` fills `out`, one `[low, high]`
/// per field, with those of `all` but for the binned fields. Cells are numbered as by
/// [`Bins`](crate::shaping::Bins): the last dimension varies fastest. The first and the last bin of
/// a field hold what lies outside too, but nothing is drawn from there.
pub fn cell_ranges(
    dims: &[Dim],
    all: &[[f64; 2]],
) -> impl Fn(usize, &mut [[f64; 2]]) + Sync + use<> {
    let (dims, all) = (dims.to_vec(), all.to_vec());
    move |mut cell, out| {
        out.copy_from_slice(&all);
        for d in dims.iter().rev() {
            let width = (d.hi - d.lo) / d.n as f64;
            let k = (cell % d.n) as f64;
            out[d.field] = [d.lo + k * width, d.lo + (k + 1.0) * width];
            cell /= d.n;
        }
    }
}

/// Samples the model of `env` discretised.
///
/// `ranges(cell, out)` says from where to draw the fields of the states in a cell (what is drawn and
/// is no state, or one of another cell, is drawn again, a few times). `asked` is called once in
/// every thread. `progress` hears how many cells are done, and of how many.
///
/// `None` if no cell has a state that `env` can be put into ([`Env::set_state`]).
///
/// # Errors
/// The first cell's for which a callback fails, or does not return a finite number or a cell.
pub fn sampled<'a, E, R, A>(
    env: &E,
    settings: &SampledSettings,
    ranges: &R,
    asked: &A,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Option<Sampled>, Fault>
where
    E: Env + Clone,
    R: Fn(usize, &mut [[f64; 2]]) + Sync,
    A: Fn() -> Asked<'a, E> + Sync,
{
    let chunks = collect(env, settings, ranges, asked, progress)?;
    let n_outcomes = chunks.iter().map(|chunk| chunk.outcomes.len()).sum();
    let mut outcomes: Vec<Outcome> = Vec::with_capacity(n_outcomes);
    let mut shaping = Vec::with_capacity(n_outcomes);
    let mut counts = Vec::with_capacity(n_outcomes);
    let mut offsets = vec![0];
    let (mut phi, mut excluded) = (Vec::new(), Vec::new());
    for chunk in chunks {
        let Chunk { lens, outcomes: list, shaping: f, counts: n, phi: at, excluded: out } = chunk;
        for len in lens {
            offsets.push(offsets[offsets.len() - 1] + len);
        }
        outcomes.extend(list);
        shaping.extend(f);
        counts.extend(n);
        phi.extend(at);
        excluded.extend(out);
    }
    if excluded.iter().all(|&out| out) {
        return Ok(None);
    }
    let lost = |(o, n): (&Outcome, &u32)| {
        let lost = !o.terminated && excluded[o.next_state as usize];
        if lost { *n as usize } else { 0 }
    };
    let lost = outcomes.iter().zip(&counts).map(lost).sum();
    let transitions = counts.iter().map(|&n| n as usize).sum();
    let initial = initial(env, settings, asked().cell)?;
    let mdp = FiniteMdp::from_parts(env.n_actions(), offsets, outcomes, initial)
        .map_err(|error| Fault(Box::new(error)))?;
    Ok(Some(Sampled { mdp, shaping, phi, excluded, transitions, lost }))
}

/// The share of the episodes that start in each cell.
fn initial<E: Env + Clone>(
    env: &E,
    settings: &SampledSettings,
    mut cell: CellOf<'_, E>,
) -> Result<Vec<f64>, Fault> {
    let (mut env, mut rng) = (env.clone(), NumpyRng::from_u64(settings.seed));
    let mut counts = vec![0u32; settings.n_cells];
    for _ in 0..settings.starts {
        let obs = env.reset(&mut rng);
        counts[within(settings.n_cells, cell(&env, &obs)?)?] += 1;
    }
    Ok(counts.into_iter().map(|n| f64::from(n) / settings.starts as f64).collect())
}

/// `cell`, if it is one.
fn within(n_cells: usize, cell: usize) -> Result<usize, Fault> {
    if cell < n_cells {
        return Ok(cell);
    }
    Err(Fault(
        format!("there are {n_cells} cells, and {cell} is none of 0 to {}", n_cells - 1).into(),
    ))
}
