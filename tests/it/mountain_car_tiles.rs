//! Mountain Car with linear values, as in Sutton & Barto 2018, example 10.1: eight tilings of 8 x 8
//! tiles, ε = 0, γ = 1, values that start at 0 and so are optimistic. The book has no time limit
//! of 200 steps, so there is none here either.

use std::sync::atomic::AtomicBool;

use runner::experiment::run_unit;
use runner::script::{Host, load};

use crate::support::{folder, write};

const TILES: &str = "tiles(#{ position: [-1.2, 0.6, 8], velocity: [-0.07, 0.07, 8], tilings: 8 })";
const SEEDS: u64 = 20;

/// Steps of each episode, mean over the seeds.
fn steps(agent: &str, discretiser: &str, episodes: u32) -> Vec<f64> {
    let folder = folder();
    let script = format!(
        "experiment(#{{ env: \"MountainCar-v0\", max_steps: 20000, agent: {agent},
            discretiser: {discretiser}, episodes: {episodes}, seeds: {SEEDS} }})"
    );
    let plan = load(&write(folder.path(), "s.rhai", &script)).unwrap_or_else(|d| panic!("{d}"));
    let host = Host::open(&plan).unwrap();
    let variant = &plan.variants[0];
    let mut mean = vec![0.0; episodes as usize];
    for &seed in &variant.seeds.0 {
        let never = AtomicBool::new(false);
        let record = run_unit(&host, variant, seed, &never, &mut |_| {}).expect("it runs");
        for (mean, row) in mean.iter_mut().zip(&record.rows) {
            *mean += f64::from(row.steps) / SEEDS as f64;
        }
    }
    mean
}

fn mean(steps: &[f64]) -> f64 {
    steps.iter().sum::<f64>() / steps.len() as f64
}

fn sarsa(alpha: f64) -> String {
    format!("sarsa(#{{ alpha: {alpha:?}, gamma: 1.0, epsilon: 0.0 }})")
}

fn sarsa_lambda(alpha: f64, lambda: f64, traces: &str) -> String {
    format!(
        "sarsa_lambda(#{{ alpha: {alpha:?}, gamma: 1.0, epsilon: 0.0, lambda: {lambda:?}, \
         traces: \"{traces}\" }})"
    )
}

/// Figure 10.2: semi-gradient SARSA with α = 0.1/8, 0.2/8 and 0.5/8.
#[test]
fn sarsa_learns_as_in_figure_10_2() {
    let [slow, middle, fast] = [0.1, 0.2, 0.5].map(|alpha| steps(&sarsa(alpha), TILES, 300));
    // The first episode explores, the larger step sizes learn sooner.
    for curve in [&slow, &middle, &fast] {
        assert!(curve[0] > 600.0, "{}", curve[0]);
    }
    let early = |curve: &[f64]| mean(&curve[..50]);
    assert!(early(&fast) < 0.8 * early(&middle), "{} {}", early(&fast), early(&middle));
    assert!(early(&middle) < 0.8 * early(&slow), "{} {}", early(&middle), early(&slow));
    // Between 100 and 200 episodes: below 150 with the largest, above with the smallest.
    assert!(mean(&fast[100..200]) < 145.0, "{}", mean(&fast[100..200]));
    assert!(mean(&middle[100..200]) < 160.0, "{}", mean(&middle[100..200]));
    assert!(mean(&slow[100..200]) > 155.0, "{}", mean(&slow[100..200]));
    assert!(mean(&fast[250..]) < 130.0, "{}", mean(&fast[250..]));
}

/// Figure 12.10: with replacing traces, the first 50 episodes take fewer steps than without.
#[test]
fn traces_help_early_as_in_figure_12_10() {
    let early = |agent: &str| mean(&steps(agent, TILES, 50));
    let without = early(&sarsa_lambda(0.5, 0.0, "replacing"));
    let with = early(&sarsa_lambda(0.5, 0.9, "replacing"));
    assert!((240.0..310.0).contains(&without), "{without}");
    assert!((180.0..240.0).contains(&with), "{with}");
    // Larger steps do better with either.
    let (without, with) =
        (early(&sarsa_lambda(1.0, 0.0, "replacing")), early(&sarsa_lambda(1.0, 0.9, "replacing")));
    assert!((205.0..260.0).contains(&without), "{without}");
    assert!((165.0..205.0).contains(&with), "{with}");
    let dutch = early(&sarsa_lambda(0.5, 0.9, "dutch"));
    assert!((170.0..220.0).contains(&dutch), "{dutch}");
}

/// λ = 0 is one-step SARSA, and an agent that never explores has no traces to cut: the same bits.
#[test]
fn algorithms_that_coincide_do() {
    let of = |agent: &str| steps(agent, TILES, 12);
    assert_eq!(of(&sarsa(0.5)), of(&sarsa_lambda(0.5, 0.0, "accumulating")));
    let watkins = "q_lambda(#{ alpha: 0.5, gamma: 1.0, epsilon: 0.0, traces: \"replacing\" })";
    assert_eq!(of(&sarsa_lambda(0.5, 0.9, "replacing")), of(watkins));
}

/// Bins that are as wide as the tiles are too coarse to climb the hill well, and fine ones have to
/// be visited one by one.
#[test]
fn tiles_learn_faster_than_bins() {
    let tiles = mean(&steps(&sarsa(0.5), TILES, 100));
    for n in [8, 20, 40] {
        let bins = format!("bins(#{{ position: [-1.2, 0.6, {n}], velocity: [-0.07, 0.07, {n}] }})");
        let bins = mean(&steps(&sarsa(0.5), &bins, 100));
        assert!(2.0 * tiles < bins, "{n}: {tiles} {bins}");
    }
}

#[test]
fn the_fourier_basis_learns_too() {
    // Order 3, as Konidaris et al. 2011 use for Mountain Car; theirs is SARSA(λ) as well.
    let curve = steps(&sarsa_lambda(0.005, 0.9, "accumulating"), "fourier(3)", 100);
    assert!(mean(&curve[50..]) < 155.0, "{}", mean(&curve[50..]));
}
