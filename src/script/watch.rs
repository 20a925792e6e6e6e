//! Ceilings on time and memory while a script runs, and who keeps them.
//!
//! Operations are counted (see `sandbox`), which ends every loop in the same place on every machine.
//! But an operation may be a native function's that works on 16,000 values, or doubles what a
//! closure holds. So a thread of its own looks every few milliseconds at what runs: first it asks
//! the script to stop, which it does at its next operation, with its place; if there is no next
//! operation it reports by itself and ends the process.

use std::io;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError, Weak};
use std::time::{Duration, Instant};

use super::diagnostic::{Diagnostic, Place};
use super::memory;

/// Unoptimised code is several times slower.
const SLOWNESS: u32 = if cfg!(debug_assertions) { 2 } else { 1 };
/// Processor time after which the script is asked to stop: for building the plan, or for one call of
/// a callback.
const SOFT_TIME: Duration = Duration::from_millis(1200 * SLOWNESS as u64);
/// Processor time after which it is ended.
const HARD_TIME: Duration = Duration::from_millis(1500 * SLOWNESS as u64);
/// The same by the clock on the wall, for what blocks: a loaded machine must do no harm.
const WALL_TIME: Duration = Duration::from_secs(15 * SLOWNESS as u64);
/// How often is looked.
const LOOK: Duration = Duration::from_millis(10);

const MIB: isize = 1 << 20;
/// What building the plan may take, in bytes; allocators take up to half as much again around
/// small pieces.
const PLAN_MEMORY: isize = 128 * MIB;
/// What one call of a callback may take.
const CALL_MEMORY: isize = 32 * MIB;
/// What callbacks of one thread may keep from call to call. They can keep nothing that is of use:
/// only values that hold each other in a circle.
const KEPT_MEMORY: isize = 8 * MIB;
/// The script is asked to stop when less than this is left.
const LAST_MEMORY: isize = 8 * MIB;

/// Why a script is asked to stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stop {
    /// It takes too long.
    Time,
    /// It takes too much memory.
    Memory,
}

impl Stop {
    /// In words.
    pub(super) fn diagnostic(self) -> Diagnostic {
        match self {
            Self::Time => Diagnostic::error("the script takes too long").hint(format!(
                "building the plan, or one call of a function, may take {} s",
                HARD_TIME.as_secs_f64()
            )),
            Self::Memory => Diagnostic::error("the script takes too much memory").hint(format!(
                "building the plan may take {} MiB, one call of a function {} MiB",
                PLAN_MEMORY / MIB,
                CALL_MEMORY / MIB
            )),
        }
    }
}

/// What of a script runs, for messages.
#[derive(Debug, Clone, PartialEq)]
struct Activity {
    /// `building the plan`.
    doing: String,
    place: Option<Place>,
    source_line: Option<Box<str>>,
}

impl Activity {
    /// `d` with when it happened, and for what.
    fn describe(&self, d: Diagnostic, when: &str, circumstance: &str) -> Diagnostic {
        let mut d = d.at(self.place.clone()).note(format!("{when} {}", self.doing));
        d.source_line.clone_from(&self.source_line);
        if circumstance.is_empty() { d } else { d.note(circumstance) }
    }
}

/// A thread that runs scripts, as the others see it.
#[derive(Debug)]
struct Slot {
    number: u64,
    /// Its number among the system's threads, if it has one that its time can be asked by.
    thread: Option<u32>,
    /// Odd while the script runs.
    turn: AtomicU64,
    /// The turn that shall end.
    stop: AtomicU64,
    activity: AtomicUsize,
    /// For which variant, in the words of a note.
    circumstance: Mutex<Arc<str>>,
}

#[derive(Debug, Default)]
struct Register {
    slots: Vec<Weak<Slot>>,
    activities: Vec<Activity>,
    threads: u64,
}

static REGISTER: Mutex<Register> =
    Mutex::new(Register { slots: Vec::new(), activities: Vec::new(), threads: 0 });
/// Whether somebody looks.
static ON: AtomicBool = AtomicBool::new(false);
static LEDGER: OnceLock<Ledger> = OnceLock::new();

