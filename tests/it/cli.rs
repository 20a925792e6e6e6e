//! The command as its user sees it: outputs, files, exit codes.

use std::path::Path;

use crate::support::{
    SMALL, assert_same, contents, expect_code, folder, run, runner, stderr, stdout, write,
};

fn exec(script: &Path, out: &Path, more: &[&str]) -> std::process::Output {
    let mut command = runner();
    command.arg("exec").arg(script).arg("--out").arg(out).args(more);
    command.output().unwrap()
}

#[test]
fn exec_writes_every_file_and_a_closing_table() {
    let dir = folder();
    let script = write(dir.path(), "small.rhai", SMALL);
    let out = dir.path().join("results");
    let output = exec(&script, &out, &[]);
    expect_code(&output, 0);
    let table = stdout(&output);
    assert!(table.contains("plain") && table.contains("unshaped"), "{table}");
    assert!(table.contains("height") && table.contains("not potential-based"), "{table}");
    assert!(stderr(&output).contains("results in"));

    let files = contents(&out);
    for name in
        ["study.json", "script.rhai", "episodes.csv", "summary.json", "summary.csv", "curves.svg"]
    {
        assert!(files.contains_key(name), "{name} is missing");
    }
    assert!(out.join("timing.json").is_file());
    assert_eq!(files["script.rhai"], SMALL.as_bytes());

    let episodes = String::from_utf8(files["episodes.csv"].clone()).unwrap();
    let mut lines = episodes.lines();
    assert_eq!(
        lines.next().unwrap(),
        "variant,seed,episode,steps,return,learned_return,shaping,effort,epsilon,ending"
    );
    assert_eq!(lines.clone().count(), 2 * 4 * 60);
    assert_eq!(lines.next().unwrap(), "plain,0,1,200,-200.0,-200.0,0.0,,1.0,truncated");

    let monitors: Vec<&String> = files.keys().filter(|n| n.ends_with("monitor.csv")).collect();
    assert_eq!(monitors.len(), 8);
    let monitor = String::from_utf8(files[monitors[0]].clone()).unwrap();
    let mut lines = monitor.lines();
    assert_eq!(lines.next().unwrap(), "#{\"t_start\": 0.0, \"env_id\": \"MountainCar-v0\"}");
    assert!(lines.next().unwrap().starts_with("r,l,t,"));
}

#[test]
fn learned_returns_are_native_plus_shaping_plus_terms() {
    let dir = folder();
    let script = write(dir.path(), "small.rhai", SMALL);
    let out = dir.path().join("results");
    expect_code(&exec(&script, &out, &[]), 0);
    let mut reader = csv::Reader::from_path(out.join("episodes.csv")).unwrap();
    let mut checked = 0;
    for line in reader.records().map(Result::unwrap).filter(|l| &l[0] == "height") {
        let number = |i: usize| line[i].parse::<f64>().unwrap();
        let (native, learned, shaping, effort) = (number(4), number(5), number(6), number(7));
        assert!((native + shaping + effort - learned).abs() < 1e-9, "{line:?}");
        assert!(effort < 0.0 && shaping != 0.0, "{line:?}");
        checked += 1;
    }
    assert_eq!(checked, 240);
}

#[test]
fn the_bytes_do_not_depend_on_the_number_of_threads() {
    let dir = folder();
    let script = write(dir.path(), "small.rhai", SMALL);
    let (one, four) = (dir.path().join("one"), dir.path().join("four"));
    expect_code(&exec(&script, &one, &["--jobs", "1"]), 0);
    expect_code(&exec(&script, &four, &["--jobs", "4"]), 0);
    assert_same(&one, &four);
}

