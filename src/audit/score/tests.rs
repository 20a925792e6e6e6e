use super::*;
use crate::audit::specimens::{lake, lake_distance, model};
use crate::mdp::math::pow_int;
use serde_json::json;

const GAMMA: f64 = 0.99;

/// Zero, −0.05 d, 0.95^d, V*, −V*.
fn five(scorer: &Scorer) -> [Vec<f64>; 5] {
    let of = |f: &dyn Fn(usize) -> f64| (0..64).map(f).collect();
    let v = scorer.dynamics.unpack(&scorer.v);
    [
        of(&|_| 0.0),
        of(&|s| -0.05 * lake_distance(s)),
        of(&|s| pow_int(0.95, lake_distance(s) as i64)),
        of(&|s| v[s]),
        of(&|s| -v[s]),
    ]
}

/// How fast Q-learning is from each of them: its mean greedy return over training, relative to the
/// optimum.
const SPEED_ON_ICE: [f64; 5] = [0.53, 0.12, 0.81, 0.88, 0.00];
const SPEED_ON_LAND: [f64; 5] = [0.04, 0.14, 0.98, 0.94, 0.00];

/// Rank correlations with the speeds, as printed.
#[test]
fn scores_rank_five_potentials_as_training_does() {
    for (slippery, speeds, expected) in [
        (true, SPEED_ON_ICE, ["1.00", "0.89", "1.00", "1.00", "1.00", "0.82"]),
        (false, SPEED_ON_LAND, ["0.80", "0.87", "0.80", "0.80", "0.90", "0.82"]),
    ] {
        let mdp = lake(slippery);
        let scorer = Scorer::new(&mdp, GAMMA).unwrap();
        let scores = five(&scorer).map(|phi| scorer.score(&phi).unwrap());
        let rho = |by: &dyn Fn(&Score) -> f64| {
            let values: Vec<f64> = scores.iter().map(by).collect();
            format!("{:.2}", spearman(&values, &speeds, 1e-9).unwrap())
        };
        let found = [
            rho(&|s| s.vi_auc.unwrap()),
            rho(&|s| -(s.sweeps.unwrap_or(SCORED_SWEEPS + 1) as f64)),
            rho(&|s| -s.mean_error),
            rho(&|s| -s.largest_error),
            rho(&|s| s.agreement),
            rho(&|s| s.rank_correlation.unwrap_or(0.0)),
        ];
        assert_eq!(found, expected, "slippery: {slippery}");
    }
}

#[test]
fn the_optimal_values_are_the_best_potential() {
    for mdp in [lake(true), model("Taxi-v4", &json!({})), model("CliffWalking-v1", &json!({}))] {
        let scorer = Scorer::new(&mdp, GAMMA).unwrap();
        let score = scorer.score(&scorer.dynamics.unpack(&scorer.v)).unwrap();
        assert!((score.vi_auc.unwrap() - 1.0).abs() < 1e-12);
        assert!((score.vi_value - scorer.optimal_return()).abs() < 1e-9);
        assert_eq!((score.sweeps, score.agreement), (Some(1), 1.0));
        assert!(score.largest_error == 0.0 && score.mean_error == 0.0);
        assert!((score.rank_correlation.unwrap() - 1.0).abs() < 1e-12);
    }
}

#[test]
fn a_distance_makes_dying_pay_until_it_is_shifted() {
    let phi: Vec<f64> = (0..64).map(|s| -0.05 * lake_distance(s)).collect();
    for (slippery, bad_ends) in [(true, 99), (false, 33)] {
        let mdp = lake(slippery);
        let scorer = Scorer::new(&mdp, GAMMA).unwrap();
        let death = scorer.score(&phi).unwrap().death;
        assert_eq!((death.bad_ends, death.paid), (bad_ends, bad_ends));
        let shift = scorer.shift(&phi).unwrap();
        assert!((shift.above.unwrap() - 0.5).abs() < 1e-12);
        assert!((shift.below.unwrap() - 1.05).abs() < 1e-12);
        let b = shift.suggested;
        // On ice the best is near the upper end; on land all of the interval is equally good.
        assert!(
            if slippery { (0.85..=1.0).contains(&b) } else { (0.7..=0.85).contains(&b) },
            "{b}"
        );
        assert!(shift.vi_auc.unwrap() > shift.vi_auc_unshifted.unwrap() + 0.2);
        let shifted: Vec<f64> = phi.iter().map(|phi| phi + b).collect();
        let score = scorer.score(&shifted).unwrap();
        assert_eq!(score.vi_auc, shift.vi_auc);
        assert_eq!((score.death.bad_ends, score.death.paid), (bad_ends, 0));
    }
    // The interval is where every shift is as good, and beyond it none is.
    let mdp = lake(false);
    let scorer = Scorer::new(&mdp, GAMMA).unwrap();
    let auc = |b: f64| {
        let shifted: Vec<f64> = phi.iter().map(|phi| phi + b).collect();
        scorer.score(&shifted).unwrap().vi_auc.unwrap()
    };
    let plateau = auc(0.75);
    for b in [0.51, 0.6, 0.9, 1.04] {
        assert!((auc(b) - plateau).abs() < 1e-12, "{b}");
    }
    for b in [0.4, 1.1, 3.0] {
        assert!(auc(b) < plateau - 0.01, "{b}");
    }
}

#[test]
fn a_shift_of_the_optimal_values_helps_nobody() {
    let mdp = lake(true);
    let scorer = Scorer::new(&mdp, GAMMA).unwrap();
    let shift = scorer.shift(&scorer.dynamics.unpack(&scorer.v)).unwrap();
    assert_eq!(shift.suggested, 0.0);
}

#[test]
fn ends_that_are_no_worse_than_going_on_are_not_bad() {
    for mdp in [model("Taxi-v4", &json!({})), model("CliffWalking-v1", &json!({}))] {
        let scorer = Scorer::new(&mdp, GAMMA).unwrap();
        let phi = vec![-1.0; mdp.n_states()];
        assert_eq!(scorer.score(&phi).unwrap().death, DeathAttraction { bad_ends: 0, paid: 0 });
        assert_eq!(scorer.shift(&phi).unwrap().above, None);
    }
}

#[test]
fn the_random_policy_scores_nothing_and_undiscounted_loops_have_no_score() {
    let mdp = lake(true);
    let scorer = Scorer::new(&mdp, GAMMA).unwrap();
    assert_eq!(
        format!("{:.4} {:.4}", scorer.optimal_return(), scorer.random_return()),
        "0.4146 0.0011"
    );
    assert_eq!(scorer.share(scorer.random_return()), Some(0.0));
    assert_eq!(scorer.share(scorer.optimal_return()), Some(1.0));
    // Undiscounted, a taxi that likes it in a corner stays there for ever.
    let taxi = model("Taxi-v4", &json!({}));
    let scorer = Scorer::new(&taxi, 1.0).unwrap();
    let corner: Vec<f64> = (0..500).map(|s| if s / 20 == 0 { 100.0 } else { 0.0 }).collect();
    assert!(matches!(scorer.score(&corner), Err(PlanError::Endless(_))));
}
