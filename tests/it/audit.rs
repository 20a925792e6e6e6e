//! `runner audit` and `runner score`, as their users meet them: terms that courses teach, and what is
//! to be said of each.

use serde_json::Value;

use crate::support::{expect_code, folder, run, runner, stderr, stdout, write};

/// The audit of a script, and its exit code.
fn audit(script: &str, more: &[&str]) -> (Value, i32) {
    let dir = folder();
    let path = write(dir.path(), "audited.rhai", script);
    let output = runner().arg("audit").arg(&path).arg("--json").args(more).output().unwrap();
    let code = output.status.code().unwrap();
    assert!(code < 2, "{}", stderr(&output));
    (serde_json::from_slice(&output.stdout).unwrap(), code)
}

/// The only variant of a script made of one experiment with these keys.
fn one(keys: &str) -> Value {
    let (json, code) = audit(&format!("experiment(#{{ {keys} }})"), &["--quick"]);
    assert_eq!(code, 0, "nothing here promises anything");
    json["variants"][0].clone()
}

const LAKE: &str = "env: env(\"FrozenLake-v1\", #{ map_name: \"8x8\" }), agent: q_learning(#{})";
const DRY_LAKE: &str = "env: env(\"FrozenLake-v1\", #{ map_name: \"8x8\", is_slippery: false }), agent: q_learning(#{})";
const CAR: &str = "env: \"MountainCar-v0\", agent: q_learning(#{}), \
                   discretiser: bins(#{ position: [-1.2, 0.6, 40], velocity: [-0.07, 0.07, 40] })";
const POLE: &str = "env: \"CartPole-v1\", agent: q_learning(#{}), \
                    discretiser: bins(#{ theta: [-0.21, 0.21, 6], theta_dot: [-3.0, 3.0, 6] })";

#[test]
fn the_pickup_bonus_on_taxi_is_caught_with_its_loop() {
    let (json, code) = audit(&std::fs::read_to_string("scripts/taxi_hacking.rhai").unwrap(), &[]);
    assert_eq!(code, 0, "every expectation about audits holds");
    let variants = json["variants"].as_array().unwrap();
    assert_eq!(json["study"], "taxi-hacking");
    let of = |name: &str| variants.iter().find(|v| v["name"] == name).unwrap();

    let large = of("bonus 2.5");
    assert_eq!(large["verdict"], "not-potential-based");
    assert_eq!(large["policy_preserved"], false);
    assert_eq!((&large["states"], &large["states_changed"]), (&400.into(), &89.into()));
    assert_eq!(large["transitions"]["violations"], 1392);
    assert_eq!(large["transitions"]["transitions"], 2400);
    assert!((large["true_return"]["shaped"].as_f64().unwrap() + 100.0).abs() < 1e-6);
    // 2.226 / 2.5.
    let k = large["critical"]["k"].as_f64().unwrap();
    assert!((k * 2.5 - 2.226).abs() < 5e-4, "{k}");
    let hacking = &large["loop"]["cycle"];
    assert_eq!(hacking["deterministic"], true);
    let mut actions: Vec<u64> =
        hacking["actions"].as_array().unwrap().iter().map(|a| a.as_u64().unwrap()).collect();
    actions.sort_unstable();
    assert_eq!(actions, [4, 5], "pickup and dropoff");
    assert_eq!(hacking["gain"], 0.5);
    // Every state that is mentioned has a name.
    for state in hacking["states"].as_array().unwrap() {
        assert!(large["state_names"][state.to_string()].as_str().unwrap().contains("passenger"));
    }
    let sums = ["direct", "detour"].map(|way| large["certificate"][way]["sum"].as_f64().unwrap());
    assert!((sums[1] - sums[0] - 2.475).abs() < 1e-12, "{sums:?}");

    let small = of("bonus 1.0");
    assert_eq!((&small["verdict"], &small["policy_preserved"]), (&large["verdict"], &true.into()));
    assert!(small["loop"].is_null());
    let potential = of("potential 2.5");
    assert_eq!(potential["verdict"], "potential-based");
    assert_eq!(potential["transitions"]["violations"], 0);
    assert_eq!(of("plain")["verdict"], "unshaped");
}

