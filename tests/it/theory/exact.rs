//! Shaping by a potential leaves `Q_F + Φ = Q` for ever (Ng, Harada & Russell 1999), sweep by sweep
//! of value iteration too.

use proptest::prelude::*;
use runner::learn::planning::{Dynamics, Over, Problem};
use runner::learn::{QTable, greedy_set};
use runner::mdp::FiniteMdp;
use runner::shaping::{potential_term, shaped_model};

use super::{environments, random_model, random_numbers, reachable, scale, solve};

/// The error of `Q_F + Φ = Q` and of the advantages, relative to the size of the numbers, and how
/// many states have greedy sets that differ, and that rounding might blur.
struct Comparison {
    identity: f64,
    advantages: f64,
    wrong: usize,
    blurred: usize,
}

fn compare(mdp: &FiniteMdp, shaped: &FiniteMdp, gamma: f64, phi: &[f64]) -> Comparison {
    let (q, q_shaped) = (solve(mdp, gamma, &vec![0.0; phi.len()]), solve(shaped, gamma, phi));
    let f: Vec<f64> = shaped.outcomes().iter().map(|o| o.reward).collect();
    let size = scale(q.values()).max(scale(phi)).max(scale(&f)).max(scale(q_shaped.values()));
    let mut found = Comparison { identity: 0.0, advantages: 0.0, wrong: 0, blurred: 0 };
    let advantage = |q: &QTable, s, a| q.get(s, a) - q.max(s);
    for s in reachable(mdp) {
        for a in 0..mdp.n_actions() {
            let error = (q_shaped.get(s, a) + phi[s] - q.get(s, a)).abs();
            found.identity = found.identity.max(error / size);
            let error = (advantage(&q_shaped, s, a) - advantage(&q, s, a)).abs();
            found.advantages = found.advantages.max(error / size);
        }
        let blurs = |a| (1e-11 * size..1e-8 * size).contains(&-advantage(&q, s, a));
        if (0..mdp.n_actions()).any(blurs) {
            found.blurred += 1;
        } else if greedy_set(q.row(s), size) != greedy_set(q_shaped.row(s), size) {
            found.wrong += 1;
        }
    }
    found
}

#[test]
fn a_potential_changes_no_advantage_on_any_environment() {
    for model in environments() {
        let gammas = [0.9, 0.99, 1.0];
        let gammas = &gammas[..if model.undiscounted { 3 } else { 2 }];
        for (&gamma, size) in gammas.iter().flat_map(|g| [1.0, 100.0, 1e3, 1e6].map(|s| (g, s))) {
            let phi = random_numbers(7, model.mdp.n_states(), size);
            let shaped = shaped_model(&model.mdp, gamma, &phi);
            let found = compare(&model.mdp, &shaped, gamma, &phi);
            let case = format!("{}, γ = {gamma}, |Φ| = {size}", model.name);
            assert!(found.identity <= 1e-9, "{case}: {}", found.identity);
            assert!(found.advantages <= 1e-9, "{case}: {}", found.advantages);
            assert_eq!(found.wrong, 0, "{case}");
            assert!(found.blurred == 0 || size >= 1e3, "{case}: {} states", found.blurred);
        }
    }
}

/// The control: a γ of its own, and Φ kept in terminal states.
#[test]
fn what_is_no_potentials_difference_fails_on_every_environment() {
    for model in environments() {
        let gamma = 0.99;
        let phi = random_numbers(7, model.mdp.n_states(), 1.0);
        let wrong_gamma = shaped_model(&model.mdp, 0.9, &phi);
        let kept = model.mdp.with_rewards(|s, _, o| {
            o.reward + potential_term(gamma, phi[s], phi[o.next_state as usize])
        });
        for shaped in [wrong_gamma, kept] {
            let found = compare(&model.mdp, &shaped, gamma, &phi);
            assert!(found.identity > 1e-5, "{}: {}", model.name, found.identity);
        }
    }
}

