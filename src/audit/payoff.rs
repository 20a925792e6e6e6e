//! What going on for ever brings per step: the optimal average reward of an end component.
//!
//! For any h, `min_s (Th − h)(s) ≤ g ≤ max_s (Th − h)(s)` with `Th(s) = max_a r(s, a) + Σ p h(s′)`
//! (Odoni 1969; Puterman 1994, section 8.5.4): relative value iteration makes the two meet.

use super::graph::{EndComponent, end_components};
use crate::learn::planning::Dynamics;

/// Transitions to look at before giving up.
const BUDGET: usize = 500_000_000;
/// Averages this much below the size of the rewards cannot be told from 0.
const ZERO: f64 = 1e-9;

/// The sign of the largest average reward.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sign {
    Negative,
    /// Exactly: all that is played for ever brings 0.
    Zero,
    Positive,
    Unclear,
}

/// The largest average reward per step of an end component.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Payoff {
    pub(super) sign: Sign,
    /// It is at least and at most this.
    pub(super) bounds: [f64; 2],
    /// If it is positive: for every state of the component a pair, which together bring at least
    /// the lower bound.
    pub(super) policy: Vec<usize>,
}

impl Payoff {
    fn known(sign: Sign, bounds: [f64; 2]) -> Self {
        Self { sign, bounds, policy: Vec::new() }
    }

    /// Of `component`, for expected `rewards` per pair.
    pub(super) fn of(dynamics: &Dynamics, rewards: &[f64], component: &EndComponent) -> Self {
        let own = || component.pairs.iter().map(|&i| rewards[i]);
        let low = own().fold(f64::INFINITY, f64::min);
        let high = own().fold(f64::NEG_INFINITY, f64::max);
        if high < 0.0 {
            return Self::known(Sign::Negative, [low, high]);
        }
        if high == 0.0 {
            // Nothing is gained: the question is whether nothing need be lost.
            let mut free = vec![false; rewards.len()];
            for &i in &component.pairs {
                free[i] = rewards[i] == 0.0;
            }
            return if end_components(dynamics, |i| free[i]).is_empty() {
                Self::known(Sign::Negative, [low, 0.0])
            } else {
                Self::known(Sign::Zero, [0.0; 2])
            };
        }
        iterate(dynamics, rewards, component, low.abs().max(high))
    }
}

/// Relative value iteration on the lazy component, which stays where it is half of the time: that
/// halves nothing but the speed, and what goes round in circles converges too.
fn iterate(dynamics: &Dynamics, rewards: &[f64], component: &EndComponent, size: f64) -> Payoff {
    let n_actions = dynamics.n_actions();
    let mut h = vec![0.0; dynamics.len()];
    let mut next = vec![0.0; component.states.len()];
    let mut policy = vec![0; component.states.len()];
    let mut bounds = [f64::NEG_INFINITY, f64::INFINITY];
    let per_sweep: usize = component.pairs.iter().map(|&i| dynamics.next(i).0.len() + 1).sum();
    for _ in 0..BUDGET / per_sweep {
        next.fill(f64::NEG_INFINITY);
        let mut at = 0;
        for &i in &component.pairs {
            while component.states[at] != i / n_actions {
                at += 1;
            }
            let value = dynamics.backup(rewards, 1.0, &h, i);
            if value > next[at] {
                (next[at], policy[at]) = (value, i);
            }
        }
        let changes = component.states.iter().zip(&next).map(|(&s, next)| next - h[s]);
        bounds = changes.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], change| {
            [low.min(change), high.max(change)]
        });
        let [low, high] = bounds;
        if high < -ZERO * size || high - low <= ZERO * size * 1e-2 {
            break;
        }
        let base = next[0];
        for (&s, next) in component.states.iter().zip(&next) {
            h[s] += 0.5 * (next - base - h[s]);
        }
    }
    let sign = match bounds {
        [_, high] if high < -ZERO * size => Sign::Negative,
        [low, _] if low > ZERO * size => Sign::Positive,
        _ => Sign::Unclear,
    };
    Payoff { sign, bounds, policy }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::planning::Over;
    use crate::mdp::{FiniteMdp, Outcome};

    fn payoff(rewards: [f64; 4]) -> Payoff {
        // Two states, each with one action to stay and one to change.
        let go = |next_state, reward| {
            vec![Outcome { probability: 1.0, next_state, reward, terminated: false }]
        };
        let [a, b, c, d] = rewards;
        let table = [vec![go(0, a), go(1, b)], vec![go(1, c), go(0, d)]];
        let mdp = FiniteMdp::new(&table, vec![1.0, 0.0]).unwrap();
        let dynamics = Dynamics::new(&mdp, Over::Every);
        let [component] = &end_components(&dynamics, |_| true)[..] else {
            unreachable!("all is one component")
        };
        Payoff::of(&dynamics, &dynamics.rewards(&mdp), component)
    }

    #[test]
    fn the_best_of_two_loops_and_a_round_trip() {
        assert_eq!(payoff([-1.0, -2.0, -3.0, -0.5]).sign, Sign::Negative);
        assert_eq!(payoff([-1.0, 0.0, -1.0, 0.0]).sign, Sign::Zero);
        assert_eq!(payoff([-1.0, 0.0, -1.0, -1e-3]).sign, Sign::Negative);
        // The round trip brings (5 − 4) / 2; a potential of 2^52 would not change that.
        let round = payoff([0.25, 5.0, 0.0, -4.0]);
        assert_eq!(round.sign, Sign::Positive);
        assert!(round.bounds.iter().all(|g| (g - 0.5).abs() < 1e-9), "{:?}", round.bounds);
        assert_eq!(round.policy, [1, 3]);
        assert_eq!(payoff([-0.25, 5.0, -0.25, -5.5]).sign, Sign::Negative);
        assert_eq!(payoff([-1.0, 5.0, -1.0, -5.0]).sign, Sign::Unclear, "0, by rounding or not");
    }
}
