//! `stop_when_solved`: which episodes are played, and what becomes of runs of unequal length.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use runner::experiment::{EpisodeRow, Progress, Store, execute, golden, run_unit, units};
use runner::script::{Host, Plan, Variant};
use serde_json::Value;

use crate::language::plan_of;
use crate::support::{assert_same, contents, expect_code, folder, runner, stderr, stdout, write};

/// Dry land, which two of three seeds solve after some 180 of 600 episodes; the third never finds
/// the goal. The second variant stops.
const SCRIPT: &str = r#"
let all = experiment(#{
    name: "all",
    env: env("FrozenLake-v1", #{ is_slippery: false }),
    agent: q_learning(#{ alpha: 0.5, gamma: 0.95, epsilon: exponential(1.0, 0.99, 0.05) }),
    episodes: 600,
    seeds: [0, 1, 4],
    window: 50,
});
study("stopping", [all, all.with(#{ name: "early", stop_when_solved: true })])
    .baseline("all")
    .expect("two are solved", |r| r.early.solved.seeds == 2 && r.early.episodes == 600)
"#;

fn rows(plan: &Plan, variant: &Variant, seed: u64) -> Vec<EpisodeRow> {
    let host = Host::open(plan).unwrap();
    run_unit(&host, variant, seed, &AtomicBool::new(false), &mut |_| {}).expect("it runs").rows
}

/// The number of episodes after which 35 of the last 50 reached the goal for the first time: a mean
/// of 0.7.
fn solved_after(rows: &[EpisodeRow]) -> Option<usize> {
    let goals =
        |played: usize| rows[played - 50..played].iter().filter(|r| r.native == 1.0).count();
    (50..=rows.len()).find(|&played| goals(played) >= 35)
}

#[test]
fn training_ends_with_the_episode_that_solves_the_task() {
    let plan = plan_of(SCRIPT, &[]);
    let [all, early] = &plan.variants[..] else { panic!("two variants") };
    let mut stopped = 0;
    for &seed in &all.seeds.0 {
        let (whole, part) = (rows(&plan, all, seed), rows(&plan, early, seed));
        let expected = solved_after(&whole).unwrap_or(600);
        assert_eq!((whole.len(), part.len()), (600, expected), "seed {seed}");
        assert_eq!(part, whole[..expected], "up to there nothing is different");
        stopped += usize::from(expected < 600);
    }
    assert_eq!(stopped, 2, "one never finds the goal");
    // Solved with the very last episode, and never with half a window.
    let n = solved_after(&rows(&plan, all, 1)).unwrap();
    let upto = |episodes: usize| Variant { episodes: episodes as u32, ..early.clone() };
    assert_eq!(rows(&plan, &upto(n), 1).len(), n);
    assert_eq!(rows(&plan, &upto(n - 1), 1).len(), n - 1);
    let lucky = Variant { threshold: Some(0.0), ..early.clone() };
    assert_eq!(rows(&plan, &lucky, 1).len(), 50, "a full window, and not an episode more");
}

/// What the stopped learner knows is what it knew then.
#[test]
fn what_is_learned_is_that_of_as_many_episodes() {
    let plan = plan_of(SCRIPT, &[]);
    let [all, early] = &plan.variants[..] else { panic!("two variants") };
    let host = Host::open(&plan).unwrap();
    let run = |v: &Variant| run_unit(&host, v, 4, &AtomicBool::new(false), &mut |_| {}).unwrap();
    let part = run(early);
    let as_many = Variant { episodes: part.rows.len() as u32, ..all.clone() };
    assert_eq!(part, run(&as_many));
}

#[test]
fn a_unit_is_another_only_where_the_key_is_on() {
    let with = |keys: &str| {
        let script = format!(
            "let a = experiment(#{{ env: \"FrozenLake-v1\", agent: q_learning(), seeds: 1 }}); \
             a.with(#{{ {keys} }})"
        );
        units(&plan_of(&script, &[]))[0].hash.clone()
    };
    let plain = with("");
    for same in ["stop_when_solved: false", "stop_when_solved: ()", "window: 7", "threshold: 0.1"] {
        assert_eq!(with(same), plain, "{same}");
    }
    // Threshold and window decide then.
    let on = "stop_when_solved: true";
    let four = [
        plain,
        with(on),
        with(&format!("{on}, window: 7")),
        with(&format!("{on}, threshold: 0.1")),
    ];
    assert!((1..4).all(|i| !four[..i].contains(&four[i])), "{four:?}");
    // Gymnasium's threshold, written out, is the same one.
    assert_eq!(with(&format!("{on}, threshold: 0.7, window: 20")), four[1]);
}

#[test]
fn progress_reaches_the_end_all_the_same() {
    let plan = plan_of(SCRIPT, &[]);
    let dir = folder();
    let store = Store::open(dir.path()).unwrap();
    for ran in [6, 0] {
        let progress = Progress::default();
        let execution = execute(&plan, &store, 2, &progress).unwrap();
        assert_eq!(execution.finished.len(), ran);
        assert_eq!(progress.episodes.load(Ordering::Relaxed), 2 * 3 * 600);
    }
}

fn exec(script: &Path, out: &Path, more: &[&str]) -> std::process::Output {
    let output =
        runner().arg("exec").arg(script).arg("--out").arg(out).args(more).output().unwrap();
    expect_code(&output, 0);
    output
}

fn json(bytes: &[u8]) -> Value {
    serde_json::from_slice(bytes).unwrap()
}

/// Mean area under the learning curve, from `episodes.csv`: what a seed did not play counts as its
/// last 50 episodes did.
fn area(episodes: &[(String, u64, f64)], variant: &str) -> f64 {
    let of_seed = |seed: u64| {
        let own = episodes.iter().filter(|(v, s, _)| v == variant && *s == seed);
        let returns: Vec<f64> = own.map(|(_, _, r)| *r).collect();
        let last = returns[returns.len() - 50..].iter().sum::<f64>() / 50.0;
        (returns.iter().sum::<f64>() + (600 - returns.len()) as f64 * last) / 600.0
    };
    [0, 1, 4].map(of_seed).iter().sum::<f64>() / 3.0
}

#[test]
fn results_of_unequal_length_are_summarised_side_by_side() {
    let dir = folder();
    let script = write(dir.path(), "stopping.rhai", SCRIPT);
    let out = dir.path().join("results");
    let output = exec(&script, &out, &[]);
    let files = contents(&out);
    let summary = json(&files["summary.json"]);
    let [all, early] = &summary["variants"].as_array().unwrap()[..] else { panic!("two variants") };
    assert_eq!(early["solved"], all["solved"], "each is solved where the other is");
    let first: Vec<Option<u64>> =
        serde_json::from_value(early["solved"]["first_episode"].clone()).unwrap();
    let [None, Some(one), Some(four)] = first[..] else { panic!("{first:?}") };

    // Only what was played is listed.
    let mut reader = csv::Reader::from_reader(&files["episodes.csv"][..]);
    let episodes: Vec<(String, u64, f64)> = reader
        .records()
        .map(Result::unwrap)
        .map(|l| (l[0].to_string(), l[1].parse().unwrap(), l[4].parse().unwrap()))
        .collect();
    let played = |v: &str, seed: u64| {
        episodes.iter().filter(|(w, s, _)| w == v && *s == seed).count() as u64
    };
    assert_eq!([0, 1, 4].map(|seed| played("all", seed)), [600; 3]);
    assert_eq!([0, 1, 4].map(|seed| played("early", seed)), [600, one, four]);
    let mut lengths: Vec<u64> = files
        .iter()
        .filter(|(name, _)| name.ends_with("result.json"))
        .map(|(_, bytes)| json(bytes)["episodes"].as_u64().unwrap())
        .collect();
    lengths.sort_unstable();
    assert_eq!(lengths, [four, one, 600, 600, 600, 600]);
    let mut monitors: Vec<u64> = files
        .iter()
        .filter(|(name, _)| name.ends_with("monitor.csv"))
        .map(|(_, bytes)| String::from_utf8_lossy(bytes).lines().count() as u64 - 2)
        .collect();
    monitors.sort_unstable();
    assert_eq!(monitors, lengths);

    // Statistics over the same 600 episodes.
    assert_eq!((&all["episodes"], &early["episodes"]), (&Value::from(600), &Value::from(600)));
    for (name, variant) in [("all", all), ("early", early)] {
        let auc = variant["auc"]["mean"].as_f64().unwrap();
        assert!((auc - area(&episodes, name)).abs() < 1e-12, "{name}: {auc}");
    }
    let finals: Vec<f64> = serde_json::from_value(early["final_returns"].clone()).unwrap();
    assert!(finals[0] == 0.0 && finals[1] == 0.7 && finals[2] == 0.7, "{finals:?}");
    let warnings = |v: &Value| v["warnings"].to_string();
    assert!(warnings(early).contains("2 of 3 seeds stopped before episode 600"));
    assert!(!warnings(all).contains("stopped"));

    // The curve goes on to the end of the seed that was not solved.
    let svg = String::from_utf8(files["curves.svg"].clone()).unwrap();
    assert!(svg.contains(", stopped seeds carried forward</text>"));
    assert!(svg.contains(" after 600 episodes, 2 of 3 seeds stopped before and carried forward."));
    assert_eq!(svg.matches("before and carried forward.").count(), 1, "of one variant only");

    let table = stdout(&output);
    let joined = table.split_whitespace().collect::<Vec<_>>().join(" ");
    let cell = format!("{:.0} (2/3)", f64::midpoint(one as f64, four as f64));
    assert_eq!(joined.matches(&cell).count(), 2, "{cell}: {table}");
    assert!(joined.contains("stopped when solved: early (2 of 3 seeds);"), "{table}");
    assert!(joined.contains("paired over 3 seeds, after unequal numbers of episodes"), "{table}");
    assert!(joined.contains("ok two are solved"), "{table}");
    // The same table is read back.
    let shown = runner().arg("show").arg(&out).output().unwrap();
    expect_code(&shown, 0);
    assert!(stdout(&shown).starts_with(&table), "{}", stdout(&shown));
    // What a stopped seed has learned reaches the goal.
    let mut play = runner();
    let played = play.arg("play").arg(&out).args(["--variant", "early", "--seed", "4"]);
    let played = played.output().unwrap();
    expect_code(&played, 0);
    assert!(stderr(&played).contains("6 steps, return 1, terminated"), "{}", stderr(&played));
}

#[test]
fn the_bytes_depend_neither_on_threads_nor_on_an_interruption() {
    let dir = folder();
    let script = write(dir.path(), "stopping.rhai", SCRIPT);
    let (one, four) = (dir.path().join("one"), dir.path().join("four"));
    exec(&script, &one, &["--jobs", "1"]);
    exec(&script, &four, &["--jobs", "4"]);
    assert_same(&one, &four);
    // Without half of its units, as if it had been stopped, it goes on with the others.
    let before = contents(&one);
    let mut removed = 0;
    for shelf in std::fs::read_dir(one.join("units")).unwrap().step_by(2) {
        std::fs::remove_dir_all(shelf.unwrap().path()).unwrap();
        removed += 1;
    }
    assert!(removed >= 2);
    exec(&script, &one, &[]);
    assert_eq!(contents(&one), before);
}

/// Where all seeds have stopped the curve ends: nobody plays any more.
#[test]
fn a_curve_ends_with_its_last_seed() {
    let dir = folder();
    let script = SCRIPT.replace("seeds: [0, 1, 4]", "seeds: [1, 4]").replace(".expect(", "/*");
    let script = write(dir.path(), "stopping.rhai", &(script + "*/"));
    let out = dir.path().join("results");
    exec(&script, &out, &[]);
    let files = contents(&out);
    let summary = json(&files["summary.json"]);
    let last = summary["variants"][1]["solved"]["first_episode"][0].as_u64().unwrap();
    let svg = String::from_utf8(files["curves.svg"].clone()).unwrap();
    let end = format!("early: 0.7 after {last} episodes, 1 of 2 seeds stopped before");
    assert!(svg.contains(&end), "{end}: {}", &svg[..800]);
}

#[test]
fn pictures_have_the_potential_of_the_episode_in_which_a_seed_stopped() {
    let dir = folder();
    let key = "stop_when_solved: true, potential: |s, episode| 0.0001 * episode";
    let script = SCRIPT.replace("stop_when_solved: true", key).replace(".expect(", "/*");
    let script = write(dir.path(), "stopping.rhai", &(script + "*/"));
    let out = dir.path().join("results");
    exec(&script, &out, &[]);
    let lengths: Vec<u64> = {
        let summary = json(&contents(&out)["summary.json"]);
        let first = summary["variants"][1]["solved"]["first_episode"].as_array().unwrap().clone();
        first.iter().map(|n| n.as_u64().unwrap_or(600)).collect()
    };
    assert!(lengths.iter().any(|n| *n < 600), "{lengths:?}");
    let potential = |seed: &str| {
        let mut show = runner();
        let show = show.arg("show").arg(&out).args(["--variant", "early", "--json", "--potential"]);
        let output = show.args(["--seed", seed]).output().unwrap();
        expect_code(&output, 0);
        let picture = json(&output.stdout)["pictures"][0].clone();
        (picture["rows"][0][0].as_f64().unwrap(), picture["seeds"].as_str().unwrap().to_string())
    };
    for (seed, &n) in ["0", "1", "4"].iter().zip(&lengths) {
        assert!((potential(seed).0 - 1e-4 * n as f64).abs() < 1e-12, "seed {seed}");
    }
    let (mean, whose) = potential("all");
    let expected = 1e-4 * lengths.iter().sum::<u64>() as f64 / 3.0;
    assert!((mean - expected).abs() < 1e-12, "{mean}, not {expected}");
    assert_eq!(whose, "mean over 3 seeds, of each when it stopped");
}

#[test]
fn golden_files_say_where_each_seed_stopped() {
    let script =
        SCRIPT.replace("study(", "let s = study(") + ".golden(#{ episodes: 600, seeds: 2 }); s";
    let text = golden::text(&plan_of(&script, &[])).unwrap();
    let (all, early) = text.split_once("variant early").unwrap();
    assert!(!all.contains("stops at"), "{text}");
    assert!(early.contains("\n  stops at a mean return of 0.7 over 50 episodes\n"), "{text}");
    let ends: Vec<&str> = early
        .lines()
        .filter(|l| l.starts_with("    return"))
        .map(|l| l.rsplit(", ").next().unwrap())
        .collect();
    assert!(ends[0] == "0.0000 after 600" && ends[1].starts_with("0.7000 after 18"), "{ends:?}");
}
