//! Figures of shapings that are taught, on the exact models of Gymnasium's environments: confirmed
//! beforehand with NumPy. γ = 0.99 unless said.

use runner::audit::{
    Critical, NotSsp, Pair, PolicyChange, Preservation, SspCheck, Unsolved, Verdict,
};
use runner::env::make;
use runner::mdp::{FiniteMdp, Outcome};
use serde_json::json;

const GAMMA: f64 = 0.99;

fn model(id: &str, kwargs: &serde_json::Value) -> FiniteMdp {
    (**make(id, kwargs.as_object().unwrap()).unwrap().finite().unwrap()).clone()
}

fn lake(slippery: bool) -> FiniteMdp {
    model("FrozenLake-v1", &json!({ "map_name": "8x8", "is_slippery": slippery }))
}

fn taxi() -> FiniteMdp {
    model("Taxi-v4", &json!({}))
}

fn cliff() -> FiniteMdp {
    model("CliffWalking-v1", &json!({}))
}

/// F per outcome, from s, s′ and the outcome.
fn added(mdp: &FiniteMdp, f: impl Fn(usize, usize, &Outcome) -> f64) -> Vec<f64> {
    let states = (0..mdp.n_states()).flat_map(|s| (0..mdp.n_actions()).map(move |a| (s, a)));
    let outcomes = states.flat_map(|(s, a)| mdp.of(s, a).iter().map(move |o| (s, o)));
    outcomes.map(|(s, o)| f(s, o.next_state as usize, o)).collect()
}

/// The number of steps from a state of the 8x8 lake to the goal.
fn d(s: usize) -> f64 {
    ((7 - s / 8) + (7 - s % 8)) as f64
}

/// The same on the cliff.
fn to_the_end(s: usize) -> f64 {
    ((3 - s / 12) + (11 - s % 12)) as f64
}

/// Whether a state of Taxi has the passenger in the taxi.
fn inside(s: usize) -> bool {
    s / 4 % 5 == 4
}

fn pickup(mdp: &FiniteMdp, bonus: f64) -> Vec<f64> {
    added(mdp, |s, t, _| if !inside(s) && inside(t) { bonus } else { 0.0 })
}

struct Judged {
    pair: Pair,
    sets: Preservation,
    change: PolicyChange,
}

fn judge(mdp: &FiniteMdp, f: &[f64]) -> Judged {
    let pair = Pair::new(mdp, f, GAMMA).unwrap();
    let sets = pair.preservation(&vec![0.0; mdp.n_states()]);
    let change = pair.policy_change().unwrap();
    assert!(change.largest_loss <= change.bound.unwrap());
    assert!(change.worst <= change.best && change.best <= change.optimal + 1e-12);
    assert_eq!(change.largest_loss < 1e-9, sets.verdict == Verdict::Preserved);
    Judged { pair, sets, change }
}

fn close(x: f64, expected: f64, last_digit: f64) {
    assert!((x - expected).abs() <= 0.5 * last_digit, "{x}, not {expected}");
}

#[test]
fn progress_on_dry_land_pays_for_going_to_and_fro() {
    let mdp = lake(false);
    let judged = judge(&mdp, &added(&mdp, |s, t, _| 0.1 * (d(s) - d(t)).max(0.0)));
    assert_eq!(judged.sets.states_changed.len(), 5);
    close(judged.change.optimal, 0.878, 1e-3);
    assert_eq!((judged.change.best, judged.change.worst), (0.0, 0.0));
    assert_eq!(judged.change.worst_endings.terminated, 0.0);
    assert_eq!(judged.change.optimal_endings.goal, 1.0);
    let hacking = judged.pair.hacking(&judged.change).unwrap().expect("a loop");
    let mut states = hacking.cycle.states.clone();
    states.sort_unstable();
    assert_eq!(states, [61, 62]);
    assert!(hacking.cycle.deterministic);
    close(hacking.cycle.gain, 0.1, 1e-12);
    assert_eq!((hacking.cycle.native, hacking.reached, hacking.loops), (0.0, 1.0, 2));
    // The other one is at the other side of the goal.
    assert!(hacking.learned > hacking.learned_optimal && hacking.native < hacking.native_optimal);
}

