//! Networks as files: what a unit leaves behind plays, is exported, and is refused where it does
//! not belong.

use std::path::{Path, PathBuf};

use crate::support::{
    SMALL, assert_same, contents, expect_code, folder, run, runner, stderr, stdout, stored, write,
};

const NETWORKS: &str = r#"
let cart = experiment(#{
    name: "cart", env: "CartPole-v1", episodes: 12, seeds: [3, 4],
    agent: dqn(#{ net_arch: [8, 8], batch_size: 16, log_interval: 50 }),
});
study("networks", [
    cart,
    cart.with(#{ name: "car", env: "MountainCar-v0", frame_skip: 4, max_steps: 50, episodes: 3,
        normalise: #{ position: [-1.2, 0.6], velocity: [-0.07, 0.07] },
        agent: double_dqn(#{ net_arch: [8], dueling: true, batch_size: 16 }) }),
    cart.with(#{ name: "lake", env: "FrozenLake-v1", episodes: 30 }),
    // Up would fall back, left goes nowhere: from the start on only down and right.
    cart.with(#{ name: "fenced", env: env("FrozenLake-v1", #{ is_slippery: false }),
        allowed: |s, a| a == 2 || a == 1, episodes: 30 }),
])
"#;

/// The folder of a variant's first unit.
fn unit(results: &Path, variant: &str) -> PathBuf {
    let manifest = std::fs::read(results.join("study.json")).unwrap();
    let manifest: serde_json::Value = serde_json::from_slice(&manifest).unwrap();
    let variants = manifest["identity"]["variants"].as_array().unwrap();
    let own = variants.iter().find(|v| v["name"] == variant).unwrap();
    let hash = own["units"][0].as_str().unwrap();
    results.join("units").join(&hash[..2]).join(hash)
}

fn model(results: &Path, variant: &str) -> String {
    unit(results, variant).join("model.safetensors").display().to_string()
}

fn json(output: &std::process::Output) -> serde_json::Value {
    expect_code(output, 0);
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn a_stored_network_plays_from_its_study_and_from_its_file() {
    let dir = folder();
    let results = stored(dir.path(), NETWORKS);
    let play = |more: &[&str]| runner().arg("play").arg(&results).args(more).output().unwrap();
    for (variant, env) in
        [("cart", "CartPole-v1"), ("car", "MountainCar-v0"), ("lake", "FrozenLake-v1")]
    {
        let played = play(&["--variant", variant, "--env-seed", "5"]);
        expect_code(&played, 0);
        let steps = (stdout(&played).lines().count() - 1).to_string();
        let file = model(&results, variant);
        let by_file = run(&["rollout", env, "--seed", "5", "--steps", &steps, "--policy", &file]);
        expect_code(&by_file, 0);
        let lines = |output| stdout(output).lines().map(String::from).collect::<Vec<_>>();
        let (played, by_file) = (lines(&played), lines(&by_file));
        // The last step apart: the variant's time limit is not the environment's.
        assert_eq!(played[..played.len() - 1], by_file[..played.len() - 1], "{variant}");
    }
    let fenced = play(&["--variant", "fenced", "--steps", "100", "--episodes", "9"]);
    expect_code(&fenced, 0);
    assert!(
        !stdout(&fenced).contains(r#""action":0"#) && !stdout(&fenced).contains(r#""action":3"#)
    );
    // The best of CartPole's networks is kept beside the last.
    let best = unit(&results, "cart").join("best.safetensors").display().to_string();
    let said = json(&run(&["export", &best, "--json"]));
    assert_eq!(said["manifest"]["checkpoint"], "best");
    let played = play(&["--model", "best", "--env-seed", "5"]);
    expect_code(&played, 0);
    let by_file = ["rollout", "CartPole-v1", "--seed", "5", "--policy", &best, "--steps"];
    let steps = (stdout(&played).lines().count() - 1).to_string();
    assert_eq!(stdout(&run(&[&by_file[..], &[&steps]].concat())), stdout(&played));

    let other = dir.path().join("tables");
    std::fs::create_dir(&other).unwrap();
    let tables = stored(&other, SMALL);
    let refused = runner().arg("play").arg(&tables).args(["--model", "last"]).output().unwrap();
    expect_code(&refused, 2);
    let said = stderr(&refused);
    assert!(said.contains("variant `plain` has no networks: its agent `q_learning`"), "{said}");
}

#[test]
fn a_network_is_exported_and_nothing_is_overwritten() {
    let dir = folder();
    let results = stored(dir.path(), NETWORKS);
    let file = model(&results, "car");
    let onnx = dir.path().join("car.onnx");
    let onnx = onnx.to_str().unwrap();
    let output = run(&["export", &file, "--onnx", onnx]);
    expect_code(&output, 0);
    let bytes = std::fs::read(onnx).unwrap();
    assert!(stderr(&output).starts_with(onnx), "{}", stderr(&output));
    let again = run(&["export", &file, "--onnx", onnx]);
    expect_code(&again, 2);
    let said = stderr(&again);
    assert!(said.contains("is already there") && said.contains("--force replaces it"), "{said}");
    std::fs::write(onnx, "x").unwrap();
    expect_code(&run(&["export", &file, "--onnx", onnx, "--force"]), 0);
    assert_eq!(std::fs::read(onnx).unwrap(), bytes);
    let into_nothing = dir.path().join("nowhere/car.onnx");
    expect_code(&run(&["export", &file, "--onnx", into_nothing.to_str().unwrap()]), 2);

    let said = json(&run(&["export", &file, "--json"]));
    let manifest = &said["manifest"];
    assert_eq!(
        [&manifest["env"], &manifest["seed"], &manifest["episode"]],
        ["MountainCar-v0", "3", "3"]
    );
    assert_eq!(manifest["config"]["agent"], "double_dqn");
    assert_eq!(manifest["actions"][0], "left");
    assert_eq!(manifest["inputs"]["fields"][1]["shown"][1], 0.07);
    let names: Vec<&str> =
        said["tensors"].as_array().unwrap().iter().map(|t| t["name"].as_str().unwrap()).collect();
    let heads = ["advantage.weight", "advantage.bias", "value.weight", "value.bias"];
    assert_eq!(names, [&["q_net.0.weight", "q_net.0.bias"][..], &heads].concat());
    assert_eq!(run(&["export", &file]).status.code(), Some(2));
}

#[test]
fn files_that_do_not_belong_are_refused() {
    let dir = folder();
    let results = stored(dir.path(), NETWORKS);
    let refused = |env: &str, file: &str, message: &str| {
        let output = run(&["rollout", env, "--policy", file]);
        expect_code(&output, 2);
        assert!(stderr(&output).contains(message), "{}", stderr(&output));
    };
    let car = model(&results, "car");
    refused("CartPole-v1", &car, "is about the actions left, none, right of MountainCar-v0");
    let lake = model(&results, "lake");
    refused(
        "FrozenLake8x8-v1",
        &lake,
        "is about the 16 states of FrozenLake-v1, here there are 64",
    );

    let bytes = std::fs::read(&car).unwrap();
    let half = dir.path().join("half.safetensors");
    std::fs::write(&half, &bytes[..bytes.len() - 9]).unwrap();
    let half = half.to_str().unwrap();
    refused("MountainCar-v0", half, "is damaged: there are ");
    let output = run(&["export", half, "--json"]);
    expect_code(&output, 2);
    assert!(stderr(&output).contains("half.safetensors: is damaged"), "{}", stderr(&output));
    let text = write(dir.path(), "text.safetensors", "no weights here");
    refused("MountainCar-v0", text.to_str().unwrap(), "is no safetensors file");

    // A unit whose network was exchanged is found out.
    std::fs::write(&car, std::fs::read(model(&results, "cart")).unwrap()).unwrap();
    let play = runner().arg("play").arg(&results).args(["--variant", "car"]).output().unwrap();
    expect_code(&play, 2);
    assert!(stderr(&play).contains("was changed after it was written"), "{}", stderr(&play));
}

#[test]
fn training_is_written_for_tensorboard_the_same_every_time() {
    let dir = folder();
    let script = write(dir.path(), "networks.rhai", NETWORKS);
    let exec = |out: &str| {
        let out = dir.path().join(out);
        let mut command = runner();
        command.arg("exec").arg(&script).arg("--tensorboard").arg("--out").arg(&out);
        let output = command.output().unwrap();
        expect_code(&output, 0);
        assert!(stderr(&output).contains("tensorboard --logdir "), "{}", stderr(&output));
        out
    };
    let (one, two) = (exec("one"), exec("two"));
    assert_same(&one, &two);
    let files = contents(&one);
    for (variant, seed) in [("cart", 3), ("cart", 4), ("car", 3), ("lake", 3), ("fenced", 4)] {
        let name =
            format!("tensorboard/{variant}/seed-{seed}/events.out.tfevents.0000000000.runner");
        let text = String::from_utf8_lossy(&files[&name]);
        assert!(text.contains("brain.Event:2") && text.contains("rollout/ep_rew_mean"), "{name}");
        let learned = text.contains("train/loss") && text.contains("train/n_updates");
        assert_eq!(learned, variant != "car", "{name}: its log has no entries");
    }
    // What is there is read, not run again; without the flag nothing is written.
    let tables = write(dir.path(), "small.rhai", SMALL);
    let out = dir.path().join("small");
    let command = |more: &[&str]| {
        let mut command = runner();
        command.arg("exec").arg(&tables).arg("--out").arg(&out).args(more).output().unwrap()
    };
    expect_code(&command(&[]), 0);
    assert!(!out.join("tensorboard").exists());
    expect_code(&command(&["--tensorboard"]), 0);
    assert!(out.join("tensorboard/height/seed-0").is_dir());
}