/// `max |V_F + Φ − V|` over `sweeps` sweeps of value iteration from `v0 − Φ` and from `v0`.
fn drift(mdp: &FiniteMdp, phi: &[f64], gamma: f64, sweeps: usize, start: f64) -> f64 {
    let shaped = shaped_model(mdp, gamma, phi);
    let dynamics = Dynamics::new(mdp, Over::Reachable);
    let (rewards, shaped) = (dynamics.rewards(mdp), dynamics.rewards(&shaped));
    let plain = Problem { dynamics: &dynamics, rewards: &rewards, gamma, allowed: None };
    let shaped = Problem { rewards: &shaped, ..plain };
    let phi: Vec<f64> = (0..dynamics.len()).map(|place| phi[dynamics.state(place)]).collect();
    let mut v = vec![0.0; phi.len()];
    let mut v_shaped: Vec<f64> = phi.iter().map(|phi| start * phi).collect();
    let mut worst = 0.0f64;
    for _ in 0..sweeps {
        (v, v_shaped) = (plain.sweep(&v), shaped.sweep(&v_shaped));
        for ((v, v_shaped), phi) in v.iter().zip(&v_shaped).zip(&phi) {
            worst = worst.max((v_shaped + phi - v).abs() / v.abs().max(1.0));
        }
    }
    worst
}

#[test]
fn shaped_sweeps_are_plain_sweeps_minus_phi_with_any_gamma() {
    for model in environments() {
        for gamma in [0.99, 1.0] {
            let phi = random_numbers(3, model.mdp.n_states(), 1.0);
            let error = drift(&model.mdp, &phi, gamma, 2_000, -1.0);
            // Undiscounted, rounding errors add up: thirds do not sum to 1.
            let bound = if gamma < 1.0 { 1e-13 } else { 1e-12 };
            assert!(error < bound, "{}, γ = {gamma}: {error}", model.name);
            // The control: from another start they differ.
            assert!(drift(&model.mdp, &phi, gamma, 3, 0.0) > 0.1, "{}", model.name);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn a_potential_changes_no_advantage_on_any_model(
        seed: u64,
        n in 1..40usize,
        size in prop::sample::select(vec![0.0, 1.0, 1e3, 1e6]),
        gamma in prop::sample::select(vec![0.5, 0.9, 0.99, 1.0]),
    ) {
        let (mdp, phi) = (random_model(seed, n), random_numbers(seed, n, size));
        let found = compare(&mdp, &shaped_model(&mdp, gamma, &phi), gamma, &phi);
        prop_assert!(found.identity <= 1e-9 && found.advantages <= 1e-9);
        prop_assert_eq!(found.wrong, 0);
        prop_assert!(drift(&mdp, &phi, gamma, 200, -1.0) <= 1e-13 * size.max(1.0));
    }
}

/// In the average-reward setting `Φ(s′) − Φ(s)` adds nothing to any policy's gain; `γΦ(s′) − Φ(s)`
/// adds `(γ − 1) E Φ`, which can change which policy is best.
#[test]
fn average_rewards_want_a_potential_without_gamma() {
    // A policy that stays where it pays 1, Φ = 10, against one that stays where it pays 0.99, Φ = 0.
    let gain = |gamma, reward: f64, phi| reward + potential_term(gamma, phi, phi);
    assert_eq!((gain(1.0, 1.0, 10.0), gain(1.0, 0.99, 0.0)), (1.0, 0.99));
    assert!(gain(0.9, 1.0, 10.0) < gain(0.9, 0.99, 0.0));
    // Any chain: a random one without endings, its stationary distribution by iteration.
    let n = 12;
    let (mdp, phi) = (random_model(5, n), random_numbers(5, n, 1.0));
    let next = |s: usize| mdp.of(s, 0).iter().filter(|o| !o.terminated);
    let lazy = |mu: &[f64]| {
        let mut to: Vec<f64> = mu.iter().map(|x| 0.5 * x).collect();
        for (s, mass) in mu.iter().enumerate() {
            next(s).for_each(|o| to[o.next_state as usize] += 0.5 * mass * o.probability / 0.95);
        }
        to
    };
    let mut mu = vec![1.0 / n as f64; n];
    for _ in 0..20_000 {
        mu = lazy(&mu);
    }
    let added = |gamma: f64| -> f64 {
        let of = |s: usize| next(s).map(move |o| (s, o.probability / 0.95, o.next_state as usize));
        let terms = (0..n).flat_map(of);
        terms.map(|(s, p, t)| mu[s] * p * potential_term(gamma, phi[s], phi[t])).sum()
    };
    let mean: f64 = mu.iter().zip(&phi).map(|(mu, phi)| mu * phi).sum();
    assert!(added(1.0).abs() < 1e-14, "{}", added(1.0));
    assert!((added(0.9) + 0.1 * mean).abs() < 1e-14);
    assert!(mean.abs() > 1e-3, "else there is nothing to leak");
}