#[test]
fn a_step_cost_does_no_harm_on_dry_land_and_much_on_ice() {
    let cost = |mdp: &FiniteMdp| judge(mdp, &added(mdp, |_, _, _| -0.01));
    let dry = cost(&lake(false));
    assert_eq!(dry.sets.verdict, Verdict::Preserved);
    assert_eq!((dry.change.worst, dry.change.largest_loss), (dry.change.optimal, 0.0));
    let ice = cost(&lake(true));
    assert_eq!(ice.sets.states_changed.len(), 26);
    close(ice.change.optimal, 0.415, 1e-3);
    close(ice.change.worst, 0.206, 1e-3);
    assert!(ice.change.worst_endings.goal < 0.5 && ice.change.optimal_endings.goal > 0.8);
    assert_eq!(ice.pair.hacking(&ice.change).unwrap(), None, "dying soon is no loop");
    // A tenth of it is too much: V and V_F of both policies at 0.1018 say so.
    assert!(ice.pair.critical().unwrap().k.unwrap() < 0.11);
}

#[test]
fn a_penalty_for_holes_on_ice() {
    let mdp = lake(true);
    let hole = |o: &Outcome| f64::from(u8::from(o.terminated && o.reward == 0.0));
    let judged = judge(&mdp, &added(&mdp, |_, _, o| -hole(o)));
    assert_eq!(judged.sets.states_changed.len(), 6);
    close(judged.change.optimal, 0.415, 1e-3);
    close(judged.change.worst, 0.391, 1e-3);
    // It is safer for that.
    assert!(judged.change.worst_endings.goal > judged.change.optimal_endings.goal);
}

#[test]
fn a_bonus_for_picking_up_is_earned_again_and_again() {
    let mdp = taxi();
    let judged = judge(&mdp, &pickup(&mdp, 2.5));
    assert_eq!(judged.sets.states_changed.len(), 89);
    close(judged.change.worst, -100.0, 1e-9);
    let hacking = judged.pair.hacking(&judged.change).unwrap().expect("a loop");
    // Pick up, put down: the optimum there is 9.6.
    assert_eq!((hacking.cycle.states.len(), &hacking.cycle.actions[..]), (2, &[4, 5][..]));
    close(hacking.cycle.gain, 0.5, 1e-12);
    close(hacking.native, -100.0, 1e-9);
    close(hacking.native_optimal, 9.6, 0.1);
    assert!(hacking.loops > 1);
    close(hacking.reached, 1.0, 1e-9);
    // How much of a bonus of 1 the optimal policy withstands.
    let critical = Pair::new(&mdp, &pickup(&mdp, 1.0), GAMMA).unwrap().critical().unwrap();
    close(critical.k.unwrap(), 2.226, 1e-3);
    assert!(!critical.breaks_ties);
    for (bonus, expected) in [(2.2257, Verdict::Preserved), (2.2258, Verdict::Changed)] {
        assert_eq!(judge(&mdp, &pickup(&mdp, bonus)).sets.verdict, expected, "bonus {bonus}");
    }
}

/// Without discounting a loop that pays leaves no optimal policy: (b − 2) / 2 per step.
#[test]
fn the_pickup_loop_without_discounting() {
    let mdp = taxi();
    for (bonus, gain) in [(1.9, None), (2.1, Some(0.05)), (5.0, Some(1.5))] {
        match (Pair::new(&mdp, &pickup(&mdp, bonus), 1.0), gain) {
            (Ok(pair), None) => {
                assert_eq!(pair.preservation(&[0.0; 500]).verdict, Verdict::Preserved);
                close(pair.critical().unwrap().k.unwrap(), 2.0 / bonus, 1e-9);
                assert_eq!(pair.policy_change().unwrap().bound, None);
            }
            (Err(Unsolved::Learned(SspCheck::NotSsp { why, .. })), Some(gain)) => {
                let NotSsp::PayingLoop { payoff, cycle: Some(cycle) } = why else {
                    panic!("{why:?}")
                };
                close(payoff[0], gain, 1e-8);
                close(payoff[1], gain, 1e-8);
                assert_eq!(cycle.actions, [4, 5]);
                close(cycle.gain, 2.0 * gain, 1e-12);
                assert_eq!(cycle.native, -2.0);
            }
            (other, _) => panic!("bonus {bonus}: {:?}", other.map(|_| "solved")),
        }
    }
}

