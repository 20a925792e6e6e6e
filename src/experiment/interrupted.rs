//! A network's unit on its way: what is kept of it besides the agent, and how all of it is written
//! down, so that training goes on after an interruption as if there had been none.

use std::time::{Duration, Instant};

use super::record::{EpisodeRow, StartValue, TrainedNetwork};
use super::store::{Checkpoint, Store, StoreError};
use super::unit::Unit;
use crate::learn::dqn::{Dqn, Snapshot};
use crate::mdp::Ending;
use crate::mdp::numpy::NumpyRng;
use crate::stats::mean;

/// How often a unit is written down that is not asked to stop: what a crash costs at most. When that
/// happens changes no result.
const INTERVAL: Duration = Duration::from_secs(30);

/// Numbers of an episode besides its terms.
const NUMBERS: usize = 8;

/// Where a unit is written down while it is under way.
#[derive(Debug, Clone, Copy)]
pub struct Resumable<'a> {
    /// The store.
    pub store: &'a Store,
    /// The unit.
    pub unit: &'a Unit,
}

/// What was done so far.
pub(super) struct SoFar<'a> {
    pub(super) rows: Vec<EpisodeRow>,
    /// The environment's generator.
    pub(super) rng: NumpyRng,
    /// The network of the best mean return so far, and that mean.
    best: Option<(f64, TrainedNetwork)>,
    at: Option<Resumable<'a>>,
    written: Instant,
}

impl<'a> SoFar<'a> {
    /// Nothing.
    pub(super) fn start(seed: u64, episodes: u32, at: Option<Resumable<'a>>) -> Self {
        Self {
            rows: Vec::with_capacity(episodes as usize),
            rng: NumpyRng::from_u64(seed),
            best: None,
            at,
            written: Instant::now(),
        }
    }

    /// What was written down of the unit, with `agent` as it was then; the agent as it is if there
    /// is nothing that is whole and fits.
    pub(super) fn resume(self, agent: Dqn) -> (Self, Dqn) {
        let Some(at) = self.at else { return (self, agent) };
        let Some(snapshot) = at.store.partial(at.unit) else { return (self, agent) };
        match agent.clone().restore(&snapshot) {
            Some(restored) => match self.read(&snapshot, &restored) {
                Ok(resumed) => (resumed, restored),
                Err(nothing) => (nothing, agent),
            },
            None => (self, agent),
        }
    }

    fn read(self, from: &Snapshot, agent: &Dqn) -> Result<Self, Self> {
        let read = || {
            let rng: NumpyRng = from.get("environment")?;
            let n_terms: usize = from.get("n_terms")?;
            let rows = from.doubles.get("episodes")?;
            let rows = rows.chunks(NUMBERS + n_terms).map(|row| episode(row, n_terms));
            let rows: Vec<EpisodeRow> = rows.collect::<Option<_>>()?;
            let best = match from.get::<Option<(f64, u32)>>("best")? {
                None => None,
                Some((mean, episode)) => {
                    let mut net = agent.network().clone();
                    from.copy("best", net.params_mut())?;
                    Some((mean, TrainedNetwork { which: Checkpoint::Best, episode, net }))
                }
            };
            Some((rows, rng, best))
        };
        match read() {
            Some((rows, rng, best)) => Ok(Self { rows, rng, best, ..self }),
            None => Err(self),
        }
    }

    /// An episode was played, after which the generator is `rng`.
    pub(super) fn played(&mut self, row: EpisodeRow, window: usize, agent: &Dqn, rng: &NumpyRng) {
        self.rows.push(row);
        if let Some(last) = self.rows.len().checked_sub(window) {
            let returns: Vec<f64> = self.rows[last..].iter().map(|row| row.native).collect();
            let mean = mean(&returns);
            if self.best.as_ref().is_none_or(|(best, _)| mean > *best) {
                let episode = self.rows.len() as u32;
                let net = agent.network().clone();
                self.best = Some((mean, TrainedNetwork { which: Checkpoint::Best, episode, net }));
            }
        }
        if self.at.is_some() && self.written.elapsed() > INTERVAL {
            self.rng = rng.clone();
            // Should the disk be full, the unit's own files will say so.
            let _ = self.write(agent);
            self.written = Instant::now();
        }
    }

    /// Writes down everything, if there is a place for it and the agent is between two episodes.
    ///
    /// # Errors
    /// If it cannot be written.
    pub(super) fn write(&self, agent: &Dqn) -> Result<(), StoreError> {
        let Some(at) = self.at else { return Ok(()) };
        let steps: u64 = self.rows.iter().map(|row| u64::from(row.steps)).sum();
        // One that has diverged is not to be gone on with: it fails at the same step when run anew.
        if steps != agent.steps() || steps == 0 || agent.failed_at().is_some() {
            return Ok(());
        }
        let mut snapshot = Snapshot::default();
        agent.save(&mut snapshot);
        snapshot.put("environment", &self.rng);
        snapshot.put("n_terms", &self.rows.first().map_or(0, |row| row.terms.len()));
        snapshot.doubles.insert("episodes".into(), self.rows.iter().flat_map(numbers).collect());
        let best = self.best.as_ref();
        snapshot.put("best", &best.map(|(mean, best)| (*mean, best.episode)));
        if let Some((_, best)) = best {
            snapshot.singles.insert("best".into(), best.net.params().to_vec());
        }
        at.store.put_partial(at.unit, &snapshot)
    }

    /// The networks that are kept: the last, and the best or if no window was full, the last again.
    pub(super) fn networks(&self, agent: &Dqn) -> Vec<TrainedNetwork> {
        let last = |which| {
            let net = agent.network().clone();
            TrainedNetwork { which, episode: self.rows.len() as u32, net }
        };
        let best = self.best.as_ref().map(|(_, best)| best.clone());
        vec![last(Checkpoint::Last), best.unwrap_or_else(|| last(Checkpoint::Best))]
    }
}

/// An episode as numbers.
fn numbers(row: &EpisodeRow) -> Vec<f64> {
    let ending = f64::from(u8::from(row.ending == Ending::Truncated));
    let mut numbers =
        vec![f64::from(row.steps), row.native, row.learned, row.shaping, row.epsilon, ending];
    let start = row.start.expect("a network's episodes begin with a value");
    numbers.extend([start.believed, start.brought]);
    numbers.extend(&row.terms);
    numbers
}

/// The episode that [`numbers`] wrote.
fn episode(numbers: &[f64], n_terms: usize) -> Option<EpisodeRow> {
    let (&[steps, native, learned, shaping, epsilon, ending, believed, brought], terms) =
        numbers.split_first_chunk()?;
    let ending = if ending == 0.0 { Ending::Terminated } else { Ending::Truncated };
    (terms.len() == n_terms).then(|| EpisodeRow {
        steps: steps as u32,
        native,
        learned,
        shaping,
        terms: terms.to_vec(),
        epsilon,
        ending,
        value_error: None,
        start: Some(StartValue { believed, brought }),
    })
}
