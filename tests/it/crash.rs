//! Nothing is lost: signals, kills, full disks, edited files.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use runner::mdp::streams::Stream;

use crate::support::{SMALL, assert_same, contents, expect_code, folder, runner, stderr, write};

/// A study of 48 units that takes a second or two on one thread: without the term, which is
/// interpreted at every step.
fn long() -> String {
    let term = SMALL.find(", terms:").unwrap()..SMALL.find("} })])").unwrap() + 1;
    let mut text = SMALL.to_string();
    text.replace_range(term, "");
    text.replace("episodes: 60", "episodes: 3000").replace("seeds: 4", "seeds: 24")
}

fn exec(script: &Path, out: &Path) -> Command {
    let mut command = runner();
    command.arg("exec").arg(script).arg("--out").arg(out);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn signal(child: &Child, name: &str) {
    let status = Command::new("kill").arg(name).arg(child.id().to_string()).status().unwrap();
    assert!(status.success());
}

fn finished_units(out: &Path) -> usize {
    if !out.exists() {
        return 0;
    }
    contents(out).keys().filter(|name| name.ends_with("result.json")).count()
}

/// Waits until a unit is stored, so that the signal comes half-way.
fn wait_for_a_unit(child: &mut Child, out: &Path) {
    for _ in 0..3000 {
        let stored = std::fs::read_dir(out.join("units")).map_or(0, |shelves| {
            shelves
                .flatten()
                .filter(|s| std::fs::read_dir(s.path()).is_ok_and(|mut d| d.next().is_some()))
                .count()
        });
        if stored > 0 {
            return;
        }
        assert!(child.try_wait().unwrap().is_none(), "it ended before a unit was stored");
        std::thread::sleep(Duration::from_millis(2));
    }
    panic!("no unit was stored");
}

#[cfg(unix)]
#[test]
fn a_stopped_run_says_how_to_go_on_and_ends_in_the_same_bytes() {
    let dir = folder();
    let script = write(dir.path(), "long.rhai", &long());
    let whole = dir.path().join("whole");
    expect_code(&exec(&script, &whole).output().unwrap(), 0);
    for name in ["-INT", "-TERM"] {
        let out = dir.path().join(name);
        let mut child = exec(&script, &out).arg("--jobs").arg("1").spawn().unwrap();
        wait_for_a_unit(&mut child, &out);
        signal(&child, name);
        let output = child.wait_with_output().unwrap();
        expect_code(&output, 75);
        let text = stderr(&output);
        assert!(text.contains("of 48 units are stored"), "{text}");
        let resume = text.lines().find_map(|l| l.strip_prefix("to go on: runner ")).unwrap();
        let done = finished_units(&out);
        assert!((1..48).contains(&done), "{done} units");
        let args: Vec<&str> = resume.split(' ').collect();
        expect_code(&runner().args(args).output().unwrap(), 0);
        assert_same(&whole, &out);
    }
}

#[cfg(unix)]
#[test]
fn kills_at_random_moments_tear_nothing_and_change_nothing() {
    let dir = folder();
    let script = write(dir.path(), "long.rhai", &long());
    let (whole, out) = (dir.path().join("whole"), dir.path().join("killed"));
    expect_code(&exec(&script, &whole).output().unwrap(), 0);
    let mut moments = Stream::new(1, "moments");
    for _ in 0..12 {
        let mut child = exec(&script, &out).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(moments.below(120) as u64));
        let _ = child.kill();
        child.wait().unwrap();
    }
    expect_code(&exec(&script, &out).output().unwrap(), 0);
    assert_same(&whole, &out);
}

#[cfg(unix)]
#[test]
fn a_file_that_cannot_be_written_is_an_error_and_loses_nothing() {
    let dir = folder();
    let script = write(dir.path(), "long.rhai", &long());
    let out = dir.path().join("results");
    expect_code(
        &exec(&script, &out).args(["--seeds", "1", "--episodes", "20"]).output().unwrap(),
        0,
    );
    let before = contents(&out);
    // Writing beyond 8 blocks of 1024 bytes fails, as it would on a full disk.
    let line = format!(
        "trap '' XFSZ; ulimit -f 8; exec {} exec {} --out {} --quiet",
        env!("CARGO_BIN_EXE_runner"),
        script.display(),
        out.display()
    );
    let output = Command::new("bash").arg("-c").arg(line).output().unwrap();
    expect_code(&output, 2);
    let text = stderr(&output);
    assert!(text.contains("cannot be written") && text.contains("too large"), "{text}");
    assert!(!text.contains("panicked"), "{text}");
    let after = contents(&out);
    for (name, bytes) in before.iter().filter(|(name, _)| name.starts_with("units")) {
        assert!(after.get(name) == Some(bytes), "{name} was lost");
    }
    assert!(!after.keys().any(|name| name.contains(".tmp-")), "{:?}", after.keys());
    expect_code(&exec(&script, &out).output().unwrap(), 0);
}

#[test]
fn an_edited_unit_is_named_and_never_used() {
    let dir = folder();
    let script = write(dir.path(), "small.rhai", SMALL);
    let out = dir.path().join("results");
    expect_code(&exec(&script, &out).output().unwrap(), 0);
    let clean = contents(&out);
    let victim = clean.keys().find(|n| n.ends_with("monitor.csv")).unwrap();
    let text = String::from_utf8(clean[victim].clone()).unwrap().replacen("-200.0", "-100.0", 1);
    std::fs::write(out.join(victim), text).unwrap();
    let output = exec(&script, &out).output().unwrap();
    expect_code(&output, 2);
    assert!(stderr(&output).contains("was changed after it was written"), "{}", stderr(&output));
    assert!(stderr(&output).contains("monitor.csv"));
    expect_code(&exec(&script, &out).arg("--fresh").output().unwrap(), 0);
    assert_eq!(contents(&out), clean);
}

#[test]
fn two_processes_on_one_folder_end_in_the_same_bytes() {
    let dir = folder();
    let script = write(dir.path(), "long.rhai", &long().replace("seeds: 24", "seeds: 8"));
    let (whole, out) = (dir.path().join("whole"), dir.path().join("shared"));
    expect_code(&exec(&script, &whole).output().unwrap(), 0);
    let (a, b) = (exec(&script, &out).spawn().unwrap(), exec(&script, &out).spawn().unwrap());
    expect_code(&a.wait_with_output().unwrap(), 0);
    expect_code(&b.wait_with_output().unwrap(), 0);
    assert_same(&whole, &out);
}
