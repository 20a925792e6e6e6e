//! `runner play`: a stored policy plays as it was learned, and what does not fit is refused.

use std::path::Path;

use runner::env::Session;
use runner::shaping::{Bins, Dim};

use crate::support::{
    LAKE, SMALL, expect_code, folder, run, runner, stderr, stdout, stored, untouched, write,
};

fn play(results: &Path, more: &[&str]) -> std::process::Output {
    runner().arg("play").arg(results).args(more).output().unwrap()
}

/// The unit folders of a variant, by seed.
fn units(results: &Path, variant: &str) -> Vec<std::path::PathBuf> {
    let manifest = std::fs::read(results.join("study.json")).unwrap();
    let manifest: serde_json::Value = serde_json::from_slice(&manifest).unwrap();
    let variants = manifest["identity"]["variants"].as_array().unwrap();
    let own = variants.iter().find(|v| v["name"] == variant).unwrap();
    let hashes = own["units"].as_array().unwrap().iter().map(|u| u.as_str().unwrap());
    hashes.map(|hash| results.join("units").join(&hash[..2]).join(hash)).collect()
}

#[test]
fn dry_land_is_crossed_in_six_steps() {
    let dir = folder();
    let results = stored(dir.path(), LAKE);
    let output = play(&results, &[]);
    expect_code(&output, 0);
    // The shortest way: six steps, and the first of two equally good actions at the start.
    let kwargs = r#"{"is_slippery": false}"#;
    let by_hand =
        run(&["rollout", "FrozenLake-v1", "--kwargs", kwargs, "--actions", "1,1,2,1,2,2"]);
    assert_eq!(stdout(&output), stdout(&by_hand));
    assert_eq!(stdout(&output).lines().count(), 7);
    let said = stderr(&output);
    assert!(said.contains("playing `dry`; --variant chooses among dry, ice"), "{said}");
    assert!(said.ends_with("episode 1: 6 steps, return 1, terminated\n"), "{said}");

    let policy = units(&results, "dry")[0].join("policy.csv");
    let policy = policy.to_str().unwrap();
    let by_file = ["rollout", "FrozenLake-v1", "--kwargs", kwargs, "--steps", "6", "--policy"];
    let by_file = run(&[&by_file[..], &[policy]].concat());
    assert_eq!(stdout(&by_file), stdout(&output));
    let cart = run(&["rollout", "CartPole-v1", "--policy", policy]);
    expect_code(&cart, 2);
    assert!(stderr(&cart).contains("runner play RESULTS"), "{}", stderr(&cart));
    let other = run(&["rollout", "FrozenLake8x8-v1", "--policy", policy]);
    expect_code(&other, 2);
    assert!(stderr(&other).contains("state 16 of 64 is missing"), "{}", stderr(&other));
}

/// A planner plays greedily while it "trains": the same seed gives the same episodes.
#[test]
fn a_planners_training_is_played_again() {
    let dir = folder();
    let results = stored(dir.path(), LAKE);
    for variant in ["ice", "ice-shaped"] {
        for seed in ["0", "1"] {
            let output = play(
                &results,
                &["--variant", variant, "--seed", seed, "--env-seed", seed, "--episodes", "20"],
            );
            expect_code(&output, 0);
            let said = stderr(&output);
            let unit = &units(&results, variant)[seed.parse::<usize>().unwrap()];
            let monitor = std::fs::read_to_string(unit.join("monitor.csv")).unwrap();
            for (i, row) in monitor.lines().skip(2).enumerate() {
                let row: Vec<&str> = row.split(',').collect();
                let number = row[0].parse::<f64>().unwrap();
                let line =
                    format!("episode {}: {} steps, return {number}, {}\n", i + 1, row[1], row[6]);
                assert!(said.contains(&line), "{variant}, seed {seed}: no {line}in {said}");
            }
            assert!(said.contains("mean return of 20 finished episodes: "), "{said}");
        }
    }
}