fn locked<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    // What is behind these locks is whole at every moment.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// This thread's part in the ceilings.
#[derive(Debug, Clone)]
pub(super) struct Watched {
    slot: Arc<Slot>,
    on: bool,
}

thread_local! {
    static WATCHED: Watched = Watched::new();
}

impl Watched {
    /// The one of this thread.
    pub(super) fn here() -> Self {
        WATCHED.with(Clone::clone)
    }

    fn new() -> Self {
        let mut register = locked(&REGISTER);
        register.threads += 1;
        let slot = Arc::new(Slot {
            number: register.threads,
            thread: thread_number(),
            turn: AtomicU64::new(0),
            stop: AtomicU64::new(0),
            activity: AtomicUsize::new(0),
            circumstance: Mutex::default(),
        });
        memory::number_thread(slot.number);
        register.slots.push(Arc::downgrade(&slot));
        Self { slot, on: ON.load(Ordering::Relaxed) }
    }

    /// What runs, by a number for [`Self::turn`]; the same for the same.
    pub(super) fn activity(doing: String, place: Option<Place>, line: Option<Box<str>>) -> usize {
        let activity = Activity { doing, place, source_line: line };
        let known = &mut locked(&REGISTER).activities;
        known.iter().position(|a| *a == activity).unwrap_or_else(|| {
            known.push(activity);
            known.len() - 1
        })
    }

    /// Says for what the script runs from now on, in words that stand in a note.
    pub(super) fn circumstance(&self, text: &str) {
        *locked(&self.slot.circumstance) = text.into();
    }

    /// Begins building a plan, or what belongs to it; it ends when the turn is dropped.
    pub(super) fn plan(&self, doing: &str) -> Turn<'_> {
        let turn = self.turn(Self::activity(doing.into(), None, None), PLAN_MEMORY);
        self.announce();
        turn
    }

    /// Begins a call of a callback.
    #[inline]
    pub(super) fn call(&self, activity: usize) -> Turn<'_> {
        self.turn(activity, CALL_MEMORY)
    }

    #[inline]
    fn turn(&self, activity: usize, bytes: isize) -> Turn<'_> {
        let turn = self.slot.turn.load(Ordering::Relaxed);
        // A call within the building of the plan is part of it.
        let outermost = self.on && turn.is_multiple_of(2);
        if outermost {
            self.slot.activity.store(activity, Ordering::Relaxed);
            self.slot.turn.store(turn + 1, Ordering::Release);
            memory::allow(Some(bytes));
        }
        Turn { watched: outermost.then_some(self) }
    }

    /// Whether the script shall stop now.
    #[inline]
    pub(super) fn stop(&self) -> Option<Stop> {
        // No turn is stopped before the first, which is number 1.
        let stop = self.slot.stop.load(Ordering::Relaxed);
        if stop != 0 && stop == self.slot.turn.load(Ordering::Relaxed) {
            return Some(Stop::Time);
        }
        (memory::left() < LAST_MEMORY).then_some(Stop::Memory)
    }

    /// Leaves word of what runs, for whoever finds this process dead: a stack that overflows leaves
    /// no time for it. Called once a call has done so much that it may come to that.
    #[cold]
    pub(super) fn announce(&self) {
        if let (true, Some(ledger)) = (self.on, LEDGER.get()) {
            let circumstance = locked(&self.slot.circumstance).clone();
            let activity = self.slot.activity.load(Ordering::Relaxed);
            let register = locked(&REGISTER);
            if let Some(activity) = register.activities.get(activity) {
                ledger.write(activity, &circumstance);
            }
        }
    }
}

/// A time in which the script runs on this thread.
pub(super) struct Turn<'a> {
    watched: Option<&'a Watched>,
}

impl Drop for Turn<'_> {
    #[inline]
    fn drop(&mut self) {
        if let Some(watched) = self.watched {
            let turn = &watched.slot.turn;
            turn.store(turn.load(Ordering::Relaxed) + 1, Ordering::Release);
            memory::allow(None);
        }
    }
}

