//! `runner watch`, driven as its user drives it: saving files, reading what it prints, Ctrl-C.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use crate::support::{SMALL, contents, expect_code, folder, run, runner, stderr, write};

/// Far longer than anything here takes, on a machine that has much else to do.
const PATIENCE: Duration = Duration::from_mins(2);

struct Watcher {
    child: Child,
    lines: Receiver<String>,
}

impl Watcher {
    fn start(script: &Path, out: &Path) -> Self {
        let mut command = runner();
        command.arg("watch").arg(script).arg("--out").arg(out).args(["--jobs", "1"]);
        let mut child = command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn().unwrap();
        let stdout = BufReader::new(child.stdout.take().unwrap());
        let (send, lines) = channel();
        std::thread::spawn(move || {
            for line in stdout.lines().map_while(Result::ok) {
                let _ = send.send(line);
            }
        });
        Self { child, lines }
    }

    /// What is printed up to the end of the next pass.
    fn pass(&self) -> String {
        let begun = Instant::now();
        let mut block = String::new();
        loop {
            let left = PATIENCE.saturating_sub(begun.elapsed());
            let line = self.lines.recv_timeout(left);
            let line = line.unwrap_or_else(|e| panic!("{e}; so far:\n{block}"));
            block += &line;
            block.push('\n');
            if line.starts_with("watching ") {
                return block;
            }
        }
    }

