//! Values that are linear in features, from the script to what is stored, played and pictured.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use runner::env::Session;
use runner::experiment::{AuditVerdict, audit_variant, run_unit, units};
use runner::script::{Host, Plan, load};

use crate::support::{
    assert_same, expect_code, folder, run, runner, stderr, stdout, stored, write,
};

const CAR: &str = r#"
let plain = experiment(#{
    name: "plain", env: "MountainCar-v0", max_steps: 500,
    agent: sarsa_lambda(#{ alpha: 0.5, gamma: 1.0, epsilon: 0.05, traces: "replacing", initial_q: 0.7 }),
    discretiser: tiles([[-1.25, 0.75, 8], [-0.125, 0.125, 4]], 4),
    episodes: 15, seeds: [3, 5],
});
study("cars", [plain, plain.with(#{ name: "height", potential: |s| sin(3.0 * s.position) })])
"#;

fn plan(script: &str) -> Plan {
    let folder = folder();
    load(&write(folder.path(), "s.rhai", script)).unwrap_or_else(|d| panic!("{d}"))
}

/// Native return and steps of every episode of the first variant's first seed.
fn episodes(plan: &Plan) -> Vec<(f64, u32)> {
    let (host, variant) = (Host::open(plan).unwrap(), &plan.variants[0]);
    let never = AtomicBool::new(false);
    let record =
        run_unit(&host, variant, variant.seeds.0[0], &never, &mut |_| {}).expect("it runs");
    record.rows.iter().map(|row| (row.native, row.steps)).collect()
}

/// The `weights.csv` of a variant's `i`-th seed.
fn weights_file(results: &Path, variant: &str, i: usize) -> PathBuf {
    let manifest = std::fs::read(results.join("study.json")).unwrap();
    let manifest: serde_json::Value = serde_json::from_slice(&manifest).unwrap();
    let variants = manifest["identity"]["variants"].as_array().unwrap();
    let own = variants.iter().find(|v| v["name"] == variant).unwrap();
    let hash = own["units"][i].as_str().unwrap();
    results.join("units").join(&hash[..2]).join(hash).join("weights.csv")
}

/// What a `weights.csv` of the study above says: q(s, a), by the rule of the book's own tile coder,
/// and whether anything was learned of the state.
struct ByHand {
    rows: Vec<Option<[f64; 3]>>,
}

impl ByHand {
    fn read(file: &Path) -> Self {
        let mut rows = vec![None; 4 * 9 * 5];
        let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_path(file).unwrap();
        for line in reader.records().map(Result::unwrap) {
            let row = [1, 2, 3].map(|i| line[i].parse().unwrap());
            rows[line[0].parse::<usize>().unwrap()] = Some(row);
        }
        Self { rows }
    }

    fn q(&self, position: f64, velocity: f64) -> ([f64; 3], bool) {
        // Quarters of a tile, of which there are 32 and 16.
        let part = |x: f64, lo: f64, width: f64, n: f64| {
            ((x - lo) / width * 4.0).floor().clamp(0.0, 4.0 * n - 1.0) as usize
        };
        let (x, v) = (part(position, -1.25, 0.25, 8.0), part(velocity, -0.125, 0.0625, 4.0));
        let (mut q, mut known) = ([0.0; 3], false);
        for t in 0..4 {
            let row = self.rows[45 * t + (x + t) / 4 * 5 + (v + 3 * t % 4) / 4];
            known |= row.is_some();
            for (q, w) in q.iter_mut().zip(row.unwrap_or([0.7 / 4.0; 3])) {
                *q += w;
            }
        }
        (q, known)
    }
}

fn greedy(q: [f64; 3]) -> usize {
    let best = q.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    q.iter().position(|q| *q >= best - 1e-9 * best.abs().max(1.0)).unwrap()
}

#[test]
fn stored_weights_play_what_they_say() {
    let dir = folder();
    let results = stored(dir.path(), CAR);
    let file = weights_file(&results, "plain", 1);
    let mut command = runner();
    let played = command.arg("play").arg(&results).args(["--seed", "5", "--env-seed", "11"]);
    let played = played.output().unwrap();
    expect_code(&played, 0);
    let played = stdout(&played);
    assert!(played.lines().count() > 50);

    // The file knows what its features are.
    let steps = (played.lines().count() - 1).to_string();
    let file_name = file.to_str().unwrap();
    let options = ["--seed", "11", "--steps", &steps, "--policy", file_name];
    let by_file = run(&[&["rollout", "MountainCar-v0"], &options[..]].concat());
    expect_code(&by_file, 0);
    let actions = |text: &str| -> Vec<String> {
        let steps = text.lines().skip(1).take(199);
        steps.map(|l| l.split(",\"obs\"").next().unwrap().to_string()).collect()
    };
    assert_eq!(actions(&stdout(&by_file)), actions(&played));

    let table = ByHand::read(&file);
    let mut session = Session::new("MountainCar-v0", &serde_json::Map::new()).unwrap();
    session.reset(Some(&11.into()), None).unwrap();
    for line in actions(&played) {
        let action = greedy(table.q(session.fields()[0], session.fields()[1]).0);
        assert_eq!(line, format!(r#"{{"type":"step","action":{action}"#));
        session.step(&(action as i64).into()).unwrap();
    }
}

#[test]
fn weights_that_do_not_fit_are_refused() {
    let dir = folder();
    let results = stored(dir.path(), CAR);
    let file = weights_file(&results, "plain", 0);
    let text = std::fs::read_to_string(&file).unwrap();
    let refused = |env: &str, text: &str, expected: &str| {
        let changed = write(dir.path(), "weights.csv", text);
        let output = run(&["rollout", env, "--policy", changed.to_str().unwrap()]);
        expect_code(&output, 2);
        assert!(stderr(&output).contains(expected), "{}", stderr(&output));
    };
    refused("CartPole-v1", &text, "is about the actions left, none, right of MountainCar-v0");
    refused("MountainCar-v0", "#{}\n", "its first line does not say what its features are");
    refused("MountainCar-v0", &text.replace("velocity", "speed"), "is about a field `speed`");
    refused(
        "MountainCar-v0",
        &text.replace("-1.25", "9.0"),
        "line 1: the lower bound 9 is not below",
    );
    refused("MountainCar-v0", &text.replace("w_2", "w_3"), "there is no `feature,w_0,w_1,w_2`");
    refused(
        "MountainCar-v0",
        &format!("{text}180,0.0,0.0,0.0\n"),
        "there is no feature 180 among 180",
    );
    let second = text.lines().nth(2).unwrap();
    refused("MountainCar-v0", &format!("{text}{second}\n"), "not in ascending order");
    let cut = text.trim_end().rsplit_once(',').unwrap().0;
    refused("MountainCar-v0", cut, "found record with 3 fields");
    let worded = format!("{},x\n", text.trim_end().rsplit_once(',').unwrap().0);
    refused("MountainCar-v0", &worded, "a value is no finite number");

    std::fs::write(&file, text.replace("0.7", "0.8")).unwrap();
    let output = runner().arg("play").arg(&results).output().unwrap();
    expect_code(&output, 2);
    assert!(stderr(&output).contains("weights.csv: was changed after it was written"));
}

#[test]
fn pictures_show_the_values_of_every_place() {
    let dir = folder();
    let results = stored(dir.path(), CAR);
    let mut command = runner();
    let output = command.arg("show").arg(&results).args(["--variant", "height", "--json"]);
    let output = output.output().unwrap();
    expect_code(&output, 0);
    let all: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    let table = ByHand::read(&weights_file(&results, "height", 0));
    let pictures = all["pictures"].as_array().unwrap();
    assert_eq!(pictures.len(), 3);
    let [value, policy, potential] = [0, 1, 2].map(|i| &pictures[i]["rows"]);
    assert_eq!(
        (&pictures[0]["x"]["field"], &pictures[0]["x"]["n"]),
        (&"position".into(), &60.into())
    );
    let mut unknown = 0;
    for (j, i) in (0..60).flat_map(|j| (0..60).map(move |i| (j, i))) {
        let middle = |k: usize, lo: f64, hi: f64| lo + (hi - lo) * ((k as f64 + 0.5) / 60.0);
        let (x, v) = (middle(i, -1.25, 0.75), middle(j, -0.125, 0.125));
        let (q, known) = table.q(x, v);
        let phi = runner::mdp::math::sin(3.0 * x);
        assert!((potential[j][i].as_f64().unwrap() - phi).abs() < 1e-12);
        assert_eq!(value[j][i].is_null(), !known);
        if known {
            let best = q.iter().copied().fold(f64::NEG_INFINITY, f64::max) + phi;
            assert!((value[j][i].as_f64().unwrap() - best).abs() < 1e-12);
            assert_eq!(policy[j][i].as_f64().unwrap(), greedy(q) as f64);
        } else {
            unknown += 1;
        }
    }
    assert!((100..2500).contains(&unknown), "{unknown}");
}

#[test]
fn results_do_not_depend_on_threads_and_are_resumed() {
    let dir = folder();
    let script = write(dir.path(), "cars.rhai", CAR);
    let exec = |out: &Path, more: &[&str]| {
        let mut command = runner();
        let output = command.arg("exec").arg(&script).arg("--out").arg(out).args(more);
        expect_code(&output.output().unwrap(), 0);
    };
    let (one, two) = (dir.path().join("one"), dir.path().join("two"));
    exec(&one, &["--jobs", "1"]);
    exec(&two, &["--jobs", "2"]);
    assert_same(&one, &two);
    // A unit that is gone is run again, to the same bytes.
    let gone = weights_file(&two, "height", 1);
    std::fs::remove_dir_all(gone.parent().unwrap()).unwrap();
    exec(&two, &[]);
    assert_same(&one, &two);
}

#[test]
fn a_unit_is_named_by_its_features() {
    let hash = |discretiser: &str| {
        let plan = plan(&format!(
            "experiment(#{{ env: \"MountainCar-v0\", agent: q_learning(), seeds: 1,
                discretiser: {discretiser} }})"
        ));
        units(&plan)[0].hash.clone()
    };
    let all = [
        "tiles(#{ position: [-1.2, 0.6, 8], velocity: [-0.07, 0.07, 8], tilings: 8 })",
        "tiles(#{ position: [-1.2, 0.6, 8], velocity: [-0.07, 0.07, 8], tilings: 4 })",
        "tiles(#{ position: [-1.2, 0.6, 8], velocity: [-0.07, 0.07, 7], tilings: 8 })",
        "tiles(#{ position: [-1.2, 0.6, 8], tilings: 8 })",
        "bins(#{ position: [-1.2, 0.6, 8], velocity: [-0.07, 0.07, 8] })",
        "fourier(8)",
        "fourier(#{ order: 8, position: [-1.2, 0.6] })",
    ];
    let hashes: std::collections::BTreeSet<String> = all.iter().map(|d| hash(d)).collect();
    assert_eq!(hashes.len(), all.len());
    assert_eq!(hash(all[0]), hash("tiles([[-1.2, 0.6, 8], [-0.07, 0.07, 8]], 8)"));
    // The bounds of the schema, which are float32 numbers.
    let float = |x: f32| format!("{:?}", f64::from(x));
    let (position, velocity) = ([-1.2, 0.6].map(float), [-0.07, 0.07].map(float));
    let named = format!(
        "fourier(#{{ order: 8, position: [{}], velocity: [{}] }})",
        position.join(", "),
        velocity.join(", ")
    );
    assert_eq!(hash(all[5]), hash(&named));
}

#[test]
fn check_says_how_many_weights_there_are_and_what_holds_of_the_potential() {
    let dir = folder();
    let script = write(dir.path(), "cars.rhai", CAR);
    let output = runner().arg("check").arg(script).output().unwrap();
    expect_code(&output, 0);
    assert_eq!(stderr(&output), "");
    let said = stdout(&output);
    assert!(said.contains("4 tilings of 8 × 4 tiles, 180 features, 540 weights"), "{said}");
    assert!(said.contains("on the state itself, at every step"), "{said}");
}

/// Ranges are in the units that the agent sees.
#[test]
fn normalised_ranges_are_the_same_features() {
    let script = |keys: &str| {
        format!(
            "experiment(#{{ env: \"CartPole-v1\", agent: sarsa(#{{ alpha: 0.3 }}), seeds: 1,
                episodes: 20, {keys} }})"
        )
    };
    for (tiles, ranges) in [
        ("tiles(#{ theta: [-1, 1, 5], theta_dot: [-1, 1, 5], tilings: 8 })", ""),
        ("fourier(#{ order: 3, theta: [-1, 1], theta_dot: [-1, 1] })", ""),
        ("fourier(2)", "x: [-2.4, 2.4], x_dot: [-3, 3], "),
    ] {
        let normalise = format!("normalise: #{{ {ranges}theta: [-0.2, 0.2], theta_dot: [-3, 3] }}");
        let physical = tiles
            .replace("theta: [-1, 1", "theta: [-0.2, 0.2")
            .replace("theta_dot: [-1, 1", "theta_dot: [-3, 3")
            .replace(
                "fourier(2)",
                &format!(
                    "fourier(#{{ order: 2, {ranges}theta: [-0.2, 0.2], theta_dot: [-3, 3] }})"
                ),
            );
        let seen = plan(&script(&format!("{normalise}, discretiser: {tiles}")));
        let plain = plan(&script(&format!("discretiser: {physical}")));
        assert_eq!(episodes(&seen), episodes(&plain), "{tiles}");
    }
}

