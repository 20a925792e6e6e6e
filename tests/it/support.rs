//! What the tests of the command share: running it, and folders to run it in.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

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
