//! The samples: cells in chunks, chunks in threads.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use super::{Asked, SampledSettings, within};
use crate::audit::pathwise::{advance, finite};
use crate::mdp::numpy::NumpyRng;
use crate::mdp::streams::Stream;
use crate::mdp::{Env, Outcome};
use crate::shaping::{Fault, Transition, potential_term};

/// Cells that a thread takes at a time.
const CHUNK: usize = 128;
/// Draws per sample that is wanted, at most: from cells of which only a part are states.
const TRIES: usize = 16;

/// What consecutive cells came to.
#[derive(Default)]
pub(super) struct Chunk {
    /// Number of outcomes of each (cell, action).
    pub(super) lens: Vec<u32>,
    /// By next cell and ending, in order.
    pub(super) outcomes: Vec<Outcome>,
    /// Mean F of each outcome.
    pub(super) shaping: Vec<f64>,
    /// Samples of each outcome.
    pub(super) counts: Vec<u32>,
    /// Mean Φ of each cell.
    pub(super) phi: Vec<f64>,
    /// One flag per cell.
    pub(super) excluded: Vec<bool>,
}

/// Samples of the same outcome.
struct Pile {
    next: usize,
    terminated: bool,
    count: u32,
    reward: f64,
    shaping: f64,
}

/// Every chunk, in order.
pub(super) fn collect<'a, E, R, A>(
    env: &E,
    settings: &SampledSettings,
    ranges: &R,
    asked: &A,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<Chunk>, Fault>
where
    E: Env + Clone,
    R: Fn(usize, &mut [[f64; 2]]) + Sync,
    A: Fn() -> Asked<'a, E> + Sync,
{
    let n_chunks = settings.n_cells.div_ceil(CHUNK);
    let (taken, failed, done) = (AtomicUsize::new(0), AtomicBool::new(false), AtomicUsize::new(0));
    let work = |env: E| {
        let mut sampler = Sampler::new(env, settings, ranges, asked());
        let mut chunks = Vec::new();
        // Chunks are taken in order, and one that was taken is finished: the first chunk that fails
        // is among them, whichever thread fails first.
        while !failed.load(Ordering::Relaxed) {
            let i = taken.fetch_add(1, Ordering::Relaxed);
            if i >= n_chunks {
                break;
            }
            let cells = i * CHUNK..settings.n_cells.min((i + 1) * CHUNK);
            let n = cells.len();
            let chunk = sampler.chunk(cells);
            failed.fetch_or(chunk.is_err(), Ordering::Relaxed);
            chunks.push((i, chunk));
            progress(done.fetch_add(n, Ordering::Relaxed) + n, settings.n_cells);
        }
        chunks
    };
    let threads = settings.threads.clamp(1, n_chunks.max(1));
    let mut chunks: Vec<(usize, Result<Chunk, Fault>)> = std::thread::scope(|scope| {
        let spawn = |env: E| scope.spawn(|| work(env));
        let threads: Vec<_> = (0..threads).map(|_| spawn(env.clone())).collect();
        let joined = threads.into_iter().map(|thread| match thread.join() {
            Ok(chunks) => chunks,
            Err(panic) => std::panic::resume_unwind(panic),
        });
        joined.flatten().collect()
    });
    chunks.sort_by_key(|(i, _)| *i);
    chunks.into_iter().map(|(_, chunk)| chunk).collect()
}

/// One thread's work.
struct Sampler<'s, 'a, E: Env, R> {
    env: E,
    settings: &'s SampledSettings,
    ranges: &'s R,
    asked: Asked<'a, E>,
    n_actions: usize,
    /// The ranges of the present cell, and a state's fields.
    bounds: Vec<[f64; 2]>,
    fields: Vec<f64>,
    /// The outcomes of each action in the present cell.
    piles: Vec<Vec<Pile>>,
}