#[test]
fn which_tasks_have_values_without_discounting() {
    let check = |mdp: &FiniteMdp| {
        Pair::new(mdp, &vec![0.0; mdp.outcomes().len()], 1.0).map(|pair| {
            let change = pair.policy_change().unwrap();
            assert!(change.optimal_endings.terminated > 1.0 - 1e-12);
            pair.preservation(&vec![0.0; mdp.n_states()]).verdict
        })
    };
    for mdp in [cliff(), taxi(), model("Blackjack-v1", &json!({}))] {
        assert_eq!(check(&mdp), Ok(Verdict::Preserved));
    }
    for mdp in [lake(false), lake(true)] {
        let why = check(&mdp).unwrap_err();
        let Unsolved::Native(SspCheck::NotSsp { why: NotSsp::FreeLoop, .. }) = &why else {
            panic!("{why:?}")
        };
        assert!(why.to_string().ends_with("for ever and lose nothing; use gamma < 1"), "{why}");
    }
}

/// A potential is kept without discounting as well, where there are values at all.
#[test]
fn a_potential_without_discounting() {
    let mdp = cliff();
    let phi: Vec<f64> = (0..48).map(|s| -3.0 * to_the_end(s)).collect();
    let f = added(&mdp, |s, t, o| if o.terminated { 0.0 } else { phi[t] } - phi[s]);
    let pair = Pair::new(&mdp, &f, 1.0).unwrap();
    let sets = pair.preservation(&phi);
    assert_eq!(sets.verdict, Verdict::Preserved);
    assert!(sets.identity_holds());
    assert_eq!(pair.critical().unwrap(), Critical { k: None, breaks_ties: false });
}

#[test]
fn progress_along_the_cliff_does_no_harm() {
    let mdp = cliff();
    let progress = |s, t| 2.0 * (to_the_end(s) - to_the_end(t)).max(0.0);
    let judged = judge(&mdp, &added(&mdp, |s, t, _| progress(s, t)));
    assert_eq!(judged.sets.verdict, Verdict::Preserved);
    assert_eq!(judged.pair.hacking(&judged.change).unwrap(), None);
    assert!(judged.pair.critical().unwrap().k.unwrap() > 1.0);
}

/// A correct potential has a loop with a positive reward too, and it is not one to exploit.
#[test]
fn a_loop_that_pays_less_than_the_task_is_not_reported() {
    let mdp = lake(false);
    let phi = |s| -0.1 * d(s);
    let f = added(&mdp, |s, t, o| GAMMA * if o.terminated { 0.0 } else { phi(t) } - phi(s));
    let judged = judge(&mdp, &f);
    assert!(
        added(&mdp, |s, t, _| f64::from(u8::from(s == t && phi(s) < 0.0)))
            .iter()
            .zip(&f)
            .any(|(same, f)| *same > 0.0 && *f > 0.0)
    );
    assert_eq!(judged.sets.verdict, Verdict::Preserved);
    assert_eq!(judged.pair.hacking(&judged.change).unwrap(), None);
    assert_eq!(judged.pair.critical().unwrap(), Critical { k: None, breaks_ties: false });
}