#[test]
fn taught_terms_on_ice_are_judged_exactly() {
    // As far as the published tables go: states changed, and whether that costs anything.
    let step = "terms: #{ step: |t| -0.01 }";
    let hole = "terms: #{ hole: |t| if t.next_state.tile == \"H\" { -1.0 } else { 0.0 } }";
    for (lake, term, changed, pattern) in [
        (LAKE, step, 26, "constant"),
        (DRY_LAKE, step, 0, "constant"),
        (LAKE, hole, 6, "at-the-end"),
    ] {
        let v = one(&format!("{lake}, {term}"));
        assert_eq!(v["verdict"], "not-potential-based", "{term}");
        assert_eq!(v["states_changed"], changed, "{term}");
        assert_eq!(v["policy_preserved"], changed == 0, "{term}");
        assert_eq!(v["pattern"], pattern, "{term}");
        assert!(!v["instead"].as_str().unwrap().is_empty());
    }
    let distance = "fn d(s) { abs(s.row - s.goal_row) + abs(s.col - s.goal_col) }";
    let progress = "terms: #{ p: |t| 0.1 * max(0, d(t.state) - d(t.next_state)) }";
    let (json, _) = audit(&format!("{distance} experiment(#{{ {DRY_LAKE}, {progress} }})"), &[]);
    let v = &json["variants"][0];
    assert_eq!((&v["states_changed"], &v["pattern"]), (&5.into(), &"one-way".into()));
    assert_eq!(v["true_return"]["shaped"], 0.0);
    let mut states: Vec<u64> = v["loop"]["cycle"]["states"]
        .as_array()
        .unwrap()
        .iter()
        .map(|s| s.as_u64().unwrap())
        .collect();
    states.sort_unstable();
    assert_eq!(states, [61, 62]);
}

#[test]
fn a_potential_written_out_with_mistakes_is_diagnosed() {
    let phi = "fn phi(s) { 14 - abs(s.row - s.goal_row) - abs(s.col - s.goal_col) }";
    let judged = |term: &str| {
        let (json, _) = audit(&format!("{phi} experiment(#{{ {DRY_LAKE}, {term} }})"), &[]);
        json["variants"][0].clone()
    };
    let right = judged(
        "terms: #{ f: |t| 0.99 * (if t.terminated { 0 } else { phi(t.next_state) }) - phi(t.state) }",
    );
    assert_eq!(right["verdict"], "potential-based");
    assert_eq!(right["policy_preserved"], true);
    let terminal = judged("terms: #{ f: |t| 0.99 * phi(t.next_state) - phi(t.state) }");
    assert_eq!(terminal["verdict"], "not-potential-based");
    assert!(terminal["instead"].as_str().unwrap().contains("terminal"), "{}", terminal["instead"]);
    let gamma = judged(
        "terms: #{ f: |t| (if t.terminated { 0 } else { phi(t.next_state) }) - phi(t.state) }",
    );
    assert_eq!(gamma["verdict"], "not-potential-based");
    assert!(gamma["instead"].as_str().unwrap().contains("γ = 1"), "{}", gamma["instead"]);
}

