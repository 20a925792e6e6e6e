//! Networks that are trained further, from a stored one.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::atomic::AtomicBool;

use serde_json::Value;
use sha2::{Digest, Sha256};

use runner::experiment::{Checkpoint, Model, UnitRecord, run_unit, start_from, units};
use runner::script::Host;

use crate::language::plan_of;
use crate::support::{SMALL, assert_same, expect_code, folder, runner, stderr, stored, write};

const FIRST: &str = r#"
let dqn = experiment(#{
    name: "dqn", env: "CartPole-v1", episodes: 40, seeds: 2,
    agent: dqn(#{ net_arch: [8], batch_size: 16, learning_rate: 0.01 }),
});
study("first", [
    dqn,
    dqn.with(#{ name: "table", agent: q_learning(), discretiser: bins(#{ theta: [-0.2, 0.2, 8] }) }),
])
"#;

fn manifest(results: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(results.join("study.json")).unwrap()).unwrap()
}

/// The folder of the first unit of the `i`-th variant.
fn unit(results: &Path, i: usize) -> PathBuf {
    let manifest = manifest(results);
    let hash = manifest["identity"]["variants"][i]["units"][0].as_str().unwrap();
    results.join("units").join(&hash[..2]).join(hash)
}

/// A network that has learned, and the results it is from.
fn learned(folder: &Path) -> (PathBuf, PathBuf) {
    let results = stored(folder, FIRST);
    (unit(&results, 0).join("model.safetensors"), results)
}

fn exec(script: &Path, from: &Path, out: &Path) -> Output {
    let mut command = runner();
    command.arg("exec").arg(script).arg("--from").arg(from).arg("--out").arg(out);
    command.output().unwrap()
}

/// Where learning starts after the end, what is stored is what it started from.
#[test]
fn training_starts_from_the_stored_weights() {
    let dir = folder();
    let (file, first_results) = learned(dir.path());
    let start = Model::read(&file).unwrap().net;
    let script = FIRST.replace("learning_rate: 0.01", "learning_starts: 1000000");
    let script = write(dir.path(), "still.rhai", &script);
    let out = dir.path().join("still");
    expect_code(&exec(&script, &file, &out), 0);
    let end = Model::read(&unit(&out, 0).join("model.safetensors")).unwrap();
    assert_eq!(end.net, start);
    // What it believes of the first states is what it has learned: an untrained one knows nothing.
    let first = |results: &Path| -> f64 {
        let text = std::fs::read_to_string(results.join("episodes.csv")).unwrap();
        let line: Vec<&str> = text.lines().nth(1).unwrap().split(',').collect();
        line[line.len() - 2].parse().unwrap()
    };
    let (anew, here) = (first(&first_results), first(&out));
    assert!(anew.abs() < 1.0 && here > 1.0, "{anew} {here}");

    // It goes on learning from there: episodes and weights are others than from random ones.
    let plan = plan_of(FIRST, &[]);
    let mut further = plan.clone();
    start_from(&mut further, &file).unwrap();
    let host = Host::open(&plan).unwrap();
    let never = AtomicBool::new(false);
    let play = |plan: &runner::script::Plan| {
        run_unit(&host, &plan.variants[0], 0, &never, &mut |_| {}).unwrap()
    };
    let (random, further) = (play(&plan), play(&further));
    assert_ne!(random.rows, further.rows);
    let last = |record: &UnitRecord| {
        let mut networks = record.networks.iter();
        networks.find(|network| network.which == Checkpoint::Last).unwrap().net.clone()
    };
    assert_eq!(last(&random), start, "the first study's own");
    assert_ne!(last(&further), start);
}

#[test]
fn the_start_is_part_of_the_units_that_learn_networks() {
    let dir = folder();
    let (file, _) = learned(dir.path());
    let plan = plan_of(FIRST, &[]);
    let mut further = plan.clone();
    start_from(&mut further, &file).unwrap();
    assert_eq!(plan.variants[0].identity().get("start"), None);
    let digest = Sha256::digest(std::fs::read(&file).unwrap());
    let digest = digest.iter().fold(String::new(), |mut text, byte| {
        write!(text, "{byte:02x}").unwrap();
        text
    });
    assert_eq!(further.variants[0].identity()["start"]["sha256"], digest);
    let hashes = |plan| units(plan).into_iter().map(|u| u.hash).collect::<Vec<_>>();
    let (before, after) = (hashes(&plan), hashes(&further));
    assert!(before[..2].iter().zip(&after).all(|(a, b)| a != b));
    assert_eq!(before[2..], after[2..], "a table starts as ever");
}

