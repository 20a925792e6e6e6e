//! The toy-text environments from outside: what Gymnasium refuses is refused, and states without a
//! model can be learned in.

use std::sync::atomic::AtomicBool;

use runner::env::frozen_lake::generate_random_map;
use runner::env::{PlayedAction, Session, find_with_note};
use runner::experiment::{audit_variant, check, run_unit};
use runner::mdp::numpy::Seed;
use runner::script::Host;
use serde_json::{Map, Value, json};

use crate::language::plan_of;

fn session(id: &str, kwargs: &Value) -> Result<Session, String> {
    Session::new(id, kwargs.as_object().unwrap()).map_err(|error| error.to_string())
}

#[test]
fn what_gymnasium_refuses_is_refused() {
    // Gymnasium: KeyError and AssertionError.
    for (id, actions) in
        [("Taxi-v4", [6, -1]), ("CliffWalking-v1", [4, -1]), ("Blackjack-v1", [2, -1])]
    {
        let mut session = session(id, &json!({})).unwrap();
        let unready = session.step(&PlayedAction::Index(0)).unwrap_err();
        assert!(unready.message.contains("there was no reset before this step"), "{id}");
        session.reset(Some(&Seed::from(0)), None).unwrap();
        for action in actions {
            let error = session.step(&PlayedAction::Index(action)).unwrap_err();
            assert!(error.message.starts_with(&format!("{id} has no action {action}: ")), "{id}");
        }
        let float = session.step(&PlayedAction::Box(vec![0.0])).unwrap_err();
        assert!(float.message.contains(id), "{float}");
    }
    // Gymnasium: DeprecatedEnv, VersionNotFound; a TypeError for an argument it does not know.
    for (id, kwargs, error) in [
        ("CliffWalking-v0", json!({}), "out of date (use `CliffWalking-v1`)"),
        ("Taxi-v5", json!({}), "there is no `Taxi-v5`; there is `Taxi-v4` (use `Taxi-v4`)"),
        ("Blackjack-v1", json!({"sap": true}), "(did you mean `sab`?)"),
        ("CliffWalking-v1", json!({"slippery": true}), "(did you mean `is_slippery`?)"),
        // Gymnasium takes it, and samples from what are no probabilities.
        (
            "Taxi-v4",
            json!({"rainy_probability": 2.0, "is_rainy": true}),
            "`rainy_probability` must be between 0 and 1, not 2",
        ),
    ] {
        let got = session(id, &kwargs).unwrap_err();
        assert!(got.ends_with(error), "{got}");
    }
    // It warns of an id without version, and refuses the older one, which is understood here.
    for id in ["Taxi", "Taxi-v3"] {
        let (spec, note) = find_with_note(id).unwrap();
        assert_eq!(spec.id, "Taxi-v4");
        assert!(note.unwrap().contains("`Taxi-v4`"));
    }
    let map = |size, p| generate_random_map(size, p, &Seed::from(0));
    assert_eq!(map(4, 1.0).unwrap(), ["SFFF", "FFFF", "FFFF", "FFFG"]);
    // ValueError, IndexError; the last one gives a map without holes.
    assert!(map(8, -0.5).is_err() && map(0, 0.5).is_err() && map(8, f64::NAN).is_err());
}

/// The native return per episode at the end of training, and the audit's verdict, of each variant.
fn run(script: &str) -> Vec<(f64, &'static str, String)> {
    let plan = plan_of(script, &[]);
    check(&plan).unwrap();
    let host = Host::open(&plan).unwrap();
    plan.variants
        .iter()
        .map(|variant| {
            let record = run_unit(&host, variant, 0, &AtomicBool::new(false), &mut |_| {}).unwrap();
            let last = &record.rows[record.rows.len() - 100..];
            let mean = last.iter().map(|row| row.native).sum::<f64>() / 100.0;
            let audit = audit_variant(&host, variant, None).unwrap();
            (mean, audit.verdict.as_str(), audit.basis)
        })
        .collect()
}

#[test]
fn a_fickle_passenger_can_be_learned_with_but_not_planned_for() {
    let results = run("fn far(s) {
            0.0 - abs(s.row - s.passenger_row) - abs(s.col - s.passenger_col)
        }
        let base = experiment(#{
            name: \"base\", env: env(\"Taxi-v4\", #{ fickle_passenger: true }), episodes: 3000,
            agent: q_learning(#{ alpha: 0.5, epsilon: 0.05 }),
        });
        [
            base,
            base.with(#{ name: \"phi\", potential: far }),
            base.with(#{ name: \"reward\", reward: |t| t.reward - 0.01 * t.next_state.in_taxi }),
        ]");
    let verdicts: Vec<_> = results.iter().map(|(_, verdict, _)| *verdict).collect();
    assert_eq!(verdicts, ["unshaped", "potential-based", "not-potential-based"]);
    assert_eq!(results[1].2, "by construction: Φ is a function of the state");
    assert_eq!(results[2].2, "two ways from one state are paid differently");
    // A random policy is near -770; a ride that goes well brings about 8.
    assert!(results.iter().all(|(mean, ..)| *mean > -10.0), "{results:?}");
}

#[test]
fn a_dry_taxi_and_blackjack_are_judged_exactly() {
    for (env, potential) in [
        ("Taxi-v4", "0.0 - abs(s.row - s.passenger_row) - abs(s.col - s.passenger_col)"),
        ("Blackjack-v1", "0.1 * s.player + s.natural"),
        ("CliffWalkingSlippery-v1", "0.0 - abs(s.row - s.goal_row) - abs(s.col - s.goal_col)"),
    ] {
        let results = run(&format!(
            "let base = experiment(#{{ name: \"base\", env: \"{env}\", agent: q_learning(), \
             episodes: 100 }});
            [
                base.with(#{{ name: \"phi\", potential: |s| {potential} }}),
                base.with(#{{ name: \"bonus\", reward: |t| t.reward + t.action }}),
            ]"
        ));
        let verdicts: Vec<_> = results.iter().map(|(_, verdict, _)| *verdict).collect();
        assert_eq!(verdicts, ["potential-based", "not-potential-based"], "{env}");
    }
}

#[test]
fn a_random_map_is_played_on() {
    let plan = plan_of(
        "experiment(#{
            env: env(\"FrozenLake-v1\", #{ desc: generate_random_map(8, 0.8, 42) }),
            agent: q_learning(),
        })",
        &[],
    );
    let drawn = generate_random_map(8, 0.8, &Seed::from(42)).unwrap();
    let variant = &plan.variants[0];
    let env = variant.environment().unwrap();
    assert_eq!(env.schema().grid.unwrap().rows, drawn);
    let plain = variant.env.make(&Map::new()).unwrap();
    assert_eq!(plain.schema().grid.unwrap().rows.len(), 4);
}