#[test]
fn a_finished_study_is_not_run_again_and_an_edit_reruns_what_it_reaches() {
    let dir = folder();
    let script = write(dir.path(), "small.rhai", SMALL);
    let out = dir.path().join("results");
    expect_code(&exec(&script, &out, &[]), 0);
    let timing = std::fs::read(out.join("timing.json")).unwrap();
    let units = || contents(&out).keys().filter(|n| n.ends_with("result.json")).count();
    assert_eq!(units(), 8);

    expect_code(&exec(&script, &out, &[]), 0);
    assert_eq!(std::fs::read(out.join("timing.json")).unwrap(), timing, "units ran again");

    let commented = SMALL.replace("fn height(s) {", "// a note\nfn height( s )  { /* same */");
    write(dir.path(), "small.rhai", &commented);
    expect_code(&exec(&script, &out, &[]), 0);
    assert_eq!(units(), 8, "a comment is no change");

    let edited = SMALL.replace("sin(3.0", "sin(2.9");
    assert_ne!(edited, SMALL);
    write(dir.path(), "small.rhai", &edited);
    expect_code(&exec(&script, &out, &[]), 0);
    assert_eq!(units(), 12, "the four units of one variant are new");
}

#[test]
fn seeds_and_episodes_can_be_overridden() {
    let dir = folder();
    let script = write(dir.path(), "small.rhai", SMALL);
    let out = dir.path().join("results");
    let output = exec(&script, &out, &["--seeds", "6", "--episodes", "5", "--quiet"]);
    expect_code(&output, 0);
    assert_eq!((stdout(&output), stderr(&output)), (String::new(), String::new()));
    let episodes = String::from_utf8(contents(&out)["episodes.csv"].clone()).unwrap();
    assert_eq!(episodes.lines().count(), 1 + 2 * 6 * 5);
}

#[test]
fn an_expectation_decides_the_exit_code() {
    let dir = folder();
    let out = dir.path().join("results");
    let claims = ".expect(\"true\", |r| r.plain.seeds == 4)\n.expect(\"false\", |r| r.plain.final_return.mean > 0.0)";
    let script = write(dir.path(), "s.rhai", &format!("{}{claims}", SMALL.trim_end()));
    let output = exec(&script, &out, &[]);
    expect_code(&output, 1);
    assert!(stdout(&output).contains("ok     true") && stdout(&output).contains("FAILED false"));
}

#[test]
fn a_folder_that_is_not_the_studys_is_refused_and_left_alone() {
    let dir = folder();
    let script = write(dir.path(), "small.rhai", SMALL);
    let out = dir.path().join("results");
    expect_code(&exec(&script, &out, &["--seeds", "1", "--episodes", "2"]), 0);
    let before = contents(&out);
    let other = write(dir.path(), "other.rhai", &SMALL.replace("\"small\"", "\"other\""));
    let output = exec(&other, &out, &["--fresh"]);
    expect_code(&output, 2);
    assert!(
        stderr(&output).contains("holds the results of the study \"small\""),
        "{}",
        stderr(&output)
    );
    assert!(stderr(&output).contains("--out DIR"));
    assert_eq!(contents(&out), before);

    let mine = dir.path().join("mine");
    write(&mine, "thesis.tex", "years of work");
    expect_code(&exec(&script, &mine, &["--fresh"]), 2);
    assert_eq!(contents(&mine).len(), 1);

    let file = write(dir.path(), "file", "not a folder");
    expect_code(&exec(&script, &file, &[]), 2);
}

#[test]
fn mistakes_in_the_arguments_are_exit_code_2() {
    for args in [
        &["exec"][..],
        &["exec", "nowhere.rhai"],
        &["exec", "scripts"],
        &["exec", "scripts/cartpole.rhai", "--seeds", "0"],
        &["frobnicate"],
        &["rollout", "CartPole-v9"],
        &["rollout", "CartPole-v1", "--actions", "0,2"],
        &["rollout", "CartPole-v1", "--kwargs", "{"],
        &["rollout", "CartPole-v1", "--kwargs", "{\"gravity\": 1}"],
        &["rollout", "CartPole-v1", "--seed=-1"],
        &["parity", "nowhere.jsonl"],
        &["parity", "Cargo.toml"],
        &["golden", "nowhere.rhai"],
        &["completions", "cobol"],
    ] {
        let output = run(args);
        expect_code(&output, 2);
        assert!(stderr(&output).starts_with("error"), "{args:?}: {}", stderr(&output));
        assert!(!stderr(&output).contains("panicked"), "{args:?}");
    }
}

