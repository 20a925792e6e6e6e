//! The kinds of shaping as a script's user meets them: what a run is equal to by theorem, what
//! stands in the columns, what is refused and what is warned of.

use std::sync::atomic::AtomicBool;

use runner::experiment::{UnitRecord, audit_variant, run_unit};
use runner::learn::greedy_sets;
use runner::script::{Host, Plan};

use crate::language::plan_of;
use crate::support::{expect_code, folder, run as run_command, stdout, stored, write};

/// A script of one study on slippery ice, whose variants are `variants`: maps of keys that differ
/// from 300 episodes of Q-learning.
fn lake(variants: &str) -> Plan {
    let script = format!(
        r#"
        fn closer(s) {{ 1.0 - 0.05 * (abs(s.row - s.goal_row) + abs(s.col - s.goal_col)) }}
        fn forward(s, a) {{ 0.3 * closer(s) + if a == 1 || a == 2 {{ 0.2 }} else {{ 0.0 }} }}
        const RATES = #{{ alpha: 0.2, gamma: 0.95 }};
        const SOLID = RATES + #{{ epsilon: 0.2 }};
        let base = experiment(#{{
            env: env("FrozenLake-v1", #{{ map_name: "8x8" }}),
            agent: q_learning(SOLID),
            episodes: 300,
        }});
        let list = [];
        for (map, i) in [{variants}] {{
            map.name = "v" + i;
            list.push(base.with(map));
        }}
        list
        "#
    );
    plan_of(&script, &[])
}

fn run(plan: &Plan, seed: u64) -> Vec<UnitRecord> {
    let host = Host::open(plan).unwrap();
    let unit = |v| run_unit(&host, v, seed, &AtomicBool::new(false), &mut |_| {}).expect("it runs");
    plan.variants.iter().map(unit).collect()
}

/// Steps and native return of every episode.
fn played(record: &UnitRecord) -> Vec<(u32, f64)> {
    record.rows.iter().map(|row| (row.steps, row.native)).collect()
}

/// `max |a + shift − b|` over the tables.
fn apart(a: &UnitRecord, b: &UnitRecord, shift: f64) -> f64 {
    let (a, b) = (a.q.as_ref().unwrap(), b.q.as_ref().unwrap());
    a.values().iter().zip(b.values()).map(|(a, b)| (a + shift - b).abs()).fold(0.0, f64::max)
}

/// The columns agree: what is learned from is the native reward and the shaping.
fn adds_up(record: &UnitRecord) {
    for row in &record.rows {
        assert!((row.learned - row.native - row.shaping).abs() < 1e-9, "{row:?}");
    }
}

#[test]
fn a_shift_is_an_initial_value() {
    for agent in ["q_learning", "sarsa", "expected_sarsa"] {
        let plan = lake(&format!(
            "#{{ agent: {agent}(SOLID + #{{ initial_q: 0.5 }}) }},
             #{{ agent: {agent}(SOLID), potential_shift: 0.5 }},
             #{{ agent: {agent}(SOLID) }}"
        ));
        let records = run(&plan, 3);
        assert_eq!(played(&records[0]), played(&records[1]), "{agent}");
        assert!(apart(&records[1], &records[0], 0.5) < 1e-13, "{agent}");
        assert_ne!(played(&records[0]), played(&records[2]), "{agent}: 0.5 makes a difference");
        adds_up(&records[1]);
        // Undiscounted, an episode's terms are (γ − 1) b a step, and −γ b more if it terminates.
        for row in &records[1].rows {
            let ended = f64::from(u8::from(row.ending.as_str() == "terminated"));
            let expected = -0.05 * 0.5 * f64::from(row.steps) - 0.95 * 0.5 * ended;
            assert!((row.shaping - expected).abs() < 1e-9, "{row:?}");
        }
    }
}

#[test]
fn a_shift_is_added_to_the_potential() {
    let plan = lake(
        "#{ potential: closer, potential_shift: -0.75 }, #{ potential: |s| closer(s) - 0.75 },
         #{ potential: closer }",
    );
    let records = run(&plan, 0);
    assert_eq!(records[0].rows, records[1].rows);
    assert_ne!(played(&records[0]), played(&records[2]));
    let names: Vec<String> = plan.variants.iter().map(|v| v.identity().to_string()).collect();
    assert_ne!(names[0], names[2]);
}

#[test]
fn episodes_are_counted_from_1_and_each_has_its_own_potential() {
    let plan = lake(
        "#{ potential: |s, episode| closer(s) }, #{ potential: closer },
         #{ potential: |s, episode| if episode == 1 { 7.0 } else { 0.0 } },
         #{ potential: |s, episode| closer(s) / episode }",
    );
    let records = run(&plan, 1);
    assert_eq!(records[0].rows, records[1].rows, "one that does not change is a static one");
    let shaped: Vec<usize> = (0..300).filter(|&i| records[2].rows[i].shaping != 0.0).collect();
    assert_eq!(shaped, [0]);
    assert_ne!(played(&records[3]), played(&records[1]));
    adds_up(&records[3]);
    let warned = |text: &str| plan.warnings.iter().filter(|w| w.to_string().contains(text)).count();
    assert_eq!(warned("is not the same as initial values"), 1, "{:?}", plan.warnings);
}

