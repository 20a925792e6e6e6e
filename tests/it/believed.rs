//! What networks believe of the first state of an episode, beside what the episode brings.

use std::path::Path;

use serde_json::Value;

use crate::support::{expect_code, folder, run, runner, stderr, stdout, stored, write};

/// Two networks and a table. Untrained, the first believes what its random weights say.
const SCRIPT: &str = r#"
let dqn = experiment(#{
    name: "dqn", env: "CartPole-v1", episodes: 30, seeds: [2, 5], window: 10,
    agent: dqn(#{ net_arch: [8], batch_size: 16, gamma: 0.9, learning_starts: 100000 }),
});
study("believed", [
    dqn,
    dqn.with(#{ name: "table", agent: q_learning(), discretiser: bins(#{ theta: [-0.2, 0.2, 8] }) }),
    dqn.with(#{ name: "double", agent: double_dqn(#{ net_arch: [8], batch_size: 16 }) }),
])
.expect("at first they believe nothing", |r| r.dqn.overestimation.mean < 0.0)
"#;

/// The rows of `episodes.csv` of a variant: seed, `start_value`, `start_return`, steps.
fn episodes(results: &Path, variant: &str) -> Vec<[String; 4]> {
    let text = std::fs::read_to_string(results.join("episodes.csv")).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().unwrap();
    assert_eq!(header[header.len() - 3..], ["ending", "start_value", "start_return"]);
    let at = |name: &str| header.iter().position(|n| *n == name).unwrap();
    let columns = ["seed", "start_value", "start_return", "steps"].map(at);
    let own = lines.filter(|line| line[0] == variant);
    own.map(|line| columns.map(|i| line[i].to_string())).collect()
}

#[test]
fn overestimation_is_what_is_believed_beyond_what_is_brought() {
    let dir = folder();
    let results = stored(dir.path(), SCRIPT);
    let summary: Value =
        serde_json::from_slice(&std::fs::read(results.join("summary.json")).unwrap()).unwrap();
    let number = |text: &str| text.parse::<f64>().unwrap();
    let rows = episodes(&results, "dqn");
    assert_eq!(rows.len(), 60);
    let mut expected = 0.0;
    for seed in ["2", "5"] {
        let own: Vec<&[String; 4]> = rows.iter().filter(|row| row[0] == seed).collect();
        for [_, _, brought, steps] in &own[20..] {
            // A reward of 1 a step, discounted by 0.9.
            let (brought, steps) = (number(brought), number(steps));
            let sum = (0..steps as u32).fold(0.0, |sum, _| 1.0 + 0.9 * sum);
            assert!((brought - sum).abs() < 1e-12, "{brought} for {steps} steps");
        }
        let last = own[20..].iter().map(|row| number(&row[1]) - number(&row[2]));
        expected += last.sum::<f64>() / 10.0 / 2.0;
    }
    let mean = summary["variants"][0]["overestimation"]["mean"].as_f64().unwrap();
    assert!((mean - expected).abs() < 1e-12, "{mean} is not {expected}");
    // A random network believes nearly nothing, and whole episodes are worth 10 at most.
    assert!((-10.0..-3.0).contains(&mean), "{mean}");

    // The table's rows are empty there, and so is its summary.
    assert!(episodes(&results, "table").iter().all(|row| row[1].is_empty() && row[2].is_empty()));
    assert_eq!(summary["variants"][1].get("overestimation"), None);
    let csv = std::fs::read_to_string(results.join("summary.csv")).unwrap();
    let lines: Vec<&str> = csv.lines().collect();
    assert!(lines[0].ends_with(
        ",audit,overestimation_mean,overestimation_iqm,overestimation_low,overestimation_high"
    ));
    assert!(lines[1].contains(&format!(",{mean:?},")) && lines[2].ends_with(",,,,"), "{csv}");

    let shown = stdout(&run(&["show", results.to_str().unwrap()]));
    assert!(shown.contains("  overest.  "), "{shown}");
    assert!(shown.contains("overest.: what the network believed"), "{shown}");
}

#[test]
fn values_are_drawn_where_networks_learn_and_nowhere_else() {
    let dir = folder();
    let results = stored(dir.path(), SCRIPT);
    let svg = std::fs::read_to_string(results.join("values.svg")).unwrap();
    assert!(svg.contains(">discounted return from the start<"));
    for name in ["dqn: believed", "dqn: brought", "double: believed", "double: brought"] {
        assert!(svg.contains(&format!(">{name}</text>")), "{name}");
    }
    assert!(!svg.contains("table") && !svg.contains("mean over seeds"));
    // Each variant in the colour that it has in curves.svg, solid what it believed, dashed what
    // was brought: a line and its sample in the legend.
    for colour in ["#0072B2", "#009E73"] {
        let line = format!("stroke=\"{colour}\" stroke-width=\"2.2\"");
        let dashed = format!("{line} stroke-dasharray=\"7 4\"/>");
        assert_eq!(svg.matches(&format!("{line}/>")).count(), 2, "{colour}");
        assert_eq!(svg.matches(&dashed).count(), 2, "{colour}");
    }

    // A study of the same name without networks leaves none of it.
    let (before, after) = SCRIPT.split_once("study(").unwrap();
    let script = after.replace("    dqn,\n", "").replace("    dqn.with(#{ name: \"double\"", "//");
    let script = script.split(".expect").next().unwrap();
    let script = write(dir.path(), "study.rhai", &format!("{before}study({script}"));
    let output = runner().arg("exec").arg(&script).arg("--out").arg(&results).output().unwrap();
    expect_code(&output, 0);
    assert!(!stdout(&output).contains("overest"), "{}", stdout(&output));
    assert!(!results.join("values.svg").exists());
    for file in ["episodes.csv", "summary.csv", "summary.json"] {
        let text = std::fs::read_to_string(results.join(file)).unwrap();
        assert!(!text.contains("start_value") && !text.contains("overestimation"), "{file}");
    }
}

#[test]
fn no_term_takes_a_column_of_starts() {
    let dir = folder();
    let text = r#"experiment(#{ env: "CartPole-v1", agent: dqn(), episodes: 5,
        terms: #{ start_value: |t| 0.0 } })"#;
    let script = write(dir.path(), "taken.rhai", text);
    let output = runner().arg("check").arg(&script).output().unwrap();
    expect_code(&output, 2);
    assert!(stderr(&output).contains("a term cannot be called `start_value`"));
}
