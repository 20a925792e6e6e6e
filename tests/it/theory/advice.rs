//! Advice on actions (Wiewiora, Cottrell & Elkan 2003): looking ahead it is exact if choices are
//! corrected, looking back it is exact where no two ways meet.

use runner::learn::control::{Advised, Backup, Tabular};
use runner::learn::registry::TabularAgent;
use runner::learn::{
    Agent, AlphaSource, Exploration, Last, Learn, LookBack, MonteCarlo, QTable, Sarsa, Schedule,
    Unit, Visits,
};
use runner::mdp::FiniteMdp;
use runner::mdp::streams::Stream;

use super::{lake, model, random_numbers, reachable, scale, solve, wrong};

const GAMMA: f64 = 0.99;

/// Where the values of a shaped one-step learner settle, by 4,000 sweeps: bootstrapped from the
/// action that is best by `Q_F + Φ` if choices are `corrected`, else by `Q_F`.
fn settled(mdp: &FiniteMdp, phi: &QTable, corrected: bool) -> QTable {
    let n_actions = mdp.n_actions();
    let mut q = QTable::new(mdp.n_states(), n_actions, 0.0);
    for _ in 0..4_000 {
        let worth: Vec<f64> = (0..mdp.n_states())
            .map(|s| {
                let sum = |a: usize| q.get(s, a) + phi.get(s, a);
                let by = |a: usize| if corrected { sum(a) } else { q.get(s, a) };
                let best =
                    (1..n_actions).fold(0, |best, a| if by(a) > by(best) { a } else { best });
                sum(best)
            })
            .collect();
        for s in 0..mdp.n_states() {
            for a in 0..n_actions {
                let next = |o: &runner::mdp::Outcome| {
                    if o.terminated { 0.0 } else { worth[o.next_state as usize] }
                };
                let outcomes = mdp.of(s, a).iter();
                let sum: f64 = outcomes.map(|o| o.probability * (o.reward + GAMMA * next(o))).sum();
                *q.get_mut(s, a) = sum - phi.get(s, a);
            }
        }
    }
    q
}

fn sum(a: &QTable, b: &QTable) -> QTable {
    let values = a.values().iter().zip(b.values()).map(|(a, b)| a + b);
    QTable::from_values(a.n_actions(), values.collect())
}

#[test]
fn corrected_choices_are_right_and_others_are_not() {
    let cliff = model("CliffWalking-v1", &serde_json::json!({}));
    let taxi = model("Taxi-v4", &serde_json::json!({}));
    for (name, mdp) in [("lake", lake(true)), ("cliff", cliff), ("taxi", taxi)] {
        let n = mdp.n_states() * mdp.n_actions();
        let phi = QTable::from_values(mdp.n_actions(), random_numbers(2, n, 2.0));
        let q = solve(&mdp, GAMMA, &vec![0.0; mdp.n_states()]);
        let states = reachable(&mdp);
        let size = scale(q.values()).max(scale(phi.values()));
        let right = settled(&mdp, &phi, true);
        let pairs = || states.iter().flat_map(|&s| (0..mdp.n_actions()).map(move |a| (s, a)));
        let error = |(s, a)| (right.get(s, a) + phi.get(s, a) - q.get(s, a)).abs();
        let error = pairs().map(error).fold(0.0, f64::max);
        assert!(error < 1e-11, "{name}: Q_F + Φ is off by {error}");
        assert!(wrong(&states, &sum(&right, &phi), &q, size).is_empty(), "{name}");
        // The controls. More than half of the states are wrong by Q_F itself, and what bootstraps by
        // it is not put right by adding Φ afterwards.
        let uncorrected = wrong(&states, &right, &q, size).len();
        assert!(2 * uncorrected > states.len(), "{name}: {uncorrected}");
        let other = settled(&mdp, &phi, false);
        assert!(wrong(&states, &sum(&other, &phi), &q, size).len() > 5, "{name}");
    }
}