#[test]
fn bins_and_scripted_cells_play_what_their_table_says() {
    let dir = folder();
    let script = r#"
        fn bin(x, lo, hi, n) { clamp(to_int(floor((x - lo) / (hi - lo) * n)), 0, n - 1) }
        let bins = experiment(#{
            name: "bins", env: "MountainCar-v0", agent: q_learning(#{ epsilon: 0.3 }),
            discretiser: bins(#{ position: [-1.25, 0.75, 16], velocity: [-0.125, 0.125, 16] }),
            episodes: 30, seeds: [3, 5], max_steps: 150,
        });
        study("cars", [bins, bins.with(#{ name: "cells", discretiser: cells([16, 16], |s| [
            bin(s.position, -1.25, 0.75, 16), bin(s.velocity, -0.125, 0.125, 16)
        ]) })])
    "#;
    let results = stored(dir.path(), script);
    let lines = |variant: &str, more: &[&str]| {
        let output = play(&results, &[&["--variant", variant, "--env-seed", "11"], more].concat());
        expect_code(&output, 0);
        (stdout(&output), stderr(&output))
    };
    let (by_bins, said) = lines("bins", &["--seed", "5"]);
    assert_eq!(by_bins, lines("cells", &["--seed", "5"]).0);
    // The variant's time limit.
    assert_eq!(by_bins.lines().count(), 151);
    assert!(said.contains("episode 1: 150 steps, return -150, truncated"), "{said}");
    assert!(by_bins.trim_end().ends_with(r#""terminated":false,"truncated":true}"#));
    let (_, said) = lines("bins", &["--steps", "40", "--episodes", "2"]);
    assert!(said.contains("episode 1: 40 steps, return -40, stopped\n"), "{said}");

    // The same from the file, by hand: the first of the best actions, 0 where nothing was learned.
    let mut table = vec![[0.0f64; 3]; 256];
    let file = units(&results, "bins")[1].join("policy.csv");
    for line in csv::Reader::from_path(file).unwrap().records().map(Result::unwrap) {
        let row = [2, 3, 4].map(|i| line[i].parse().unwrap());
        table[line[0].parse::<usize>().unwrap()] = row;
    }
    let dims = [(0, -1.25, 0.75), (1, -0.125, 0.125)];
    let bins = Bins::new(&dims.map(|(field, lo, hi)| Dim { field, lo, hi, n: 16 })).unwrap();
    let mut session = Session::new("MountainCar-v0", &serde_json::Map::new()).unwrap();
    session.reset(Some(&11.into()), None).unwrap();
    for line in by_bins.lines().skip(1) {
        let row = table[bins.index(session.fields())];
        let best = row.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let action = row.iter().position(|q| *q >= best - 1e-9 * best.abs().max(1.0)).unwrap();
        let step = session.step(&(action as i64).into()).unwrap();
        let expected = format!(
            r#"{{"type":"step","action":{action},"obs":{},"#,
            serde_json::to_string(&step.obs).unwrap()
        );
        assert!(line.starts_with(&expected), "{line}\nnot {expected}");
    }
}

/// An action is held for as long as in training, and real-valued ones are played as such.
#[test]
fn the_setting_of_a_variant_is_played_in() {
    let dir = folder();
    let script = r#"
        study("setting", [experiment(#{
            name: "skip", env: "CliffWalking-v1", agent: q_learning(#{ epsilon: 0.5 }),
            episodes: 200, seeds: 1, frame_skip: 3, max_steps: 50,
        }), experiment(#{
            name: "push", env: "MountainCarContinuous-v0", agent: q_learning(),
            discretiser: bins(#{ position: [-1.2, 0.6, 4], velocity: [-0.07, 0.07, 4] }),
            actions: [[-0.5], [0.75]], episodes: 3, seeds: 1, max_steps: 50,
        })])
    "#;
    let results = stored(dir.path(), script);
    let actions = |variant: &str| -> Vec<Vec<serde_json::Value>> {
        let output = play(&results, &["--variant", variant, "--episodes", "5"]);
        expect_code(&output, 0);
        let lines = stdout(&output);
        let lines = lines.lines().map(|l| serde_json::from_str::<serde_json::Value>(l).unwrap());
        let mut episodes = Vec::new();
        for line in lines {
            match line["type"].as_str().unwrap() {
                "reset" => episodes.push(Vec::new()),
                _ => episodes.last_mut().unwrap().push(line["action"].clone()),
            }
        }
        episodes
    };
    let episodes = actions("skip");
    assert_eq!(episodes.len(), 5);
    for episode in &episodes {
        assert!(episode.len() <= 50);
        assert!(episode.chunks(3).all(|held| held.iter().all(|a| *a == held[0])), "{episode:?}");
    }
    assert!(episodes.iter().flatten().any(|a| *a != episodes[0][0]), "more than one action");
    let pushes = [serde_json::json!([-0.5]), serde_json::json!([0.75])];
    assert!(actions("push").iter().flatten().all(|a| pushes.contains(a)));
}

#[test]
fn what_does_not_fit_is_refused_and_nothing_is_touched() {
    let dir = folder();
    let results = stored(dir.path(), LAKE);
    let before = untouched(&results);
    let refused = |results: &Path, more: &[&str], message: &str| {
        for command in ["play", "show"] {
            let output = runner().arg(command).arg(results).args(more).output().unwrap();
            expect_code(&output, 2);
            assert!(stderr(&output).contains(message), "{command}: {}", stderr(&output));
        }
    };
    refused(&results, &["--variant", "dri"], "did you mean `dry`?");
    refused(&results, &["--variant", "dry", "--seed", "7"], "its seeds are 0-1");
    refused(&results, &["--variant", "random"], "has no policy: its agent `random_agent`");
    refused(&dir.path().join("nowhere"), &[], "there is no such folder");
    refused(dir.path(), &[], "is not a results folder: it has no study.json");
    refused(&dir.path().join("study.rhai"), &[], "is a file, not a results folder");
    expect_code(&play(&results, &["--env-seed", "x"]), 2);
    expect_code(&play(&results, &["--episodes", "0"]), 2);
    assert_eq!(untouched(&results), before);

    // A table that somebody has had a hand in.
    let file = units(&results, "dry")[0].join("policy.csv");
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, text.replacen("0.95", "0.85", 1)).unwrap();
    refused(&results, &["--variant", "dry"], "policy.csv: was changed after it was written");
    let hand = write(dir.path(), "hand.csv", &text.replacen("0,1,", "0,3,", 1));
    let output = run(&["rollout", "FrozenLake-v1", "--policy", hand.to_str().unwrap()]);
    expect_code(&output, 2);
    let said = stderr(&output);
    assert!(said.contains("line 2: `greedy` is 3, but by its values it is 1"), "{said}");
}

