//! What the strict check says of shapings that are commonly taught, on Gymnasium's own models: how
//! many transitions contradict a potential, and the smallest models on which each mistake matters.

use runner::audit::{Advantages, Finding, Strict, Verdict, broken_task, preservation, strict};
use runner::env::make;
use runner::learn::planning::{Dynamics, Over, Planner, Policy, PolicyIteration, policy_value};
use runner::mdp::{FiniteMdp, Outcome};
use runner::shaping::shaped_model;
use serde_json::{Value, json};

const GAMMA: f64 = 0.99;

fn model(id: &str, kwargs: &Value) -> FiniteMdp {
    let env = make(id, kwargs.as_object().unwrap()).unwrap();
    (**env.finite().unwrap()).clone()
}

fn lake(is_slippery: bool) -> FiniteMdp {
    model("FrozenLake8x8-v1", &json!({ "is_slippery": is_slippery }))
}

/// One number per outcome: `reward(s, a, outcome)`.
fn rewards(mdp: &FiniteMdp, reward: impl FnMut(usize, usize, &Outcome) -> f64) -> Vec<f64> {
    mdp.with_rewards(reward).outcomes().iter().map(|o| o.reward).collect()
}

fn run(mdp: &FiniteMdp, f: &[f64], gamma: f64) -> Strict {
    strict(mdp, f, gamma, &mdp.reachable(), None)
}

/// Steps to the goal of the 8x8 lake, and of the cliff.
fn to_goal(s: usize, cols: usize, goal: usize) -> f64 {
    ((goal / cols).abs_diff(s / cols) + (goal % cols).abs_diff(s % cols)) as f64
}

#[test]
fn violations_of_terms_that_are_commonly_taught() {
    let (dry, ice) = (lake(false), lake(true));
    let (taxi, cliff) = (model("Taxi-v4", &json!({})), model("CliffWalking-v1", &json!({})));
    let nearer = |s: usize, o: &Outcome| {
        (to_goal(s, 8, 63) - to_goal(o.next_state as usize, 8, 63)).max(0.0)
    };
    let hole = |o: &Outcome| if o.terminated && o.reward == 0.0 { -1.0 } else { 0.0 };
    let progress =
        |s: usize, o: &Outcome| to_goal(s, 12, 47) - to_goal(o.next_state as usize, 12, 47);
    let pickup = |a: usize, o: &Outcome| if a == 4 && o.reward == -1.0 { 2.5 } else { 0.0 };
    for (mdp, f, expected) in [
        (&dry, rewards(&dry, |s, _, o| 0.1 * nearer(s, o)), (135, 212)),
        (&ice, rewards(&ice, |_, _, _| -0.01), (378, 630)),
        (&dry, rewards(&dry, |_, _, _| -0.01), (128, 212)),
        (&ice, rewards(&ice, |_, _, o| hole(o)), (384, 630)),
        (&taxi, rewards(&taxi, |_, a, o| pickup(a, o)), (1392, 2400)),
        (&cliff, rewards(&cliff, |s, _, o| 2.0 * progress(s, o)), (89, 148)),
    ] {
        let found = run(mdp, &f, GAMMA);
        assert_eq!((found.violations, found.transitions), expected);
        assert_eq!(found.finding, Finding::Fails);
        let proof = found.certificate.unwrap();
        assert!(proof.gain.abs() > 1e-4, "{proof:?}");
        let dynamics = Dynamics::new(mdp, Over::Reachable);
        let advantages = Advantages::new(mdp, &dynamics, &f, GAMMA).unwrap();
        assert_eq!(advantages.expected(None).finding, Finding::Fails);
        assert_eq!(advantages.scaling().finding, Finding::Fails);
        assert!(broken_task(mdp, &dynamics, &f, GAMMA).unwrap().is_some());
    }
}

#[test]
fn a_potential_of_the_passenger_has_no_violations() {
    let taxi = model("Taxi-v4", &json!({}));
    let phi: Vec<f64> = (0..500).map(|s| if s / 4 % 5 == 4 { 2.5 } else { 0.0 }).collect();
    for gamma in [0.9, GAMMA, 1.0] {
        let shaped = shaped_model(&taxi, gamma, &phi);
        let pairs = shaped.outcomes().iter().zip(taxi.outcomes());
        let f: Vec<f64> = pairs.map(|(shaped, native)| shaped.reward - native.reward).collect();
        let found = strict(&taxi, &f, gamma, &taxi.reachable(), Some(&phi));
        assert_eq!((found.finding, found.violations, found.transitions), (Finding::Holds, 0, 2400));
        assert!(found.declared.unwrap().largest < 1e-9);
    }
}