#[test]
fn advice_that_looks_ahead_is_an_initial_value_of_actions() {
    for agent in ["q_learning", "sarsa", "expected_sarsa"] {
        for exploration in ["epsilon: 0.2", "exploration: softmax(0.1)", "exploration: ucb(0.3)"] {
            let plan = lake(&format!(
                "#{{ agent: {agent}(RATES + #{{ {exploration} }}), advice: forward }},
                 #{{ agent: {agent}(RATES + #{{ {exploration}, initial_q: forward }}) }},
                 #{{ agent: {agent}(RATES + #{{ {exploration} }}) }}"
            ));
            let records = run(&plan, 2);
            assert_eq!(played(&records[0]), played(&records[1]), "{agent}, {exploration}");
            assert!(apart(&records[0], &records[1], 0.0) < 1e-13, "{agent}, {exploration}");
            assert_ne!(played(&records[0]), played(&records[2]), "{agent}, {exploration}");
            adds_up(&records[0]);
            assert!(records[0].rows.iter().all(|row| row.shaping != 0.0));
            assert!(records[1].rows.iter().all(|row| row.shaping == 0.0));
        }
    }
}

#[test]
fn advice_adds_to_a_potential_and_bows_to_a_shield() {
    let plan = lake(
        "#{ potential: closer, advice: forward, allowed: |s, a| a != 3 || s.row == 0 },
         #{ agent: #{ initial_q: |s, a| closer(s) + forward(s, a) },
            allowed: |s, a| a != 3 || s.row == 0 },
         #{ advice: forward, clip_reward: [-1, 0.5] }",
    );
    let records = run(&plan, 5);
    assert_eq!(played(&records[0]), played(&records[1]));
    // The clip is the reward's; what advice adds comes after it.
    adds_up_to(&records[2], |native| native.clamp(-1.0, 0.5));
}

fn adds_up_to(record: &UnitRecord, learned: impl Fn(f64) -> f64) {
    for row in &record.rows {
        assert!((row.learned - learned(row.native) - row.shaping).abs() < 1e-9, "{row:?}");
    }
}

/// On-policy and undiscounted, F of an episode sums to −Φ of its first step: the played action is
/// the one bootstrapped from.
#[test]
fn the_advice_of_an_undiscounted_episode_telescopes() {
    let plan = plan_of(
        r#"experiment(#{
            env: "CliffWalking-v1", agent: sarsa(#{ alpha: 0.5, gamma: 1.0 }), episodes: 50,
            advice: |s, a| if a == 1 { 3.0 } else { 2.0 }, max_steps: 100000,
        })"#,
        &[],
    );
    for row in &run(&plan, 0)[0].rows {
        assert!(row.shaping == -3.0 || row.shaping == -2.0, "{row:?}");
    }
}

