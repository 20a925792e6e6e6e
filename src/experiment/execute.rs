//! Runs all units of a plan on threads.

use std::collections::BTreeSet;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::time::Instant;

use super::interrupted::Resumable;
use super::store::{Store, StoreError};
use super::unit::{Unit, UnitError, resume_unit, units};
use crate::script::{Diagnostic, Host, Plan};

/// How a run is going; read by whoever shows it.
#[derive(Debug, Default)]
pub struct Progress {
    /// Episodes finished, stored units included; with a unit that stops early also those that it
    /// need not play.
    pub episodes: AtomicU64,
    /// Steps made in this run.
    pub steps: AtomicU64,
    /// Units finished, stored units included.
    pub units: AtomicUsize,
    /// Raised to make every thread stop at the end of its episode.
    pub stop: AtomicBool,
}

/// How long a unit took.
#[derive(Debug, Clone, PartialEq)]
pub struct Finished {
    /// The unit.
    pub unit: Unit,
    /// Steps made.
    pub steps: u64,
    /// Wall time of its training, in seconds.
    pub seconds: f64,
}

/// A run that came to its end.
#[derive(Debug)]
pub struct Execution {
    /// Every unit of the plan, all of them stored.
    pub units: Vec<Unit>,
    /// Those that ran now, in the order of the plan.
    pub finished: Vec<Finished>,
}

/// A run that did not.
#[derive(Debug)]
pub enum ExecuteError {
    /// The script's fault.
    Script(Box<Diagnostic>),
    /// A unit could not be stored or read.
    Store(StoreError),
    /// It was asked to stop: so many units are stored, of so many.
    Interrupted {
        /// Units stored.
        done: usize,
        /// Units of the plan.
        total: usize,
    },
}

impl From<StoreError> for ExecuteError {
    fn from(error: StoreError) -> Self {
        Self::Store(error)
    }
}

/// Runs the units of `plan` that `store` does not hold yet, on `jobs` threads.
///
/// Results do not depend on `jobs`: a unit draws from streams of its own, and nothing else reaches
/// it. Units that were finished before an error or an interruption are kept.
///
/// # Errors
/// The error of the first failing unit in the plan's order among those that ran.
///
/// # Panics
/// Only if a worker thread has panicked: a bug.
pub fn execute(
    plan: &Plan,
    store: &Store,
    jobs: usize,
    progress: &Progress,
) -> Result<Execution, ExecuteError> {
    let all = units(plan);
    let mut todo = Vec::new();
    let mut seen = BTreeSet::new();
    for (i, unit) in all.iter().enumerate() {
        // Two variants that differ in name only are one unit.
        let twin = !seen.insert(unit.hash.as_str());
        if twin || store.has(unit)? {
            progress.units.fetch_add(1, Ordering::Relaxed);
            let episodes = u64::from(plan.variants[unit.variant].episodes);
            progress.episodes.fetch_add(episodes, Ordering::Relaxed);
        } else {
            todo.push(i);
        }
    }
    let next = AtomicUsize::new(0);
    let finished = Mutex::new(Vec::new());
    let failed = Mutex::new(None::<(usize, ExecuteError)>);
    let fail = |i: usize, error: ExecuteError| {
        let mut failed = failed.lock().expect("no thread panics while it holds this");
        if failed.as_ref().is_none_or(|(first, _)| i < *first) {
            *failed = Some((i, error));
        }
        // No further units; those under way go on, so that the error of the first failing unit is
        // reported, whichever thread was faster.
        next.store(usize::MAX / 2, Ordering::Relaxed);
    };
    std::thread::scope(|scope| {
        for _ in 0..jobs.clamp(1, todo.len().max(1)) {
            scope.spawn(|| {
                let host = match Host::open(plan) {
                    Ok(host) => host,
                    Err(d) => return fail(0, ExecuteError::Script(Box::new(d))),
                };
                while let Some(&i) = todo.get(next.fetch_add(1, Ordering::Relaxed)) {
                    if progress.stop.load(Ordering::Relaxed) {
                        break;
                    }
                    match one(plan, &all[i], store, &host, progress) {
                        Ok(done) => {
                            progress.units.fetch_add(1, Ordering::Relaxed);
                            let mut finished =
                                finished.lock().expect("no thread panics while it holds this");
                            finished.push((i, done));
                        }
                        Err(Some(error)) => fail(i, error),
                        Err(None) => break,
                    }
                }
            });
        }
    });
    if let Some((_, error)) = failed.into_inner().expect("every thread has ended") {
        return Err(error);
    }
    let mut finished = finished.into_inner().expect("every thread has ended");
    if finished.len() < todo.len() {
        let done = progress.units.load(Ordering::Relaxed);
        return Err(ExecuteError::Interrupted { done, total: all.len() });
    }
    finished.sort_by_key(|(i, _)| *i);
    Ok(Execution { units: all, finished: finished.into_iter().map(|(_, f)| f).collect() })
}

/// Runs and stores one unit; `None` if it was interrupted.
fn one(
    plan: &Plan,
    unit: &Unit,
    store: &Store,
    host: &Host,
    progress: &Progress,
) -> Result<Finished, Option<ExecuteError>> {
    let variant = &plan.variants[unit.variant];
    let start = Instant::now();
    let mut made = 0;
    let mut each = |steps: u32| {
        made += u64::from(steps);
        progress.episodes.fetch_add(1, Ordering::Relaxed);
        progress.steps.fetch_add(u64::from(steps), Ordering::Relaxed);
    };
    let at = Some(Resumable { store, unit });
    let record = match resume_unit(host, variant, unit.seed, at, &progress.stop, &mut each) {
        Ok(record) => record,
        Err(UnitError::Interrupted) => return Err(None),
        Err(UnitError::Script(d)) => return Err(Some(ExecuteError::Script(d))),
        Err(UnitError::Store(e)) => return Err(Some(e.into())),
        Err(UnitError::Diverged(d, record)) => {
            let kept = store.put_failed(unit, variant, &record).map_err(|e| Some(e.into()))?;
            let note = format!("its logs are in {}", kept.display());
            return Err(Some(ExecuteError::Script(Box::new(d.note(note)))));
        }
    };
    let seconds = start.elapsed().as_secs_f64();
    let unplayed = u64::from(variant.episodes) - record.rows.len() as u64;
    progress.episodes.fetch_add(unplayed, Ordering::Relaxed);
    store.commit(unit, variant, &record).map_err(|e| Some(e.into()))?;
    Ok(Finished { unit: unit.clone(), steps: made, seconds })
}
