//! Blackjack's exact model: against the game it is a model of, and against what is known of it.

use runner::env::blackjack::{Blackjack, Rules};
use runner::learn::planning::{Planner, ValueIteration};
use runner::learn::{QTable, greedy_set};
use runner::mdp::numpy::NumpyRng;
use runner::mdp::streams::Stream;
use runner::mdp::{Env, FiniteMdp};

const RULES: [Rules; 3] = [Rules::Plain, Rules::Natural, Rules::SuttonBarto];

fn solve(mdp: &FiniteMdp) -> QTable {
    let planner = ValueIteration { gamma: 1.0, theta: 0.0, max_sweeps: 100 };
    let solution = planner.solve(mdp, &vec![0.0; mdp.n_states()]).unwrap();
    // No hand takes more than 21 cards.
    assert!(solution.converged && solution.changes.len() <= 23);
    solution.q
}

/// The expected return of `value(state)` at the start.
fn at_the_start(mdp: &FiniteMdp, value: impl Fn(usize) -> f64) -> f64 {
    let starts = mdp.initial().iter().enumerate().filter(|(_, p)| **p > 0.0);
    starts.map(|(s, p)| p * value(s)).sum()
}

#[test]
fn the_optimal_return_is_the_exact_one() {
    // By exhaustion over all hands in rational arithmetic, rounded once.
    let exact = [-0.046_555_977_066_706_55, -0.025_729_182_789_319_86, -0.043_113_105_413_477_015];
    for (rules, exact) in RULES.into_iter().zip(exact) {
        let env = Blackjack::new(rules);
        let mdp = env.finite().unwrap();
        let q = solve(mdp);
        let value = at_the_start(mdp, |s| q.get(s, 0).max(q.get(s, 1)));
        assert!((value - exact).abs() < 1e-12, "{rules:?}: {value}");
    }
}

#[test]
fn a_threshold_has_its_exact_return() {
    // Hitting below this sum, in rational arithmetic over all hands as above.
    for (threshold, exact) in [
        (12, -0.102_372_267_779_427_05),
        (17, -0.075_851_660_034_836_63),
        (20, -0.350_111_146_088_341_65),
    ] {
        let env = Blackjack::new(Rules::SuttonBarto);
        let mdp = env.finite().unwrap();
        // Every hit raises the hard sum: so many rounds are enough.
        let mut v = vec![0.0; mdp.n_states()];
        for _ in 0..23 {
            let value = |s: usize| {
                let hit = env.state(s).unwrap().player < threshold;
                let outcomes = mdp.of(s, usize::from(hit));
                let next = |o: &runner::mdp::Outcome| {
                    o.reward + if o.terminated { 0.0 } else { v[o.next_state as usize] }
                };
                outcomes.iter().map(|o| o.probability * next(o)).sum()
            };
            v = (0..mdp.n_states()).map(value).collect();
        }
        let value = at_the_start(mdp, |s| v[s]);
        assert!((value - exact).abs() < 1e-12, "{threshold}: {value}");
    }
}

#[test]
fn the_optimal_policy_is_figure_5_2() {
    // Sutton & Barto 2018: the smallest sum to stick on, by the dealer's card from ace to ten.
    let hard = [17, 13, 13, 12, 12, 12, 17, 17, 17, 17];
    let soft = [19, 18, 18, 18, 18, 18, 18, 18, 19, 19];
    let env = Blackjack::new(Rules::SuttonBarto);
    let q = solve(env.finite().unwrap());
    for (ace, sums, least) in [(false, 11..22, hard), (true, 12..22, soft)] {
        for sum in sums {
            for (dealer, least) in (1..).zip(least) {
                let state = (sum * 11 + dealer) * 2 + usize::from(ace);
                let best = greedy_set(q.row(state), 1.0);
                let expected = usize::from(sum < least);
                assert_eq!(best, [expected], "sum {sum}, ace {ace}, dealer {dealer}");
            }
        }
    }
    // With a natural nothing is to be gained by another card.
    for natural in 704..714 {
        assert_eq!(greedy_set(q.row(natural), 1.0), [0]);
    }
}

