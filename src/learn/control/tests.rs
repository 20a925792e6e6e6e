//! Updates by hand, of the agents whose files have no tests of their own. Unless said otherwise
//! row 0 is (0, 1), row 1 is (4, 2), γ = 0.9, α = 0.5 and ε = 0.

use super::*;
use crate::learn::{Agent, AlphaSource, Exploration, Last, Learn, QTable, Schedule};
use crate::mdp::streams::Stream;
use crate::shaping::{ActionSet, Shielded};

const ROWS: [f64; 4] = [0.0, 1.0, 4.0, 2.0];

pub(super) fn exploring(alpha: f64, epsilon: f64) -> Tabular {
    let q = QTable::from_values(2, ROWS.to_vec());
    let alpha = AlphaSource::Schedule(Schedule::constant(alpha));
    let epsilon = (Exploration::EpsilonGreedy, Schedule::constant(epsilon));
    Tabular::new(q, 0.9, alpha, epsilon, Stream::new(0, "test"))
}

pub(super) fn greedy(alpha: f64) -> Tabular {
    exploring(alpha, 0.0)
}

fn q(agent: &impl Agent, s: usize, a: usize) -> f64 {
    agent.q().unwrap().get(s, a)
}

#[track_caller]
fn close(a: f64, b: f64) {
    assert!((a - b).abs() < 1e-14, "{a} is not {b}");
}

#[test]
fn expected_sarsa() {
    let mut agent = ExpectedSarsa::new(exploring(0.5, 0.5));
    let a = agent.begin(0);
    let old = ROWS[a];
    // What ε = 0.5 expects of row 1: 0.5 * (4 + 2) / 2 + 0.5 * 4 = 3.5.
    agent.step(10.0, 1);
    close(q(&agent, 0, a), old + 0.5 * (10.0 + 0.9 * 3.5 - old));
    let mut agent = ExpectedSarsa::new(greedy(0.5));
    assert_eq!(agent.begin(1), 0);
    // The next action is chosen after the update: Q(1, 0) = 4 + 0.5 (-20 + 3.6 - 4) = -6.2.
    assert_eq!(agent.step(-20.0, 1), 1);
    agent.end(1.0, Last::<usize>::Terminated);
    close(q(&agent, 1, 1), 2.0 + 0.5 * (1.0 - 2.0));
}

#[test]
fn expected_sarsa_behind_a_shield() {
    let mut agent = ExpectedSarsa::new(exploring(0.5, 0.5));
    let state = |cell, allowed| Shielded { cell, allowed: ActionSet(allowed) };
    assert_eq!(agent.begin(state(0, 0b01)), 0);
    // Only action 1, worth 2, is there to be expected.
    agent.end(10.0, Last::Truncated(state(1, 0b10)));
    close(q(&agent, 0, 0), 0.5 * (10.0 + 0.9 * 2.0));
}

#[test]
fn sarsa_lambda() {
    for (kind, trace) in [(Trace::Accumulating, 1.0 + 0.45 * 0.45), (Trace::Replacing, 1.0)] {
        // γλ = 0.45.
        let mut agent = SarsaLambda::new(greedy(0.5), Traces::new(kind, 0.45, 0.0, 4));
        assert_eq!(agent.begin(0), 1);
        // δ = 10 + 0.9 * 4 - 1 = 12.6; only (0, 1) has a trace.
        assert_eq!(agent.step(10.0, 1), 0);
        close(q(&agent, 0, 1), 7.3);
        // Back in 0, where 1 is greedy: δ = -2 + 0.9 * 7.3 - 4 = 0.57; traces 1 and 0.45.
        assert_eq!(agent.step(-2.0, 0), 1);
        close(q(&agent, 1, 0), 4.0 + 0.5 * 0.57);
        let q01 = 7.3 + 0.5 * 0.57 * 0.45;
        close(q(&agent, 0, 1), q01);
        // The end pays 3: δ = 3 - Q(0, 1), and the second visit of (0, 1) shows.
        let delta = 3.0 - q01;
        agent.end(3.0, Last::<usize>::Terminated);
        close(q(&agent, 0, 1), q01 + 0.5 * delta * trace);
        close(q(&agent, 1, 0), 4.285 + 0.5 * delta * 0.45);
        // The next episode starts without traces.
        let before = q(&agent, 1, 0);
        agent.begin(0);
        agent.end(5.0, Last::<usize>::Terminated);
        close(q(&agent, 1, 0), before);
    }
}

