//! Whether a model has optimal values without discounting: whether it is a stochastic shortest path
//! problem (Bertsekas & Tsitsiklis 1991).
//!
//! From every state some policy must be sure to end, and every policy that is not must lose for
//! ever: the average reward of every end component is negative. A component that brings 0 leaves
//! greedy actions that never end; one that pays has no optimal policy at all.

use serde::Serialize;

use super::cycle::Cycle;
use super::graph::end_components;
use super::payoff::{Payoff, Sign};
use crate::learn::planning::{Dynamics, Policy, Problem};

/// Whether values without discounting mean what they should.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SspCheck {
    /// They do.
    Fine,
    /// They do not.
    NotSsp {
        /// Why.
        why: NotSsp,
        /// The states concerned.
        component: Vec<usize>,
    },
    /// Whether going on for ever among these states loses cannot be told.
    Inconclusive {
        /// The states.
        component: Vec<usize>,
        /// Bounds on the largest average reward per step.
        payoff: [f64; 2],
    },
}

/// Why a model is no stochastic shortest path problem.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum NotSsp {
    /// From the state, no policy is sure to end.
    NoEnd,
    /// An episode can go on among the states for ever and lose nothing.
    FreeLoop,
    /// An episode can go on among the states for ever and gain.
    PayingLoop {
        /// Bounds on the largest average reward per step.
        payoff: [f64; 2],
        /// A loop that brings at least the lower bound.
        cycle: Option<Cycle>,
    },
}

impl SspCheck {
    /// Looks at every end component for expected `rewards` per pair; `native` are those without
    /// shaping, for the description of a loop.
    pub fn new(dynamics: &Dynamics, rewards: &[f64], native: &[f64]) -> Self {
        let problem = Problem { dynamics, rewards, gamma: 1.0, allowed: None };
        if let Err(place) = problem.proper_policy() {
            let component = vec![dynamics.state(place)];
            return Self::NotSsp { why: NotSsp::NoEnd, component };
        }
        let staying = (0..rewards.len()).filter(|&i| !dynamics.ends(i));
        if staying.map(|i| rewards[i]).all(|r| r < 0.0) {
            return Self::Fine;
        }
        let mut result = Self::Fine;
        for component in end_components(dynamics, |_| true) {
            let payoff = Payoff::of(dynamics, rewards, &component);
            let states = || component.states.iter().map(|&place| dynamics.state(place)).collect();
            match payoff.sign {
                Sign::Positive => {
                    let cycle = best_cycle(dynamics, [rewards, native], &payoff);
                    let why = NotSsp::PayingLoop { payoff: payoff.bounds, cycle };
                    return Self::NotSsp { why, component: states() };
                }
                Sign::Zero => {
                    result = Self::NotSsp { why: NotSsp::FreeLoop, component: states() };
                }
                Sign::Unclear if result == Self::Fine => {
                    result = Self::Inconclusive { component: states(), payoff: payoff.bounds };
                }
                Sign::Negative | Sign::Unclear => {}
            }
        }
        result
    }
}

/// The first loop of the policy that pays; elsewhere it plays whatever there is.
fn best_cycle(dynamics: &Dynamics, rewards: [&[f64]; 2], payoff: &Payoff) -> Option<Cycle> {
    let n_actions = dynamics.n_actions();
    let mut policy = vec![0; dynamics.len()];
    let mut inside = vec![false; dynamics.len()];
    for &i in &payoff.policy {
        policy[i / n_actions] = i % n_actions;
        inside[i / n_actions] = true;
    }
    let sets = dynamics.recurrent(Policy::Deterministic(&policy));
    let cycles = sets.iter().filter(|set| inside[set[0]]);
    cycles
        .filter_map(|set| Cycle::new(dynamics, rewards, &policy, set).ok())
        .max_by(|a, b| per_step(a).total_cmp(&per_step(b)))
}

fn per_step(cycle: &Cycle) -> f64 {
    if cycle.deterministic { cycle.gain / cycle.states.len() as f64 } else { cycle.gain }
}