/// How far counts are from what they should be, in standard deviations.
#[derive(Default)]
struct Distance {
    /// Pearson's statistic less its mean, and its exact variance, summed over distributions.
    excess: f64,
    variance: f64,
    /// The largest of a single count, where enough were expected.
    largest: f64,
}

impl Distance {
    fn add(&mut self, counts: &[f64], probabilities: &[f64]) {
        let n: f64 = counts.iter().sum();
        let possible = || counts.iter().zip(probabilities).filter(|(_, p)| **p > 0.0);
        if possible().map(|(count, _)| count).sum::<f64>() < n {
            // The impossible happened.
            self.excess = f64::INFINITY;
        }
        for (count, p) in possible().filter(|(_, p)| n * **p >= 25.0 && **p < 1.0) {
            let sigmas = (count - n * p).abs() / (n * p * (1.0 - p)).sqrt();
            self.largest = self.largest.max(sigmas);
        }
        let k = possible().count() as f64;
        let statistic: f64 = possible().map(|(c, p)| (c - n * p) * (c - n * p) / (n * p)).sum();
        let inverses: f64 = possible().map(|(_, p)| 1.0 / p).sum();
        self.excess += statistic - (k - 1.0);
        self.variance += 2.0 * (k - 1.0) + (inverses - k * k - 2.0 * k + 2.0) / n;
    }

    fn sigmas(&self) -> f64 {
        (self.excess.abs() / self.variance.sqrt()).max(self.largest)
    }
}

/// Plays random actions and compares how often everything happened with the model: the distances
/// of the starts and of the outcomes.
fn distances(rules: Rules, model: &FiniteMdp, episodes: usize) -> [f64; 2] {
    let mut env = Blackjack::new(rules);
    let mut rng = NumpyRng::from_u64(2024);
    let mut actions = Stream::new(1, "blackjack");
    let mut starts = vec![0.0; model.n_states()];
    let mut counts = vec![0.0; model.outcomes().len()];
    for _ in 0..episodes {
        let obs = env.reset(&mut rng);
        starts[env.state_index(&obs).unwrap()] += 1.0;
        loop {
            let step = env.step(actions.below(2), &mut rng);
            counts[env.outcome_index(&step.obs).unwrap()] += 1.0;
            if step.terminated {
                break;
            }
        }
    }
    let mut initial = Distance::default();
    initial.add(&starts, model.initial());
    let mut outcomes = Distance::default();
    for s in 0..model.n_states() {
        for a in 0..2 {
            let counts = &counts[model.range(s, a)];
            if counts.iter().sum::<f64>() > 0.0 {
                let probabilities: Vec<f64> =
                    model.of(s, a).iter().map(|o| o.probability).collect();
                outcomes.add(counts, &probabilities);
            }
        }
    }
    [initial.sigmas(), outcomes.sigmas()]
}

#[test]
fn the_game_is_played_as_the_model_says() {
    for rules in RULES {
        let env = Blackjack::new(rules);
        let model = env.finite().unwrap();
        let sigmas = distances(rules, model, 2_000_000);
        assert!(sigmas.iter().all(|sigma| *sigma < 5.0), "{rules:?}: {sigmas:?}");
    }
}

#[test]
fn a_wrong_model_would_be_found() {
    // Only the rows of naturals differ: a draw against three cards is possible or not.
    let (plain, sab) = (Blackjack::new(Rules::Plain), Blackjack::new(Rules::SuttonBarto));
    let [_, impossible] = distances(Rules::Plain, sab.finite().unwrap(), 200_000);
    let [_, too_rare] = distances(Rules::SuttonBarto, plain.finite().unwrap(), 200_000);
    assert!(impossible == f64::INFINITY && too_rare > 5.0, "{impossible}, {too_rare}");
}
