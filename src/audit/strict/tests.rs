use nalgebra::DMatrix;

use super::*;
use crate::audit::specimens::{
    lake, lake_distance, model, potential_rewards, random_model, rewards, symmetric,
};
use crate::mdp::Outcome;
use crate::mdp::streams::Stream;
use serde_json::json;

const GAMMA: f64 = 0.99;

fn run(mdp: &FiniteMdp, f: &[f64], gamma: f64) -> Strict {
    strict(mdp, f, gamma, &mdp.reachable(), None)
}

/// Random potentials of every size over random models, some of which may never end.
fn cases(each: usize, mut test: impl FnMut(&mut Stream, &FiniteMdp, f64, &[f64])) {
    let mut stream = Stream::new(1, "strict");
    for size in [1.0, 1e3, 1e6] {
        for ends in [0.0, 0.02, 0.3] {
            for gamma in [0.5, 0.9, 0.99] {
                for _ in 0..each {
                    let n = 1 + stream.below(30);
                    let mdp = random_model(&mut stream, n, ends);
                    let phi: Vec<f64> = (0..n).map(|_| size * symmetric(&mut stream)).collect();
                    test(&mut stream, &mdp, gamma, &phi);
                }
            }
        }
    }
}

#[test]
fn a_potential_is_recovered_wherever_episodes_can_be() {
    cases(20, |_, mdp, gamma, phi| {
        let (f, reachable) = (potential_rewards(mdp, gamma, phi), mdp.reachable());
        let found = strict(mdp, &f, gamma, &reachable, Some(phi));
        assert_eq!((found.finding, found.violations, found.free_constants), (Finding::Holds, 0, 0));
        let error = found.declared.unwrap().largest;
        assert!(error <= 9e-14 * found.scale.max(1.0), "{error} on {}", found.scale);
        assert!(found.certificate.is_none() && found.diagnosis.is_none());
    });
}

#[test]
fn the_difference_to_a_declared_potential_names_the_state() {
    let mdp = lake(true);
    let phi: Vec<f64> = (0..64).map(|s| -0.05 * lake_distance(s)).collect();
    let mut declared = phi.clone();
    declared[9] += 0.25;
    let f = potential_rewards(&mdp, GAMMA, &phi);
    let found = strict(&mdp, &f, GAMMA, &mdp.reachable(), Some(&declared));
    let difference = found.declared.unwrap();
    assert_eq!((found.finding, difference.state), (Finding::Holds, 9));
    assert!((difference.largest - 0.25).abs() < 1e-12);
}

#[test]
fn a_small_perturbation_of_any_transition_is_found_and_proved() {
    let mut stream = Stream::new(2, "strict");
    for ends in [0.0, 0.05, 0.3] {
        for _ in 0..60 {
            let n = 2 + stream.below(10);
            let mdp = random_model(&mut stream, n, ends);
            let phi: Vec<f64> = (0..n).map(|_| symmetric(&mut stream)).collect();
            let reachable = mdp.reachable();
            let f = potential_rewards(&mdp, GAMMA, &phi);
            for s in (0..n).filter(|&s| reachable[s]) {
                for (i, _) in leaving(&mdp, s) {
                    let mut f = f.clone();
                    f[i] += 1e-4;
                    let found = run(&mdp, &f, GAMMA);
                    // A state with one transition only has whatever Φ it takes.
                    if leaving(&mdp, s).count() == 1 {
                        continue;
                    }
                    assert_eq!(found.finding, Finding::Fails, "outcome {i} of state {s}");
                    proves(&mdp, &f, &found.certificate.unwrap());
                }
            }
        }
    }
}

/// The walks are what they say: connected, of the model, with these sums, which differ.
fn proves(mdp: &FiniteMdp, f: &[f64], proof: &Certificate) {
    for walk in [&proof.direct, &proof.detour] {
        let mut at = proof.start;
        for (k, step) in walk.steps.iter().enumerate() {
            assert_eq!(step.state, at);
            let exists = mdp.range(step.state, step.action).any(|i| {
                let o = &mdp.outcomes()[i];
                o.probability > 0.0
                    && (o.next_state as usize, o.terminated) == (step.next_state, step.terminated)
                    && (o.reward, f[i]) == (step.reward, step.shaping)
            });
            assert!(exists, "{step:?}");
            assert_eq!(step.terminated, walk.repeats_from.is_none() && k + 1 == walk.steps.len());
            at = step.next_state;
        }
        if let Some(from) = walk.repeats_from {
            assert_eq!(at, walk.steps[from].state);
        }
        // The sum, step by step, going round until nothing is left.
        let (mut sum, mut discount, mut k) = (0.0, 1.0, 0);
        while k < walk.steps.len() && discount > 1e-17 {
            sum += discount * walk.steps[k].shaping;
            discount *= GAMMA;
            k += 1;
            if k == walk.steps.len() {
                k = walk.repeats_from.unwrap_or(k);
            }
        }
        assert!((sum - walk.sum).abs() < 1e-9, "{sum} {}", walk.sum);
    }
    assert!((proof.detour.sum - proof.direct.sum - proof.gain).abs() < 1e-12);
    assert!(proof.gain.abs() > 1e-9, "{}", proof.gain);
}

