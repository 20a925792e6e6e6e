//! The README tells the truth: its script runs, its tables are complete.

use crate::support::{expect_code, folder, run, runner, stdout, write};

fn readme() -> String {
    std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/README.md")).unwrap()
}

/// The first block of `language` in the README.
fn block(readme: &str, language: &str) -> String {
    let start = readme.find(&format!("```{language}\n")).expect("there is such a block");
    let text = &readme[start..].split_once('\n').unwrap().1;
    text.split("```").next().unwrap().to_string()
}

#[test]
fn the_script_in_the_readme_runs_and_its_claims_hold() {
    let dir = folder();
    let script = write(dir.path(), "lake.rhai", &block(&readme(), "rhai"));
    let out = dir.path().join("results");
    let output = runner().arg("exec").arg(&script).arg("--out").arg(&out).output().unwrap();
    expect_code(&output, 0);
    // The table is what the README prints, the measured speed aside.
    let printed = block(&readme(), "text");
    let without_speed = |table: &str| -> Vec<String> {
        let rows = table.lines().filter(|l| l.starts_with("plain") || l.starts_with("closer"));
        rows.map(|l| {
            l.split_whitespace().filter(|w| !w.ends_with('M')).collect::<Vec<_>>().join(" ")
        })
        .collect()
    };
    assert_eq!(without_speed(&printed), without_speed(&stdout(&output)));
}

#[test]
fn everything_registered_is_in_the_readme() {
    let readme = readme();
    for key in runner::script::keys::names() {
        assert!(readme.contains(&format!("| `{key}` |")), "key {key}");
    }
    for spec in runner::env::specs() {
        assert!(readme.contains(&format!("`{}`", spec.id)), "environment {}", spec.id);
    }
    for agent in runner::learn::registry::AGENTS {
        let params: Vec<String> =
            agent.params.iter().map(|p| format!("{}: {}", p.name, p.default)).collect();
        let row = format!("| `{}` | `{}`", agent.name, params.join(", "));
        assert!(readme.contains(&row), "agent {row}");
    }
    for function in runner::script::functions::functions() {
        assert!(readme.contains(function.name), "function {}", function.name);
    }
    let help = stdout(&run(&["--help"]));
    let commands = help.lines().skip_while(|l| !l.starts_with("Commands:")).skip(1);
    for command in commands.map_while(|l| l.split_whitespace().next()).filter(|c| *c != "help") {
        assert!(readme.contains(&format!("runner {command}")), "command {command}");
    }
}
