//! Values known beforehand: by hand, by theorem, or by another method.

use proptest::prelude::*;

use super::*;
use crate::mdp::{Action, FiniteMdp, Outcome};

fn outcome(probability: f64, next_state: u32, reward: f64, terminated: bool) -> Outcome {
    Outcome { probability, next_state, reward, terminated }
}

/// Each of two states exits with reward 1 with probability 1/2, else moves to the other for 0:
/// V = 1/2 + γ/2 V, so V = 1 / (2 − γ).
#[test]
fn a_two_state_chain_by_hand() {
    let row = |to| vec![vec![outcome(0.5, to, 1.0, true), outcome(0.5, to, 0.0, false)]];
    let mdp = FiniteMdp::new(&[row(1), row(0)], vec![1.0, 0.0]).unwrap();
    for (gamma, expected) in [(0.9, 1.0 / 1.1), (1.0, 1.0)] {
        for policy in [Policy::Deterministic(&[0, 0]), Policy::Uniform] {
            let value = policy_value(&mdp, gamma, policy, Over::Every).unwrap();
            for v in value.v {
                assert!((v - expected).abs() < 1e-15);
            }
            assert!(value.bound < 1e-13);
        }
    }
}

/// The random walk of Sutton & Barto, example 6.2: the chance to leave on the right is s / (n + 1),
/// the expected number of steps s (n + 1 − s).
fn random_walk(n: usize) -> FiniteMdp {
    let table: Vec<_> = (0..n)
        .map(|s| {
            let left = outcome(0.5, s.saturating_sub(1) as u32, 0.0, s == 0);
            let right = outcome(0.5, (s + 1).min(n - 1) as u32, f64::from(s + 1 == n), s + 1 == n);
            vec![vec![left, right]]
        })
        .collect();
    let mut initial = vec![0.0; n];
    initial[n / 2] = 1.0;
    FiniteMdp::new(&table, initial).unwrap()
}

#[test]
fn the_random_walk_undiscounted_small_and_large() {
    for n in [5, 63, 64, 65, 500] {
        let mdp = random_walk(n);
        let value = policy_value(&mdp, 1.0, Policy::Uniform, Over::Reachable).unwrap();
        let error = |(i, v): (usize, &f64)| (v - (i + 1) as f64 / (n + 1) as f64).abs();
        let error = value.v.iter().enumerate().map(error).fold(0.0, f64::max);
        assert!(error <= value.bound, "{n}: off by {error}, bound {}", value.bound);
        assert!(value.bound < 1e-15 * (n * n) as f64, "{n}: {}", value.bound);
        let costly = mdp.with_rewards(|_, _, _| -1.0);
        let steps = policy_value(&costly, 1.0, Policy::Uniform, Over::Reachable).unwrap();
        for (i, v) in steps.v.iter().enumerate() {
            let expected = -((i + 1) as f64 * (n - i) as f64);
            assert!((v - expected).abs() <= 1e-9 * expected.abs(), "{n}, {i}: {v}");
        }
    }
}

/// Discounted, V(s) = (x^s − x^−s) / (x^N − x^−N) with x the root of x = γ/2 (x² + 1), s from 1,
/// N = n + 1, and 1/γ times that as the last reward is not discounted: x^(N − s) / γ near the right
/// end.
#[test]
fn the_random_walk_discounted() {
    let mdp = random_walk(3_000);
    for gamma in [0.9, 0.99, 0.999] {
        let value = policy_value(&mdp, gamma, Policy::Uniform, Over::Reachable).unwrap();
        assert!(value.bound <= 1e-13 / (1.0 - gamma), "{gamma}: {}", value.bound);
        let x = (1.0 - (1.0 - gamma * gamma).sqrt()) / gamma;
        let mut expected = 1.0 / gamma;
        for v in value.v.iter().rev().take(1_000) {
            expected *= x;
            assert!((v - expected).abs() <= value.bound + 1e-15, "{gamma}: {v}, not {expected}");
        }
    }
}

