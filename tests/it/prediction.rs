//! Prediction and exploring starts as a script's user meets them.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use serde_json::Value;

use crate::support::{code, expect_code, folder, run, runner, stderr, stdout, stored, write};
use runner::env::frozen_lake::FrozenLake;
use runner::env::{AnyEnv, make};
use runner::experiment::{Limits, World, train};
use runner::learn::{Agent, Last, Learn, QTable};
use runner::mdp::numpy::NumpyRng;
use runner::mdp::{Action, Env};
use runner::shaping::{NativeReward, NoPotential, StateIndex};

const WALK: &str = r#"
fn closer(s) { 1.0 - 0.05 * (abs(s.row - s.goal_row) + abs(s.col - s.goal_col)) }
fn down_then_right(s) { if s.row < 3 && s.tile != "H" && s.index != 8 { 1 } else { 2 } }
let td = experiment(#{
    name: "td",
    env: env("FrozenLake-v1", #{ is_slippery: true }),
    agent: td0(#{ gamma: 0.9, alpha: visit_count(0.6) }),
    episodes: 10000,
    seeds: 4,
});
study("walk", [
    td,
    td.with(#{ name: "shaped", potential: closer }),
    td.with(#{ name: "mc", agent: mc_prediction(#{ gamma: 0.9 }) }),
    td.with(#{ name: "every", agent: mc_prediction(#{ gamma: 0.9, visits: "every" }) }),
    td.with(#{ name: "lambda", agent: td_lambda(#{ gamma: 0.9, alpha: visit_count(0.6) }) }),
    td.with(#{ name: "n", agent: n_step_td(#{ gamma: 0.9, alpha: visit_count(0.6) }) }),
    td.with(#{ name: "greedy", agent: #{ policy: "greedy" } }),
    td.with(#{ name: "scripted", agent: #{ policy: down_then_right, initial_v: |s| 0.1 } }),
    td.with(#{ name: "shielded", agent: mc_prediction(#{ gamma: 0.9 }), allowed: |s, a| a != 3 || s.row == 3 }),
    td.with(#{ name: "planned", agent: value_iteration(#{ gamma: 0.9 }), episodes: 5 }),
])
    .expect("td learns", |r| r.td.value_error.mean < 0.02)
    .expect("whatever the potential", |r| r.shaped.value_error.mean < 0.05)
    .expect("and so does mc", |r| r.mc.value_error.mean < 0.02 && r.every.value_error.mean < 0.02)
    .expect("and td(λ)", |r| r.lambda.value_error.mean < 0.02)
    .expect("and n-step td", |r| r.n.value_error.mean < 0.02)
    .expect("of other policies too", |r| r.greedy.value_error.mean < 0.02)
    .expect("and of scripted ones", |r| r.scripted.value_error.mean < 0.02)
    .expect("behind a shield", |r| r.shielded.value_error.mean < 0.02)
    .expect("the largest error is larger", |r| r.td.value_error_max.mean > r.td.value_error.mean)
    .expect("it fell", |r| r.td.value_error_auc.mean > r.td.value_error.mean)
"#;

/// The rows of a CSV file by the names of its columns.
fn rows(path: &Path) -> Vec<BTreeMap<String, String>> {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines().filter(|l| !l.starts_with('#'));
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    lines
        .map(|l| {
            names.iter().map(ToString::to_string).zip(l.split(',').map(String::from)).collect()
        })
        .collect()
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

/// The folder of the first unit of a variant.
fn unit(results: &Path, variant: &str) -> std::path::PathBuf {
    let manifest = json(&results.join("study.json"));
    let variants = manifest["identity"]["variants"].as_array().unwrap();
    let own = variants.iter().find(|v| v["name"] == variant).unwrap();
    let hash = own["units"][0].as_str().unwrap();
    results.join("units").join(&hash[..2]).join(hash)
}

/// State, value, exact value.
fn values(results: &Path, variant: &str) -> Vec<(f64, Option<f64>)> {
    let of = |row: BTreeMap<String, String>| (row["v"].parse().unwrap(), row["exact"].parse().ok());
    rows(&unit(results, variant).join("values.csv")).into_iter().map(of).collect()
}

#[test]
fn predictors_learn_the_exact_values() {
    let dir = folder();
    // The claims of the study hold, or this fails.
    let results = stored(dir.path(), WALK);

    // The last error of a seed is that of its values.
    let td = values(&results, "td");
    let squares: Vec<f64> =
        td.iter().filter_map(|(v, exact)| Some((v - (*exact)?) * (v - (*exact)?))).collect();
    assert_eq!((td.len(), squares.len()), (16, 11), "holes and the goal are not reached");
    let expected = (squares.iter().sum::<f64>() / 11.0).sqrt();
    let monitor = rows(&unit(&results, "td").join("monitor.csv"));
    let last: f64 = monitor.last().unwrap()["value_error"].parse().unwrap();
    assert!((last - expected).abs() < 1e-15, "{last} is not {expected}");
    let episodes = rows(&results.join("episodes.csv"));
    let of =
        |variant: &str| episodes.iter().filter(|r| r["variant"] == variant).collect::<Vec<_>>();
    assert_eq!(of("td")[9999]["value_error"].parse::<f64>().unwrap(), last);
    assert!(of("planned").iter().all(|row| row["value_error"].is_empty()));

    // Shaped values are the plain ones minus the potential.
    let phi = |s: usize| 1.0 - 0.05 * ((3 - s / 4) + (3 - s % 4)) as f64;
    for (s, (plain, shaped)) in td.iter().zip(values(&results, "shaped")).enumerate() {
        if let (Some(plain), Some(shaped)) = (plain.1, shaped.1) {
            assert!((shaped + phi(s) - plain).abs() < 1e-12, "state {s}");
        }
    }
    // The greedy policy's are the optimal ones.
    let policy = rows(&unit(&results, "planned").join("policy.csv"));
    for (row, (_, exact)) in policy.iter().zip(values(&results, "greedy")) {
        let q = (0..4).map(|a| row[&format!("q_{a}")].parse::<f64>().unwrap());
        let best = q.fold(f64::NEG_INFINITY, f64::max);
        assert!(exact.is_none_or(|exact| (exact - best).abs() < 1e-9), "state {}", row["state"]);
    }

    // The table, the plot (not all variants predict) and the pictures.
    let shown = stdout(&run(&["show", results.to_str().unwrap(), "--variant", "td", "--value"]));
    assert!(shown.contains("value error [95 %]"), "{shown}");
    assert!(shown.contains("td, seed 0: V of the given policy\n"), "{shown}");
    let svg = std::fs::read_to_string(results.join("curves.svg")).unwrap();
    assert!(svg.contains(">native return<"));
    let output = run(&["play", results.to_str().unwrap(), "--variant", "td"]);
    expect_code(&output, 2);
    assert!(stderr(&output).contains("`td` has no policy of its own"), "{}", stderr(&output));
}

#[test]
fn studies_of_predictors_plot_errors_and_others_know_nothing_of_them() {
    let dir = folder();
    let script = r#"
        let mc = experiment(#{ name: "mc", env: "FrozenLake-v1", agent: mc_prediction(), seeds: 2,
            episodes: 10 });
        study("two", [mc, mc.with(#{ name: "td", agent: td0() })])
    "#;
    let results = stored(dir.path(), script);
    let svg = std::fs::read_to_string(results.join("curves.svg")).unwrap();
    assert!(svg.contains(">value error (RMS)<") && svg.contains("Value error (RMS) over episodes"));
    let summary = json(&results.join("summary.json"));
    assert!(summary["variants"][0]["value_error"]["mean"].is_f64());
    let header = std::fs::read_to_string(results.join("summary.csv")).unwrap();
    assert!(header.lines().next().unwrap().ends_with(",value_error_low,value_error_high"));

    let dir = folder();
    let results =
        stored(dir.path(), &script.replace("mc_prediction", "sarsa").replace("td0", "q_learning"));
    for file in ["episodes.csv", "summary.csv", "summary.json", "curves.svg"] {
        let text = std::fs::read_to_string(results.join(file)).unwrap();
        assert!(!text.contains("value_error"), "{file}");
    }
}

#[test]
fn without_a_model_there_are_values_but_no_errors() {
    let dir = folder();
    let script = r#"
        experiment(#{ name: "cart", env: "CartPole-v1", agent: td_lambda(#{
            policy: |s| if s.theta > 0.0 { 1 } else { 0 },
            initial_v: |s| 10.0 - abs(s.theta),
        }), discretiser: bins(#{ theta: [-0.2, 0.2, 8] }), seeds: 2, episodes: 50 })
    "#;
    let results = stored(dir.path(), script);
    let cart = values(&results, "cart");
    assert_eq!(cart.len(), 8);
    // Bins from -0.2 to 0.2 have their centres at ±0.025, ±0.075, …: the pole falls to neither
    // side at once, so that its value is far above the initial one.
    assert!(cart[3].0 > 15.0 && cart.iter().all(|(_, exact)| exact.is_none()), "{cart:?}");
    let error = &rows(&results.join("episodes.csv"))[0]["value_error"];
    assert_eq!(error, "");
}

/// The exit code and the message of a script whose one variant is FrozenLake with these keys.
fn refused(keys: &str) -> String {
    let dir = folder();
    let env = if keys.contains("env: ") { "" } else { "env: \"FrozenLake-v1\", " };
    let text = format!("experiment(#{{ {env}episodes: 5, {keys} }})");
    let script = write(dir.path(), "wrong.rhai", &text);
    let output = runner().arg("check").arg(&script).output().unwrap();
    assert_eq!(code(&output), 2, "{keys}: {}", stdout(&output));
    stderr(&output)
}

#[test]
fn what_a_predictor_cannot_be_given_is_refused() {
    for (keys, expected) in [
        (
            "agent: td0(#{ policy: |s| s.row + 3 })",
            "the policy (a closure) must return the number of an action, 0 to 3, it returned 4",
        ),
        ("agent: td0(#{ policy: |s| s.row + 3 })", "on the state"),
        (
            "agent: td0(#{ policy: |s| 1.0 })",
            "must return the number of an action, 0 to 3, it returned 1.0",
        ),
        (
            "agent: td0(#{ policy: \"optimal\" })",
            "`policy` of `td0` is \"random\" or \"greedy\", or a function (s) -> action, got \"optimal\"",
        ),
        (
            "agent: td0(#{ policy: \"greedy\" }), frame_skip: 2",
            "it speaks of single steps, not of `frame_skip`",
        ),
        (
            "agent: td0(#{ policy: \"greedy\" }), discretiser: bins(#{ row: [0.0, 4.0, 4] })",
            "it speaks of states, not of a discretiser's cells",
        ),
        (
            "agent: td0(#{ policy: \"greedy\" }), env: \"CartPole-v1\", discretiser: bins(#{ x: [0.0, 4.0, 4] })",
            "is planned on the finite model of CartPole-v1: it has none",
        ),
        (
            "agent: td0(#{ policy: |s| 0 }), discretiser: cells(4, |s| s.row)",
            "scripted cells have no representative to evaluate `policy` on",
        ),
        (
            "agent: td0(#{ policy: |s| 0 }), allowed: |s, a| true",
            "`td0` plays the policy that it is given",
        ),
        (
            "agent: monte_carlo(#{ exploring_starts: true }), env: env(\"Taxi-v4\", #{ fickle_passenger: true })",
            "`exploring_starts` draws start states from the finite model of Taxi-v4: it has none",
        ),
        (
            "agent: monte_carlo(#{ exploring_starts: 1 })",
            "`exploring_starts` of `monte_carlo` is true or false, got 1",
        ),
        (
            "agent: mc_prediction(#{ visits: \"last\" })",
            "`visits` of `mc_prediction` is \"first\" or \"every\", got \"last\"",
        ),
    ] {
        let message = refused(keys);
        assert!(message.contains(expected), "{keys}: {message}");
    }
}

/// Notes where episodes begin.
struct Scribe(Vec<u32>);

impl Agent for Scribe {
    fn gamma(&self) -> f64 {
        1.0
    }
    fn bootstraps_when_truncated(&self) -> bool {
        false
    }
    fn epsilon(&self) -> f64 {
        0.0
    }
    fn q(&self) -> Option<&QTable> {
        None
    }
}

impl Learn<usize> for Scribe {
    fn begin(&mut self, s: usize) -> Action {
        self.0[s] += 1;
        0
    }
    fn step(&mut self, _reward: f64, _next: usize) -> Action {
        0
    }
    fn end(&mut self, _reward: f64, _last: Last<usize>) {}
}

fn lake() -> FrozenLake {
    match make("FrozenLake-v1", &serde_json::Map::new()).unwrap() {
        AnyEnv::FrozenLake(env) => env,
        _ => unreachable!("the id says so"),
    }
}

#[test]
fn exploring_starts_are_uniform_over_what_can_be_reached() {
    let starts = |exploring_starts| {
        let env = lake();
        let reachable = env.finite().unwrap().reachable();
        let discretiser = StateIndex { n_states: 16 };
        let mut world = World { env, discretiser, potential: NoPotential, reward: NativeReward };
        let limits =
            Limits { episodes: 11_000, max_steps: Some(1), exploring_starts, ..Limits::EPISODE };
        let (mut agent, mut rng) = (Scribe(vec![0; 16]), NumpyRng::from_u64(0));
        let stop = AtomicBool::new(false);
        assert!(train(&mut world, &mut agent, limits, &mut rng, &stop, |_, _| ()).is_ok());
        (agent.0, reachable)
    };
    let (counts, reachable) = starts(Some(3));
    for (n, reachable) in counts.iter().zip(reachable) {
        // A thousand each, standard deviation 30.
        assert!(if reachable { (850..1150).contains(n) } else { *n == 0 }, "{counts:?}");
    }
    assert_eq!(starts(None).0[0], 11_000);
}

#[test]
fn exploring_starts_find_what_exploration_does_not() {
    let dir = folder();
    // Without them, a greedy learner on dry land never leaves the start's neighbourhood.
    let script = r#"
        let greedy = experiment(#{ name: "greedy", env: env("FrozenLake-v1", #{ is_slippery: false }),
            agent: monte_carlo(#{ gamma: 0.9, epsilon: 0.0 }), episodes: 2000, seeds: 5 });
        study("starts", [greedy, greedy.with(#{ name: "starts", agent: #{ exploring_starts: true } })])
            .expect("never there", |r| r.greedy.final_return.mean == 0.0)
            .expect("from nearly everywhere", |r| r.starts.final_return.mean > 0.7)
    "#;
    stored(dir.path(), script);
}