#[test]
fn an_edited_script_is_noticed_where_it_matters() {
    let dir = folder();
    let results = stored(dir.path(), SMALL);
    let script = results.join("script.rhai");
    let original = std::fs::read_to_string(&script).unwrap();
    let edited = |from: &str, to: &str| {
        assert!(original.contains(from));
        std::fs::write(&script, original.replacen(from, to, 1)).unwrap();
        let output = play(&results, &["--variant", "height", "--steps", "3"]);
        (output.status.code().unwrap(), stderr(&output))
    };
    // A comment reaches no unit.
    assert_eq!(edited("const GAMMA", "// a note\nconst GAMMA").0, 0);
    for (from, to, what) in [
        ("sin(3.0", "sin(2.9", "variant `height` is another now"),
        ("alpha: 0.1", "alpha: 0.2", "variant `plain` is another now"),
        ("name: \"height\"", "name: \"hight\"", "variant `hight` was not run"),
        ("[plain, plain.with", "[plain.with", "it has other variants now"),
    ] {
        let (code, said) = edited(from, to);
        assert_eq!(code, 2, "{said}");
        let message = format!("script.rhai was changed after the run: {what}");
        assert!(said.contains(&message), "{said}");
    }
    assert_eq!(edited("study(\"small\"", "nonsense(").0, 2);
    std::fs::write(&script, &original).unwrap();
    expect_code(&play(&results, &["--steps", "3"]), 0);
}

#[test]
fn imports_are_found_beside_the_script_and_watched() {
    let dir = folder();
    write(dir.path(), "lib/shape.rhai", "fn height(s) { sin(3.0 * s.position) }");
    let script = r#"
        import "lib/shape" as shape;
        study("imported", [experiment(#{
            name: "car", env: "MountainCar-v0", agent: q_learning(),
            discretiser: bins(#{ position: [-1.2, 0.6, 5], velocity: [-0.07, 0.07, 5] }),
            potential: |s| shape::height(s), episodes: 5, seeds: 1,
        })])
    "#;
    let results = stored(dir.path(), script);
    expect_code(&play(&results, &["--steps", "3"]), 0);
    write(&results, "lib/shape.rhai", "fn height(s) { cos(3.0 * s.position) }");
    let output = play(&results, &["--steps", "3"]);
    expect_code(&output, 2);
    let said = stderr(&output);
    assert!(said.contains("lib/shape.rhai was changed after the run"), "{said}");
}
