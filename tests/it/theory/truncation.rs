//! Episodes that a time limit cuts off (Pardo et al. 2018): Φ of the last state is kept if and only
//! if it is bootstrapped from. Both right ways are exact, both wrong ways are not.
//!
//! The limit is a random one here, κ a step, so that the learner's fixed point is a model's.

use runner::learn::QTable;
use runner::mdp::{FiniteMdp, Outcome};
use runner::shaping::potential_term;

use super::{lake, minus_distance, model, random_numbers, reachable, scale, solve, wrong};

const GAMMA: f64 = 0.99;
const KAPPA: f64 = 0.02;

/// What a learner meets whose episodes are cut off with probability κ after each step. If it
/// bootstraps, the state it was cut off in is worth what it always is; else nothing.
fn cut_off(
    mdp: &FiniteMdp,
    bootstraps: bool,
    f: impl Fn(usize, &Outcome, bool) -> f64,
) -> FiniteMdp {
    let split = |s: usize, o: &Outcome| {
        let rest = Outcome {
            probability: o.probability * if o.terminated { 1.0 } else { 1.0 - KAPPA },
            reward: o.reward + f(s, o, false),
            ..*o
        };
        let cut = Outcome {
            probability: o.probability - rest.probability,
            reward: o.reward + f(s, o, true),
            terminated: o.terminated || !bootstraps,
            ..*o
        };
        [rest, cut]
    };
    let list = |s, a| mdp.of(s, a).iter().flat_map(|o| split(s, o)).collect();
    let table: Vec<Vec<Vec<_>>> =
        (0..mdp.n_states()).map(|s| (0..mdp.n_actions()).map(|a| list(s, a)).collect()).collect();
    FiniteMdp::new(&table, mdp.initial().to_vec()).unwrap()
}

/// The error of `Q_F + Φ = Q`, and the states whose greedy sets are wrong.
fn cell(mdp: &FiniteMdp, phi: &[f64], bootstraps: bool, keeps: bool) -> (f64, usize) {
    let plain = cut_off(mdp, bootstraps, |_, _, _| 0.0);
    let shaped = cut_off(mdp, bootstraps, |s, o, cut| {
        let gone = o.terminated || (cut && !keeps);
        potential_term(GAMMA, phi[s], if gone { 0.0 } else { phi[o.next_state as usize] })
    });
    let (q, q_shaped) = (solve(&plain, GAMMA, &vec![0.0; phi.len()]), solve(&shaped, GAMMA, phi));
    let states = reachable(mdp);
    let error = |q_shaped: &QTable, s: usize, a| (q_shaped.get(s, a) + phi[s] - q.get(s, a)).abs();
    let errors = states.iter().flat_map(|&s| (0..mdp.n_actions()).map(move |a| (s, a)));
    let worst = errors.map(|(s, a)| error(&q_shaped, s, a)).fold(0.0, f64::max);
    let size = scale(q.values()).max(scale(phi));
    (worst, wrong(&states, &q, &q_shaped, size).len())
}

#[test]
fn the_right_ways_are_exact() {
    let taxi = model("Taxi-v4", &serde_json::json!({}));
    for (mdp, phi) in [
        (lake(false), minus_distance()),
        (lake(true), minus_distance()),
        (taxi, random_numbers(1, 500, 10.0)),
    ] {
        for bootstraps in [true, false] {
            let (error, wrong) = cell(&mdp, &phi, bootstraps, bootstraps);
            assert!(error < 6e-12, "bootstraps: {bootstraps}: off by {error}");
            assert_eq!(wrong, 0);
        }
    }
}

/// With Φ = −distance; confirmed by NumPy.
#[test]
fn the_wrong_ways_are_wrong() {
    for (is_slippery, bootstraps, error, states) in [
        (false, true, 26.851, 51),
        (false, false, 1.780, 10),
        (true, true, 24.360, 18),
        (true, false, 2.289, 39),
    ] {
        let (found, wrong) = cell(&lake(is_slippery), &minus_distance(), bootstraps, !bootstraps);
        let case = format!("slippery: {is_slippery}, bootstraps: {bootstraps}: {found}, {wrong}");
        assert!((found - error).abs() < 5e-4, "{case}");
        assert_eq!(wrong, states, "{case}");
    }
}
