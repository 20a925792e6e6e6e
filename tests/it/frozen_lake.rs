//! FrozenLake, exactly: shaping by a potential leaves the optimal actions and `Q + Φ` what they
//! were, and the same check fails on shapings that are wrong.

use runner::audit::{Preservation, Verdict, preservation};
use runner::env::make;
use runner::learn::planning::{Planner, PolicyIteration, ValueIteration};
use runner::learn::{QTable, greedy_sets};
use runner::mdp::{FiniteMdp, Schema};
use runner::shaping::shaped_model;
use serde_json::json;

const GAMMA: f64 = 0.99;

fn lake(kwargs: &serde_json::Value) -> (FiniteMdp, Schema) {
    let env = make("FrozenLake-v1", kwargs.as_object().unwrap()).unwrap();
    ((**env.finite().unwrap()).clone(), env.schema())
}

/// `-scale` times the distance to the goal in the lower right corner.
fn distance(schema: &Schema, scale: f64) -> Vec<f64> {
    let grid = schema.grid.as_ref().unwrap();
    let (rows, cols) = (grid.rows.len(), grid.rows[0].len());
    (0..rows * cols)
        .map(|s| -scale * ((rows - 1 - s / cols) + (cols - 1 - s % cols)) as f64)
        .collect()
}

/// Value iteration, the shaped model from −Φ.
fn solve(mdp: &FiniteMdp, phi: &[f64]) -> QTable {
    let v0: Vec<f64> = phi.iter().map(|x| -x).collect();
    let planner = ValueIteration { gamma: GAMMA, theta: 1e-13, max_sweeps: 100_000 };
    let solution = planner.solve(mdp, &v0).unwrap();
    assert!(solution.converged);
    solution.q
}

/// The map with the greedy set of each state that is played in.
fn map(schema: &Schema, mdp: &FiniteMdp, q: &QTable) -> String {
    let grid = schema.grid.as_ref().unwrap();
    let (sets, reachable) = (greedy_sets(q), mdp.reachable());
    let cols = grid.rows[0].len();
    let cell = |s: usize| {
        if reachable[s] {
            sets[s].iter().map(|&a| grid.arrows[a]).collect()
        } else {
            grid.rows[s / cols][s % cols..=s % cols].to_string()
        }
    };
    let rows = (0..grid.rows.len()).map(|r| {
        let cells: Vec<String> = (0..cols).map(|c| format!("{:<4}", cell(r * cols + c))).collect();
        cells.concat().trim_end().to_string()
    });
    rows.collect::<Vec<_>>().join("\n")
}

fn cases() -> Vec<serde_json::Value> {
    let mut cases = Vec::new();
    for map_name in ["4x4", "8x8"] {
        for is_slippery in [true, false] {
            cases.push(json!({ "map_name": map_name, "is_slippery": is_slippery }));
        }
    }
    cases
}

#[test]
fn value_iteration_keeps_the_greedy_sets_and_q_plus_phi() {
    for kwargs in cases() {
        let (mdp, schema) = lake(&kwargs);
        let reachable = mdp.reachable();
        let plain = solve(&mdp, &vec![0.0; mdp.n_states()]);
        for scale in [0.01, 0.05, 1.0, 1000.0] {
            let phi = distance(&schema, scale);
            let shaped = solve(&shaped_model(&mdp, GAMMA, &phi), &phi);
            let size = phi.iter().fold(1.0f64, |m, x| m.max(x.abs()));
            for s in (0..mdp.n_states()).filter(|&s| reachable[s]) {
                for a in 0..mdp.n_actions() {
                    let error = (shaped.get(s, a) + phi[s] - plain.get(s, a)).abs();
                    assert!(
                        error <= 1e-9 * size,
                        "{kwargs} scale {scale}: Q({s}, {a}) off by {error}"
                    );
                }
                let set = |q: &QTable| runner::learn::greedy_set(q.row(s), size);
                assert_eq!(set(&plain), set(&shaped), "{kwargs} scale {scale}: state {s}");
            }
        }
    }
}

#[test]
fn the_audit_agrees_on_every_case() {
    for kwargs in cases() {
        let (mdp, schema) = lake(&kwargs);
        for scale in [0.05, 1.0, 100.0] {
            let phi = distance(&schema, scale);
            let result = judge(&mdp, &shaped_model(&mdp, GAMMA, &phi), &phi);
            assert_eq!(result.verdict, Verdict::Preserved, "{kwargs} scale {scale}");
            assert!(result.identity_holds(), "{kwargs} scale {scale}: {}", result.identity_error);
        }
    }
}

fn judge(plain: &FiniteMdp, shaped: &FiniteMdp, phi: &[f64]) -> Preservation {
    preservation(plain, shaped, GAMMA, phi).unwrap()
}

