//! What the tests of the command share: running it, and folders to run it in.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use runner::learn::registry::{AgentSpec, Build, BuildFn};

/// How a learner of action values is built; `None` for planners and predictors.
pub(crate) fn build_of(spec: &AgentSpec) -> Option<BuildFn> {
    match spec.build {
        Build::Learner(build) | Build::OnPolicy { build, .. } | Build::OneStep { build, .. } => {
            Some(build)
        }
        Build::Predictor(_) | Build::Network(_) | Build::Planner(_) => None,
    }
}

/// A folder that vanishes with the test.
pub(crate) fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// Writes a script (or any file) into `folder` and returns its path.
pub(crate) fn write(folder: &Path, name: &str, text: &str) -> PathBuf {
    let path = folder.join(name);
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(&path, text).unwrap();
    path
}

/// The command, to be given arguments.
pub(crate) fn runner() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_runner"));
    command.env("NO_COLOR", "1").current_dir(env!("CARGO_MANIFEST_DIR"));
    command
}

/// Runs the command with `args`.
pub(crate) fn run(args: &[&str]) -> Output {
    runner().args(args).output().expect("the command starts")
}

/// Its exit code; a test that gets none (a signal) fails here.
pub(crate) fn code(output: &Output) -> i32 {
    output.status.code().unwrap_or_else(|| panic!("ended by a signal: {}", stderr(output)))
}

pub(crate) fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).expect("stdout is UTF-8")
}

pub(crate) fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Asserts the exit code, showing what was printed if it is another.
pub(crate) fn expect_code(output: &Output, expected: i32) {
    let got = code(output);
    assert_eq!(got, expected, "stdout:\n{}\nstderr:\n{}", stdout(output), stderr(output));
}

/// Every file below `folder` by its relative path, except what may differ between equal runs:
/// times, and the circumstance in the manifest.
pub(crate) fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut stack = vec![folder.to_path_buf()];
    while let Some(path) = stack.pop() {
        if path.is_dir() {
            stack.extend(std::fs::read_dir(&path).unwrap().map(|e| e.unwrap().path()));
            continue;
        }
        let name = path.strip_prefix(folder).unwrap().display().to_string();
        let mut bytes = std::fs::read(&path).unwrap();
        match name.as_str() {
            "timing.json" => continue,
            "study.json" => {
                let mut manifest: serde_json::Value = serde_json::from_slice(&bytes).unwrap();
                manifest.as_object_mut().unwrap().remove("circumstance").expect("it is there");
                bytes = manifest.to_string().into_bytes();
            }
            _ => {}
        }
        files.insert(name, bytes);
    }
    files
}

/// Asserts that two results folders hold the same bytes.
pub(crate) fn assert_same(a: &Path, b: &Path) {
    let (a, b) = (contents(a), contents(b));
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>());
    for (name, bytes) in &a {
        assert!(*bytes == b[name], "{name} differs");
    }
}

/// A study of two variants that takes some tens of milliseconds.
pub(crate) const SMALL: &str = r#"
const GAMMA = 0.99;
fn height(s) { sin(3.0 * s.position) }
let plain = experiment(#{
    name: "plain",
    env: "MountainCar-v0",
    agent: q_learning(#{ alpha: 0.1, gamma: GAMMA, epsilon: exponential(1.0, 0.99, 0.01) }),
    discretiser: bins(#{ position: [-1.2, 0.6, 20], velocity: [-0.07, 0.07, 20] }),
    episodes: 60,
    seeds: 4,
});
study("small", [plain, plain.with(#{ name: "height", potential: height, terms: #{
    effort: |t| if t.action == 1 { 0.0 } else { -0.1 },
} })])
"#;

/// Planning on dry land and on ice, and an agent that learns nothing.
pub(crate) const LAKE: &str = r#"
fn closer(s) { 1.0 - 0.05 * (abs(s.row - s.goal_row) + abs(s.col - s.goal_col)) }
let dry = experiment(#{
    name: "dry",
    env: env("FrozenLake-v1", #{ is_slippery: false }),
    agent: value_iteration(#{ gamma: 0.99 }),
    episodes: 20,
    seeds: 2,
});
let ice = dry.with(#{ name: "ice", env: env("FrozenLake-v1", #{ is_slippery: true }) });
study("lake", [
    dry,
    ice,
    ice.with(#{ name: "ice-shaped", potential: closer }),
    dry.with(#{ name: "random", agent: random_agent() }),
]).expect("dry land is easy", |r| r.dry.final_return.mean == 1.0)
"#;

/// Runs `script` in `folder`; the results folder.
pub(crate) fn stored(folder: &Path, script: &str) -> PathBuf {
    let script = write(folder, "study.rhai", script);
    let results = folder.join("results");
    let mut command = runner();
    let output = command.arg("exec").arg(script).arg("--out").arg(&results).output().unwrap();
    expect_code(&output, 0);
    results
}

/// Everything below `folder` that changes when anything there is written: names, and when files
/// and folders were changed.
pub(crate) fn untouched(folder: &Path) -> BTreeMap<PathBuf, std::time::SystemTime> {
    let mut seen = BTreeMap::new();
    let mut stack = vec![folder.to_path_buf()];
    while let Some(path) = stack.pop() {
        if path.is_dir() {
            stack.extend(std::fs::read_dir(&path).unwrap().map(|e| e.unwrap().path()));
        }
        let changed = std::fs::metadata(&path).unwrap().modified().unwrap();
        seen.insert(path, changed);
    }
    seen
}