#[test]
fn an_outcome_of_probability_zero_proves_nothing() {
    let go = |probability, next_state, terminated| Outcome {
        probability,
        next_state,
        reward: 0.0,
        terminated,
    };
    let mdp =
        FiniteMdp::new(&[vec![vec![go(1.0, 0, true), go(0.0, 0, false)]]], vec![1.0]).unwrap();
    assert_eq!(run(&mdp, &[-1.0, 17.0], GAMMA).finding, Finding::Holds);
    let other = FiniteMdp::new(&[vec![vec![go(0.5, 0, true), go(0.5, 0, false)]]], vec![1.0]);
    assert_eq!(run(&other.unwrap(), &[-1.0, 17.0], GAMMA).finding, Finding::Fails);
}

#[test]
fn the_size_of_the_numbers_does_not_matter() {
    let mdp = lake(false);
    for size in [1e-9, 1.0, 1e9] {
        let tiny = mdp.with_rewards(|_, _, o| size * o.reward);
        let step = rewards(&tiny, |_, _, _| -0.01 * size);
        assert_eq!(run(&tiny, &step, GAMMA).finding, Finding::Fails, "{size}");
        let phi: Vec<f64> = (0..64).map(|s| size * lake_distance(s)).collect();
        let f = potential_rewards(&tiny, GAMMA, &phi);
        assert_eq!(run(&tiny, &f, GAMMA).finding, Finding::Holds, "{size}");
    }
    let infinite = rewards(&mdp, |s, _, _| if s == 3 { f64::INFINITY } else { 0.0 });
    assert_eq!(run(&mdp, &infinite, GAMMA).finding, Finding::Inconclusive);
    let near = rewards(&mdp, |s, a, _| if (s, a) == (20, 0) { 3e-9 } else { 0.0 });
    assert_eq!(run(&mdp, &near, GAMMA).finding, Finding::Inconclusive);
}

/// A graph with γ-balanced and other cycles, ends, dead ends, and parts that only meet downstream.
fn partial_graph(stream: &mut Stream) -> FiniteMdp {
    let n = 2 + stream.below(7);
    let layered = stream.below(2) == 0;
    let density = stream.uniform();
    let mut table = Vec::new();
    for s in 0..n {
        let mut outcomes = Vec::new();
        for _ in 0..3 {
            // Between layers of two every cycle of the underlying graph is as long forth as back.
            let next = if layered { 2 * (s / 2 + 1) + stream.below(2) } else { stream.below(n) };
            let exists = next < n && stream.uniform() < density;
            outcomes.push(Outcome {
                probability: if exists { 0.3 } else { 0.0 },
                next_state: next.min(n - 1) as u32,
                reward: 0.0,
                terminated: stream.uniform() < 0.04,
            });
        }
        table.push(vec![outcomes]);
    }
    FiniteMdp::new(&table, vec![1.0 / n as f64; n]).unwrap()
}

#[test]
fn free_constants_are_the_nullity_of_the_equations() {
    let mut stream = Stream::new(3, "strict");
    let mut seen = [0; 9];
    for round in 0..600 {
        let gamma = [1.0, 0.9, 0.5][round % 3];
        let mdp = partial_graph(&mut stream);
        let n = mdp.n_states();
        let mut rows = Vec::new();
        for s in 0..n {
            for (_, o) in leaving(&mdp, s) {
                let mut row = vec![0.0; n];
                row[s] -= 1.0;
                if !o.terminated {
                    row[o.next_state as usize] += gamma;
                }
                rows.extend(row);
            }
        }
        let matrix = DMatrix::from_row_slice(rows.len() / n, n, &rows);
        let rank = if rows.is_empty() { 0 } else { matrix.rank(1e-9) };
        let phi: Vec<f64> = (0..n).map(|_| symmetric(&mut stream)).collect();
        let f = potential_rewards(&mdp, gamma, &phi);
        let found = strict(&mdp, &f, gamma, &vec![true; n], Some(&phi));
        assert_eq!(found.free_constants, n - rank, "round {round}, gamma {gamma}: {mdp:?}");
        assert_eq!(found.finding, Finding::Holds, "round {round}: {found:?}");
        // What is free was chosen to be what was declared.
        assert!(found.declared.unwrap().largest < 1e-9, "round {round}: {found:?}");
        seen[found.free_constants] += 1;
    }
    assert!(seen[..4].iter().all(|&count| count > 20), "{seen:?}");
}

/// Every terminal state a potential of its own, and the discount of the shaping another.
fn mistaken(mdp: &FiniteMdp, gamma: f64, phi: &[f64]) -> Vec<f64> {
    rewards(mdp, |s, _, o| gamma * phi[o.next_state as usize] - phi[s])
}

