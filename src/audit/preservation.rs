//! Whether a shaping keeps the optimal policy: solve both models and compare.
//!
//! For a potential-based shaping, `Q_F + Φ = Q` for every state and action (Ng, Harada & Russell
//! 1999), hence equal advantages and equal greedy sets.
//!
//! Each model is read on its own scale S, the largest of its |Q|, |r| and |Φ|, for that is what
//! rounding errors are relative to: gaps below `1e-11 S` are ties, gaps above `1e-8 S` are not, and
//! between the two nothing is certain. A potential of 1e12 drowns the gaps of the plain model: where
//! those are real but below `1e-8` of the shaped model's scale, its ties prove nothing either.

use serde::Serialize;

use super::gap::{Gap, Scale, best};
use super::pair::{Pair, Unsolved};
use crate::mdp::{Action, FiniteMdp};

/// What comes of the comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The greedy action sets are equal in every reachable state.
    Preserved,
    /// They differ.
    Changed,
    /// Rounding could explain the difference, or its absence.
    Inconclusive,
}

impl Verdict {
    /// Whether the greedy sets are equal; `None` if the numbers cannot tell.
    pub fn preserved(self) -> Option<bool> {
        match self {
            Self::Preserved => Some(true),
            Self::Changed => Some(false),
            Self::Inconclusive => None,
        }
    }
}

/// A comparison of two models that differ in their rewards.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Preservation {
    /// Preserved, changed or inconclusive.
    pub verdict: Verdict,
    /// Reachable states whose greedy sets differ.
    pub states_changed: Vec<usize>,
    /// `max |Q_F + Φ − Q|` over reachable states, relative to the larger scale (at least 1): at most
    /// 1e-9 for a correct potential.
    pub identity_error: f64,
    /// Greedy sets of the plain model, one per state; empty where no episode can be.
    pub plain: Vec<Vec<Action>>,
    /// Greedy sets of the shaped model, likewise.
    pub shaped: Vec<Vec<Action>>,
}

impl Preservation {
    /// Whether `Q_F + Φ = Q` holds.
    pub fn identity_holds(&self) -> bool {
        self.identity_error <= 1e-9
    }
}

/// Solves `plain` and `shaped` (the same dynamics with other rewards) exactly and compares them on
/// the states that are reachable. `phi` holds one value per state, all 0 without a potential.
///
/// # Errors
/// If γ = 1 and either is no stochastic shortest path problem, or a value is not finite.
pub fn preservation(
    plain: &FiniteMdp,
    shaped: &FiniteMdp,
    gamma: f64,
    phi: &[f64],
) -> Result<Preservation, Unsolved> {
    Ok(Pair::of_models(plain, shaped, gamma)?.preservation(phi))
}

impl Pair {
    /// Compares the greedy sets. `phi` holds one value per state of the model: all 0 without a
    /// potential.
    pub fn preservation(&self, phi: &[f64]) -> Preservation {
        let n_actions = self.dynamics.n_actions();
        let phi: Vec<f64> =
            (0..self.dynamics.len()).map(|place| phi[self.dynamics.state(place)]).collect();
        let (q, q_shaped) = (&self.native.optimum.q, &self.learned.optimum.q);
        let scale = Scale::new(&self.native, 0.0);
        let largest_phi = phi.iter().fold(0.0f64, |m, phi| m.max(phi.abs()));
        let scale_shaped = Scale::new(&self.learned, largest_phi);
        let size = scale.size.max(scale_shaped.size).max(1.0);
        let mut result = Preservation {
            verdict: Verdict::Preserved,
            states_changed: Vec::new(),
            identity_error: 0.0,
            plain: vec![Vec::new(); self.dynamics.n_model_states()],
            shaped: vec![Vec::new(); self.dynamics.n_model_states()],
        };
        let mut uncertain = false;
        for (place, phi) in phi.iter().enumerate() {
            let s = self.dynamics.state(place);
            let row = &q[place * n_actions..][..n_actions];
            let row_shaped = &q_shaped[place * n_actions..][..n_actions];
            result.plain[s] = tied(row, &scale);
            result.shaped[s] = tied(row_shaped, &scale_shaped);
            for (a, b) in row.iter().zip(row_shaped) {
                result.identity_error = result.identity_error.max((b + phi - a).abs() / size);
            }
            match compare(row, &scale, row_shaped, &scale_shaped) {
                Some(true) => {}
                Some(false) => result.states_changed.push(s),
                None => uncertain = true,
            }
        }
        result.verdict = match (result.states_changed.is_empty(), uncertain) {
            (false, _) => Verdict::Changed,
            (true, true) => Verdict::Inconclusive,
            (true, false) => Verdict::Preserved,
        };
        result
    }
}

/// The actions that are not clearly below the best.
fn tied(row: &[f64], scale: &Scale) -> Vec<Action> {
    (0..row.len()).filter(|&a| scale.gap(row, a) != Gap::Real).collect()
}

