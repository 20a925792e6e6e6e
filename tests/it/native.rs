//! Machine code, the interpreter, and that nobody can tell them apart by what comes out.

use std::fs;
use std::path::Path;

use crate::support;

/// What a command says, and its exit code.
struct Ran {
    stdout: String,
    stderr: String,
    code: i32,
}

fn run(args: &[&str]) -> Ran {
    let output = support::run(args);
    let (stdout, stderr) = (support::stdout(&output), support::stderr(&output));
    Ran { stdout, stderr, code: support::code(&output) }
}

fn check(script: &Path, more: &[&str]) -> Ran {
    let mut args = vec!["check", script.to_str().unwrap()];
    args.extend(more);
    run(&args)
}

/// Everything that a study writes and that does not speak of time.
fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut all = Vec::new();
    let mut open = vec![folder.to_path_buf()];
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
                continue;
            }
            let name = path.file_name().unwrap().to_str().unwrap().to_string();
            if !["timing.json", "study.json", "report.html"].contains(&name.as_str()) {
                all.push((path.display().to_string(), fs::read(&path).unwrap()));
            }
        }
    }
    all.sort();
    all
}

const STUDY: &str = r#"
const W = [0.5, -1.0, 2.0, 0.25];
fn lean(s) { let x = 0.0; for i in 0..s.len() { x += W[i] * abs(s[i]); } -x }
fn cell(s) {
    let a = clamp(to_int(floor(s.theta * 20.0 + 5.0)), 0, 9);
    let b = if s.theta_dot < -0.5 { 0 } else if s.theta_dot < 0.5 { 1 } else { 2 };
    [a, b]
}
fn paid(t) { if t.terminated { return -5.0; } t.reward - 0.1 * hypot(t.next_state.x, t.state.x) }
let a = experiment(#{
    name: "a", env: "CartPole-v1", agent: q_learning(#{ alpha: 0.2, epsilon: 0.1 }),
    discretiser: cells([10, 3], cell), potential: lean, potential_on: "raw", reward: paid,
    terms: #{ early: |t| if t.step < 10 { 1 } else { 0 } },
    allowed: |s, a| a == 0 || s.x < 2.0,
    episodes: 60, seeds: 2,
});
let b = a.with(#{ name: "b", potential: (|k, s, episode| k * s.x / episode).curry(0.5) });
study("tiers", [a, b])
"#;

#[test]
fn results_are_the_same_without_machine_code() {
    let folder = tempfile::tempdir().unwrap();
    let script = folder.path().join("tiers.rhai");
    fs::write(&script, STUDY).unwrap();
    let results = |name: &str, more: &[&str]| {
        let out = folder.path().join(name);
        let mut args = vec!["exec", script.to_str().unwrap(), "--out", out.to_str().unwrap()];
        args.extend(more);
        let ran = run(&args);
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        let files = files(&out);
        let relative =
            |(path, bytes): (String, Vec<u8>)| (path.replace(out.to_str().unwrap(), ""), bytes);
        files.into_iter().map(relative).collect::<Vec<_>>()
    };
    let native = results("native", &[]);
    assert!(native.len() > 8);
    for (one, other) in native.iter().zip(&results("interpreted", &["--no-jit"])) {
        assert_eq!(one.0, other.0);
        assert!(one.1 == other.1, "{} differs", one.0);
    }
}

#[test]
fn check_says_how_callbacks_are_run() {
    let folder = tempfile::tempdir().unwrap();
    let script = folder.path().join("tiers.rhai");
    fs::write(&script, STUDY).unwrap();
    let checked = check(&script, &[]);
    let all = "native       discretiser, potential, reward, terms.early, allowed";
    assert_eq!(checked.stdout.matches(all).count(), 2, "{}", checked.stdout);
    let without = check(&script, &["--no-jit"]);
    assert!(without.stdout.contains("not native   reward: machine code is switched off"));

    let slow = STUDY.replace("if t.terminated {", "if `${t.terminated}` == \"true\" {");
    fs::write(&script, slow).unwrap();
    let checked = check(&script, &[]);
    let line = "not native   reward: line 9: a string that is put together; interpreted at every step, \
                each call some 200 times slower";
    assert!(checked.stdout.contains(line), "{}", checked.stdout);
}

/// What a callback does wrong is said by the interpreter, whoever found it.
#[test]
fn mistakes_read_the_same_without_machine_code() {
    let mut compared = 0;
    for entry in fs::read_dir("tests/wrong").unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap();
        if ["callback", "cells", "allowed", "advice", "terms"].iter().any(|k| name.starts_with(k)) {
            let (native, interpreted) = (check(&path, &[]), check(&path, &["--no-jit"]));
            assert_eq!(native.stderr, interpreted.stderr, "{name}");
            assert_eq!((native.code, interpreted.code), (2, 2), "{name}");
            compared += 1;
        }
    }
    assert!(compared > 15, "{compared}");
}

/// An imported file's functions and constants are its own.
#[test]
fn functions_of_imported_files_are_native() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("lib")).unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write(
        "lib/shapes.rhai",
        "import \"more\" as more;\nconst K = -3.0;\nfn half(x) { x * 0.5 }\n\
         fn lean(s) { K * half(s.theta) + more::one() }",
    );
    write("lib/more.rhai", "const ONE = 1;\nfn one() { ONE }");
    write(
        "s.rhai",
        "import \"lib/shapes\" as shapes;\nconst K = 7.0;\nfn half(x) { x * 100.0 }\n\
         experiment(#{ env: \"CartPole-v1\", agent: q_learning(#{}),\n\
         discretiser: bins([[-2.4, 2.4, 2], [-3.0, 3.0, 2], [-0.5, 0.5, 4], [-2.0, 2.0, 4]]),\n\
         potential: |s| shapes::lean(s), episodes: 20, seeds: 1 })",
    );
    let script = folder.path().join("s.rhai");
    let checked = check(&script, &[]);
    assert!(
        checked.stdout.contains("native       potential"),
        "{}{}",
        checked.stdout,
        checked.stderr
    );
    let returns = |more: &[&str]| {
        let out = folder.path().join(format!("out{}", more.len()));
        let mut args = vec!["exec", script.to_str().unwrap(), "--out", out.to_str().unwrap()];
        args.extend(more);
        assert_eq!(run(&args).code, 0);
        fs::read(out.join("episodes.csv")).unwrap()
    };
    assert_eq!(returns(&[]), returns(&["--no-jit"]));
}
