//! Gymnasium's own recordings and tables, against the environments here.

use std::fmt::Write as _;
use std::io::Read;
use std::path::{Path, PathBuf};

use flate2::read::GzDecoder;
use runner::env::frozen_lake::generate_random_map;
use runner::env::recording::{ParityReport, Tolerance, replay, replay_file, tolerance};
use runner::env::taxi::TaxiState;
use runner::env::{ActionMask, make, specs};
use runner::mdp::{ActionSpace, Outcome, Schema};
use serde_json::{Map, Value, json};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/gymnasium")
}

/// Every recording, in order of name.
fn reports() -> Vec<ParityReport> {
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(folder()).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.to_string_lossy().ends_with(".jsonl.gz"));
    paths.sort();
    let replay = |path: &PathBuf| {
        replay_file(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    };
    paths.iter().map(replay).collect()
}

#[test]
fn recordings_replay_bit_for_bit() {
    // Where the C library's functions are not the correctly rounded ones, and it shows: the file,
    // and how many of its numbers differ.
    let inexact = [("acrobot_pump", 192), ("pendulum_pd", 2)];
    let mut failed = String::new();
    for report in &reports() {
        let known = inexact.iter().find(|(config, _)| *config == report.config);
        let expected = known.map_or(0, |(_, mismatches)| *mismatches);
        if report.mismatches != expected || !report.is_within_tolerance() {
            writeln!(failed, "{report:#?}").unwrap();
        }
    }
    assert!(failed.is_empty(), "{failed}");
}

#[test]
fn every_registered_id_has_a_recording() {
    let reports = reports();
    for spec in specs() {
        assert!(reports.iter().any(|report| report.env_id == spec.id), "{}", spec.id);
    }
}

#[test]
fn the_tolerance_is_exact_but_where_sines_are_amplified() {
    for id in ["FrozenLake-v1", "MountainCar-v0"] {
        assert_eq!(tolerance(id, 500), Tolerance::Exact);
    }
    let cart = |step| tolerance("CartPole-v1", step);
    assert_eq!([cart(0), cart(100)], [Tolerance::Exact; 2]);
    assert_eq!([cart(101), cart(300)], [Tolerance::Within(1e-6); 2]);
    assert_eq!(cart(301), Tolerance::Unchecked);
    assert_eq!(tolerance("Acrobot-v1", 150), Tolerance::Within(1e-6));
    assert_eq!(tolerance("Pendulum-v1", 80), Tolerance::Within(1e-9));
}

/// Gymnasium's `(prob, next_state, reward, terminated)`.
type Row = (f64, u32, f64, bool);

/// A recording of two steps in a deterministic lake, with `step` as its second one.
fn recording(step: &str) -> String {
    let kwargs = r#"{"desc":["SFG"],"is_slippery":false}"#;
    let first =
        r#"{"action":2,"obs":1,"reward":0,"terminated":false,"truncated":false,"prob":1.0}"#;
    format!(
        r#"{{"type":"header","config":"c","env_id":"FrozenLake-v1","kwargs":{kwargs}}}
{{"type":"episode","seed":3,"episode":0,"reset_seed":3,"reset_options":null,"reset_obs":0,"steps":[{first},{step}]}}
"#
    )
}

#[test]
fn differences_are_counted_and_located() {
    let right = r#"{"action":2,"obs":2,"reward":1,"terminated":true,"truncated":false}"#;
    let report = replay(recording(right).as_bytes()).unwrap();
    assert!(report.is_exact() && report.first_mismatch.is_none());
    assert_eq!((report.episodes, report.steps), (1, 2));
    // The reset, and four and five things of the two steps: one has a probability.
    assert_eq!(report.compared, 1 + 5 + 4);

    let wrong = r#"{"action":2,"obs":2,"reward":0.25,"terminated":false,"truncated":false}"#;
    let report = replay(recording(wrong).as_bytes()).unwrap();
    assert_eq!((report.mismatches, report.violations), (2, 2));
    assert_eq!(report.largest_difference, 0.75);
    let first = report.first_mismatch.unwrap();
    assert_eq!((first.line, first.seed, first.episode, first.step), (2, 3, 0, 2));
    assert_eq!((&*first.field, first.expected, first.got), ("reward", 0.25, 1.0));
}