#[test]
fn an_endless_policy_has_no_undiscounted_value() {
    let stay = |to| vec![outcome(1.0, to, -1.0, false)];
    let leave = vec![outcome(1.0, 0, -1.0, true)];
    let mdp = FiniteMdp::new(&[vec![stay(0), leave.clone()], vec![stay(1), leave]], vec![1.0, 0.0])
        .unwrap();
    let value = |gamma, policy: &[Action], over| {
        policy_value(&mdp, gamma, Policy::Deterministic(policy), over)
    };
    assert_eq!(value(1.0, &[0, 1], Over::Every), Err(PlanError::Endless(vec![0])));
    assert!((value(0.9, &[0, 1], Over::Every).unwrap().v[0] + 10.0).abs() < 1e-12);
    // What happens where no episode gets to does not matter.
    assert_eq!(value(1.0, &[1, 0], Over::Every), Err(PlanError::Endless(vec![1])));
    assert_eq!(value(1.0, &[1, 0], Over::Reachable).unwrap().v, [-1.0, 0.0]);
    let half = policy_value(&mdp, 1.0, Policy::Uniform, Over::Every).unwrap();
    assert!((half.v[0] + 2.0).abs() < 1e-15, "two steps on average");
    let message = value(1.0, &[0, 0], Over::Every).unwrap_err().to_string();
    assert!(message.contains("stay in state 0 for ever; use gamma < 1"), "{message}");
}

#[test]
fn without_a_way_out_no_policy_is_proper() {
    let stay = vec![vec![outcome(1.0, 0, -1.0, false)]];
    let mdp = FiniteMdp::new(&[stay], vec![1.0]).unwrap();
    let solve = |gamma| PolicyIteration { gamma }.solve(&mdp, &[0.0]);
    assert_eq!(solve(1.0), Err(PlanError::NoProperPolicy(0)));
    assert!((solve(0.5).unwrap().v[0] + 2.0).abs() < 1e-12);
}

/// A corridor of 300 states, −1 a step either way: without discounting the way out is the nearer
/// end. The first greedy policy of value iteration from 0 runs in circles; this one must not.
#[test]
fn the_shortest_way_out_of_a_corridor() {
    let n = 300;
    let table: Vec<_> = (0..n)
        .map(|s| {
            let left = vec![outcome(1.0, s.max(1) - 1, -1.0, s == 0)];
            let right = vec![outcome(1.0, (s + 1).min(n - 1), -1.0, s == n - 1)];
            vec![left, right]
        })
        .collect();
    let mut initial = vec![0.0; n as usize];
    initial[17] = 1.0;
    let mdp = FiniteMdp::new(&table, initial).unwrap();
    let found = PolicyIteration { gamma: 1.0 }.solve(&mdp, &vec![0.0; n as usize]).unwrap();
    for s in 0..n {
        assert_eq!(found.v[s as usize], -f64::from((s + 1).min(n - s)));
        assert_eq!(found.policy[s as usize], usize::from(s >= n / 2));
    }
    assert!(found.converged && found.bound.is_none());
    assert_eq!(found.changes.len(), found.switched.len());
}

/// From state 0 to a loop of two states, stochastic: the second is left at once, the first with
/// probability 1/2. An episode is in them 2/3 and 1/3 of the time.
#[test]
fn the_average_of_a_recurrent_set() {
    let go = |p, to, reward| outcome(p, to, reward, false);
    let table = [
        vec![vec![go(0.5, 1, 9.0), outcome(0.5, 0, 0.0, true)]],
        vec![vec![go(0.5, 1, 1.0), go(0.5, 2, 2.0)]],
        vec![vec![go(1.0, 1, -3.0)]],
    ];
    let mdp = FiniteMdp::new(&table, vec![1.0, 0.0, 0.0]).unwrap();
    let dynamics = Dynamics::new(&mdp, Over::Reachable);
    let sets = dynamics.recurrent(Policy::Uniform);
    assert_eq!(sets, [[1, 2]]);
    let average = dynamics.average(&dynamics.rewards(&mdp), Policy::Uniform, &sets[0]).unwrap();
    assert!((average - (1.5 * 2.0 - 3.0) / 3.0).abs() < 1e-15);
    let ending = dynamics.expect(&mdp, |i| f64::from(u8::from(mdp.outcomes()[i].terminated)));
    assert_eq!(dynamics.chances(&ending, Policy::Uniform).unwrap(), [0.5, 0.0, 0.0]);
}

