//! What is said when the child dies, and who dies with whom.

use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A script that takes long, in functions that do much.
const LONG: &str = "fn slow(t) { let x = 0.0; for i in 0..3000 { x += 1.0; } x }
experiment(#{
    name: \"long\",
    env: \"CartPole-v1\",
    agent: q_learning(),
    discretiser: bins(#{ theta: [-0.2, 0.2, 6] }),
    reward: slow,
    terms: #{ more: |t| t.step },
    episodes: 1000000,
    seeds: 2,
})";

fn begin(folder: &Path) -> Child {
    std::fs::write(folder.join("long.rhai"), LONG).unwrap();
    Command::new(env!("CARGO_BIN_EXE_runner"))
        .args(["exec", "long.rhai", "--quiet", "--no-jit", "--jobs", "1"])
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Waits for `what`, for a while.
fn until<T>(mut what: impl FnMut() -> Option<T>) -> T {
    let begun = Instant::now();
    loop {
        if let Some(found) = what() {
            return found;
        }
        assert!(begun.elapsed() < Duration::from_mins(1), "it does not come");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// The process that `parent` watches over, once it trains.
fn child_of(parent: &Child, folder: &Path) -> String {
    let id = parent.id();
    until(|| folder.join("results/long/units").exists().then_some(()));
    std::thread::sleep(Duration::from_millis(200));
    let path = format!("/proc/{id}/task/{id}/children");
    until(|| std::fs::read_to_string(&path).ok()?.split_whitespace().next().map(String::from))
}

fn signal(name: &str, process: &str) {
    assert!(Command::new("kill").args([name, "--", process]).status().unwrap().success());
}

fn end(mut parent: Child) -> (Option<i32>, String) {
    let mut text = String::new();
    parent.stderr.take().unwrap().read_to_string(&mut text).unwrap();
    (parent.wait().unwrap().code(), text)
}

#[cfg(target_os = "linux")]
#[test]
fn a_child_that_dies_is_explained() {
    for (name, words) in [
        ("-ABRT", "error: there is not enough memory for this run"),
        ("-KILL", "error: the run was killed from outside"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let parent = begin(folder.path());
        signal(name, &child_of(&parent, folder.path()));
        let (code, text) = end(parent);
        assert_eq!(code, Some(2), "{text}");
        assert!(text.starts_with(words), "{text}");
        for part in ["--> long.rhai:1:", "last seen calling the function `slow`", "variant `long`"]
        {
            assert!(text.contains(part), "{part}: {text}");
        }
    }
}

#[cfg(target_os = "linux")]
#[test]
fn nobody_is_left_behind() {
    let folder = tempfile::tempdir().unwrap();
    let mut parent = begin(folder.path());
    let child = child_of(&parent, folder.path());
    parent.kill().unwrap();
    parent.wait().unwrap();
    // Gone, or dead and not yet buried by whoever has inherited it.
    let state = || std::fs::read_to_string(format!("/proc/{child}/stat")).ok();
    until(|| state().is_none_or(|stat| stat.contains(") Z ")).then_some(()));
}

#[cfg(target_os = "linux")]
#[test]
fn signals_reach_the_child_once() {
    // By the parent alone, by the whole group at once, and by both processes one after the other.
    for whole_group in [false, true] {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("long.rhai"), LONG).unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_runner"));
        command
            .args(["exec", "long.rhai", "--quiet", "--no-jit", "--jobs", "1"])
            .current_dir(folder.path());
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        let parent = std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let parent = parent.spawn().unwrap();
        child_of(&parent, folder.path());
        let id = parent.id();
        signal("-INT", &if whole_group { format!("-{id}") } else { id.to_string() });
        let (code, text) = end(parent);
        assert_eq!(code, Some(75), "{text}");
        // It was asked politely, not twice.
        assert!(text.contains("units are stored"), "{text}");
    }
}

/// Where there is no room for the large stack, ordinary recursion overflows the small one.
#[cfg(target_os = "linux")]
#[test]
fn an_overflowing_stack_is_explained() {
    let overflows = |address_space: u32| {
        let line = format!(
            "ulimit -s 100; ulimit -v {address_space}; exec {} check plan_endless_recursion.rhai",
            env!("CARGO_BIN_EXE_runner")
        );
        let output =
            Command::new("bash").args(["-c", &line]).current_dir(super::FOLDER).output().unwrap();
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        let begins = text.starts_with("error: the script has overflowed the stack\n");
        if begins {
            assert_eq!(output.status.code(), Some(2), "{text}");
            assert!(text.contains("last seen building the plan"), "{text}");
            assert!(!text.contains("overflowed its stack"), "{text}");
        }
        begins
    };
    assert!((50_000..110_000).step_by(5_000).any(overflows), "no stack was small enough");
}