/// Whether the greedy sets of a state are equal; `None` if that cannot be said.
fn compare(row: &[f64], scale: &Scale, shaped: &[f64], scale_shaped: &Scale) -> Option<bool> {
    let mut equal = Some(true);
    for a in 0..row.len() {
        match (scale.gap(row, a), scale_shaped.gap(shaped, a)) {
            (Gap::Tie, Gap::Tie) | (Gap::Real, Gap::Real) => {}
            (Gap::Tie, Gap::Real) => return Some(false),
            // Had the shaping kept the gap, would it have been seen?
            (Gap::Real, Gap::Tie) if best(row) - row[a] >= scale_shaped.real() => {
                return Some(false);
            }
            _ => equal = None,
        }
    }
    equal
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mdp::Outcome;
    use crate::shaping::shaped_model;

    /// Grześ's counterexample: from s0 to one terminal for 1, to another for 0.5; the second
    /// terminal's potential is 0.6.
    fn choice() -> FiniteMdp {
        let exit = |next_state, reward| {
            vec![Outcome { probability: 1.0, next_state, reward, terminated: true }]
        };
        FiniteMdp::new(
            &[vec![exit(1, 1.0), exit(2, 0.5)], vec![exit(1, 0.0); 2], vec![exit(2, 0.0); 2]],
            vec![1.0, 0.0, 0.0],
        )
        .unwrap()
    }

    #[test]
    fn a_potential_preserves_and_a_terminal_potential_does_not() {
        let (mdp, phi) = (choice(), [3.0, 0.0, 0.6]);
        let good = preservation(&mdp, &shaped_model(&mdp, 1.0, &phi), 1.0, &phi).unwrap();
        assert_eq!(good.verdict, Verdict::Preserved);
        assert!(good.identity_holds());

        let wrong = mdp.with_rewards(|s, _, o| o.reward + phi[o.next_state as usize] - phi[s]);
        let bad = preservation(&mdp, &wrong, 1.0, &phi).unwrap();
        assert_eq!(bad.verdict, Verdict::Changed);
        assert_eq!(bad.states_changed, [0]);
        assert!(!bad.identity_holds());
    }

    #[test]
    fn a_gap_near_the_tolerance_is_inconclusive() {
        let mdp = choice();
        let near = mdp.with_rewards(|_, a, _| if a == 0 { 1.0 } else { 1.0 - 1e-10 });
        let verdict = preservation(&near, &near, 1.0, &[0.0; 3]).unwrap().verdict;
        assert_eq!(verdict, Verdict::Inconclusive);
    }

    #[test]
    fn a_potential_that_drowns_the_rewards_is_inconclusive() {
        let mdp = choice();
        for (size, expected) in [
            (1e3, Verdict::Preserved),
            (1e6, Verdict::Preserved),
            (1e8, Verdict::Inconclusive),
            (1e10, Verdict::Inconclusive),
            (1e17, Verdict::Inconclusive),
        ] {
            let phi = [size, 0.0, 0.0];
            let result = preservation(&mdp, &shaped_model(&mdp, 1.0, &phi), 1.0, &phi).unwrap();
            assert_eq!(result.verdict, expected, "potential of {size}");
        }
    }

    #[test]
    fn positive_scaling_preserves_whatever_the_factor() {
        let mdp = choice();
        for k in [1e-12, 1e-6, 1.0, 1e6, 1e12] {
            let scaled = mdp.with_rewards(|_, _, o| k * o.reward);
            let result = preservation(&mdp, &scaled, 1.0, &[0.0; 3]).unwrap();
            assert_eq!(result.verdict, Verdict::Preserved, "times {k}");
        }
    }

    /// A constant potential that terminal states have too is a living cost of (1 − γ) c: to exit for
    /// 1 now or for 1.2 in the next step changes places at γ = 0.9, c = 1.
    #[test]
    fn a_constant_potential_must_leave_out_terminal_states() {
        let go = |next_state, reward, terminated| {
            vec![Outcome { probability: 1.0, next_state, reward, terminated }]
        };
        let (now, later) = (go(1, 1.0, true), go(1, 0.0, false));
        let mdp =
            FiniteMdp::new(&[vec![now, later], vec![go(1, 1.2, true); 2]], vec![1.0, 0.0]).unwrap();
        let phi = [1.0; 2];
        let right = preservation(&mdp, &shaped_model(&mdp, 0.9, &phi), 0.9, &phi).unwrap();
        assert_eq!(right.verdict, Verdict::Preserved);
        assert_eq!(right.plain[0], [1]);
        let wrong = mdp.with_rewards(|_, _, o| o.reward + 0.9 - 1.0);
        let wrong = Pair::of_models(&mdp, &wrong, 0.9).unwrap();
        assert_eq!(wrong.preservation(&[0.0; 2]).shaped[0], [0]);
        for (q, expected) in wrong.learned.optimum.q.iter().zip([0.9, 0.89]) {
            assert!((q - expected).abs() < 1e-12);
        }
    }
}