#[test]
fn a_terminal_potential_is_named() {
    for slippery in [false, true] {
        let mdp = lake(slippery);
        let phi: Vec<f64> = (0..64).map(|s| -0.1 * lake_distance(s) - 2.0).collect();
        let found = run(&mdp, &mistaken(&mdp, GAMMA, &phi), GAMMA);
        assert_eq!(found.finding, Finding::Fails);
        let diagnosis = found.diagnosis.unwrap();
        assert!(!diagnosis.ambiguous);
        assert_eq!((diagnosis.gamma, diagnosis.common()), (GAMMA, None));
        let states: Vec<usize> = diagnosis.terminals.iter().map(|t| t.state).collect();
        assert_eq!(states, [19, 29, 35, 41, 42, 46, 49, 52, 54, 59, 63]);
        for t in &diagnosis.terminals {
            assert!((t.phi - phi[t.state]).abs() < 1e-9, "{t:?}");
        }
        let reachable = mdp.reachable();
        for s in (0..64).filter(|&s| reachable[s]) {
            assert!((diagnosis.potential[s] - phi[s]).abs() < 1e-9, "{s}");
        }

        // A constant everywhere, terminals included, is a hidden cost of living.
        let constant = run(&mdp, &mistaken(&mdp, GAMMA, &[1.0; 64]), GAMMA).diagnosis.unwrap();
        assert!((constant.common().unwrap() - 1.0).abs() < 1e-9);
    }
}

#[test]
fn another_discount_is_named() {
    let mdp = lake(true);
    let phi: Vec<f64> = (0..64).map(|s| 0.0714 * (14.0 - lake_distance(s))).collect();
    for gamma in [1.0, 0.95, 0.9, 1.0 / GAMMA, 0.123_456_789] {
        let found = run(&mdp, &potential_rewards(&mdp, gamma, &phi), GAMMA);
        assert_eq!(found.finding, Finding::Fails);
        let diagnosis = found.diagnosis.unwrap_or_else(|| panic!("γ_F = {gamma}"));
        assert!((diagnosis.gamma - gamma).abs() < 1e-9, "{} {gamma}", diagnosis.gamma);
        assert!(diagnosis.terminals.is_empty());
    }
    // Differences of Φ that go on to the terminal states: both mistakes at once.
    let both = run(&mdp, &mistaken(&mdp, 1.0, &phi), GAMMA).diagnosis.unwrap();
    assert_eq!((both.gamma, both.ambiguous), (1.0, true));
    let goal = both.terminals.last().unwrap();
    assert_eq!((goal.state, goal.phi), (63, 0.0));
    for t in &both.terminals {
        assert!((t.phi - (phi[t.state] - phi[63])).abs() < 1e-9, "{t:?}");
    }
}

#[test]
fn no_mistake_is_named_that_was_not_made() {
    let mdp = lake(true);
    let step_onto = rewards(&mdp, |_, _, o| if o.next_state == 10 { 1.0 } else { 0.0 });
    let found = run(&mdp, &step_onto, GAMMA);
    assert_eq!((found.finding, found.diagnosis), (Finding::Fails, None));
}

#[test]
fn without_an_end_the_walks_go_round_for_ever() {
    let go = |next_state| Outcome { probability: 1.0, next_state, reward: 0.0, terminated: false };
    // Round 0 1 2, or a short cut from 1 back to 0.
    let mdp = FiniteMdp::new(
        &[vec![vec![go(1)]; 2], vec![vec![go(2)], vec![go(0)]], vec![vec![go(0)]; 2]],
        vec![1.0, 0.0, 0.0],
    )
    .unwrap();
    let f = rewards(&mdp, |s, a, _| if (s, a) == (1, 1) { 1.0 } else { 0.0 });
    let found = run(&mdp, &f, 0.9);
    assert_eq!((found.finding, found.transitions), (Finding::Fails, 6));
    let proof = found.certificate.unwrap();
    assert!(proof.direct.repeats_from.is_some() && proof.detour.repeats_from.is_some());
    assert!(proof.gain.abs() > 0.1, "{proof:?}");
    // Undiscounted, the two ways round end where they began, and should both pay nothing.
    let found = run(&mdp, &f, 1.0);
    let proof = found.certificate.unwrap();
    assert_eq!((proof.direct.repeats_from, proof.detour.repeats_from), (None, None));
    assert_eq!(proof.gain.abs(), 1.0);
}

#[test]
fn the_bonus_for_a_pickup_is_refuted_by_setting_down_and_picking_up_again() {
    let taxi = model("Taxi-v4", &json!({}));
    let f = rewards(&taxi, |_, a, o| if a == 4 && o.reward == -1.0 { 2.0 } else { 0.0 });
    let found = run(&taxi, &f, GAMMA);
    assert_eq!((found.violations, found.transitions), (1392, 2400));
    let proof = found.certificate.unwrap();
    proves(&taxi, &f, &proof);
    assert_eq!((proof.direct.sum, proof.detour.sum), (0.0, 1.98));
    let first: Vec<usize> = proof.detour.steps[..2].iter().map(|step| step.action).collect();
    assert_eq!(first, [5, 4]);
    assert_eq!(proof.direct.steps.len() + proof.detour.steps.len(), 12);
}