/// From s0 to one end for 1, to another for 0.5, whose potential is 0.6: Q = (1, 1.1).
#[test]
fn a_potential_of_one_end_flips_a_choice() {
    let exit = |next_state, reward| {
        vec![Outcome { probability: 1.0, next_state, reward, terminated: true }]
    };
    let mdp = FiniteMdp::new(
        &[vec![exit(1, 1.0), exit(2, 0.5)], vec![exit(1, 0.0); 2], vec![exit(2, 0.0); 2]],
        vec![1.0, 0.0, 0.0],
    )
    .unwrap();
    let phi = [3.0, 0.0, 0.6];
    let f = rewards(&mdp, |s, _, o| phi[o.next_state as usize] - phi[s]);
    let found = run(&mdp, &f, 1.0);
    assert_eq!((found.violations, found.transitions), (1, 2));
    let proof = found.certificate.unwrap();
    assert_eq!((proof.direct.steps.len(), proof.detour.steps.len()), (1, 1));
    assert!((proof.gain - 0.6).abs() < 1e-15);
    // Nothing tells which of the two ends is the one that should be 0.
    let diagnosis = found.diagnosis.unwrap();
    let [one, two] = diagnosis.terminals[..] else { panic!("two ends") };
    assert!(diagnosis.ambiguous && (two.phi - one.phi - 0.6).abs() < 1e-15);
}

/// Leave at once for 1, or with the next step for 1.2: a potential of 1 everywhere, ends included,
/// is a cost of living of 0.1, Q = (0.90, 0.89) at γ = 0.9.
#[test]
fn a_constant_that_includes_the_end_is_a_cost_of_living() {
    let go = |next_state, reward, terminated| {
        vec![Outcome { probability: 1.0, next_state, reward, terminated }]
    };
    let mdp = FiniteMdp::new(
        &[
            vec![go(2, 1.0, true), go(1, 0.0, false)],
            vec![go(2, 1.2, true); 2],
            vec![go(2, 0.0, true); 2],
        ],
        vec![1.0, 0.0, 0.0],
    )
    .unwrap();
    let f = rewards(&mdp, |_, _, _| 0.9 - 1.0);
    let found = run(&mdp, &f, 0.9);
    assert_eq!(found.finding, Finding::Fails);
    let shaped = mdp.with_rewards(|_, _, o| o.reward + 0.9 - 1.0);
    assert_eq!(preservation(&mdp, &shaped, 0.9, &[0.0; 3]).unwrap().verdict, Verdict::Changed);
    let diagnosis = found.diagnosis.unwrap();
    assert!((diagnosis.common().unwrap() - 1.0).abs() < 1e-12);
    // Taken as a potential that ends with the episode it keeps the choice.
    let mended = shaped_model(&mdp, 0.9, &diagnosis.potential);
    let kept = preservation(&mdp, &mended, 0.9, &diagnosis.potential).unwrap();
    assert_eq!(kept.verdict, Verdict::Preserved);
}

/// Differences of Φ = k (14 − d), without the learner's γ: parking at z is worth Φ(z). Beside the goal
/// that is 13k: for k = 0.1 more than the goal, and nobody goes there.
#[test]
fn differences_without_the_discount_are_named() {
    let mdp = lake(false);
    for (k, true_return) in [(0.0714, "0.878"), (0.1, "0.000")] {
        let phi: Vec<f64> = (0..64).map(|s| k * (14.0 - to_goal(s, 8, 63))).collect();
        let shaped = shaped_model(&mdp, 1.0, &phi);
        let pairs = shaped.outcomes().iter().zip(mdp.outcomes());
        let f: Vec<f64> = pairs.map(|(shaped, native)| shaped.reward - native.reward).collect();
        let found = run(&mdp, &f, GAMMA);
        assert_eq!(found.finding, Finding::Fails);
        let diagnosis = found.diagnosis.unwrap();
        assert_eq!((diagnosis.gamma, diagnosis.terminals.len()), (1.0, 0));
        let policy = PolicyIteration { gamma: GAMMA }.solve(&shaped, &[0.0; 64]).unwrap().policy;
        let played = policy_value(&mdp, GAMMA, Policy::Deterministic(&policy), Over::Reachable);
        assert_eq!(format!("{:.3}", played.unwrap().v[0]), true_return, "k = {k}");
    }
}
