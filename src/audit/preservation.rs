//! Whether a shaping keeps the optimal policy: solve both models and compare.
//!
//! For a potential-based shaping, `Q_F + Φ = Q` for every state and action (Ng, Harada & Russell
//! 1999), hence equal advantages and equal greedy sets.
//!
//! Each model is read on its own scale S, the largest of its |Q|, |r| and |Φ|, for that is what
//! rounding errors are relative to: gaps below `1e-11 S` are ties, gaps above `1e-8 S` are not, and
//! between the two nothing is certain. A potential of 1e12 drowns the gaps of the plain model: where
//! those are real but below `1e-8` of the shaped model's scale, its ties prove nothing either.

use crate::learn::QTable;
use crate::learn::planning::{PlanError, Planner, PolicyIteration};
use crate::mdp::FiniteMdp;

/// What comes of the comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
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
#[derive(Debug, Clone, PartialEq)]
pub struct Preservation {
    /// Preserved, changed or inconclusive.
    pub verdict: Verdict,
    /// Reachable states whose greedy sets differ.
    pub states_changed: Vec<usize>,
    /// `max |Q_F + Φ − Q|` over reachable states, relative to the larger scale (at least 1): at most
    /// 1e-9 for a correct potential.
    pub identity_error: f64,
    /// Greedy sets of the plain model, one per state.
    pub plain: Vec<Vec<usize>>,
    /// Greedy sets of the shaped model, one per state.
    pub shaped: Vec<Vec<usize>>,
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
/// If a policy has no value: with γ = 1, episodes that may never end.
pub fn preservation(
    plain: &FiniteMdp,
    shaped: &FiniteMdp,
    gamma: f64,
    phi: &[f64],
) -> Result<Preservation, PlanError> {
    let reachable = plain.reachable();
    let zero = vec![0.0; phi.len()];
    let minus_phi: Vec<f64> = phi.iter().map(|phi| -phi).collect();
    let q = PolicyIteration { gamma }.solve(plain, &zero)?.q;
    let q_shaped = PolicyIteration { gamma }.solve(shaped, &minus_phi)?.q;
    let scale = scale_of(plain, &q, &zero, &reachable);
    let scale_shaped = scale_of(shaped, &q_shaped, phi, &reachable);
    let (mut identity_error, mut uncertain) = (0.0f64, false);
    let mut states_changed = Vec::new();
    let (mut sets, mut sets_shaped) = (Vec::new(), Vec::new());
    for s in 0..plain.n_states() {
        let (row, row_shaped) = (q.row(s), q_shaped.row(s));
        sets.push(tied(row, scale));
        sets_shaped.push(tied(row_shaped, scale_shaped));
        if !reachable[s] {
            continue;
        }
        for (a, b) in row.iter().zip(row_shaped) {
            let size = scale.max(scale_shaped).max(1.0);
            identity_error = identity_error.max((b + phi[s] - a).abs() / size);
        }
        match compare(row, scale, row_shaped, scale_shaped) {
            Some(true) => {}
            Some(false) => states_changed.push(s),
            None => uncertain = true,
        }
    }
    let verdict = match (states_changed.is_empty(), uncertain) {
        (false, _) => Verdict::Changed,
        (true, true) => Verdict::Inconclusive,
        (true, false) => Verdict::Preserved,
    };
    Ok(Preservation { verdict, states_changed, identity_error, plain: sets, shaped: sets_shaped })
}

/// The largest |Q|, |r| and |Φ| over reachable states.
fn scale_of(mdp: &FiniteMdp, q: &QTable, phi: &[f64], reachable: &[bool]) -> f64 {
    let mut scale = 0.0f64;
    for s in (0..mdp.n_states()).filter(|&s| reachable[s]) {
        scale = scale.max(phi[s].abs());
        for a in 0..mdp.n_actions() {
            scale = scale.max(q.get(s, a).abs());
            for o in mdp.of(s, a) {
                scale = scale.max(o.reward.abs());
            }
        }
    }
    scale
}

/// How far an action is below the best: nothing, something, or too close to call.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Gap {
    Tie,
    Unclear,
    Real,
}

fn gap(row: &[f64], a: usize, scale: f64) -> Gap {
    let best = row.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    match best - row[a] {
        gap if gap <= 1e-11 * scale => Gap::Tie,
        gap if gap >= 1e-8 * scale => Gap::Real,
        _ => Gap::Unclear,
    }
}

/// The actions that are not clearly below the best.
fn tied(row: &[f64], scale: f64) -> Vec<usize> {
    (0..row.len()).filter(|&a| gap(row, a, scale) != Gap::Real).collect()
}

/// Whether the greedy sets of a state are equal; `None` if that cannot be said.
fn compare(row: &[f64], scale: f64, shaped: &[f64], scale_shaped: f64) -> Option<bool> {
    let best = row.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mut equal = Some(true);
    for a in 0..row.len() {
        match (gap(row, a, scale), gap(shaped, a, scale_shaped)) {
            (Gap::Tie, Gap::Tie) | (Gap::Real, Gap::Real) => {}
            (Gap::Tie, Gap::Real) => return Some(false),
            // Had the shaping kept the gap, would it have been seen?
            (Gap::Real, Gap::Tie) if best - row[a] >= 1e-8 * scale_shaped => return Some(false),
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
}