impl<'s, 'a, E, R> Sampler<'s, 'a, E, R>
where
    E: Env,
    R: Fn(usize, &mut [[f64; 2]]),
{
    fn new(env: E, settings: &'s SampledSettings, ranges: &'s R, asked: Asked<'a, E>) -> Self {
        let (n_actions, n_fields) = (env.n_actions(), env.schema().fields.len());
        Self {
            env,
            settings,
            ranges,
            asked,
            n_actions,
            bounds: vec![[0.0; 2]; n_fields],
            fields: vec![0.0; n_fields],
            piles: (0..n_actions).map(|_| Vec::new()).collect(),
        }
    }

    fn chunk(&mut self, cells: std::ops::Range<usize>) -> Result<Chunk, Fault> {
        let mut chunk = Chunk::default();
        for cell in cells {
            let mut stream = Stream::new(self.settings.seed, &format!("audit cell {cell}"));
            let mut rng = NumpyRng::from_u64(stream.next_u64());
            self.env.reset(&mut rng);
            (self.ranges)(cell, &mut self.bounds);
            let (mut found, mut phi, mut tries) = (0, 0.0, TRIES * self.settings.samples);
            while found < self.settings.samples && tries > 0 {
                tries -= 1;
                if let Some(at) = self.sample(cell, &mut stream, &mut rng)? {
                    found += 1;
                    phi += at;
                }
            }
            self.close(cell, found, &mut chunk);
            chunk.phi.push(if found == 0 { 0.0 } else { phi / found as f64 });
            chunk.excluded.push(found == 0);
        }
        Ok(chunk)
    }

    /// Draws a state and plays every action from it; its Φ. `None` if the draw is no state of the
    /// cell.
    fn sample(
        &mut self,
        cell: usize,
        stream: &mut Stream,
        rng: &mut NumpyRng,
    ) -> Result<Option<f64>, Fault> {
        let Self { env, asked, settings, .. } = self;
        for (x, &[low, high]) in self.fields.iter_mut().zip(&self.bounds) {
            *x = low + (high - low) * stream.uniform();
        }
        let Some(state) = env.set_state(&self.fields) else { return Ok(None) };
        if (asked.cell)(env, &state)? != cell {
            return Ok(None);
        }
        let phi = finite((asked.phi)(env, cell, &state)?)?;
        for (action, piles) in self.piles.iter_mut().enumerate() {
            if action > 0 {
                env.set_state(&self.fields);
            }
            let step = advance(env, action, settings.frame_skip, rng);
            let t = Transition {
                state: &state,
                action,
                reward: step.reward,
                next_state: &step.obs,
                terminated: step.terminated,
                truncated: false,
                step: 0,
            };
            let next = within(settings.n_cells, (asked.cell)(env, &step.obs)?)?;
            let phi_next = if t.terminated { 0.0 } else { (asked.phi)(env, next, &step.obs)? };
            let extra = (asked.extra)(env, &t)?;
            let f = finite(extra + potential_term(settings.gamma, phi, phi_next))?;
            let same = piles.iter().position(|p| p.next == next && p.terminated == t.terminated);
            let pile = if let Some(i) = same {
                &mut piles[i]
            } else {
                let terminated = t.terminated;
                piles.push(Pile { next, terminated, count: 0, reward: 0.0, shaping: 0.0 });
                piles.last_mut().expect("just pushed")
            };
            pile.count += 1;
            pile.reward += t.reward;
            pile.shaping += f;
        }
        Ok(Some(phi))
    }

    /// Turns the piles of `found` samples into outcomes.
    fn close(&mut self, cell: usize, found: usize, chunk: &mut Chunk) {
        if found == 0 {
            for _ in 0..self.n_actions {
                chunk.lens.push(1);
                chunk.outcomes.push(Outcome {
                    probability: 1.0,
                    next_state: cell as u32,
                    reward: 0.0,
                    terminated: true,
                });
                chunk.shaping.push(0.0);
                chunk.counts.push(0);
            }
            return;
        }
        for piles in &mut self.piles {
            piles.sort_by_key(|p| (p.next, p.terminated));
            chunk.lens.push(piles.len() as u32);
            for pile in piles.drain(..) {
                let count = f64::from(pile.count);
                chunk.outcomes.push(Outcome {
                    probability: count / found as f64,
                    next_state: pile.next as u32,
                    reward: pile.reward / count,
                    terminated: pile.terminated,
                });
                chunk.shaping.push(pile.shaping / count);
                chunk.counts.push(pile.count);
            }
        }
    }
}