#[test]
fn a_shield_is_obeyed() {
    let plan = plan(
        "experiment(#{ env: \"MountainCar-v0\", agent: q_lambda(#{ epsilon: 0.5, alpha: 0.3 }),
            discretiser: tiles(#{ position: [-1.2, 0.6, 8], velocity: [-0.07, 0.07, 8], tilings: 8 }),
            allowed: |s, a| a != 1 && (a == 2 || s.velocity < 0.0), episodes: 20, seeds: 1,
            terms: #{ none: |t| if t.action == 1 { 1.0 } else { 0.0 },
                back: |t| if t.action == 0 && t.state.velocity >= 0.0 { 1.0 } else { 0.0 } } })",
    );
    let (host, variant) = (Host::open(&plan).unwrap(), &plan.variants[0]);
    let never = AtomicBool::new(false);
    let record = run_unit(&host, variant, 0, &never, &mut |_| {}).expect("it runs");
    assert!(record.rows.iter().all(|row| row.terms == [0.0, 0.0]));
    assert!(record.steps() > 1000);
}

/// The audit speaks of the states themselves: exactly where there is a model.
#[test]
fn the_audit_of_linear_values_is_that_of_the_problem() {
    let audit = |keys: &str| {
        let plan = plan(&format!("experiment(#{{ {keys} }})"));
        assert!(plan.warnings.is_empty(), "{:?}", plan.warnings);
        audit_variant(&Host::open(&plan).unwrap(), &plan.variants[0], None).unwrap()
    };
    let lake = "env: \"FrozenLake-v1\", agent: sarsa(),
        discretiser: tiles(#{ row: [0, 4, 4], col: [0, 4, 4], tilings: 4 }), ";
    let exact = audit(&format!("{lake} potential: |s| 0.1 * s.row"));
    assert_eq!((exact.verdict, exact.identity_holds), (AuditVerdict::PotentialBased, Some(true)));
    let changed = audit(&format!("{lake} terms: #{{ cost: |t| -0.01 * t.state.row }}"));
    assert!(changed.states_changed.is_some());
    let car = "env: \"MountainCar-v0\", agent: sarsa(), discretiser: fourier(3), ";
    let by_construction = audit(&format!("{car} potential: |s| s.position"));
    assert_eq!(by_construction.verdict, AuditVerdict::PotentialBased);
    assert_eq!(by_construction.policy_preserved, Some(true));
    assert_eq!(by_construction.basis, "by construction: Φ is a function of the state");
    // Speed pays on the way to and fro: no potential does that.
    let bonus = audit(&format!("{car} terms: #{{ speed: |t| abs(t.next_state.velocity) }}"));
    assert_eq!(bonus.verdict, AuditVerdict::NotPotentialBased);
}

/// Ten seeds of CartPole: with 81 Fourier features, and with tiles, far better than with bins of
/// the tiles' width.
#[test]
fn cart_pole_improves() {
    let last = |agent: &str, discretiser: &str| {
        let plan = plan(&format!(
            "experiment(#{{ env: \"CartPole-v1\", agent: {agent}, discretiser: {discretiser},
                episodes: 200, seeds: 10 }})"
        ));
        let (host, variant) = (Host::open(&plan).unwrap(), &plan.variants[0]);
        let never = AtomicBool::new(false);
        let mean = |seed| {
            let record = run_unit(&host, variant, seed, &never, &mut |_| {}).expect("it runs");
            record.rows[150..].iter().map(|row| row.native).sum::<f64>() / 50.0
        };
        variant.seeds.0.iter().map(|seed| mean(*seed)).sum::<f64>() / 10.0
    };
    let q = |alpha: f64| format!("q_learning(#{{ alpha: {alpha:?}, epsilon: 0.05 }})");
    let fourier = "fourier(#{ order: 2, x: [-2.4, 2.4], x_dot: [-3, 3], theta: [-0.21, 0.21],
        theta_dot: [-3.5, 3.5] })";
    let cut = |kind: &str, more: &str| {
        format!(
            "{kind}(#{{ x: [-2.4, 2.4, 3], x_dot: [-3, 3, 3], theta: [-0.21, 0.21, 6],
            theta_dot: [-3.5, 3.5, 6]{more} }})"
        )
    };
    let bins = last(&q(0.3), &cut("bins", ""));
    let fourier = last(&q(0.003), fourier);
    let tiles = last(&q(0.3), &cut("tiles", ", tilings: 16"));
    assert!(bins < 110.0, "{bins}");
    assert!(fourier > 160.0, "{fourier}");
    assert!(tiles > 160.0, "{tiles}");
}