#[test]
fn files_that_are_no_scripts_are_named() {
    let dir = folder();
    std::fs::write(dir.path().join("binary.rhai"), [0xff, 0xfe, 0x00, 0x80]).unwrap();
    write(dir.path(), "empty.rhai", " \n");
    write(dir.path(), "large.rhai", &"x".repeat(300 * 1024));
    for (name, message) in [
        ("binary.rhai", "is not UTF-8 text"),
        ("empty.rhai", "is empty"),
        ("large.rhai", "too long"),
        ("missing.rhai", "cannot be read"),
    ] {
        let output = runner().arg("check").arg(dir.path().join(name)).output().unwrap();
        expect_code(&output, 2);
        let text = stderr(&output);
        assert!(text.contains(name) && text.contains(message), "{text}");
    }
}

/// Recorded with Gymnasium 1.4.0: `reset(seed=42)`, then action 1.
#[test]
fn rollout_prints_gymnasiums_trajectory() {
    let output = run(&["rollout", "CartPole-v1", "--seed", "42", "--actions", "1"]);
    expect_code(&output, 0);
    let text = stdout(&output);
    let mut lines = text.lines();
    assert_eq!(
        lines.next().unwrap(),
        r#"{"type":"reset","seed":42,"obs":[0.027395604,-0.006112156,0.035859793,0.019736802]}"#
    );
    assert_eq!(
        lines.next().unwrap(),
        r#"{"type":"step","action":1,"obs":[0.027273363,0.18847767,0.03625453,-0.26141977],"reward":1.0,"terminated":false,"truncated":false}"#
    );
    assert_eq!(lines.next(), None);
}

