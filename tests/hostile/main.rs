//! Scripts that try to hurt the machine, through the real command. Every `.rhai` file of this folder
//! is checked with `runner check`, or what its comment `// Command:` says; comments say what must
//! come of it, as in `tests/wrong`:
//!
//! ```text
//! // Error: 2:27 closures are nested more than 32 deep
//! // Note: …
//! // Hint: …
//! ```
//!
//! (The place is `somewhere`, and there are no notes, where time or memory runs out: that is chance.)
//!
//! Whatever they do, it ends in that error and exit code 2, within 2 s of processor time and
//! 300 MB. What is measured is this machine's own account of the process and of the one it
//! watches over: processor time, for a machine may be loaded, and the most memory that was resident.
#![cfg(unix)]

mod generated;
mod supervision;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use wait4::Wait4;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/hostile");

/// Unoptimised code is several times slower, and so are its ceilings.
const PROCESSOR_TIME: Duration = Duration::from_secs(if cfg!(debug_assertions) { 5 } else { 2 });
const MEMORY: u64 = 300_000_000;
/// By then a machine is not loaded, but something hangs.
const PATIENCE: Duration = Duration::from_mins(5);

/// What came of a command.
pub(crate) struct Ended {
    pub(crate) code: Option<i32>,
    pub(crate) stderr: String,
    pub(crate) time: Duration,
    pub(crate) memory: u64,
}

/// Runs `runner` with `args` in `folder`.
pub(crate) fn run(args: &[&str], folder: &Path) -> Ended {
    let stderr = tempfile::NamedTempFile::new().unwrap();
    let mut child = Command::new(env!("CARGO_BIN_EXE_runner"))
        .args(args)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(stderr.reopen().unwrap())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    let used = loop {
        if let Some(used) = child.try_wait4().unwrap() {
            break used;
        }
        assert!(begun.elapsed() < PATIENCE, "{args:?} hangs");
        std::thread::sleep(Duration::from_millis(5));
    };
    Ended {
        code: used.status.code(),
        stderr: String::from_utf8_lossy(&std::fs::read(stderr.path()).unwrap()).into_owned(),
        time: used.rusage.utime + used.rusage.stime,
        memory: used.rusage.maxrss,
    }
}

impl Ended {
    /// What is wrong with it, besides what it says; one line each.
    pub(crate) fn complaints(&self) -> String {
        let mut text = String::new();
        let mut complain = |what: String| writeln!(text, "  {what}").unwrap();
        if self.code != Some(2) {
            complain(format!("exit code {:?}", self.code));
        }
        if self.time > PROCESSOR_TIME {
            complain(format!("took {:?}", self.time));
        }
        if self.memory > MEMORY {
            complain(format!("took {} MB", self.memory / 1_000_000));
        }
        for word in ["panicked", "overflowed its stack", "memory allocation of", "fatal runtime"] {
            if self.stderr.contains(word) {
                complain(format!("says `{word}`"));
            }
        }
        if self.stderr.len() > 20_000 {
            complain(format!("says {} bytes", self.stderr.len()));
        }
        if self.stderr.matches("error: ").count() != 1 {
            complain("does not say exactly one error".into());
        }
        text
    }
}

/// The one error that the command shows, in the form of the expectations.
fn said(stderr: &str, script: &str) -> String {
    let (mut message, mut place, mut rest) = ("", "", String::new());
    // Warnings come before it.
    for line in stderr.lines().skip_while(|line| !line.starts_with("error: ")) {
        let trimmed = line.trim_start();
        if let Some(text) = line.strip_prefix("error: ") {
            message = text;
        } else if let Some(at) = trimmed.strip_prefix("--> ").filter(|_| place.is_empty()) {
            place = at.strip_prefix(script).map_or(at, |at| &at[1..]);
        } else if let Some(note) = trimmed.strip_prefix("= note: ").filter(|_| !is_chance(message))
        {
            writeln!(rest, "// Note: {note}").unwrap();
        } else if let Some(hint) = trimmed.strip_prefix("= help: ") {
            writeln!(rest, "// Hint: {hint}").unwrap();
        }
    }
    if is_chance(message) {
        place = "somewhere";
    }
    let space = if place.is_empty() { "" } else { " " };
    format!("// Error: {place}{space}{message}\n{rest}")
}