/// Icy ground of 40 × 40 fields, −1 a step, out at one corner: large enough for rough evaluations
/// first and for the Krylov method, discounted or not.
#[test]
fn two_ways_over_the_ice() {
    const N: i32 = 40;
    let to = |row: i32, col: i32| {
        let next = (row.clamp(0, N - 1) * N + col.clamp(0, N - 1)) as u32;
        outcome(1.0 / 3.0, next, -1.0, next == (N * N - 1) as u32)
    };
    let ways = [(0, -1), (1, 0), (0, 1), (-1, 0)];
    let slip = |s: i32, a: usize| {
        [3, 0, 1].map(|turn| ways[(a + turn) % 4]).map(|(r, c)| to(s / N + r, s % N + c)).to_vec()
    };
    let table: Vec<_> =
        (0..N * N).map(|s| (0..4).map(|a| slip(s, a)).collect::<Vec<_>>()).collect();
    let mut initial = vec![0.0; table.len()];
    initial[0] = 1.0;
    let mdp = FiniteMdp::new(&table, initial).unwrap();
    let zero = vec![0.0; table.len()];
    for gamma in [0.99, 1.0] {
        let exact = PolicyIteration { gamma }.solve(&mdp, &zero).unwrap();
        assert!(exact.converged && exact.bound.is_none_or(|bound| bound < 1e-9));
        let vi = ValueIteration { gamma, theta: 1e-12, max_sweeps: 100_000 };
        let swept = vi.solve(&mdp, &zero).unwrap();
        for s in 0..table.len() - 1 {
            assert!((exact.v[s] - swept.v[s]).abs() < 1e-8, "{gamma}, {s}");
        }
        let value =
            policy_value(&mdp, gamma, Policy::Deterministic(&exact.policy), Over::Reachable);
        assert!((value.unwrap().v[0] - exact.v[0]).abs() < 1e-9);
    }
}

/// A loop that pays has no undiscounted value; the error says where it is.
#[test]
fn a_loop_that_pays_is_named() {
    let go = |to, reward, terminated| vec![outcome(1.0, to, reward, terminated)];
    let table =
        [vec![go(1, 1.0, false), go(0, 0.0, true)], vec![go(0, -0.5, false), go(0, 0.0, true)]];
    let mdp = FiniteMdp::new(&table, vec![1.0, 0.0]).unwrap();
    let solved = PolicyIteration { gamma: 1.0 }.solve(&mdp, &[0.0; 2]);
    assert_eq!(solved, Err(PlanError::Endless(vec![0, 1])));
}

#[test]
fn the_bounds_of_value_iteration_hold() {
    let mdp = random_walk(200);
    let exact = policy_value(&mdp, 0.99, Policy::Uniform, Over::Reachable).unwrap();
    for theta in [1e-2, 1e-4, 1e-8] {
        let vi = ValueIteration { gamma: 0.99, theta, max_sweeps: 100_000 };
        let found = vi.solve(&mdp, &[0.0; 200]).unwrap();
        let pairs = found.v.iter().zip(&exact.v);
        let error = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let bound = found.bound.unwrap();
        assert!(error <= bound && bound <= theta * 99.0 + 1e-15, "{theta}: {error}, {bound}");
    }
}