impl std::fmt::Display for SspCheck {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let among = |states: &[usize]| match states {
            [s] => format!("in state {s}"),
            [a, b] => format!("between states {a} and {b}"),
            [a, .., b] => format!("among {} states ({a} to {b})", states.len()),
            [] => unreachable!("a component has states"),
        };
        match self {
            Self::Fine => f.write_str("every policy that goes on for ever loses for ever"),
            Self::NotSsp { why: NotSsp::NoEnd, component } => write!(
                f,
                "with gamma = 1 there are no optimal values: from state {} no policy is sure to \
                 end the episode; use gamma < 1",
                component[0]
            ),
            Self::NotSsp { why: NotSsp::FreeLoop, component } => write!(
                f,
                "with gamma = 1 optimal actions need not end the episode: it can go on {} for ever \
                 and lose nothing; use gamma < 1",
                among(component)
            ),
            Self::NotSsp { why: NotSsp::PayingLoop { payoff: [low, _], cycle }, component } => {
                write!(
                    f,
                    "with gamma = 1 there is no optimal policy: an episode can go on {} for ever \
                     and gain {low:.3} a step",
                    among(cycle.as_ref().map_or(component, |cycle| &cycle.states))
                )
            }
            Self::Inconclusive { component, payoff: [low, high] } => write!(
                f,
                "whether going on {} for ever gains or loses cannot be told: from {low:e} to \
                 {high:e} a step; use gamma < 1",
                among(component)
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::planning::Over;
    use crate::mdp::{FiniteMdp, Outcome};

    /// Two states: each leads to the other by action 0, for the rewards given; action 1 may end.
    fn check(rewards: [f64; 2], ends: bool) -> SspCheck {
        let go = |probability, next_state, reward, terminated| Outcome {
            probability,
            next_state,
            reward,
            terminated,
        };
        let row = |other, reward| {
            let away = vec![go(0.5, other, reward, false), go(0.5, other, reward, false)];
            vec![away, vec![go(0.5, other, -9.0, false), go(0.5, other, -9.0, ends)]]
        };
        let table = [row(1, rewards[0]), row(0, rewards[1])];
        let mdp = FiniteMdp::new(&table, vec![1.0, 0.0]).unwrap();
        let dynamics = Dynamics::new(&mdp, Over::Reachable);
        let rewards = dynamics.rewards(&mdp);
        SspCheck::new(&dynamics, &rewards, &rewards)
    }

    #[test]
    fn what_a_round_brings_decides() {
        assert_eq!(check([-1.0, -1.0], true), SspCheck::Fine);
        assert_eq!(check([3.0, -3.1], true), SspCheck::Fine);
        let lost = check([-1.0, -1.0], false);
        assert!(
            matches!(&lost, SspCheck::NotSsp { why: NotSsp::NoEnd, component } if *component == [0])
        );
        assert!(lost.to_string().contains("from state 0 no policy is sure to end the episode"));
        let free = check([0.0, 0.0], true);
        assert!(matches!(&free, SspCheck::NotSsp { why: NotSsp::FreeLoop, .. }));
        assert!(free.to_string().contains("between states 0 and 1 for ever and lose nothing"));
        let SspCheck::NotSsp { why: NotSsp::PayingLoop { payoff, cycle }, .. } =
            check([3.5, -3.0], true)
        else {
            panic!("it pays 1/4 a step")
        };
        assert!((payoff[0] - 0.25).abs() < 1e-9 && (payoff[1] - 0.25).abs() < 1e-9);
        let cycle = cycle.unwrap();
        assert_eq!(
            (&cycle.states[..], &cycle.actions[..], cycle.gain),
            (&[0, 1][..], &[0, 0][..], 0.5)
        );
        // Nothing but rounding can tell 0.3 - 0.1 - 0.2 from 0.
        let close = check([0.3, -(0.1 + 0.2)], true);
        assert!(matches!(close, SspCheck::Inconclusive { .. }), "{close:?}");
    }
}