#[test]
fn a_learned_potential_keeps_the_greedy_actions() {
    let plan = plan_of(
        r#"
        let base = experiment(#{
            env: env("FrozenLake-v1", #{ is_slippery: false }),
            agent: q_learning(#{ alpha: 0.5, gamma: 0.9, epsilon: 1.0 }), episodes: 4000,
        });
        [base.with(#{ name: "plain" }), base.with(#{ name: "own", potential: learned(0.4) })]
        "#,
        &[],
    );
    let records = run(&plan, 0);
    let [plain, own] = [&records[0], &records[1]].map(|r| r.q.as_ref().unwrap());
    assert_eq!(played(&records[0]), played(&records[1]), "with ε = 1 nothing is greedy");
    assert_eq!(greedy_sets(plain), greedy_sets(own));
    for s in 0..16 {
        for a in 0..4 {
            let expected = plain.get(s, a) - 0.4 / 1.4 * plain.max(s);
            assert!((own.get(s, a) - expected).abs() < 1e-9, "{s}, {a}");
        }
    }
    adds_up(&records[1]);
}

#[test]
fn look_back_advice_is_in_the_columns_and_comes_with_a_warning() {
    let plan = lake(
        "#{ agent: sarsa(SOLID), advice: forward, advice_on: \"look_back\" },
         #{ agent: n_step_sarsa(#{ n: 4 }), advice: forward, advice_on: \"look_back\" },
         #{ agent: sarsa(SOLID) }",
    );
    let warnings: Vec<String> = plan.warnings.iter().map(ToString::to_string).collect();
    for (warning, agent) in warnings.iter().zip(["sarsa", "n_step_sarsa"]) {
        let expected = format!("with `{agent}` look-back advice can change which policy is best");
        assert!(warning.contains(&expected), "{warning}");
    }
    assert_eq!(warnings.len(), 2);
    let records = run(&plan, 0);
    records.iter().for_each(adds_up);
    assert_ne!(played(&records[0]), played(&records[2]));
}

/// A potential that comes to rest leaves what it leaves at rest.
#[test]
fn what_is_learned_under_a_potential_that_settles() {
    let plan = plan_of(
        r#"
        fn closer(s) { 1.0 - 0.05 * (s.row + s.col) }
        let base = experiment(#{
            env: env("FrozenLake-v1", #{ is_slippery: false }),
            agent: q_learning(#{ alpha: 0.5, gamma: 0.9, epsilon: 1.0 }), episodes: 6000,
        });
        [
            base.with(#{ name: "plain" }),
            base.with(#{ name: "moving", potential: |s, i| closer(s) * (1.0 + 0.99 ** i) }),
        ]
        "#,
        &[],
    );
    let records = run(&plan, 0);
    let [plain, moving] = [&records[0], &records[1]].map(|r| r.q.as_ref().unwrap());
    // Holes and the goal are no states to act in.
    for s in (0..16).filter(|s| ![5, 7, 11, 12, 15].contains(s)) {
        for a in 0..4 {
            let phi = 1.0 - 0.05 * (s / 4 + s % 4) as f64;
            assert!((moving.get(s, a) + phi - plain.get(s, a)).abs() < 1e-9, "{s}, {a}");
        }
    }
}

/// What `check` prints of the kinds, and what the audit says of them.
#[test]
fn the_kinds_are_described_and_judged() {
    let script = r#"
        let base = experiment(#{ env: "FrozenLake-v1", agent: sarsa(), episodes: 10, seeds: 1 });
        [
            base.with(#{ name: "moving", potential: |s, episode| 1.0 / episode }),
            base.with(#{ name: "shifted", potential_shift: 0.5 }),
            base.with(#{ name: "advised", advice: |s, a| 0.5 * a }),
            base.with(#{ name: "back", advice: |s, a| 0.5 * a, advice_on: "look_back" }),
            base.with(#{ name: "own", potential: learned(0.5) }),
            base.with(#{ name: "returns", agent: monte_carlo(), advice: |s, a| 0.5 * a,
                         advice_on: "look_back" }),
        ]"#;
    let dir = folder();
    let path = write(dir.path(), "kinds.rhai", script);
    let output = run_command(&["check", path.to_str().unwrap()]);
    expect_code(&output, 0);
    let text = stdout(&output);
    for line in [
        "potential    closure (line 4), of every episode, tabulated over the states",
        "shift        0.5 added to Φ, except of terminal states",
        "advice       closure (line 6), looking ahead, choices corrected by it",
        "advice       closure (line 7), looking back",
        "potential    0.5 times the agent's own state values",
    ] {
        assert!(text.contains(line), "{line} is not in\n{text}");
    }
    let plan = plan_of(script, &[]);
    let host = Host::open(&plan).unwrap();
    let judged = plan.variants.iter().map(|v| audit_variant(&host, v, None).unwrap());
    let judged: Vec<_> = judged.map(|a| (a.verdict.as_str(), a.policy_preserved)).collect();
    let fine = ("potential-based", Some(true));
    assert_eq!(judged, [fine, fine, fine, ("inconclusive", None), fine, fine]);
}

/// V as `show` pictures it is that of the environment, whatever the kind.
#[test]
fn pictures_undo_the_shaping() {
    let dir = folder();
    let results = stored(
        dir.path(),
        r#"
        let base = experiment(#{
            name: "plain", env: env("FrozenLake-v1", #{ is_slippery: false }), seeds: 1,
            agent: q_learning(#{ alpha: 0.5, gamma: 0.9, epsilon: 1.0 }), episodes: 4000,
        });
        study("kinds", [
            base,
            base.with(#{ name: "shifted", potential_shift: -0.5 }),
            base.with(#{ name: "own", potential: learned(0.4), potential_shift: 2.0 }),
            base.with(#{ name: "advised", advice: |s, a| 0.5 * a }),
            base.with(#{ name: "moving", potential: |s, i| s.row * (1.0 + 0.99 ** i) }),
        ])"#,
    );
    let values = |variant: &str| -> Vec<Option<f64>> {
        let results = results.to_str().unwrap();
        let output = run_command(&["show", results, "--json", "--value", "--variant", variant]);
        expect_code(&output, 0);
        let all: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
        let rows = all["pictures"][0]["rows"].as_array().unwrap().clone();
        rows.iter().flat_map(|row| row.as_array().unwrap().clone()).map(|x| x.as_f64()).collect()
    };
    let plain = values("plain");
    assert_eq!(plain.iter().flatten().count(), 11, "{plain:?}");
    for variant in ["shifted", "own", "advised", "moving"] {
        for (a, b) in values(variant).iter().zip(&plain) {
            let same = match (a, b) {
                (Some(a), Some(b)) => (a - b).abs() < 1e-6,
                (a, b) => a.is_none() && b.is_none(),
            };
            assert!(same, "{variant}: {a:?} instead of {b:?}");
        }
    }
}