#[test]
fn a_terminal_potential_fails_the_check() {
    let (mdp, schema) = lake(&json!({ "map_name": "8x8" }));
    let phi = distance(&schema, 0.05);
    // The mistake of many tutorials: Φ of the terminal state is kept. Holes lie closer to the goal
    // than the start, so that drowning is paid for.
    let wrong = mdp.with_rewards(|s, _, o| o.reward + GAMMA * phi[o.next_state as usize] - phi[s]);
    let result = judge(&mdp, &wrong, &phi);
    assert!(!result.identity_holds());
    assert_eq!(result.verdict, Verdict::Changed);
}

#[test]
fn a_wrong_gamma_fails_the_check() {
    let (mdp, schema) = lake(&json!({ "map_name": "8x8" }));
    let phi = distance(&schema, 0.05);
    let result = judge(&mdp, &shaped_model(&mdp, 1.0, &phi), &phi);
    assert!(!result.identity_holds());
    assert_eq!(result.verdict, Verdict::Changed);
}

/// Figures confirmed against NumPy: greedy sets that differ under shapings that are taught.
#[test]
fn taught_rewards_change_as_many_states_as_they_should() {
    let changed = |slippery: bool, f: &dyn Fn(usize, usize, bool, f64) -> f64| {
        let (mdp, _) = lake(&json!({ "map_name": "8x8", "is_slippery": slippery }));
        let wrong = mdp
            .with_rewards(|s, _, o| o.reward + f(s, o.next_state as usize, o.terminated, o.reward));
        let states = judge(&mdp, &wrong, &vec![0.0; 64]).states_changed.len();
        (states, mdp.reachable().iter().filter(|r| **r).count())
    };
    let d = |s: usize| ((7 - s / 8) + (7 - s % 8)) as f64;
    // +0.1 per step of progress, on dry land.
    assert_eq!(changed(false, &|s, t, _, _| 0.1 * (d(s) - d(t)).max(0.0)), (5, 53));
    // A step cost: harmless on dry land, harmful on ice.
    assert_eq!(changed(false, &|_, _, _, _| -0.01), (0, 53));
    assert_eq!(changed(true, &|_, _, _, _| -0.01), (26, 53));
    // A penalty for holes, on ice.
    let hole =
        |_: usize, _: usize, terminated: bool, r: f64| f64::from(u8::from(terminated && r == 0.0));
    assert_eq!(changed(true, &|s, t, e, r| -hole(s, t, e, r)), (6, 53));
}

#[test]
fn value_iteration_agrees_with_policy_iteration() {
    for kwargs in cases() {
        let (mdp, _) = lake(&kwargs);
        let zero = vec![0.0; mdp.n_states()];
        let exact = PolicyIteration { gamma: GAMMA }.solve(&mdp, &zero).unwrap();
        assert!(exact.converged && exact.bound.unwrap() < 1e-12);
        let iterated = solve(&mdp, &zero);
        for s in mdp.reachable().iter().enumerate().filter(|(_, r)| **r).map(|(s, _)| s) {
            for (a, b) in exact.q.row(s).iter().zip(iterated.row(s)) {
                assert!((a - b).abs() < 1e-10);
            }
        }
    }
}

/// Sweep by sweep, shaped value iteration from −Φ is plain value iteration from 0, minus Φ.
#[test]
fn shaped_sweeps_are_plain_sweeps_minus_phi() {
    let (mdp, schema) = lake(&json!({ "map_name": "8x8" }));
    let phi = distance(&schema, 1.0);
    let shaped_mdp = shaped_model(&mdp, GAMMA, &phi);
    let minus: Vec<f64> = phi.iter().map(|x| -x).collect();
    let reachable = mdp.reachable();
    for max_sweeps in [1, 2, 5, 20, 100, 2000] {
        let planner = ValueIteration { gamma: GAMMA, theta: 0.0, max_sweeps };
        let plain = planner.solve(&mdp, &vec![0.0; 64]).unwrap();
        let shaped = planner.solve(&shaped_mdp, &minus).unwrap();
        for s in (0..64).filter(|&s| reachable[s]) {
            assert!(
                (shaped.v[s] + phi[s] - plain.v[s]).abs() < 1e-12,
                "sweep {max_sweeps}, state {s}"
            );
        }
    }
}

#[test]
fn optimal_actions_of_the_4x4_lake() {
    let (mdp, schema) = lake(&json!({ "map_name": "4x4" }));
    insta::assert_snapshot!(map(&schema, &mdp, &solve(&mdp, &[0.0; 16])));
    let (mdp, schema) = lake(&json!({ "map_name": "4x4", "is_slippery": false }));
    insta::assert_snapshot!(map(&schema, &mdp, &solve(&mdp, &[0.0; 16])));
}

#[test]
fn optimal_actions_of_the_8x8_lake_plain_and_shaped() {
    let (mdp, schema) = lake(&json!({ "map_name": "8x8" }));
    let phi = distance(&schema, 0.05);
    let plain = map(&schema, &mdp, &solve(&mdp, &[0.0; 64]));
    let shaped = map(&schema, &mdp, &solve(&shaped_model(&mdp, GAMMA, &phi), &phi));
    assert_eq!(plain, shaped);
    insta::assert_snapshot!(plain);
}