#[test]
fn taught_terms_without_a_model_are_caught_on_the_way() {
    for (keys, term) in [
        (CAR, "terms: #{ speed: |t| 10.0 * abs(t.next_state.velocity) }"),
        (CAR, "terms: #{ distance: |t| abs(t.next_state.position + 0.5) }"),
        (CAR, "terms: #{ height: |t| 5.0 * sin(3.0 * t.next_state.position) }"),
        (CAR, "terms: #{ goal: |t| if t.terminated { 250.0 } else { 0.0 } }"),
        (
            CAR,
            "reward: |t| t.reward + 300.0 * (0.95 * abs(t.next_state.velocity) - abs(t.state.velocity))",
        ),
        (POLE, "terms: #{ upright: |t| 1.0 - abs(t.next_state.theta) / 0.21 }"),
        (POLE, "terms: #{ fall: |t| if t.terminated { -10.0 } else { 0.0 } }"),
    ] {
        let v = one(&format!("{keys}, {term}"));
        assert_eq!(v["verdict"], "not-potential-based", "{term}");
        assert!(v["policy_preserved"].is_null(), "{term}: no model, no claim");
        let ways = v["trajectories"]["violation"]["trajectories"].as_array().unwrap();
        let sum = |way: &Value| way["sum"].as_f64().unwrap();
        assert!(sum(&ways[1]) > sum(&ways[0]), "{term}");
    }
    // A potential in the form of a reward: nothing to be found, and nothing more is claimed.
    let v = one(&format!(
        "{CAR}, terms: #{{ f: |t| 0.99 * (if t.terminated {{ 0.0 }} else {{ \
         10.0 * abs(t.next_state.velocity) }}) - 10.0 * abs(t.state.velocity) }}"
    ));
    assert_eq!(v["verdict"], "no-violation-found");
    assert!(v["policy_preserved"].is_null());
    assert_eq!(v["query"]["violations"], 0);
    // A bonus for being early is no function of the transition.
    let v = one(&format!(
        "{CAR}, terms: #{{ early: |t| if t.terminated && t.step < 150 {{ 250.0 }} else {{ 0.0 }} }}"
    ));
    assert_eq!(v["verdict"], "not-potential-based");
    assert!(v["trajectories"]["step_dependence"]["paid"].is_array());
}

#[test]
fn lunar_landers_own_shaping_is_mentioned() {
    let lander = |shaping: &str| {
        one(&format!(
            "env: env(\"LunarLander-v3\", #{{ shaping: \"{shaping}\" }}), agent: random_agent()"
        ))
    };
    assert!(lander("native")["remark"].as_str().unwrap().contains("γ = 1"));
    assert!(lander("none")["remark"].is_null());
}