/// Whether it depends on the machine where a script is when this happens.
fn is_chance(message: &str) -> bool {
    message.starts_with("the script takes too") || message.contains("keeps memory")
}

/// Whether two texts say the same. Which ceiling is met first, and where, depends on how fast the
/// machine is; that one is met does not.
fn agree(expected: &str, said: &str) -> bool {
    const CEILINGS: [&str; 4] = [
        "the script takes too long",
        "the script takes too much memory",
        "keeps memory",
        "the operation budget is used up",
    ];
    let is_ceiling = |text: &str| {
        let first = text.lines().next().unwrap_or_default();
        CEILINGS.iter().any(|ceiling| first.contains(ceiling))
    };
    let by_chance = expected.starts_with("// Error: somewhere");
    expected == said || (by_chance && is_ceiling(expected) && is_ceiling(said))
}

fn scripts() -> Vec<PathBuf> {
    let entries = std::fs::read_dir(FOLDER).unwrap().map(|entry| entry.unwrap().path());
    let mut scripts: Vec<_> =
        entries.filter(|p| p.extension().is_some_and(|x| x == "rhai")).collect();
    scripts.sort();
    scripts
}

/// Runs one script; what is wrong with what came of it.
fn judge(script: &Path, update: bool) -> (String, Ended) {
    let name = script.file_name().unwrap().to_str().unwrap();
    let text = std::fs::read_to_string(script).unwrap();
    let comment = |mark: &str| text.lines().find_map(|l| l.strip_prefix(mark)).map(str::trim);
    let results = tempfile::tempdir().unwrap();
    let out = results.path().display().to_string();
    let args = match comment("// Command:").unwrap_or("check") {
        "exec" => vec!["exec", name, "--quiet", "--out", &out],
        command => vec![command, name],
    };
    let ended = run(&args, Path::new(FOLDER));
    let marks = ["// Error:", "// Note:", "// Hint:"];
    let is_expectation = |l: &&str| marks.iter().any(|mark| l.starts_with(mark));
    let expected: String = text.lines().filter(is_expectation).flat_map(|l| [l, "\n"]).collect();
    let said = said(&ended.stderr, name);
    let mut complaints = ended.complaints();
    if !agree(&expected, &said) {
        write!(complaints, "  expected:\n{expected}  said:\n{said}").unwrap();
        if update {
            let rest = text.lines().filter(|l| !is_expectation(l)).flat_map(|l| [l, "\n"]);
            std::fs::write(script, said + &rest.collect::<String>()).unwrap();
        }
    }
    (complaints, ended)
}

/// With `HOSTILE_UPDATE=1` in the environment what is said becomes what is expected; with
/// `HOSTILE_FIGURES=1` every script's time and memory are shown.
#[test]
fn hostile_scripts_end_in_an_error_and_hurt_nobody() {
    let scripts = scripts();
    assert!(scripts.len() >= 85);
    let set = |name: &str| std::env::var_os(name).is_some();
    let (update, figures) = (set("HOSTILE_UPDATE"), set("HOSTILE_FIGURES"));
    let next = AtomicUsize::new(0);
    let outcomes = Mutex::new(Vec::new());
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while let Some(script) = scripts.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let (complaints, ended) = judge(script, update);
                    let name = script.file_name().unwrap().to_str().unwrap().to_string();
                    let figures = (ended.time, ended.memory / 1_000_000);
                    outcomes.lock().unwrap().push((name, complaints, figures));
                }
            });
        }
    });
    let mut outcomes = outcomes.into_inner().unwrap();
    outcomes.sort();
    let mut failures = String::new();
    let mut table = String::new();
    for (name, complaints, (time, megabytes)) in &outcomes {
        writeln!(table, "{:>7.3} s {megabytes:>5} MB  {name}", time.as_secs_f64()).unwrap();
        if !complaints.is_empty() {
            write!(failures, "\n{name}\n{complaints}").unwrap();
        }
    }
    if figures {
        std::fs::write(std::env::temp_dir().join("hostile.txt"), table).unwrap();
    }
    assert!(failures.is_empty(), "{failures}");
}