#[test]
fn results_need_the_file_no_more_and_a_run_goes_on_with_its_copy() {
    let dir = folder();
    let (file, first) = learned(dir.path());
    let script = write(dir.path(), "study.rhai", FIRST);
    let out = dir.path().join("further");
    expect_code(&exec(&script, &file, &out), 0);
    let copy = out.join("start.safetensors");
    assert_eq!(std::fs::read(&copy).unwrap(), std::fs::read(&file).unwrap());
    std::fs::remove_dir_all(first).unwrap();
    let read = |command: &str| {
        let output = runner().arg(command).arg(&out).output().unwrap();
        expect_code(&output, 0);
        stderr(&output)
    };
    read("play");
    assert!(!read("show").contains("incomplete"));

    let whole = dir.path().join("whole");
    expect_code(&exec(&script, &copy, &whole), 0);
    assert_same(&out, &whole);
    std::fs::remove_dir_all(unit(&out, 0)).unwrap();
    let said = read("show");
    let command = said.split("to go on: runner ").nth(1).expect("it is incomplete");
    let command = command.lines().next().unwrap();
    assert!(command.ends_with(&format!(" --from {}", copy.display())), "{command}");
    let mut go_on = runner();
    go_on.current_dir(dir.path()).args(command.split(' '));
    expect_code(&go_on.output().unwrap(), 0);
    assert_same(&out, &whole);
}

/// One that is stopped says with which network to go on.
#[cfg(unix)]
#[test]
fn a_run_that_is_stopped_repeats_the_option() {
    let dir = folder();
    let (file, _) = learned(dir.path());
    let long = FIRST.replace("episodes: 40", "episodes: 1000000");
    let script = write(dir.path(), "long.rhai", &long);
    let out = dir.path().join("long");
    for wait in [200, 1000, 5000] {
        let mut command = runner();
        command.arg("exec").arg(&script).arg("--from").arg(&file).arg("--out").arg(&out);
        command.stderr(std::process::Stdio::piped()).stdout(std::process::Stdio::piped());
        let child = command.spawn().unwrap();
        std::thread::sleep(std::time::Duration::from_millis(wait));
        let id = child.id().to_string();
        std::process::Command::new("kill").arg("-INT").arg(id).status().unwrap();
        let ended = child.wait_with_output().unwrap();
        if ended.status.code() == Some(75) {
            let said = stderr(&ended);
            assert!(said.contains(&format!(" --from {}\n", file.display())), "{said}");
            return;
        }
    }
    panic!("no signal was heard");
}

#[test]
fn a_network_that_does_not_fit_is_refused() {
    let dir = folder();
    let (file, _) = learned(dir.path());
    let refused = |text: &str, file: &Path, expected: &[&str]| {
        let script = write(dir.path(), "refused.rhai", text);
        let output = exec(&script, file, &dir.path().join("refused"));
        expect_code(&output, 2);
        let said = stderr(&output);
        for part in expected {
            assert!(said.contains(part), "{part}: {said}");
        }
        assert!(!dir.path().join("refused").exists(), "nothing is written");
    };
    let name = "in variant `dqn`";
    refused(
        &FIRST.replace("net_arch: [8]", "net_arch: [8, 4], dueling: true"),
        &file,
        &[
            "model.safetensors: holds a network 4 → 8 → 2, here it is 4 → 8 → 4 → 2, dueling",
            "`net_arch: [8], dueling: false`",
            name,
        ],
    );
    refused(
        &FIRST.replace("\"CartPole-v1\"", "\"MountainCar-v0\"").replace("theta", "position"),
        &file,
        &["is about the actions left, right of CartPole-v1, here they are left, none, right", name],
    );
    refused(
        &FIRST.replace("seeds: 2,", "seeds: 2, normalise: #{ theta: [-0.2, 0.2] },"),
        &file,
        &["sees `theta` in physical units, here it is shown with [-0.2, 0.2] as [-1, 1]", name],
    );
    refused(SMALL, &file, &["no variant learns a network", "`double_dqn`"]);
    refused(FIRST, &dir.path().join("none"), &["none: cannot be read"]);
    let text = write(dir.path(), "text", "no weights here");
    refused(FIRST, &text, &["text: is no safetensors file", "leaves a `model.safetensors`"]);
}