fn table(q: QTable, epsilon: f64) -> Tabular {
    let alpha = AlphaSource::Schedule(Schedule::constant(1.0));
    let behaviour = (Exploration::EpsilonGreedy, Schedule::constant(epsilon));
    Tabular::new(q, GAMMA, alpha, behaviour, Stream::new(0, "agent"))
}

/// An expert's reward of 10 for the arm that pays nothing, turned into a potential by learning from
/// its negative (Harutyunyan et al. 2015): greedy by Q_F is the expert's mistake, greedy by
/// Q_F + Φ is right and nothing of the advice is left (Behboudian et al. 2021).
#[test]
fn a_potential_learned_from_an_experts_reward() {
    let phi = QTable::from_values(2, vec![0.0, -10.0]);
    let mut agent = Advised::new(Backup::Best, table(QTable::new(1, 2, 0.0), 1.0), phi);
    for _ in 0..50 {
        let arm = agent.begin(0);
        agent.end([1.0, 0.0][arm], Last::<usize>::Terminated);
    }
    assert_eq!(agent.learned().values(), [1.0, 10.0]);
    assert_eq!(agent.q().unwrap().values(), [1.0, 0.0]);
}

/// From state 0, action 0 pays nothing and action 1 pays 0.3; where they lead, the next step ends
/// the episode for nothing. Advice is 1 for action 0. Returns what `agent` learns for state 0.
fn taught(agent: Box<dyn TabularAgent>, leads_to: [usize; 2], advised: bool) -> [f64; 2] {
    let mut phi = vec![0.0; 6];
    phi[0] = f64::from(u8::from(advised));
    let mut agent = LookBack::new(agent, QTable::from_values(2, phi));
    for _ in 0..40_000 {
        let a = agent.begin(0usize);
        agent.step([0.0, 0.3][a], leads_to[a]);
        agent.end(0.0, Last::<usize>::Terminated);
    }
    let q = agent.q().unwrap();
    [q.get(0, 0), q.get(0, 1)]
}

fn sarsa() -> Box<dyn TabularAgent> {
    let (start, end, unit) = (0.5, 0.001, Unit::Episode);
    let alpha = Schedule::Linear { start, end, over: 20_000, unit };
    let (zero, epsilon) = (QTable::new(3, 2, 0.0), Schedule::constant(0.5));
    Box::new(Sarsa::new(zero, GAMMA, alpha, epsilon, Stream::new(4, "agent")))
}

fn monte_carlo() -> Box<dyn TabularAgent> {
    let (mean, epsilon) = (AlphaSource::VisitCount { omega: 1.0 }, Schedule::constant(0.5));
    let (behaviour, stream) = ((Exploration::EpsilonGreedy, epsilon), Stream::new(4, "agent"));
    let zero = QTable::new(3, 2, 0.0);
    Box::new(MonteCarlo::new(zero, GAMMA, mean, behaviour, Visits::First, stream))
}

#[test]
fn looking_back_is_right_where_every_state_has_one_way_to_it() {
    let ([a, b], [plain_a, plain_b]) =
        (taught(sarsa(), [1, 2], true), taught(sarsa(), [1, 2], false));
    assert!((a - plain_a).abs() < 1e-6 && (b - plain_b).abs() < 1e-6, "{a}, {b}");
}

/// Where two ways meet, SARSA bootstraps from a state that has forgotten by which way it was
/// reached: the advice is not taken back from the one who took it, and the worse action looks better.
#[test]
fn looking_back_misleads_a_learner_that_bootstraps_where_two_ways_meet() {
    let [a, b] = taught(sarsa(), [1, 1], true);
    assert!((a - b - 0.7).abs() < 0.05, "{a}, {b}");
    let [a, b] = taught(sarsa(), [1, 1], false);
    assert!((b - a - 0.3).abs() < 1e-6, "the control: {a}, {b}");
}

#[test]
fn looking_back_is_right_for_whole_returns() {
    for leads_to in [[1, 2], [1, 1]] {
        let [a, b] = taught(monte_carlo(), leads_to, true);
        assert!(a.abs() < 1e-12 && (b - 0.3).abs() < 1e-12, "{a}, {b}");
    }
}