/// The error if calls have kept more than they may.
pub(super) fn kept_too_much(kept: isize) -> Option<Diagnostic> {
    (kept > KEPT_MEMORY).then(|| {
        Diagnostic::error(format!(
            "this function keeps memory from call to call: more than {} MiB by now",
            KEPT_MEMORY / MIB
        ))
        .hint("does it build closures or maps that hold each other in a circle?")
    })
}

/// Starts to look after the ceilings, once a process. A violation that the script cannot be stopped
/// at goes to `report`, which ends the process. `ledger` is where [`read_ledger`] reads, if somebody
/// watches over this process; `orphaned` says whether he is gone: then it ends at once.
///
/// # Errors
/// If there can be no further thread.
pub fn start(
    ledger: Option<std::fs::File>,
    report: fn(Option<&Diagnostic>),
    orphaned: impl Fn() -> bool + Send + 'static,
) -> io::Result<()> {
    if let Some(file) = ledger {
        let _ = LEDGER.set(Ledger(Mutex::new(file)));
    }
    ON.store(true, Ordering::Relaxed);
    let look = move || {
        let mut seen = Vec::new();
        loop {
            std::thread::sleep(LOOK);
            if let Some(diagnostic) = violation(&mut seen) {
                report(Some(&diagnostic));
            }
            if orphaned() {
                report(None);
            }
        }
    };
    std::thread::Builder::new().stack_size(1 << 18).name("watch".into()).spawn(look)?;
    Ok(())
}

/// A turn that has been seen before.
struct Seen {
    number: u64,
    turn: u64,
    looks: u32,
    since: Instant,
    /// Processor time of its thread when it was first measured.
    used: Option<Duration>,
}

/// One look at all threads.
fn violation(seen: &mut Vec<Seen>) -> Option<Diagnostic> {
    let mut register = locked(&REGISTER);
    register.slots.retain(|slot| slot.strong_count() > 0);
    let slots: Vec<Arc<Slot>> = register.slots.iter().filter_map(Weak::upgrade).collect();
    drop(register);
    seen.retain(|s| slots.iter().any(|slot| slot.number == s.number));
    for slot in &slots {
        if memory::exhausted() == Some(slot.number) {
            return Some(describe(slot, Stop::Memory));
        }
        let turn = slot.turn.load(Ordering::Acquire);
        let known = seen.iter_mut().find(|s| s.number == slot.number);
        match known {
            Some(known) if known.turn == turn && turn % 2 == 1 => {
                known.looks += 1;
                if known.looks == 2 {
                    known.used = processor_time(slot);
                }
                let wall = known.since.elapsed();
                let used = known
                    .used
                    .and_then(|before| processor_time(slot).map(|now| now.saturating_sub(before)));
                let used = used.unwrap_or_default();
                if used > SOFT_TIME || wall > WALL_TIME.mul_f64(0.8) {
                    slot.stop.store(turn, Ordering::Relaxed);
                }
                let still = slot.turn.load(Ordering::Acquire) == turn;
                if still && (used > HARD_TIME || wall > WALL_TIME) {
                    return Some(describe(slot, Stop::Time));
                }
            }
            Some(known) => {
                (known.turn, known.looks) = (turn, 0);
                (known.since, known.used) = (Instant::now(), None);
            }
            None => seen.push(Seen {
                number: slot.number,
                turn,
                looks: 0,
                since: Instant::now(),
                used: None,
            }),
        }
    }
    None
}

fn describe(slot: &Slot, stop: Stop) -> Diagnostic {
    let circumstance = locked(&slot.circumstance).clone();
    let register = locked(&REGISTER);
    let activity = register.activities.get(slot.activity.load(Ordering::Relaxed));
    match activity {
        Some(activity) => activity.describe(stop.diagnostic(), "while", &circumstance),
        None => stop.diagnostic(),
    }
}

#[cfg(target_os = "linux")]
fn thread_number() -> Option<u32> {
    u32::try_from(rustix::thread::gettid().as_raw_nonzero().get()).ok()
}

