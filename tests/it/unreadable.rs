//! Files that are no scripts, through the command line; and the identity of units, which must be
//! the same in every process.

use std::path::Path;
use std::process::{Command, Output};

fn runner(args: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_runner")).args(args).current_dir(folder).output().unwrap()
}

/// `runner check FILE` on a file with this content: exit code 2 and this message, no panic.
fn refused(content: &[u8], message: &str) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("script.rhai"), content).unwrap();
    let output = runner(&["check", "script.rhai"], folder.path());
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(stderr.starts_with(&format!("error: {message}\n")), "{stderr}");
    assert!(output.stdout.is_empty());
}

#[test]
fn files_that_are_no_text_are_refused() {
    refused(&[0x7f, b'E', b'L', b'F', 0xff, 0xfe, 0], "script.rhai: is not UTF-8 text (byte 4)");
    refused(b"", "script.rhai: is empty");
    refused(b" \n\t\n", "script.rhai: is empty");
    refused(
        &vec![b' '; 300 * 1024],
        "script.rhai: 307200 bytes are too long for a script (at most 262144)",
    );
    refused(b"\0\0\0", "unexpected '␀'");
}

#[test]
fn files_that_cannot_be_read_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (file, message) in [
        ("nothing.rhai", "error: nothing.rhai: cannot be read: no such file or directory"),
        (".", "error: .: is a directory, not a script"),
    ] {
        let output = runner(&["check", file], folder.path());
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2));
        assert_eq!(stderr.lines().next(), Some(message));
    }
}

#[test]
fn nested_brackets_and_long_lists_end_in_an_error() {
    for text in [
        "(".repeat(100_000),
        "[".repeat(200_000),
        "-".repeat(200_000),
        "#{a:".repeat(50_000),
        "!".repeat(100_000),
        "|x|".repeat(50_000),
        "if true {".repeat(20_000),
    ] {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("script.rhai"), &text).unwrap();
        let output = runner(&["check", "script.rhai"], folder.path());
        assert_eq!(output.status.code(), Some(2), "{}…", &text[..4]);
    }
}

const STUDY: &str = "const K = 2;
fn g(s) { K * s.row }
let e = experiment(#{ name: \"a\", env: \"FrozenLake-v1\", agent: q_learning(), episodes: 3, seeds: 2, potential: |s| g(s) });
let k = 3;
let h = |s| k * g(s);
study(\"s\", [e, e.with(#{
    name: \"b\",
    potential: |s| h.call(s),
    reward: |t| t.reward + 1,
    terms: #{ late: |t| t.step },
})])";

#[test]
fn units_have_the_same_names_in_every_process() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("script.rhai"), STUDY).unwrap();
    let units = |out: &str| {
        let output = runner(&["exec", "script.rhai", "--quiet", "--out", out], folder.path());
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let text = std::fs::read_to_string(folder.path().join(out).join("study.json")).unwrap();
        let study: serde_json::Value = serde_json::from_str(&text).unwrap();
        study.to_string().split('"').filter(|w| w.len() == 64).map(String::from).collect::<Vec<_>>()
    };
    let first = units("one");
    assert!(first.len() >= 4, "hashes of two variants with two seeds each");
    assert_eq!(first, units("two"));
}

#[test]
fn rewards_and_terms_add_up_and_know_their_step() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("script.rhai"), STUDY).unwrap();
    let output = runner(&["exec", "script.rhai", "--quiet", "--out", "out"], folder.path());
    assert_eq!(output.status.code(), Some(0));
    let mut reader = csv::Reader::from_path(folder.path().join("out/episodes.csv")).unwrap();
    let headers = reader.headers().unwrap().clone();
    let column = |name: &str| headers.iter().position(|h| h == name).unwrap();
    let mut rows = 0;
    for row in reader.records().map(Result::unwrap).filter(|r| &r[column("variant")] == "b") {
        let at = |name: &str| row[column(name)].parse::<f64>().unwrap();
        let (steps, late) = (at("steps"), at("late"));
        assert_eq!(late, steps * (steps - 1.0) / 2.0, "steps count from 0");
        let sum = at("return") + steps + late + at("shaping");
        assert!((at("learned_return") - sum).abs() < 1e-9, "{row:?}");
        rows += 1;
    }
    assert_eq!(rows, 6);
}