/// A random model: from each state and action to up to three states; some steps end.
fn models(n_states: usize) -> impl Strategy<Value = FiniteMdp> {
    let list = prop::collection::vec(
        (0.1..1.0f64, 0..n_states as u32, -1.0..1.0f64, prop::bool::weighted(0.1)),
        1..=3,
    );
    prop::collection::vec(prop::collection::vec(list, 2), n_states).prop_map(|table| {
        let pack = |list: &Vec<(f64, u32, f64, bool)>| {
            let total: f64 = list.iter().map(|o| o.0).sum();
            list.iter().map(|&(p, to, r, end)| outcome(p / total, to, r, end)).collect()
        };
        let table: Vec<Vec<Vec<Outcome>>> =
            table.iter().map(|row| row.iter().map(pack).collect()).collect();
        let n = table.len();
        FiniteMdp::new(&table, vec![1.0 / n as f64; n]).unwrap()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// The value satisfies its equations, whatever the components look like.
    #[test]
    fn a_policys_value_solves_its_equations(
        mdp in models(150), gamma in 0.5..0.999f64, weight in 0.0..1.0f64,
    ) {
        let weights: Vec<f64> = (0..150).flat_map(|_| [weight, 1.0 - weight]).collect();
        let value = policy_value(&mdp, gamma, Policy::Stochastic(&weights), Over::Every).unwrap();
        for s in 0..150 {
            let mut sum = 0.0;
            for (a, share) in [weight, 1.0 - weight].into_iter().enumerate() {
                for o in mdp.of(s, a) {
                    let next = if o.terminated { 0.0 } else { value.v[o.next_state as usize] };
                    sum += share * o.probability * (o.reward + gamma * next);
                }
            }
            prop_assert!((sum - value.v[s]).abs() <= 1e-13 / (1.0 - gamma));
        }
        prop_assert!(value.bound <= 1e-13 / (1.0 - gamma) / (1.0 - gamma));
    }

    /// Policy iteration and value iteration find the same.
    #[test]
    fn two_ways_to_the_optimum(mdp in models(30), gamma in 0.5..0.99f64) {
        let zero = [0.0; 30];
        let exact = PolicyIteration { gamma }.solve(&mdp, &zero).unwrap();
        let vi = ValueIteration { gamma, theta: 1e-13, max_sweeps: 100_000 };
        let swept = vi.solve(&mdp, &zero).unwrap();
        for (a, b) in exact.q.values().iter().zip(swept.q.values()) {
            prop_assert!((a - b).abs() <= 1e-10);
        }
        prop_assert!(exact.bound.unwrap() <= 1e-11);
    }

    /// Sweep by sweep, shaped value iteration from V₀ − Φ is plain value iteration from V₀, minus
    /// Φ; with any γ.
    #[test]
    fn shaped_sweeps_are_plain_sweeps_minus_phi(
        mdp in models(30),
        phi in prop::collection::vec(-5.0..5.0f64, 30),
        v0 in prop::collection::vec(-5.0..5.0f64, 30),
        gamma in prop::sample::select(vec![0.5, 0.99, 1.0]),
    ) {
        let shaped = crate::shaping::shaped_model(&mdp, gamma, &phi);
        let dynamics = Dynamics::new(&mdp, Over::Every);
        let (r, r_shaped) = (dynamics.rewards(&mdp), dynamics.rewards(&shaped));
        let plain = Problem { dynamics: &dynamics, rewards: &r, gamma, allowed: None };
        let shaped = Problem { rewards: &r_shaped, ..plain };
        let mut v = v0;
        let mut v_shaped: Vec<f64> = v.iter().zip(&phi).map(|(v, phi)| v - phi).collect();
        for sweep in 0..200 {
            (v, v_shaped) = (plain.sweep(&v), shaped.sweep(&v_shaped));
            for s in 0..30 {
                let error = (v_shaped[s] + phi[s] - v[s]).abs();
                // Undiscounted, values can grow by 1 a sweep.
                let scale = v[s].abs().max(5.0);
                prop_assert!(error <= 1e-12 * scale, "sweep {}, state {}: {}", sweep, s, error);
            }
        }
    }
}