/// Shaping with γ = 1 for a learner with 0.99, Φ = k (14 − d): parking next to the goal pays
/// 13 k (1 − γ) / (1 − γ), the goal 1.
#[test]
fn a_shaping_gamma_of_its_own_pays_for_parking() {
    let mdp = lake(false);
    let phi = |k: f64, s| k * (14.0 - d(s));
    let shaping = |k| added(&mdp, |s, t, o| if o.terminated { 0.0 } else { phi(k, t) } - phi(k, s));
    let judged = |k| {
        let pair = Pair::new(&mdp, &shaping(k), GAMMA).unwrap();
        (pair.policy_change().unwrap(), pair)
    };
    let (safe, pair) = judged(0.0714);
    close(safe.worst, 0.878, 1e-3);
    assert_eq!(pair.hacking(&safe).unwrap(), None);
    let (harmful, pair) = judged(0.1);
    close(harmful.optimal, 0.878, 1e-3);
    assert_eq!(harmful.best, 0.0);
    let hacking = pair.hacking(&harmful).unwrap().expect("a place to park");
    assert!([55, 62].contains(&hacking.cycle.states[0]) && hacking.cycle.states.len() == 1);
    let critical = judged(1.0).1.critical().unwrap();
    close(critical.k.unwrap(), 1.0 / 13.0, 1e-9);
    assert!(critical.breaks_ties);
}

#[test]
fn the_smallest_differences_between_actions() {
    let smallest = |mdp: &FiniteMdp, gamma| {
        let pair = Pair::new(mdp, &vec![0.0; mdp.outcomes().len()], gamma).unwrap();
        pair.policy_change().unwrap().smallest_gap.unwrap()
    };
    close(smallest(&lake(true), GAMMA), 9.75e-4, 1e-6);
    close(smallest(&lake(true), 0.9), 3.3e-5, 1e-6);
    close(smallest(&model("Blackjack-v1", &json!({})), GAMMA), 3.4e-3, 1e-4);
    close(smallest(&model("FrozenLake-v1", &json!({})), GAMMA), 1.4e-2, 1e-3);
    close(smallest(&cliff(), GAMMA), 0.87, 1e-2);
    close(smallest(&taxi(), GAMMA), 1.0, 0.1);
}

/// `mdp` as it is for a learner whose episodes are cut off with probability 0.05 in every step, and
/// who goes on from there if it bootstraps; shaped by `phi`, which counts in the state that is cut
/// off if it is kept.
fn cut_off(mdp: &FiniteMdp, bootstraps: bool, phi: &[f64], kept: bool) -> FiniteMdp {
    let (mut offsets, mut outcomes) = (vec![0], Vec::new());
    for s in 0..mdp.n_states() {
        for a in 0..mdp.n_actions() {
            for o in mdp.of(s, a) {
                let next = GAMMA * phi[o.next_state as usize];
                let mut push = |share, next, terminated| {
                    let reward = o.reward + next - phi[s];
                    outcomes.push(Outcome {
                        probability: share * o.probability,
                        reward,
                        terminated,
                        ..*o
                    });
                };
                if o.terminated {
                    push(1.0, 0.0, true);
                } else {
                    push(0.95, next, false);
                    push(0.05, if kept { next } else { 0.0 }, !bootstraps);
                }
            }
            offsets.push(outcomes.len() as u32);
        }
    }
    FiniteMdp::from_parts(mdp.n_actions(), offsets, outcomes, mdp.initial().to_vec()).unwrap()
}

/// Whether Φ counts in a state at which the time limit strikes must go with whether the learner
/// bootstraps from it (Pardo et al. 2018): of the four ways two are right.
#[test]
fn a_cut_off_state_keeps_its_potential_if_it_is_bootstrapped_from() {
    let near: Vec<f64> = (0..64).map(|s| 14.0 - d(s)).collect();
    let south: Vec<f64> = (0..500).map(|s| (s / 100) as f64).collect();
    for (mdp, phi) in [(lake(false), &near), (lake(true), &near), (taxi(), &south)] {
        let zero = vec![0.0; phi.len()];
        for (bootstraps, kept) in [(true, true), (true, false), (false, true), (false, false)] {
            let plain = cut_off(&mdp, bootstraps, &zero, kept);
            let shaped = cut_off(&mdp, bootstraps, phi, kept);
            let sets = Pair::of_models(&plain, &shaped, GAMMA).unwrap().preservation(phi);
            if bootstraps == kept {
                assert_eq!(sets.verdict, Verdict::Preserved);
                assert!(sets.identity_error <= 1e-12, "{}", sets.identity_error);
            } else {
                assert_eq!(sets.verdict, Verdict::Changed);
                assert!(sets.identity_error > 1e-3 && sets.states_changed.len() >= 5);
            }
        }
    }
}
