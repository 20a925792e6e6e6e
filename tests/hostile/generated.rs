//! Hostile scripts that are too long to be written down, and hostile files beside them.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use super::run;

/// Asserts that checking `text` ends in one error with these words in it.
fn ends(text: &str, words: &str) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("script.rhai"), text).unwrap();
    ends_in(folder.path(), words, &text.chars().take(60).collect::<String>());
}

fn ends_in(folder: &Path, words: &str, what: &str) {
    let ended = run(&["check", "script.rhai"], folder);
    let complaints = ended.complaints();
    assert!(complaints.is_empty(), "{what}\n{complaints}{}", ended.stderr);
    assert!(ended.stderr.contains(words), "{what}\n{}", ended.stderr);
}

fn list(n: usize, item: impl Fn(usize) -> String) -> String {
    (0..n).map(item).collect::<Vec<_>>().join(",")
}

const NO_PLAN: &str = "a script ends in a study, an experiment or an array of experiments";

#[test]
fn long_lists_of_everything() {
    let cases = list(15_000, |i| format!("{i}=>1"));
    ends(&format!("let x = 5; switch x {{ {cases} }}"), NO_PLAN);
    let parameters = list(20_000, |i| format!("p{i}"));
    ends(&format!("fn f({parameters}) {{ 1 }} f(1)"), "`f` takes 20000 arguments");
    ends(&format!("[{}]", list(100_000, |_| "1".into())), "size of array");
    ends(&format!("#{{{}}}", list(16_000, |i| format!("k{i}:1"))), "map");
    ends(&format!("[{}]", list(16_000, |i| format!("|x| {i}"))), "functions");
    let functions: String = (0..10_000).fold(String::new(), |mut text, i| {
        writeln!(text, "fn f{i}() {{}}").unwrap();
        text
    });
    ends(&functions, "functions");
    let variables: String = (0..10_000).fold(String::new(), |mut text, i| {
        writeln!(text, "let v{i} = 1;").unwrap();
        text
    });
    ends(&variables, "variables");
    let words = "if true { } else ".repeat(10_000);
    ends(&format!("{words} {{ }}"), "exceeds");
}

#[test]
fn deep_nesting_of_everything() {
    for (open, words) in [
        ("(", "exceeds"),
        ("[", "exceeds"),
        ("#{a:", "exceeds"),
        ("-", "reserved symbol"),
        ("!", "exceeds"),
        ("|x|", "parameters"),
        ("{", "exceeds"),
        ("if true {", "exceeds"),
        ("while true {", "exceeds"),
        ("switch 1 { 1 => ", "exceeds"),
        ("f(", "exceeds"),
        ("a[", "exceeds"),
        ("`${", "exceeds"),
        ("try {", "exceeds"),
        ("/*", "script"),
    ] {
        ends(&open.repeat(200_000 / open.len()), words);
    }
    ends(&format!("1{}", "+1".repeat(100_000)), "exceeds");
    ends(&format!("1{}", " ?? 1".repeat(40_000)), "exceeds");
    ends(&format!("let a = []; a{}", "[0]".repeat(80_000)), "exceeds");
    ends(&format!("let a = 1; a{}", ".b".repeat(100_000)), "exceeds");
    ends(&format!("let a = 1; a{}", ".b()".repeat(60_000)), "exceeds");
}

#[test]
fn large_literals() {
    ends(&format!("let s = \"{}\";", "x".repeat(200_000)), "string");
    ends(&format!("let s = `{}`;", "x".repeat(200_000)), "string");
    ends(&format!("let x = {};", "9".repeat(200_000)), NO_PLAN);
    ends(&format!("let x = 0.{}; x", "3".repeat(200_000)), NO_PLAN);
    ends(&format!("let {} = 1; x", "x".repeat(200_000)), "`x`");
    ends(&format!("let s = `{}`; s", "${1}".repeat(40_000)), "");
    ends(&"x".repeat(300_000), "too long for a script");
}

#[test]
fn imports_that_are_no_scripts() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("script.rhai"), "import \"other\" as other;\nother::f()").unwrap();
    let other = path("other.rhai");
    let link = |to: &str| std::os::unix::fs::symlink(to, path("other.rhai")).unwrap();
    let refused = |words: &str| {
        ends_in(folder.path(), words, words);
        if path("other.rhai").is_dir() {
            std::fs::remove_dir(path("other.rhai")).unwrap();
        } else {
            std::fs::remove_file(path("other.rhai")).unwrap();
        }
    };
    assert!(Command::new("mkfifo").arg(&other).status().unwrap().success());
    refused("is no regular file");
    link("/dev/zero");
    refused("leads out of the script's folder");
    link("/etc/passwd");
    refused("leads out of the script's folder");
    link("other.rhai");
    refused("cannot be read");
    std::fs::create_dir(&other).unwrap();
    refused("is a directory");
    // 4 GB that take no room.
    std::fs::File::create(&other).unwrap().set_len(4 << 30).unwrap();
    refused("too long for a script");
    std::fs::write(&other, [0xff; 100]).unwrap();
    refused("is not UTF-8 text");
}

#[test]
fn scripts_that_are_no_files() {
    let folder = tempfile::tempdir().unwrap();
    let script = folder.path().join("script.rhai");
    assert!(Command::new("mkfifo").arg(&script).status().unwrap().success());
    ends_in(folder.path(), "is no regular file", "fifo");
    std::fs::remove_file(&script).unwrap();
    std::os::unix::fs::symlink("/dev/zero", &script).unwrap();
    ends_in(folder.path(), "is no regular file", "device");
}

#[test]
fn imports_without_number() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = String::new();
    for i in 0..200 {
        // Each imports the next one.
        let module = format!("import \"m{}\" as next;\nfn f() {{ {i} }}", i + 1);
        std::fs::write(folder.path().join(format!("m{i}.rhai")), module).unwrap();
        writeln!(text, "import \"m{i}\" as m{i};").unwrap();
    }
    std::fs::write(folder.path().join("script.rhai"), text).unwrap();
    ends_in(folder.path(), "", "200 modules");
}
