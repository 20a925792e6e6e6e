//! Figures and examples of Sutton & Barto (2018) that concern prediction and Monte Carlo control.
//! Each asserts what the figure is there to show, over enough runs to be sure of it.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use runner::env::blackjack::{Blackjack, Rules};
use runner::experiment::{Limits, World, train};
use runner::learn::control::{Trace, Traces};
use runner::learn::planning::{Over, Planner, Policy, ValueIteration, policy_value};
use runner::learn::prediction::{
    Estimate, GivenPolicy, MonteCarloPrediction, NStepTd, Prediction, Rule, Td0, TdLambda,
};
use runner::learn::{
    Agent, AlphaSource, Exploration, Learn, MonteCarlo, OffPolicyMonteCarlo, QTable, Schedule,
    Visits, argmax_tol,
};
use runner::mdp::numpy::NumpyRng;
use runner::mdp::streams::Stream;
use runner::mdp::{Action, Env, FiniteMdp, Outcome, Schema, Step};
use runner::shaping::{NativeReward, NoPotential, StateIndex};

use crate::task::Task;

/// States in a row; each step goes left or right with equal probability, and beyond the ends the
/// episode is over (examples 6.2 and 7.1). It starts in the middle. `n` states; beyond the left end
/// the reward is `left`, beyond the right one 1.
fn random_walk(n: usize, left: f64) -> Task {
    let to = |s: usize, right: bool| {
        let terminated = if right { s == n - 1 } else { s == 0 };
        let next_state = if terminated { s } else { s + usize::from(right) * 2 - 1 } as u32;
        let reward = f64::from(u8::from(terminated)) * if right { 1.0 } else { left };
        Outcome { probability: 0.5, next_state, reward, terminated }
    };
    let table: Vec<_> = (0..n).map(|s| vec![vec![to(s, false), to(s, true)]]).collect();
    Task::new(&table, n / 2)
}

/// The exact values of a walk.
fn values(walk: &Task) -> Vec<f64> {
    policy_value(walk.mdp(), 1.0, Policy::Uniform, Over::Every).unwrap().v
}

/// Plays within `limits`; `each` sees the agent after every episode.
fn play<E: Env, A: Learn<usize>>(
    env: E,
    agent: &mut A,
    limits: Limits,
    seed: u64,
    mut each: impl FnMut(&A),
) {
    let n_states = env.n_states().unwrap();
    let discretiser = StateIndex { n_states };
    let mut world = World { env, discretiser, potential: NoPotential, reward: NativeReward };
    let (mut rng, stop) = (NumpyRng::from_u64(seed), AtomicBool::new(false));
    assert!(train(&mut world, agent, limits, &mut rng, &stop, |_, agent| each(agent)).is_ok());
}

fn constant(alpha: f64) -> AlphaSource {
    AlphaSource::Schedule(Schedule::constant(alpha))
}

