//! `runner show`: the numbers it shows are those of the tables, and it touches nothing.

use std::path::Path;

use runner::env::make;
use runner::learn::greedy_set;
use runner::learn::planning::{Planner, PolicyIteration};
use serde_json::Value;

use crate::support::{
    LAKE, SMALL, expect_code, folder, runner, stderr, stdout, stored, untouched, write,
};

fn show(results: &Path, more: &[&str]) -> std::process::Output {
    runner().arg("show").arg(results).args(more).output().unwrap()
}

fn json(results: &Path, more: &[&str]) -> Value {
    let output = show(results, &[&["--json"], more].concat());
    expect_code(&output, 0);
    serde_json::from_str(&stdout(&output)).unwrap()
}

/// The pictures' numbers in reading order, `null` as NaN.
fn numbers(picture: &Value) -> Vec<f64> {
    let rows = picture["rows"].as_array().unwrap().iter();
    let row = |row: &Value| -> Vec<f64> {
        row.as_array().unwrap().iter().map(|x| x.as_f64().unwrap_or(f64::NAN)).collect()
    };
    rows.flat_map(row).collect()
}

#[test]
fn the_values_of_a_solved_lake_are_the_exact_ones_shaped_or_not() {
    let dir = folder();
    let results = stored(dir.path(), LAKE);
    let exact = |slippery: bool| {
        let kwargs = serde_json::json!({ "is_slippery": slippery });
        let mdp = make("FrozenLake-v1", kwargs.as_object().unwrap()).unwrap();
        let mdp = mdp.finite().unwrap().clone();
        let q = PolicyIteration { gamma: 0.99 }.solve(&mdp, &[0.0; 16]).unwrap().q;
        (mdp.reachable(), q)
    };
    for (variant, slippery) in [("dry", false), ("ice", true), ("ice-shaped", true)] {
        let all = json(&results, &["--variant", variant, "--value"]);
        let picture = &all["pictures"][0];
        let (reachable, q) = exact(slippery);
        let values = numbers(picture);
        assert_eq!(values.len(), 16);
        for (s, value) in values.iter().enumerate() {
            assert_eq!(value.is_nan(), !reachable[s], "{variant}, state {s}");
            if reachable[s] {
                assert!((value - q.max(s)).abs() < 1e-9, "{variant}, state {s}: {value}");
                let arrows: String = greedy_set(q.row(s), 1.0)
                    .into_iter()
                    .map(|a| ['←', '↓', '→', '↑'][a])
                    .collect();
                assert_eq!(picture["arrows"][s / 4][s % 4], arrows.as_str(), "{variant}, {s}");
            }
        }
        // The known value of the slippery lake's start at γ = 0.99, and five steps of γ to the
        // last one that pays on dry land.
        let start = if slippery { 0.542_025_9 } else { 0.99 * 0.99 * 0.99 * 0.99 * 0.99 };
        assert!((values[0] - start).abs() < 1e-6, "{variant}: {}", values[0]);
    }
}