#[test]
fn a_rollout_goes_on_with_an_unseeded_reset() {
    let kwargs = "{\"is_slippery\": false}";
    let args =
        ["rollout", "FrozenLake-v1", "--kwargs", kwargs, "--seed", "1", "--actions", "1,2,1"];
    let text = stdout(&run(&args));
    let resets: Vec<&str> = text.lines().filter(|l| l.contains("reset")).collect();
    assert_eq!(resets.len(), 2, "{text}");
    assert!(resets[1].contains(r#""seed":null"#), "{text}");
}

#[test]
fn parity_reports_every_file_and_fails_on_a_forgery() {
    let recording = "tests/data/gymnasium/frozenlake_4x4_det.jsonl.gz";
    let output = run(&["parity", recording, "tests/data/gymnasium/mountaincar_lcg.jsonl.gz"]);
    expect_code(&output, 0);
    assert_eq!(stdout(&output).matches("exact").count(), 2, "{}", stdout(&output));

    let mut text = String::new();
    let file = std::fs::File::open(Path::new(env!("CARGO_MANIFEST_DIR")).join(recording)).unwrap();
    std::io::Read::read_to_string(&mut flate2::read::GzDecoder::new(file), &mut text).unwrap();
    let dir = folder();
    let forged = write(dir.path(), "forged.jsonl", &text.replacen("\"obs\":4", "\"obs\":5", 1));
    let output = runner().arg("parity").arg(&forged).output().unwrap();
    expect_code(&output, 1);
    assert!(stdout(&output).contains("DIFFERS") && stderr(&output).contains("recorded 5"));

    let cut = write(dir.path(), "cut.jsonl", &text[..text.len() / 2]);
    expect_code(&runner().arg("parity").arg(&cut).output().unwrap(), 2);
}

#[test]
fn a_new_script_of_every_environment_passes_its_check() {
    let dir = folder();
    for spec in runner::env::specs() {
        let name = spec.id.to_lowercase();
        let mut command = runner();
        let args = ["new", &name, "--env", spec.id];
        expect_code(&command.current_dir(dir.path()).args(args).output().unwrap(), 0);
        let script = dir.path().join(format!("{name}.rhai"));
        let output = runner().arg("check").arg(&script).output().unwrap();
        expect_code(&output, 0);
        assert_eq!(stderr(&output), "", "{}: no warnings", spec.id);
    }
    // It does not overwrite.
    let mut command = runner();
    let again = command.current_dir(dir.path()).args(["new", "cartpole-v1"]).output().unwrap();
    expect_code(&again, 2);
    assert!(stderr(&again).contains("is already there"));
}

#[test]
fn lists_name_everything_that_is_registered() {
    let envs = stdout(&run(&["list", "envs"]));
    assert!(runner::env::specs().iter().all(|s| envs.contains(s.id)));
    let agents = stdout(&run(&["list", "agents"]));
    assert!(runner::learn::registry::AGENTS.iter().all(|a| agents.contains(a.name)));
    let keys = stdout(&run(&["list", "keys"]));
    assert!(runner::script::keys::names().all(|k| keys.contains(k)));
    let functions = stdout(&run(&["list", "functions"]));
    assert!(functions.contains("experiment(map)") && functions.contains("q_learning(#{"));
    assert!(stdout(&run(&["list", "examples"])).contains("scripts/cartpole.rhai"));
}

#[test]
fn completions_know_the_subcommands() {
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let output = run(&["completions", shell]);
        expect_code(&output, 0);
        assert!(stdout(&output).contains("rollout"), "{shell}");
    }
}

#[test]
fn a_closed_pipe_is_no_error() {
    use std::io::Read;
    let mut child = runner()
        .args(["rollout", "CartPole-v1", "--steps", "200000"])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let mut first = [0u8; 100];
    child.stdout.take().unwrap().read_exact(&mut first).unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(stderr(&output), "");
    expect_code(&output, 0);
}

#[test]
fn rewards_without_a_model_are_tried_and_drowned_potentials_are_inconclusive() {
    let dir = folder();
    let script = r#"
        let plain = experiment(#{
            name: "plain", env: "FrozenLake-v1", agent: q_learning(), episodes: 5, seeds: 1,
        });
        [
            plain.with(#{ name: "step", terms: #{ x: |t| if t.step > 3 { 1.0 } else { 0.0 } } }),
            plain.with(#{ name: "cut", terms: #{ x: |t| if t.truncated { 5.0 } else { 0.0 } } }),
            plain.with(#{ name: "large", potential: |s| 1e10 * s.col }),
            plain.with(#{ name: "scaled", reward: |t| 1e-12 * t.reward }),
        ]
    "#;
    let script = write(dir.path(), "judged.rhai", script);
    let out = dir.path().join("results");
    expect_code(&exec(&script, &out, &[]), 0);
    let summary: serde_json::Value =
        serde_json::from_slice(&contents(&out)["summary.json"]).unwrap();
    let verdicts: Vec<&str> = summary["variants"]
        .as_array()
        .unwrap()
        .iter()
        .map(|v| v["audit"]["verdict"].as_str().unwrap())
        .collect();
    assert_eq!(
        verdicts,
        ["not-potential-based", "inconclusive", "inconclusive", "not-potential-based"]
    );
}

#[test]
fn learners_that_diverge_and_policies_that_never_end_are_stopped() {
    let dir = folder();
    let trained = |name: &str, keys: &str| {
        let script =
            format!("experiment(#{{ name: \"{name}\", episodes: 500, seeds: 1, {keys} }})");
        let path = write(dir.path(), &format!("{name}.rhai"), &script);
        exec(&path, &dir.path().join(name), &[])
    };
    for (name, keys, message) in [
        (
            "diverges",
            "env: \"CliffWalking-v1\", max_steps: 500, agent: sarsa_lambda(#{ alpha: 1.0, \
             gamma: 1.0, lambda: 1.0, epsilon: 0.1, trace_cutoff: 0.0 })",
            "the learner diverged",
        ),
        (
            "planned",
            "env: \"CliffWalking-v1\", agent: value_iteration(#{ gamma: 0.9 }), \
             allowed: |s, a| a == 0 || a == 1",
            "may never end",
        ),
        ("given", "env: \"CliffWalking-v1\", agent: td0(#{ policy: |s| 0 })", "may never end"),
    ] {
        let output = trained(name, keys);
        expect_code(&output, 2);
        assert!(stderr(&output).contains(message), "{name}: {}", stderr(&output));
        assert!(stderr(&output).contains(&format!("variant `{name}`")), "{}", stderr(&output));
    }
}
