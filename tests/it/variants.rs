//! The kinds of shaping as a script's user meets them: what a run is equal to by theorem, what
//! stands in the columns, what is refused and what is warned of.

use std::sync::atomic::AtomicBool;

use runner::experiment::{UnitRecord, run_unit};
use runner::learn::greedy_sets;
use runner::script::{Host, Plan};

use crate::language::plan_of;

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
