//! `runner watch SCRIPT`: at each save of the script, or of a file that it imports, runs it again and
//! shows what came of it.
//!
//! Each pass is a process of its own, `runner exec SCRIPT --watched`: nothing leaks from one to the
//! next, no script can harm the watcher, and what was finished before a save came in between stays in
//! the results folder, so that only what changed is run. A pass is stopped by closing its stdin, which
//! also ends it should the watcher be killed.
//!
//! Files are looked at twenty times a second instead of waiting for the system's notifications: there
//! are a few small ones, and it works on every file system, however an editor saves.

mod screen;

use std::ffi::OsString;
use std::io::Read;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use clap::Args as ClapArgs;

use self::screen::{Report, Screen};
use super::{Failure, Outcome};
use crate::script::{Snapshot, snapshot};

#[derive(Debug, ClapArgs)]
pub(super) struct Args {
    /// The script
    script: PathBuf,
    /// Folder for the results [default: results/<study>]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Run only the first N seeds of each variant, or as many more from 0 on
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    seeds: Option<u32>,
    /// Episodes per seed, instead of the script's
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000_000))]
    episodes: Option<u32>,
    /// Threads [default: all cores]; results do not depend on it
    #[arg(long, short, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
}

/// How often files are looked at.
const POLL: Duration = Duration::from_millis(50);
/// How long a file may be gone while an editor replaces it.
const GONE: Duration = Duration::from_millis(500);
/// How long a pass may take to stop before it is killed.
const PATIENCE: Duration = Duration::from_secs(5);

/// Whether the user has pressed Ctrl-C.
static STOP: AtomicBool = AtomicBool::new(false);

fn stopped() -> bool {
    STOP.load(Ordering::Relaxed)
}

/// Watches until Ctrl-C, which is no failure: there is no other way to end it.
pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    if !args.script.is_file() {
        let message = format!("{}: there is no such file to watch", args.script.display());
        return Err(Failure::Message(message, Some("`runner new NAME` writes a script".into())));
    }
    ctrlc::set_handler(|| STOP.store(true, Ordering::Relaxed))
        .map_err(|e| Failure::Message(e.to_string(), None))?;
    let mut screen = Screen::open(&args.script);
    let mut seen = snapshot(&args.script);
    while let Some(report) = follow(args, &mut seen, &mut screen)? {
        screen.show(report, &seen)?;
        while snapshot(&args.script) == seen {
            if stopped() {
                return Ok(Outcome::Fine);
            }
            std::thread::sleep(POLL);
        }
        seen = settled(args);
    }
    Ok(Outcome::Fine)
}

/// The files once they have come to rest: an editor may write one in parts, or remove it first.
fn settled(args: &Args) -> Snapshot {
    let begun = Instant::now();
    let mut seen = snapshot(&args.script);
    loop {
        std::thread::sleep(POLL);
        let now = snapshot(&args.script);
        let whole = now.values().all(|text| text.as_ref().is_some_and(|text| !text.is_empty()));
        if stopped() || (now == seen && (whole || begun.elapsed() > GONE)) {
            return now;
        }
        seen = now;
    }
}

/// Runs a pass over what is `seen`, and starts over when that changes under way; `None` if the user
/// has had enough.
fn follow(
    args: &Args,
    seen: &mut Snapshot,
    screen: &mut Screen,
) -> Result<Option<Report>, Failure> {
    loop {
        let mut pass = Pass::start(args, screen)?;
        loop {
            if stopped() {
                pass.stop();
                return Ok(None);
            }
            if let Some(report) = pass.ended()? {
                // Stopped by someone else, or by the Ctrl-C that is on its way here as well.
                if stopped() {
                    return Ok(None);
                }
                return Ok(Some(report));
            }
            if snapshot(&args.script) != *seen {
                pass.stop();
                *seen = settled(args);
                break;
            }
            screen.running(pass.begun.elapsed())?;
            std::thread::sleep(POLL);
        }
    }
}

/// A pass under way. Dropping it stops it.
struct Pass {
    child: Child,
    begun: Instant,
    /// What it has written so far: stdout and stderr.
    written: [Option<JoinHandle<String>>; 2],
}

impl Pass {
    fn start(args: &Args, screen: &Screen) -> Result<Self, Failure> {
        let failed =
            |e: std::io::Error| Failure::Message(format!("a pass cannot be started: {e}"), None);
        let mut command = Command::new(std::env::current_exe().map_err(failed)?);
        command.args(arguments(args));
        if screen.has_colours() {
            // The pass writes into a pipe, and would leave them out.
            command.env("CLICOLOR_FORCE", "1");
        }
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().map_err(failed)?;
        let written = [
            child.stdout.take().map(|from| collect(Box::new(from))),
            child.stderr.take().map(|from| collect(Box::new(from))),
        ];
        Ok(Self { child, begun: Instant::now(), written })
    }

    /// What it says, if it has come to its end.
    fn ended(&mut self) -> Result<Option<Report>, Failure> {
        let Some(status) = self.child.try_wait()? else { return Ok(None) };
        // A thread that only reads does not panic.
        let [result, remarks] =
            [0, 1].map(|i| self.written[i].take().and_then(|t| t.join().ok()).unwrap_or_default());
        let seconds = self.begun.elapsed().as_secs_f64();
        // With a code of 1 a claim does not hold, which is a result too.
        let good = matches!(status.code(), Some(0 | 1));
        let remarks = match status.code() {
            Some(0..=2) => remarks,
            _ => format!("{remarks}error: the pass has ended early ({status})\n"),
        };
        Ok(Some(Report { good, result, remarks, seconds }))
    }

    /// Asks it to stop, and waits until it has.
    fn stop(&mut self) {
        drop(self.child.stdin.take());
        let asked = Instant::now();
        while matches!(self.child.try_wait(), Ok(None)) {
            if asked.elapsed() > PATIENCE {
                // It may have ended meanwhile.
                let _ = self.child.kill();
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

impl Drop for Pass {
    fn drop(&mut self) {
        self.stop();
    }
}

/// The command line of a pass.
fn arguments(args: &Args) -> Vec<OsString> {
    let mut all: Vec<OsString> = vec!["exec".into(), "--watched".into()];
    if !crate::jit::is_enabled() {
        all.push("--no-jit".into());
    }
    let mut add = |flag: &str, value: Option<OsString>| {
        if let Some(value) = value {
            all.extend([flag.into(), value]);
        }
    };
    add("--out", args.out.clone().map(Into::into));
    add("--seeds", args.seeds.map(|n| n.to_string().into()));
    add("--episodes", args.episodes.map(|n| n.to_string().into()));
    add("--jobs", args.jobs.map(|n| n.to_string().into()));
    all.extend(["--".into(), args.script.clone().into()]);
    all
}

/// Reads to the end, beside whatever else is going on.
fn collect(mut from: Box<dyn Read + Send>) -> JoinHandle<String> {
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        // What cannot be read is not shown.
        let _ = from.read_to_end(&mut bytes);
        String::from_utf8_lossy(&bytes).into_owned()
    })
}