#[test]
fn the_sampled_model_speaks_for_itself_only() {
    let script = format!(
        "let car = experiment(#{{ name: \"car\", {CAR} }});
        [
            car.with(#{{ name: \"bonus\", terms: #{{ speed: |t| 100.0 * abs(t.next_state.velocity) }} }}),
            car.with(#{{ name: \"cell\", potential: |s| 300.0 * abs(s.velocity) }}),
            car.with(#{{ name: \"raw\", potential: |s| 300.0 * abs(s.velocity), potential_on: \"raw\" }}),
        ]"
    );
    let (json, code) = audit(&script, &[]);
    assert_eq!(code, 0);
    let of = |i: usize| &json["variants"][i];
    let model = |i: usize| &json["variants"][i]["sampled_model"];
    // From the literature's tables: about -64 for an optimal policy, near -100 for the bonus.
    let earned = |i: usize, what: &str| model(i)["true_return"][what].as_f64().unwrap();
    assert!((-66.5..-62.0).contains(&earned(0, "optimal")), "{}", earned(0, "optimal"));
    assert!(earned(0, "shaped") < -98.0, "{}", earned(0, "shaped"));
    assert_eq!(model(1)["policy_preserved"], true);
    assert_eq!(of(1)["verdict"], "potential-based");
    assert!(model(2)["states_changed"].as_u64().unwrap() > 20);
    assert!(of(2)["policy_preserved"].is_null(), "samples never decide that");
    // Whatever the number of threads.
    assert_eq!(audit(&script, &["--jobs", "1"]).0, json);
}

#[test]
fn expectations_about_audits_decide_the_exit_code_and_others_are_left_alone() {
    let dir = folder();
    let script = |claim: &str| {
        format!(
            "study(\"s\", [experiment(#{{ name: \"cost\", {LAKE}, terms: #{{ c: |t| -0.01 }} }})])
                .expect(\"it learns\", |r| r.cost.auc.mean > 0.5)
                .expect(\"claimed\", |r| {claim})"
        )
    };
    for (claim, code) in
        [("r.cost.audit.policy_preserved", 1), ("!r.cost.audit.policy_preserved", 0)]
    {
        let path = write(dir.path(), "claims.rhai", &script(claim));
        let output = runner().arg("audit").arg(&path).output().unwrap();
        expect_code(&output, code);
        assert!(stderr(&output).contains("claimed") && !stderr(&output).contains("it learns"));
        assert!(stdout(&output).contains("CHANGES in 26 of 53 states"), "{}", stdout(&output));
    }
    let output = run(&["audit", "scripts/taxi_hacking.rhai", "--variant", "nobody"]);
    expect_code(&output, 2);
    assert!(stderr(&output).contains("bonus 2.5"));
}

#[test]
fn potentials_are_ranked_before_training_and_compared_with_it_afterwards() {
    let dir = folder();
    let script = format!(
        "fn d(s) {{ abs(s.row - s.goal_row) + abs(s.col - s.goal_col) }}
        let lake = experiment(#{{ name: \"zero\", {LAKE}, episodes: 1000, seeds: 2 }});
        study(\"lakes\", [
            lake,
            lake.with(#{{ name: \"near\", potential: |s| 0.95 ** (d(s) * 1.0) }}),
            lake.with(#{{ name: \"far\", potential: |s| -0.05 * d(s) }}),
            lake.with(#{{ name: \"bonus\", reward: |t| t.reward + 1.0 }}),
        ])"
    );
    let path = write(dir.path(), "lakes.rhai", &script);
    let score = |more: &[&str]| runner().arg("score").arg(&path).args(more).output().unwrap();
    let output = score(&["--json"]);
    expect_code(&output, 0);
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    let of = |name: &str| {
        json["variants"].as_array().unwrap().iter().find(|v| v["name"] == name).unwrap()
    };
    assert_eq!([&of("near")["rank"], &of("zero")["rank"], &of("far")["rank"]], [1, 2, 3]);
    // Minus a distance makes every fall into a hole a relief.
    assert_eq!(of("far")["score"]["death"]["paid"], 99);
    assert_eq!(of("far")["score"]["death"]["bad_ends"], 99);
    assert!(of("bonus")["score"].is_null());
    assert!(stdout(&score(&[])).contains("bonus: not scored"));
    let out = dir.path().join("results");
    let trained = runner().arg("exec").arg(&path).arg("--out").arg(&out).output().unwrap();
    expect_code(&trained, 0);
    let text = stdout(&score(&["--results", out.to_str().unwrap()]));
    assert!(text.contains("training ranked 3 of them"), "{text}");
}

#[test]
fn what_the_agent_adds_itself_is_in_no_model() {
    let v = one(&format!("{LAKE}, advice: |s, a| 0.1 * a"));
    assert_eq!(v["verdict"], "potential-based");
    assert!(v["transitions"].is_null() && v["pattern"].is_null(), "nothing of that was checked");
    let dir = folder();
    let script = format!(
        "experiment(#{{ {LAKE}, advice: |s, a| if s.index == 9 {{ 0.0 / 0.0 }} else {{ 1.0 }} }})"
    );
    let path = write(dir.path(), "nan.rhai", &script);
    let output = runner().arg("audit").arg(&path).output().unwrap();
    expect_code(&output, 2);
    assert!(stderr(&output).contains("finite number"), "{}", stderr(&output));
    // A multiple of the native reward needs no replacement.
    let v = one(&format!("{LAKE}, reward: |t| 10.0 * t.reward"));
    assert_eq!(v["policy_preserved"], true);
    assert!(v["instead"].as_str().unwrap().starts_with("nothing"), "{}", v["instead"]);
}