#[test]
fn a_map_in_characters() {
    let dir = folder();
    let results = stored(dir.path(), LAKE);
    let output = show(&results, &["--variant", "dry"]);
    expect_code(&output, 0);
    let text = stdout(&output);
    assert!(text.contains("variant     final mean"), "{text}");
    assert!(text.contains("ok     dry land is easy\n"), "{text}");
    let map = text.split_once("\n\n").unwrap().1;
    insta::assert_snapshot!(map, @r"
    dry, seed 0: V = max Q
      S↓→   F→    F↓    F←
      0.951 0.961 0.970 0.961
      F↓    H     F↓    H
      0.961       0.980
      F→    F↓→   F↓    H
      0.970 0.980 0.990
      H     F→    F→    G
            0.990 1.000
      values: 0.951 to 1.000
    ");
}

#[test]
fn what_was_learned_in_bins() {
    let dir = folder();
    let results = stored(dir.path(), SMALL);
    let all = json(&results, &["--variant", "height", "--seed", "1"]);
    let pictures = all["pictures"].as_array().unwrap();
    let kinds: Vec<&str> = pictures.iter().map(|p| p["quantity"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["value", "policy", "potential"]);
    let [value, policy, potential] = [0, 1, 2].map(|i| numbers(&pictures[i]));
    assert_eq!(pictures[0]["x"]["field"], "position");
    assert_eq!(pictures[0]["y"]["n"], 20);

    // What the unit's own file says.
    let file = policy_file(&results, "height", 1);
    let mut reader = csv::Reader::from_path(file).unwrap();
    let mut known = 0;
    for line in reader.records().map(Result::unwrap) {
        let number = |i: usize| line[i].parse::<f64>().unwrap();
        // Cells are numbered position first; pictures are rows of velocity.
        let cell = number(0) as usize;
        let place = cell % 20 * 20 + cell / 20;
        let best = number(2).max(number(3)).max(number(4));
        // Φ at the centre of the bin.
        let position = -1.2 + 1.8 * ((cell / 20) as f64 + 0.5) / 20.0;
        let phi = runner::mdp::math::sin(3.0 * position);
        assert!((potential[place] - phi).abs() < 1e-12, "cell {cell}");
        assert!((value[place] - (best + phi)).abs() < 1e-12, "cell {cell}");
        assert_eq!(policy[place], number(1), "cell {cell}");
        known += 1;
    }
    assert!(known > 50);
    assert_eq!(value.iter().filter(|v| !v.is_nan()).count(), known);
    assert_eq!(policy.iter().filter(|v| !v.is_nan()).count(), known);
    assert_eq!(potential.iter().filter(|v| v.is_nan()).count(), 0);
}

/// The `policy.csv` of a variant's seed, found by the manifest.
fn policy_file(results: &Path, variant: &str, seed: usize) -> std::path::PathBuf {
    let manifest = std::fs::read(results.join("study.json")).unwrap();
    let manifest: Value = serde_json::from_slice(&manifest).unwrap();
    let variants = manifest["identity"]["variants"].as_array().unwrap();
    let own = variants.iter().find(|v| v["name"] == variant).unwrap();
    let hash = own["units"][seed].as_str().unwrap();
    results.join("units").join(&hash[..2]).join(hash).join("policy.csv")
}

#[test]
fn all_seeds_are_averaged_where_they_know_something() {
    let dir = folder();
    let results = stored(dir.path(), SMALL);
    let value = |seed: &str| {
        let all = json(&results, &["--variant", "plain", "--value", "--seed", seed]);
        numbers(&all["pictures"][0])
    };
    let singles: Vec<Vec<f64>> = ["0", "1", "2", "3"].map(value).to_vec();
    let mean = value("all");
    let mut mixed = 0;
    for place in 0..400 {
        let known: Vec<f64> = singles.iter().map(|s| s[place]).filter(|v| !v.is_nan()).collect();
        let expected = known.iter().sum::<f64>() / known.len() as f64;
        assert!(
            (mean[place] - expected).abs() < 1e-12 || (known.is_empty() && mean[place].is_nan()),
            "place {place}: {} for {known:?}",
            mean[place]
        );
        mixed += usize::from(!known.is_empty() && known.len() < 4);
    }
    assert!(mixed > 0, "some cells are known to some seeds only");
}

#[test]
fn slices_through_more_than_two_fields() {
    let dir = folder();
    let script = r#"
        study("cart", [experiment(#{
            name: "cart", env: "CartPole-v1", agent: q_learning(#{ epsilon: 0.5 }),
            discretiser: bins(#{ x: [-2.4, 2.4, 3], theta: [-0.2, 0.2, 8], theta_dot: [-2.0, 2.0, 6] }),
            episodes: 50, seeds: 1,
        })])
    "#;
    let results = stored(dir.path(), script);
    let all = json(&results, &["--value"]);
    let picture = &all["pictures"][0];
    // The two with the most bins, the one with fewer across.
    assert_eq!(
        (&picture["x"]["field"], &picture["y"]["field"]),
        (&"theta_dot".into(), &"theta".into())
    );
    assert_eq!(picture["at"], serde_json::json!({ "x": 0.0 }));
    let chosen = json(&results, &["--value", "--fields", "x,theta", "--at", "theta_dot=-0.1"]);
    let picture = &chosen["pictures"][0];
    assert_eq!(picture["at"], serde_json::json!({ "theta_dot": -0.1 }));
    assert_eq!(picture["rows"].as_array().unwrap().len(), 8);
    assert_eq!(picture["rows"][0].as_array().unwrap().len(), 3);
    for (more, message) in [
        (["--fields", "theta"], "--fields: two names of fields, not `theta`"),
        (["--fields", "theta,tetha_dot"], "did you mean `theta_dot`?"),
        (["--fields", "theta,theta"], "the two axes are different fields"),
        (["--fields", "x_dot,theta"], "`x_dot` cannot be an axis"),
        (["--at", "theta"], "--at: a field and a number, not `theta`"),
        (["--at", "theta=0"], "--at theta: is an axis of the picture"),
        (["--seed", "x"], "--seed: `x` is neither a training seed nor `all`"),
    ] {
        let output = show(&results, &more);
        expect_code(&output, 2);
        assert!(stderr(&output).contains(message), "{more:?}: {}", stderr(&output));
    }
}

/// The optimal policy as Sutton & Barto print it (figure 5.2), and the fields of finite states.
#[test]
fn blackjack_with_and_without_an_ace_and_a_taxis_errand() {
    let dir = folder();
    let script = r#"
        let cards = experiment(#{
            name: "cards", env: env("Blackjack-v1", #{ sab: true }),
            agent: value_iteration(#{ gamma: 1.0 }), episodes: 1, seeds: 1,
        });
        let taxi = experiment(#{
            name: "taxi", env: "Taxi-v4", agent: value_iteration(#{ gamma: 0.99 }),
            episodes: 1, seeds: 1,
        });
        study("finite", [cards, taxi])
    "#;
    let results = stored(dir.path(), script);
    let all = json(&results, &["--variant", "cards", "--policy"]);
    let pictures = all["pictures"].as_array().unwrap();
    assert_eq!(pictures.len(), 2);
    for (picture, ace, sticks_from) in [
        // By the dealer's card from the ace to the ten: the least sum to stick on.
        (&pictures[0], 0.0, [17, 13, 13, 12, 12, 12, 17, 17, 17, 17]),
        (&pictures[1], 1.0, [19, 18, 18, 18, 18, 18, 18, 18, 19, 19]),
    ] {
        assert_eq!(picture["at"]["ace"], ace);
        assert_eq!((&picture["x"]["field"], &picture["x"]["low"]), (&"dealer".into(), &1.0.into()));
        assert_eq!(picture["y"]["field"], "player");
        let first = picture["y"]["low"].as_f64().unwrap() as usize;
        for (row, places) in picture["rows"].as_array().unwrap().iter().enumerate() {
            for (dealer, place) in places.as_array().unwrap().iter().enumerate() {
                let player = row + first;
                let Some(action) = place.as_f64() else { continue };
                let hits = player < sticks_from[dealer];
                assert_eq!(action == 1.0, hits, "ace {ace}, {player} against {}", dealer + 1);
            }
        }
    }
    let taxi =
        json(&results, &["--variant", "taxi", "--policy", "--at", "passenger=0,destination=1"]);
    let picture = &taxi["pictures"][0];
    // The passenger waits in the upper left corner: pick up there, else drive.
    assert_eq!(picture["rows"][0][0], 4.0);
    assert_eq!(picture["rows"][4][0], 1.0);
    assert_eq!(picture["at"], serde_json::json!({ "passenger": 0.0, "destination": 1.0 }));
    let output = show(&results, &["--variant", "taxi", "--at", "passenger=7"]);
    expect_code(&output, 2);
    assert!(stderr(&output).contains("takes the values 0, 1, 2, 3, 4"), "{}", stderr(&output));
}

#[test]
fn colours_come_and_go() {
    let dir = folder();
    let results = stored(dir.path(), LAKE);
    let coloured = |set: &[(&str, &str)]| {
        let mut command = runner();
        command.env_remove("NO_COLOR").arg("show").arg(&results).args(["--variant", "dry"]);
        for (key, value) in set {
            command.env(key, value);
        }
        stdout(&command.output().unwrap()).contains('\u{1b}')
    };
    assert!(!coloured(&[]), "stdout is no terminal");
    assert!(coloured(&[("CLICOLOR_FORCE", "1")]));
    assert!(!coloured(&[("NO_COLOR", "1")]));
}

#[test]
fn pictures_are_written_as_svg() {
    let dir = folder();
    let results = stored(dir.path(), SMALL);
    let svg = dir.path().join("a/b");
    let output = show(&results, &["--svg", svg.to_str().unwrap()]);
    expect_code(&output, 0);
    let mut names: Vec<String> = std::fs::read_dir(&svg)
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    let expected =
        ["height-policy", "height-potential", "height-value", "plain-policy", "plain-value"];
    assert_eq!(names, expected.map(|n| format!("{n}.svg")));
    for name in names {
        let text = std::fs::read_to_string(svg.join(&name)).unwrap();
        assert!(text.starts_with("<svg ") && text.ends_with("</svg>\n"), "{name}");
        assert!(text.contains(">position</text>") && text.contains(">velocity</text>"), "{name}");
        assert!(text.len() < 64 * 1024, "{name} has {} bytes", text.len());
        assert!(!text.contains("NaN"), "{name}");
    }
}

#[test]
fn what_is_missing_is_said_and_nothing_is_touched() {
    let dir = folder();
    let results = stored(dir.path(), SMALL);
    let unit = policy_file(&results, "height", 2);
    std::fs::remove_dir_all(unit.parent().unwrap()).unwrap();
    let before = untouched(&results);
    let output = show(&results, &[]);
    expect_code(&output, 0);
    let said = stderr(&output);
    assert!(
        said.contains("incomplete: 7 of 8 units are there; missing: height (seeds 2)"),
        "{said}"
    );
    assert!(said.contains("to go on: runner exec study.rhai --out "), "{said}");
    let output = show(&results, &["--variant", "height", "--seed", "2"]);
    expect_code(&output, 2);
    assert!(stderr(&output).contains("seed 2 of variant `height` has not been run to its end yet"));
    assert_eq!(untouched(&results), before);
}

#[test]
fn the_table_is_the_one_that_exec_printed() {
    let dir = folder();
    let script = write(dir.path(), "study.rhai", SMALL);
    let results = dir.path().join("results");
    let exec = |more: &[&str]| {
        let mut command = runner();
        command.arg("exec").arg(&script).arg("--out").arg(&results).args(more);
        let output = command.output().unwrap();
        expect_code(&output, 0);
        stdout(&output)
    };
    assert!(stdout(&show(&results, &["--value"])).is_empty());
    let table = exec(&[]);
    assert!(stdout(&show(&results, &[])).starts_with(&table));
    // Restricted on the command line, which the script does not know.
    let table = exec(&["--seeds", "2", "--episodes", "30"]);
    assert!(stdout(&show(&results, &[])).starts_with(&table));
}
