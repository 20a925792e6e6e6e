//! Wrong scripts and what is said about them. Every file of `tests/wrong` is loaded and checked as
//! `runner check` does; comments in it say what must come of it:
//!
//! ```text
//! // Error: 7:5 an experiment has no key `episods`
//! // Hint: did you mean `episodes`?
//! // Note: …
//! ```
//!
//! Line and column come first, with the file before them if it is an imported one; `Warning` in
//! the place of `Error` where the script runs all the same. Everything is compared exactly.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use runner::experiment::check;
use runner::report::claims::rehearse;
use runner::script::{Diagnostic, Severity, load};

const FOLDER: &str = "tests/wrong";

/// The expectations of a file, one a line.
fn expected(text: &str) -> String {
    let marks = ["Error:", "Warning:", "Hint:", "Note:"];
    let comments = text.lines().filter_map(|line| line.trim().strip_prefix("// "));
    let lines = comments.filter(|c| marks.iter().any(|mark| c.starts_with(mark)));
    lines.flat_map(|line| [line, "\n"]).collect()
}

/// A diagnostic in the form of the expectations.
fn shown(d: &Diagnostic, script: &Path) -> String {
    let mut text = match d.severity {
        Severity::Error => "Error:".to_string(),
        Severity::Warning => "Warning:".to_string(),
    };
    if let Some(place) = &d.place {
        let file = Path::new(&*place.file);
        let inner = file.strip_prefix(FOLDER).unwrap_or(file);
        let file = if file == script { String::new() } else { format!("{}:", inner.display()) };
        write!(text, " {file}{}:{}", place.line, place.column).unwrap();
        assert!(d.source_line.is_some(), "{}: a place without its line", script.display());
    }
    writeln!(text, " {}", d.message).unwrap();
    for note in &d.notes {
        writeln!(text, "Note: {note}").unwrap();
    }
    if let Some(hint) = &d.hint {
        writeln!(text, "Hint: {hint}").unwrap();
    }
    text
}

/// What loading and checking the script says.
fn actual(script: &Path) -> String {
    match load(script).and_then(|plan| check(&plan).and_then(|_| rehearse(&plan)).map(|()| plan)) {
        Ok(plan) => plan.warnings.iter().map(|d| shown(d, script)).collect(),
        Err(d) => shown(&d, script),
    }
}

fn scripts() -> Vec<PathBuf> {
    let entries = std::fs::read_dir(FOLDER).unwrap().map(|entry| entry.unwrap().path());
    let mut scripts: Vec<_> = entries.filter(|p| p.extension().is_some()).collect();
    scripts.sort();
    scripts
}

#[test]
fn wrong_scripts_are_told_what_is_wrong_with_them() {
    let scripts = scripts();
    assert!(scripts.len() >= 35);
    let mut failures = String::new();
    for script in &scripts {
        let expected = expected(&std::fs::read_to_string(script).unwrap());
        let headings =
            expected.lines().filter(|l| l.starts_with("Error:") || l.starts_with("Warning:"));
        let actual = actual(script);
        if headings.count() != 1 || expected != actual {
            write!(
                failures,
                "\n{}\n  expected (exactly one error or warning):\n{}  actual:\n{}",
                script.display(),
                indent(&expected),
                indent(&actual)
            )
            .unwrap();
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

fn indent(text: &str) -> String {
    text.lines().flat_map(|line| ["    ", line, "\n"]).collect()
}
