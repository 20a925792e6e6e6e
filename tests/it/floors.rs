//! The architecture, enforced: a floor imports from lower floors only, and files stay small.

use std::path::{Path, PathBuf};

/// From the top down.
const FLOORS: [&str; 13] = [
    "cli",
    "report",
    "experiment",
    "script",
    "audit",
    "stats",
    "learn",
    "nn",
    "shaping",
    "jit",
    "render",
    "env",
    "mdp",
];

/// Lines that a source file may have; beyond about 400 it wants splitting.
const MAX_LINES: usize = 450;

fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(sources(&path));
        } else if path.extension().is_some_and(|x| x == "rs") {
            files.push(path);
        }
    }
    files.sort();
    files
}

/// The floors that `text` mentions as `crate::floor`, with the line, comments left out.
fn imports(text: &str) -> Vec<(usize, &'static str)> {
    let mut found = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let code = line.split("//").next().unwrap_or("");
        for part in code.split("crate::").skip(1) {
            // `crate::{a, b}` names several.
            let names: Vec<&str> = match part.strip_prefix('{') {
                Some(list) => list.split([',', '}']).map(str::trim).collect(),
                None => vec![part],
            };
            for name in names {
                let word = name.split(|c: char| !(c.is_alphanumeric() || c == '_')).next();
                found.extend(FLOORS.iter().filter(|f| Some(**f) == word).map(|f| (i + 1, *f)));
            }
        }
    }
    found
}

/// Imports of `text`, a file of `floor`, that go upwards.
fn upward(floor: &str, text: &str) -> Vec<(usize, &'static str)> {
    let height = |name: &str| FLOORS.iter().position(|f| *f == name).expect("a floor");
    imports(text).into_iter().filter(|(_, to)| height(to) < height(floor)).collect()
}

#[test]
fn no_floor_imports_from_above() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut wrong = Vec::new();
    let mut seen = std::collections::BTreeSet::new();
    for file in sources(&src) {
        let relative = file.strip_prefix(&src).unwrap();
        let top = relative.components().next().unwrap().as_os_str().to_string_lossy().into_owned();
        if top == "lib.rs" || top == "main.rs" {
            continue;
        }
        assert!(FLOORS.contains(&top.as_str()), "src/{top} is on no floor");
        let text = std::fs::read_to_string(&file).unwrap();
        for (line, to) in upward(&top, &text) {
            wrong.push(format!("src/{}:{line} imports {to}", relative.display()));
        }
        seen.insert(top);
    }
    assert_eq!(seen.len(), FLOORS.len(), "a floor has no files: {seen:?}");
    assert!(wrong.is_empty(), "imports that go upwards:\n{}", wrong.join("\n"));
}

#[test]
fn an_upward_import_would_be_found() {
    assert_eq!(upward("env", "use crate::script::Plan;"), [(1, "script")]);
    assert_eq!(upward("mdp", "\nlet x = crate::{env, learn::QTable};"), [(2, "env"), (2, "learn")]);
    assert!(upward("env", "use crate::mdp::Env; // crate::cli").is_empty());
    assert!(upward("env", "use crate::environment::X;").is_empty());
}

#[test]
fn no_file_outgrows_a_room() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for folder in ["src", "tests", "benches"] {
        for file in sources(&root.join(folder)) {
            let lines = std::fs::read_to_string(&file).unwrap().lines().count();
            assert!(lines <= MAX_LINES, "{} has {lines} lines: split it", file.display());
        }
    }
}

/// The files that may hold unsafe code; each says why it is sound.
const UNSAFE: [&str; 2] = ["jit/machine/code.rs", "script/memory.rs"];

#[test]
fn unsafe_code_stays_where_it_is() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut with = Vec::new();
    for file in sources(&src) {
        let text = std::fs::read_to_string(&file).unwrap();
        let word = |line: &str| {
            let code = line.split("//").next().unwrap_or("");
            code.split(|c: char| !(c.is_alphanumeric() || c == '_'))
                .any(|w| w == "unsafe" || w == "unsafe_code")
        };
        if text.lines().any(word) {
            let relative = file.strip_prefix(&src).unwrap();
            with.push(relative.to_string_lossy().replace('\\', "/"));
        }
    }
    assert_eq!(with, UNSAFE);
}