    /// Ctrl-C; the exit code.
    fn interrupt(mut self) -> i32 {
        let id = self.child.id().to_string();
        assert!(Command::new("kill").arg("-INT").arg(id).status().unwrap().success());
        let begun = Instant::now();
        while begun.elapsed() < PATIENCE {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status.code().expect("no signal ends it");
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        panic!("it goes on");
    }
}

impl Drop for Watcher {
    fn drop(&mut self) {
        let _ = self.child.kill();
    }
}

/// Waits until `true`.
fn wait_for(what: &str, mut happened: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !happened() {
        assert!(begun.elapsed() < PATIENCE, "{what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
#[cfg(unix)]
fn every_save_is_run_and_a_mistake_leaves_the_last_result() {
    let dir = folder();
    let script = write(dir.path(), "small.rhai", SMALL);
    let watcher = Watcher::start(&script, &dir.path().join("results"));
    let first = watcher.pass();
    assert!(first.starts_with("pass 1, "), "{first}");
    assert!(first.contains("study \"small\": 8 of 8 units ran\n"), "{first}");
    assert!(first.contains("  height: potential height (line "), "{first}");
    // The curve, with a name where each one ends; the table with its verdicts.
    assert!(first.contains("native return, rolling mean over 20 episodes"), "{first}");
    assert!(first.contains("60 episodes\n"), "{first}");
    assert!(first.contains("unshaped") && first.contains("not potential-based"), "{first}");
    assert!(!first.contains('\x1b'), "no terminal, no escapes: {first}");

    // Of two variants one has changed.
    let edited = SMALL.replace("sin(3.0", "sin(2.9");
    write(dir.path(), "small.rhai", &edited);
    let second = watcher.pass();
    assert!(second.starts_with(&format!("{}\npass 2, ", "─".repeat(80))), "{second}");
    assert!(second.contains("study \"small\": 4 of 8 units ran\n"), "{second}");

    let mistaken = edited.replace("episodes:", "episods:");
    write(dir.path(), "small.rhai", &mistaken);
    let third = watcher.pass();
    let (error, last) = third.split_once("the last result, of pass 2:\n").expect("it is there");
    assert!(error.contains("error: an experiment has no key `episods`"), "{error}");
    assert!(error.contains("did you mean `episodes`?"), "{error}");
    assert!(!error.contains("unshaped"), "{error}");
    let table = |text: &str| text.split_once("study \"small\"").unwrap().1.to_string();
    assert_eq!(table(&format!("study \"small\"{}", table(last))), table(&second));

    write(dir.path(), "small.rhai", &edited);
    let fourth = watcher.pass();
    assert!(fourth.contains("study \"small\": 0 of 8 units ran\n"), "{fourth}");
    assert!(!fourth.contains("error") && !fourth.contains("the last result"), "{fourth}");
    assert_eq!(watcher.interrupt(), 0);
}

#[test]
#[cfg(unix)]
fn imports_are_watched_however_they_are_saved() {
    let dir = folder();
    let calling = SMALL.replace("sin(3.0 * s.position)", "shapes::height(s)");
    let importing = format!("import \"lib/shapes\" as shapes;\n{calling}");
    let script = write(dir.path(), "small.rhai", &importing);
    let watcher = Watcher::start(&script, &dir.path().join("results"));
    // It is missing, and then it is there.
    let missing = watcher.pass();
    assert!(missing.contains("error: ") && missing.contains("cannot be read"), "{missing}");
    assert!(!missing.contains("the last result"), "{missing}");
    let shapes = |k: &str| format!("fn height(s) {{ sin({k} * s.position) }}");
    let path = write(dir.path(), "lib/shapes.rhai", &shapes("3.0"));
    let there = watcher.pass();
    assert!(there.contains("8 of 8 units ran") && there.contains("and a file that"), "{there}");
    // Saved by another file that takes its place.
    let new = write(dir.path(), "lib/.shapes.swp", &shapes("2.9"));
    std::fs::rename(new, &path).unwrap();
    let renamed = watcher.pass();
    assert!(renamed.contains("4 of 8 units ran"), "{renamed}");
    // Deleted, and made again.
    std::fs::remove_file(&path).unwrap();
    let deleted = watcher.pass();
    assert!(deleted.contains("cannot be read"), "{deleted}");
    assert!(deleted.contains("the last result, of pass 3:"), "{deleted}");
    std::fs::write(&path, shapes("2.8")).unwrap();
    let again = watcher.pass();
    assert!(again.contains("pass 5, ") && again.contains("4 of 8 units ran"), "{again}");
    assert_eq!(watcher.interrupt(), 0);
}

/// A study whose second variant takes minutes, and whose first is done at once.
const LONG: &str = r#"
let a = experiment(#{
    name: "short",
    env: "MountainCar-v0",
    agent: q_learning(),
    discretiser: bins(#{ position: [-1.2, 0.6, 20], velocity: [-0.07, 0.07, 20] }),
    episodes: 20,
    seeds: 1,
});
study("long", [a, a.with(#{ name: "long", episodes: 2000000 })])
"#;

#[test]
#[cfg(unix)]
fn a_save_interrupts_a_run_whose_finished_units_stay() {
    let dir = folder();
    let script = write(dir.path(), "long.rhai", LONG);
    let out = dir.path().join("results");
    let watcher = Watcher::start(&script, &out);
    let units = || {
        if !out.is_dir() {
            return 0;
        }
        contents(&out).keys().filter(|n| n.ends_with("result.json")).count()
    };
    wait_for("the short variant is stored", || units() == 1);
    write(dir.path(), "long.rhai", &LONG.replace("2000000", "30"));
    let pass = watcher.pass();
    assert!(pass.starts_with("pass 1, ") && pass.contains("1 of 2 units ran"), "{pass}");
    // And Ctrl-C ends a run, too.
    write(dir.path(), "long.rhai", &LONG.replace("2000000", "2000001"));
    let study = out.join("study.json");
    let is_on = || std::fs::read_to_string(&study).is_ok_and(|text| text.contains("2000001"));
    wait_for("it runs again", is_on);
    assert_eq!(watcher.interrupt(), 0);
    assert_eq!(units(), 2);
}

#[test]
#[cfg(unix)]
fn a_claim_that_does_not_hold_is_a_result() {
    let dir = folder();
    let claim = SMALL.trim_end().to_string() + ".expect(\"it flies\", |r| r.plain.seeds == 5)";
    let script = write(dir.path(), "small.rhai", &claim);
    let watcher = Watcher::start(&script, &dir.path().join("results"));
    let pass = watcher.pass();
    assert!(pass.contains("FAILED it flies") && pass.contains("8 of 8"), "{pass}");
    assert!(!pass.contains("error"), "{pass}");
    assert_eq!(watcher.interrupt(), 0);
}

#[test]
fn there_must_be_a_script() {
    let output = run(&["watch", "nowhere.rhai"]);
    expect_code(&output, 2);
    assert!(stderr(&output).contains("nowhere.rhai: there is no such file to watch"));
}
