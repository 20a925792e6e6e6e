//! `runner golden`: what it accepts, what it refuses, and how it says so.

use crate::support::{SMALL, expect_code, folder, runner, stderr, stdout, write};

fn golden(dir: &std::path::Path, script: &str, more: &[&str]) -> std::process::Output {
    let mut command = runner();
    command.arg("golden").arg(dir.join(script)).arg("--dir").arg(dir.join("golden")).args(more);
    command.output().unwrap()
}

#[test]
fn a_golden_file_is_accepted_then_met_then_missed() {
    let dir = folder();
    write(dir.path(), "small.rhai", SMALL);
    let missing = golden(dir.path(), "small.rhai", &[]);
    expect_code(&missing, 1);
    assert!(stderr(&missing).contains("--accept writes it"));
    expect_code(&golden(dir.path(), "small.rhai", &["--accept"]), 0);
    expect_code(&golden(dir.path(), "small.rhai", &[]), 0);
    let text = std::fs::read_to_string(dir.path().join("golden/small.txt")).unwrap();
    assert!(text.len() < 20 * 1024, "small enough to review: {} bytes", text.len());

    // A change that alters what is learned.
    write(dir.path(), "small.rhai", &SMALL.replace("alpha: 0.1", "alpha: 0.11"));
    let changed = golden(dir.path(), "small.rhai", &[]);
    expect_code(&changed, 1);
    let diff = stdout(&changed);
    assert!(diff.starts_with("--- ") && diff.contains("\n-") && diff.contains("\n+"), "{diff}");
    // It changes nothing by itself.
    assert_eq!(std::fs::read_to_string(dir.path().join("golden/small.txt")).unwrap(), text);
}

#[test]
fn every_sample_has_its_golden_file_and_meets_it() {
    let output = {
        let mut command = runner();
        command.arg("golden");
        for entry in std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/scripts")).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|x| x == "rhai") {
                command.arg(path);
            }
        }
        command.output().unwrap()
    };
    assert!(output.status.success(), "{}{}", stdout(&output), stderr(&output));
}

/// The check that golden files of finite environments hold is one that can fail.
#[test]
fn a_reward_that_changes_the_policy_shows_in_the_golden_file() {
    let dir = folder();
    let script = r#"
        fn step_cost(t) { -0.01 }
        let lake = experiment(#{
            name: "cost", env: "FrozenLake8x8-v1", agent: value_iteration(), seeds: 1,
            episodes: 5, terms: #{ cost: step_cost },
        });
        [lake, lake.with(#{ name: "phi", terms: (), potential: |s| 0.1 * s.index })]
    "#;
    write(dir.path(), "cost.rhai", script);
    expect_code(&golden(dir.path(), "cost.rhai", &["--accept"]), 0);
    let text = std::fs::read_to_string(dir.path().join("golden/cost.txt")).unwrap();
    assert!(text.contains("shaping policy changed (26)"), "{text}");
    assert!(text.contains("the greedy sets differ in states ["), "{text}");
    assert!(text.contains("Q_F + Φ = Q holds"), "{text}");
}