/// The root mean square over the states of the walk and over `runs` of what `rule` learns, after
/// each episode: first within a run, then averaged over the runs as the figures do.
fn errors<R: Rule>(
    walk: &Task,
    (initial, alpha): (f64, f64),
    (runs, episodes): (u64, u32),
    rule: impl Fn() -> R,
) -> Vec<f64> {
    let n = walk.mdp().n_states();
    let exact = values(walk);
    let mut means = vec![0.0; episodes as usize];
    for run in 0..runs {
        let estimate = Estimate::new(vec![initial; n], 1.0, constant(alpha));
        let mut agent = Prediction::new(estimate, GivenPolicy::Fixed(vec![0; n]), rule());
        let mut episode = 0;
        let limits = Limits { episodes, ..Limits::EPISODE };
        play(walk.clone(), &mut agent, limits, run, |agent| {
            let v = agent.v().unwrap();
            let squares = v.iter().zip(&exact).map(|(v, exact)| (v - exact) * (v - exact));
            means[episode] += (squares.sum::<f64>() / n as f64).sqrt() / runs as f64;
            episode += 1;
        });
    }
    means
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn the_walks_have_the_books_values() {
    let five = random_walk(5, 0.0);
    let v = values(&five);
    assert!(v.iter().zip(1..).all(|(v, i)| (v - f64::from(i) / 6.0).abs() < 1e-12), "{v:?}");
    let nineteen = random_walk(19, -1.0);
    let v = values(&nineteen);
    assert!(v.iter().zip(-9..).all(|(v, i)| (v - f64::from(i) / 10.0).abs() < 1e-12), "{v:?}");
}

#[test]
fn example_6_2_td_beats_constant_alpha_monte_carlo() {
    let walk = random_walk(5, 0.0);
    let size = (100, 100);
    let monte_carlo = || MonteCarloPrediction::new(Visits::Every, 5);
    let td = [0.05, 0.1, 0.15].map(|alpha| errors(&walk, (0.5, alpha), size, Td0::default));
    let mc = [0.01, 0.02, 0.03, 0.04].map(|alpha| errors(&walk, (0.5, alpha), size, monte_carlo));
    for td in &td {
        for mc in &mc {
            // "The TD method was consistently better than the MC method": on the whole, and from
            // the figure's first quarter on.
            assert!(mean(td) < 0.75 * mean(mc), "{} and {}", mean(td), mean(mc));
            assert!((25..100).all(|i| td[i] < mc[i]));
        }
    }
    // The figure's curves: the smallest step size ends lowest, the largest starts fastest.
    assert!(td[0][99] < 0.045 && td[0][99] < td[1][99] && td[1][99] < td[2][99]);
    assert!(td[2][10] < td[1][10] && td[1][10] < td[0][10]);
}

/// The smallest of the errors at these step sizes, averaged over the first ten episodes.
fn best<R: Rule>(walk: &Task, alphas: &[f64], rule: impl Fn() -> R) -> f64 {
    let at = |&alpha: &f64| mean(&errors(walk, (0.0, alpha), (100, 10), &rule));
    alphas.iter().map(at).fold(f64::INFINITY, f64::min)
}

#[test]
fn figure_7_2_an_intermediate_n_is_best() {
    let walk = random_walk(19, -1.0);
    let alphas: Vec<f64> = (1..=10).map(|i| f64::from(i) / 10.0).collect();
    let errors = [1, 2, 4, 8, 16, 32, 64, 128].map(|n| best(&walk, &alphas, || NStepTd::new(n)));
    // It falls up to n = 4 and rises from there on.
    assert!(errors[..3].is_sorted_by(|a, b| a > b), "{errors:?}");
    assert!(errors[2..].is_sorted_by(|a, b| a < b), "{errors:?}");
    // What is read off the figure: 0.27 for n = 4, 0.35 for n = 1, 0.45 for n = 64.
    for (i, expected) in [(2, 0.27), (0, 0.35), (6, 0.45)] {
        assert!((errors[i] - expected).abs() < 0.02, "{errors:?}");
    }
}

#[test]
fn figure_12_6_an_intermediate_lambda_is_best() {
    let walk = random_walk(19, -1.0);
    let alphas: Vec<f64> = [1, 2, 5]
        .map(|i| f64::from(i) / 100.0)
        .into_iter()
        .chain((1..=10).map(|i| f64::from(i) / 10.0))
        .collect();
    let with = |kind, lambda| TdLambda::new(Traces::new(kind, lambda, 0.0, 19));
    let of =
        |kind| [0.0, 0.4, 0.8, 0.95, 1.0].map(|lambda| best(&walk, &alphas, || with(kind, lambda)));
    let [zero, low, high, higher, one] = of(Trace::Accumulating);
    assert!(
        high < low && low < zero && high < higher && higher < one,
        "{zero} {low} {high} {higher} {one}"
    );
    assert!((high - 0.27).abs() < 0.02);
    // Replacing traces bear larger steps: where accumulating ones diverge, at lambda = 1, they
    // are hardly worse than the best (Singh & Sutton 1996).
    let replacing = of(Trace::Replacing);
    assert!(replacing[4] < 0.9 * one, "{replacing:?}");
}

/// The index of a state of Blackjack.
fn hand(sum: usize, dealer: usize, ace: bool) -> usize {
    (sum * 11 + dealer) * 2 + usize::from(ace)
}

/// Optimal action values.
fn optimal(mdp: &FiniteMdp) -> QTable {
    let planner = ValueIteration { gamma: 1.0, theta: 0.0, max_sweeps: 100 };
    planner.solve(mdp, &vec![0.0; mdp.n_states()]).unwrap().q
}

const SAMPLE_AVERAGE: AlphaSource = AlphaSource::VisitCount { omega: 1.0 };

#[test]
fn figure_5_2_blackjack_is_solved_with_exploring_starts() {
    let env = Blackjack::new(Rules::SuttonBarto);
    let mdp = env.finite().unwrap().clone();
    let q = QTable::new(mdp.n_states(), 2, 0.0);
    let behaviour = (Exploration::EpsilonGreedy, Schedule::constant(0.0));
    let stream = |purpose| Stream::new(0, purpose);
    let mut agent =
        MonteCarlo::new(q, 1.0, SAMPLE_AVERAGE, behaviour, Visits::First, stream("agent"))
            .with_exploring_starts(stream("first actions"));
    let limits = Limits { episodes: 5_000_000, exploring_starts: Some(0), ..Limits::EPISODE };
    play(env, &mut agent, limits, 0, |_| ());
    let (learned, exact) = (agent.q().unwrap(), optimal(&mdp));
    let mut wrong = Vec::new();
    for ace in [false, true] {
        for (sum, dealer) in (12..22).flat_map(|sum| (1..11).map(move |dealer| (sum, dealer))) {
            let s = hand(sum, dealer, ace);
            if argmax_tol(learned.row(s)) != argmax_tol(exact.row(s)) {
                wrong.push((sum, dealer, ace, exact.get(s, 0) - exact.get(s, 1)));
            }
        }
    }
    // Of 200 states, with and without a usable ace. Where two actions are worth nearly the same,
    // even five million episodes may not tell.
    assert!(wrong.len() <= 2, "{wrong:?}");
    assert!(wrong.iter().all(|w| w.3.abs() < 0.01), "{wrong:?}");
}

/// Blackjack from one state.
#[derive(Clone)]
struct FromHand(Blackjack, usize);

impl Env for FromHand {
    type Obs = <Blackjack as Env>::Obs;

    const INDEXED: bool = true;

    fn n_actions(&self) -> usize {
        self.0.n_actions()
    }

    fn reset(&mut self, rng: &mut NumpyRng) -> Self::Obs {
        self.0.reset(rng);
        self.0.set_index(self.1).unwrap()
    }

    fn step(&mut self, action: Action, rng: &mut NumpyRng) -> Step<Self::Obs> {
        self.0.step(action, rng)
    }

    fn finite(&self) -> Option<&Arc<FiniteMdp>> {
        self.0.finite()
    }

    fn state_index(&self, obs: &Self::Obs) -> Option<usize> {
        self.0.state_index(obs)
    }

    fn schema(&self) -> Schema {
        self.0.schema()
    }

    fn fields(&self, obs: &Self::Obs, out: &mut [f64]) {
        self.0.fields(obs, out);
    }
}

/// The state of figure 5.3: a sum of 13 with a usable ace against a deuce.
const THIRTEEN: (usize, usize, bool) = (13, 2, true);

#[test]
fn figure_5_3_the_value_of_a_blackjack_state() {
    let env = Blackjack::new(Rules::SuttonBarto);
    let (mdp, s) = (env.finite().unwrap().clone(), hand(THIRTEEN.0, THIRTEEN.1, THIRTEEN.2));
    // Sticks on 20 and 21 only.
    let policy: Vec<Action> = (0..mdp.n_states())
        .map(|s| usize::from(env.state(s).is_none_or(|obs| obs.player < 20)))
        .collect();
    let v = policy_value(&mdp, 1.0, Policy::Deterministic(&policy), Over::Reachable).unwrap().v;
    // The book's value, from a hundred million episodes.
    assert!((v[s] + 0.27726).abs() < 2e-4, "{}", v[s]);
    // From twenty thousand: the standard error is 0.007.
    let estimate = Estimate::new(vec![0.0; mdp.n_states()], 1.0, SAMPLE_AVERAGE);
    let rule = MonteCarloPrediction::new(Visits::First, mdp.n_states());
    let mut agent = Prediction::new(estimate, GivenPolicy::Fixed(policy), rule);
    let limits = Limits { episodes: 20_000, ..Limits::EPISODE };
    play(FromHand(env, s), &mut agent, limits, 0, |_| ());
    let learned = agent.v().unwrap()[s];
    assert!((learned - v[s]).abs() < 0.03, "{learned} instead of {}", v[s]);
}

/// The figure's state and its behaviour, hit or stick with equal probability; the target policy is
/// the greedy one that is being learned, not the figure's.
#[test]
fn figure_5_3_weighted_importance_sampling_has_a_low_error() {
    let env = Blackjack::new(Rules::SuttonBarto);
    let (mdp, s) = (env.finite().unwrap().clone(), hand(THIRTEEN.0, THIRTEEN.1, THIRTEEN.2));
    let exact = optimal(&mdp).max(s);
    let marks = [100, 1_000, 10_000];
    let mut squares = [0.0; 3];
    for run in 0..100 {
        let q = QTable::new(mdp.n_states(), 2, 0.0);
        let stream = Stream::new(run, "agent");
        let mut agent = OffPolicyMonteCarlo::new(q, 1.0, Schedule::constant(1.0), stream);
        let mut episode = 0;
        let limits = Limits { episodes: 10_000, ..Limits::EPISODE };
        play(FromHand(env.clone(), s), &mut agent, limits, run, |agent| {
            episode += 1;
            if let Some(i) = marks.iter().position(|mark| *mark == episode) {
                let error = agent.q().unwrap().max(s) - exact;
                squares[i] += error * error / 100.0;
            }
        });
    }
    // The figure's mean square error falls to about 0.2 after 100 episodes and below 0.01 after
    // 10,000.
    assert!(squares[2] < 0.01 && squares[2] < squares[1] && squares[1] < squares[0], "{squares:?}");
}