#[test]
fn a_tolerance_admits_what_it_says() {
    // A real episode of 200 steps, with one number moved by about 1e-7 at step 150: a mismatch,
    // but no violation; moved by 1e-5, or at step 50, it is one.
    let mut text = String::new();
    let file = std::fs::File::open(folder().join("cartpole_v0_pd.jsonl.gz")).unwrap();
    GzDecoder::new(file).read_to_string(&mut text).unwrap();
    let lines: Vec<&str> = text.lines().take(2).collect();
    let violations = |step: usize, by: f64| {
        let mut episode: Value = serde_json::from_str(lines[1]).unwrap();
        let x = &mut episode["steps"][step - 1]["obs"][0];
        *x = (x.as_f64().unwrap() + by).into();
        let report = replay(format!("{}\n{episode}\n", lines[0]).as_bytes()).unwrap();
        assert_eq!(report.mismatches, 1);
        report.violations
    };
    assert_eq!([violations(150, 1e-7), violations(150, 1e-5), violations(50, 1e-7)], [0, 1, 1]);
}

#[test]
fn malformed_recordings_name_the_line() {
    let good = recording(r#"{"action":2,"obs":2,"reward":1,"terminated":true,"truncated":false}"#);
    for (text, message) in [
        (String::new(), "line 1: the recording is empty"),
        ("nonsense".into(), "line 1: not a header: expected ident at line 1 column 2"),
        (
            good.replace("\"header\"", "\"episode\""),
            "line 1: a recording starts with a line of type `header`, not `episode`",
        ),
        (
            good.replace("FrozenLake-v1", "FrozenLak-v1"),
            "line 1: there is no environment `FrozenLak-v1` (did you mean `FrozenLake-v1`?)",
        ),
        (
            good.replace("\"is_slippery\":false", "\"is_slippery\":3"),
            "line 1: `is_slippery` must be true or false, not 3",
        ),
        (
            good.replace("\"config\":\"c\"", "\"attrs\":{\"mass\":1}"),
            "line 1: FrozenLake-v1 has no attributes, so no `mass`",
        ),
        (
            good.replace("\"config\":\"c\"", "\"make_kwargs\":{\"max_episode_steps\":1.5}"),
            "line 1: `max_episode_steps` must be an integer, not 1.5",
        ),
        (
            good.replace("\"type\":\"episode\"", "\"type\":\"note\""),
            "line 2: after the header come lines of type `episode`, not `note`",
        ),
        (good.replace("\"episode\":0,", ""), "line 2: not an episode: missing field `episode`"),
        (
            good.replace("\"reset_seed\":3", "\"reset_seed\":-3"),
            "line 2: not an episode: a seed must be an integer of 0 or more, or its digits as text",
        ),
        (
            good.replace("\"reset_seed\":3", "\"reset_seed\":null"),
            "line 2: the first reset needs a seed",
        ),
        (
            good.replace("\"action\":2,\"obs\":2", "\"action\":4,\"obs\":2"),
            "line 2: at step 2: FrozenLake-v1 has no action 4: its actions are 0 (left), 1 (down), \
             2 (right), 3 (up)",
        ),
        (
            good.replace("\"reset_obs\":0", "\"reset_obs\":[0.5]"),
            "line 2: the observation at step 0 has not the shape of FrozenLake-v1's, which is an \
             integer",
        ),
        (
            good.replace("\"prob\":1.0", "\"mask\":\"1111\""),
            "line 2: the mask at step 1 must be 0 characters 0 or 1, not `1111`",
        ),
        (format!("{good}{{\n"), "line 3: not an episode: EOF while parsing"),
    ] {
        let error = replay(text.as_bytes()).unwrap_err().to_string();
        assert!(error.starts_with(message), "{error}\nshould start with\n{message}");
    }
    let error = replay_file(Path::new("no/such.jsonl")).unwrap_err().to_string();
    assert!(error.starts_with("cannot read no/such.jsonl: "), "{error}");
}

#[test]
fn gzip_is_recognised_by_content_and_damage_is_an_error() {
    let dir = tempfile::tempdir().unwrap();
    let packed = std::fs::read(folder().join("frozenlake_rect.jsonl.gz")).unwrap();
    let path = dir.path().join("any.name");
    std::fs::write(&path, &packed).unwrap();
    assert!(replay_file(&path).unwrap().is_exact());
    std::fs::write(&path, &packed[..packed.len() / 2]).unwrap();
    let error = replay_file(&path).unwrap_err().to_string();
    assert!(error.contains("cannot be read: "), "{error}");
}

fn gzipped(name: &str) -> Value {
    let file = std::fs::File::open(folder().join(name)).unwrap();
    serde_json::from_reader(GzDecoder::new(file)).unwrap()
}

#[test]
fn tables_are_gymnasiums() {
    let files = ["frozenlake_tables.json.gz", "cliff_taxi_tables.json.gz"];
    let tables: Vec<Value> =
        files.iter().flat_map(|name| gzipped(name).as_array().unwrap().clone()).collect();
    assert_eq!(tables.len(), 7 + 5);
    for table in tables {
        let kwargs = table["kwargs"].as_object().unwrap();
        let env = make(table["env_id"].as_str().unwrap(), kwargs).unwrap();
        let mdp = env.finite().unwrap();
        let initial: Vec<f64> =
            serde_json::from_value(table["initial_state_distrib"].clone()).unwrap();
        assert_eq!(mdp.initial(), initial, "{kwargs:?}");
        let states: Vec<Vec<Vec<Row>>> = serde_json::from_value(table["P"].clone()).unwrap();
        assert_eq!((mdp.n_states(), mdp.n_actions()), (states.len(), states[0].len()));
        for (s, actions) in states.iter().enumerate() {
            for (a, outcomes) in actions.iter().enumerate() {
                let expected: Vec<Outcome> = outcomes
                    .iter()
                    .map(|&(probability, next_state, reward, terminated)| Outcome {
                        probability,
                        next_state,
                        reward,
                        terminated,
                    })
                    .collect();
                assert_eq!(mdp.of(s, a), expected, "{kwargs:?} state {s} action {a}");
            }
        }
    }
}

#[test]
fn every_taxi_mask_is_gymnasiums() {
    let masks: Vec<String> =
        serde_json::from_value(gzipped("taxi_masks.json.gz")["mask"].take()).unwrap();
    assert_eq!(masks.len(), 500);
    for (s, mask) in masks.iter().enumerate() {
        assert_eq!(
            ActionMask(TaxiState::decode(s).action_mask().to_vec()).to_string(),
            *mask,
            "state {s}"
        );
    }
}

#[test]
fn random_maps_are_gymnasiums() {
    let mut compared = 0;
    for map in gzipped("random_maps.json.gz")["maps"].as_array().unwrap() {
        let (size, p) = (map["size"].as_u64().unwrap() as usize, map["p"].as_f64().unwrap());
        let seed = map["seed"].to_string().trim_matches('"').parse().unwrap();
        let drawn = generate_random_map(size, p, &seed);
        // Gymnasium takes a p above 1 for 1.
        if p > 1.0 {
            drawn.unwrap_err();
            continue;
        }
        let expected: Vec<String> = serde_json::from_value(map["map"].clone()).unwrap();
        assert_eq!(drawn.unwrap(), expected, "{map}");
        compared += 1;
    }
    assert_eq!(compared, 105);
}

#[test]
fn limits_thresholds_and_spaces_are_gymnasiums() {
    let text = std::fs::read_to_string(folder().join("registry.json")).unwrap();
    let registry: Vec<Value> = serde_json::from_str(&text).unwrap();
    assert_eq!(registry.len(), specs().len());
    for spec in specs() {
        let theirs = registry.iter().find(|theirs| theirs["id"] == spec.id).unwrap();
        assert_eq!(spec.max_steps.map(u64::from), theirs["max_episode_steps"].as_u64());
        assert_eq!(spec.reward_threshold, theirs["reward_threshold"].as_f64());
        let env = spec.make(&Map::new()).unwrap();
        let actions = match env.action_space() {
            ActionSpace::Discrete(n) => Value::from(format!("Discrete({n})")),
            ActionSpace::Box { low, high } => {
                json!({"type": "Box", "low": low, "high": high, "dtype": "float32"})
            }
        };
        assert_eq!(theirs["action_space"], actions);
        match &theirs["observation_space"] {
            Value::String(tuple) if tuple.starts_with("Tuple") => {
                // The tuple's numbers come first, others that scripts see after them.
                let fields = env.schema().fields;
                let spaces: Vec<String> = fields[..tuple.matches("Discrete").count()]
                    .iter()
                    .map(|field| format!("Discrete({})", field.high + 1.0))
                    .collect();
                assert_eq!(*tuple, format!("Tuple({})", spaces.join(", ")));
            }
            Value::String(discrete) => {
                assert_eq!(*discrete, format!("Discrete({})", env.n_states().unwrap()));
            }
            space => {
                assert_eq!(
                    bounds(&env.schema()),
                    [numbers(&space["low"]), numbers(&space["high"])]
                );
            }
        }
    }
}

fn bounds(schema: &Schema) -> [Vec<f64>; 2] {
    let (low, high) = schema.fields.iter().map(|field| (field.low, field.high)).unzip();
    [low, high]
}

fn numbers(list: &Value) -> Vec<f64> {
    let number = |x: &Value| x.as_f64().unwrap_or_else(|| x.as_str().unwrap().parse().unwrap());
    list.as_array().unwrap().iter().map(number).collect()
}