/// Processor time that the slot's thread has used since it began.
#[cfg(target_os = "linux")]
fn processor_time(slot: &Slot) -> Option<Duration> {
    let path = format!("/proc/self/task/{}/schedstat", slot.thread?);
    let text = std::fs::read_to_string(path).ok()?;
    text.split(' ').next()?.parse().ok().map(Duration::from_nanos)
}

#[cfg(not(target_os = "linux"))]
fn thread_number() -> Option<u32> {
    None
}

/// Elsewhere time is the wall's.
#[cfg(not(target_os = "linux"))]
fn processor_time(_: &Slot) -> Option<Duration> {
    None
}

/// A file in which the process leaves word of what it does.
#[derive(Debug)]
struct Ledger(Mutex<std::fs::File>);

impl Ledger {
    /// If that is impossible, a death is reported without what the script did.
    fn write(&self, activity: &Activity, circumstance: &str) {
        use io::{Seek, Write};
        let place = activity.place.as_ref().map(|p| (&*p.file, p.line, p.column));
        let word = (&activity.doing, circumstance, place, &activity.source_line);
        let Ok(mut bytes) = serde_json::to_vec(&word) else { return };
        // Whatever was longer before ends behind the line break.
        bytes.push(b'\n');
        let mut file = locked(&self.0);
        let _ = file.rewind().and_then(|()| file.write_all(&bytes));
    }
}

/// `diagnostic` with what the script of another process was last seen doing, as `ledger` says.
pub fn read_ledger(ledger: &mut std::fs::File, diagnostic: Diagnostic) -> Diagnostic {
    use io::{BufRead, Seek};
    type Word = (String, String, Option<(String, usize, usize)>, Option<Box<str>>);
    let mut line = Vec::new();
    let read =
        ledger.rewind().and_then(|()| io::BufReader::new(ledger).read_until(b'\n', &mut line));
    let word = read.ok().and_then(|_| serde_json::from_slice::<Word>(&line).ok());
    let Some((doing, circumstance, place, source_line)) = word else { return diagnostic };
    let place = place.map(|(file, line, column)| Place { file: file.into(), line, column });
    Activity { doing, place, source_line }.describe(diagnostic, "last seen", &circumstance)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_are_those_of_the_documentation() {
        let text = include_str!("../../docs/safety.md");
        let seconds = HARD_TIME.as_secs_f64() / f64::from(SLOWNESS);
        let wall = WALL_TIME.as_secs() / u64::from(SLOWNESS);
        let (plan, call, kept) = (PLAN_MEMORY / MIB, CALL_MEMORY / MIB, KEPT_MEMORY / MIB);
        for row in [
            format!("| processor time | {seconds} s | {seconds} s |"),
            format!("| time by the clock on the wall | {wall} s | {wall} s |"),
            format!("| memory | {plan} MiB | {call} MiB |"),
            format!("| memory kept from call to call | | {kept} MiB |"),
        ] {
            assert!(text.contains(&row), "{row}");
        }
    }

    #[test]
    fn what_was_announced_is_read_by_the_other_process() {
        let mut file = tempfile::tempfile().unwrap();
        let ledger = Ledger(Mutex::new(file.try_clone().unwrap()));
        let place = Place { file: "a.rhai".into(), line: 3, column: 4 };
        let long = Activity { doing: "x".repeat(500), place: None, source_line: None };
        ledger.write(&long, "");
        let activity = Activity {
            doing: "calling `f`".into(),
            place: Some(place.clone()),
            source_line: Some("fn f(s) { 1 }".into()),
        };
        ledger.write(&activity, "in variant `v`");
        let d = read_ledger(&mut file, Diagnostic::error("it died"));
        assert_eq!((d.place, d.source_line.as_deref()), (Some(place), Some("fn f(s) { 1 }")));
        assert_eq!(d.notes, ["last seen calling `f`", "in variant `v`"]);
        let empty = read_ledger(&mut tempfile::tempfile().unwrap(), Diagnostic::error("it died"));
        assert_eq!(empty, Diagnostic::error("it died"));
    }
}
