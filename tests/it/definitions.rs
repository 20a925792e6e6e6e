//! `runner definitions`: what editors are told, and where it is written.

use std::path::Path;
use std::process::Output;

use crate::support::{contents, expect_code, folder, runner, stderr, stdout, write};

fn definitions(folder: &Path) -> Output {
    runner().arg("definitions").arg("--out").arg(folder).output().unwrap()
}

#[test]
fn the_files_are_written_named_and_written_again() {
    let dir = folder();
    let into = dir.path().join("project");
    let output = definitions(&into);
    expect_code(&output, 0);
    let files = contents(&into);
    let names: Vec<&str> = files.keys().map(String::as_str).collect();
    assert_eq!(names, [".vscode/runner.code-snippets", "runner.d.rhai"]);
    for name in names {
        assert!(stdout(&output).contains(&into.join(name).display().to_string()), "{name}");
    }
    expect_code(&definitions(&into), 0);
    assert_eq!(contents(&into), files);
}

#[test]
fn a_file_of_the_users_own_is_left_alone() {
    let dir = folder();
    write(dir.path(), "runner.d.rhai", "module static;");
    let output = definitions(dir.path());
    expect_code(&output, 2);
    assert!(stderr(&output).contains("is there already"), "{}", stderr(&output));
    assert_eq!(contents(dir.path()).len(), 1);
}