#[test]
fn q_lambda_cuts_after_exploration_only() {
    let traces = || Traces::new(Trace::Accumulating, 0.45, 0.0, 4);
    // Greedy throughout: as SARSA(λ), whose next action is the greedy one.
    let mut agent = QLambda::new(greedy(0.5), traces());
    agent.begin(0);
    agent.step(10.0, 1);
    agent.step(-2.0, 0);
    close(q(&agent, 0, 1), 7.3 + 0.5 * 0.57 * 0.45);
    // The shield forces the worse action on the agent in state 1: greedy among the allowed, so
    // nothing is cut, and what is bootstrapped from is worth 2.
    let mut agent = QLambda::new(greedy(0.5), traces());
    let (free, bound) = (ActionSet(0b11), ActionSet(0b10));
    assert_eq!(agent.begin(Shielded { cell: 0, allowed: free }), 1);
    // δ = 10 + 0.9 * 2 - 1 = 10.8, Q(0, 1) = 6.4.
    assert_eq!(agent.step(10.0, Shielded { cell: 1, allowed: bound }), 1);
    // δ = -2 + 0.9 * 6.4 - 2 = 1.76.
    agent.step(-2.0, Shielded { cell: 0, allowed: free });
    close(q(&agent, 0, 1), 6.4 + 0.5 * 1.76 * 0.45);
    // An agent that always explores plays both actions; where the worse one was chosen in state 1,
    // the step from there changes nothing in state 0.
    let mut cut = [0, 0];
    let mut agent = QLambda::new(exploring(0.5, 1.0), traces());
    for _ in 0..100 {
        agent.begin(0);
        let in_one = agent.step(0.0, 1);
        let greedy = q(&agent, 1, 0) > q(&agent, 1, 1) + 0.5;
        let (first, second) = (q(&agent, 0, 0), q(&agent, 0, 1));
        agent.end(9.0, Last::<usize>::Terminated);
        let unchanged = (first, second) == (q(&agent, 0, 0), q(&agent, 0, 1));
        if greedy {
            assert_eq!(unchanged, in_one == 1);
            cut[in_one] += 1;
        }
    }
    assert!(cut.iter().all(|n| *n > 0), "{cut:?}: neither was seen");
}

#[test]
fn dyna_q() {
    // One planning step after the first real one can only repeat it.
    let mut agent = DynaQ::new(greedy(0.5), 1, Stream::new(0, "planning"));
    assert_eq!(agent.begin(0), 1);
    agent.step(10.0, 1);
    // 1 → 7.3 by the real step → 7.3 + 0.5 (10 + 3.6 - 7.3) = 10.45 by the planned one.
    close(q(&agent, 0, 1), 10.45);
    // A terminal transition is remembered as one: (1, 0) has 4 → 3.5 by the real step, and after
    // enough planning both are at their fixed points, 3 and 10 + 0.9 * 3.
    let mut agent = DynaQ::new(greedy(0.5), 400, Stream::new(0, "planning"));
    agent.begin(0);
    agent.step(10.0, 1);
    agent.end(3.0, Last::<usize>::Terminated);
    close(q(&agent, 1, 0), 3.0);
    close(q(&agent, 0, 1), 12.7);
    // Pairs never tried are never planned.
    assert_eq!([q(&agent, 0, 0), q(&agent, 1, 1)], [0.0, 2.0]);
    // What happened last is what counts.
    agent.begin(1);
    agent.end(-1.0, Last::<usize>::Terminated);
    close(q(&agent, 1, 0), -1.0);
}

#[test]
fn dyna_q_remembers_what_was_allowed() {
    let mut agent = DynaQ::new(greedy(0.5), 200, Stream::new(0, "planning"));
    let allowed = ActionSet(0b10);
    agent.begin(Shielded { cell: 0, allowed });
    agent.end(1.0, Last::Truncated(Shielded { cell: 1, allowed }));
    // 1 + 0.9 * 2: the refused action, worth 4, is not planned with either.
    close(q(&agent, 0, 1), 2.8);
}

/// Dyna-Q without planning, n-step SARSA with n = 1 and the λ agents with λ = 0 are what they
/// extend, choice by choice.
#[test]
fn special_cases_are_the_plain_agents() {
    let table = || exploring(0.5, 0.3);
    let traces = || Traces::new(Trace::Accumulating, 0.0, 0.0, 4);
    let mut q_learning = QLearning::of(table());
    let mut dyna = DynaQ::new(table(), 0, Stream::new(0, "planning"));
    let mut sarsa = Sarsa::of(table());
    let mut sarsa_lambda = SarsaLambda::new(table(), traces());
    let mut one = NStepSarsa::new(table(), 1);
    let mut random = Stream::new(2, "walk");
    for _ in 0..50 {
        let s = random.below(2);
        assert_eq!(q_learning.begin(s), dyna.begin(s));
        let a = sarsa.begin(s);
        assert_eq!([a, a], [sarsa_lambda.begin(s), one.begin(s)]);
        for _ in 0..random.below(9) {
            let (r, next) = (random.uniform(), random.below(2));
            assert_eq!(q_learning.step(r, next), dyna.step(r, next));
            let a = sarsa.step(r, next);
            assert_eq!([a, a], [sarsa_lambda.step(r, next), one.step(r, next)]);
        }
        let last =
            if random.below(2) == 0 { Last::Terminated } else { Last::Truncated(random.below(2)) };
        for agent in [
            &mut q_learning as &mut dyn Learn<usize>,
            &mut dyna,
            &mut sarsa,
            &mut sarsa_lambda,
            &mut one,
        ] {
            agent.end(1.0, last);
        }
    }
    assert_eq!(q_learning.q(), dyna.q());
    for pair in 0..4 {
        let q = |agent: &dyn Learn<usize>| agent.q().unwrap().values()[pair];
        close(q(&sarsa_lambda), q(&sarsa));
        close(q(&one), q(&sarsa));
    }
}
