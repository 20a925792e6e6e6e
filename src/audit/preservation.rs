//! Whether a shaping keeps the optimal policy: solve both models and compare.
//!
//! For a potential-based shaping, `Q_F + Φ = Q` for every state and action (Ng, Harada & Russell
//! 1999), hence equal advantages and equal greedy sets. Numbers are compared on the scale
//! `S = max(1, max |Q|, max |Φ|, max |F|)`: values to `1e-9 S`, ties to `1e-9 S`; a gap between
//! actions inside `(1e-11 S, 1e-8 S)` is too close to call.

use crate::learn::planning::{PolicyIteration, PolicyValueError};
use crate::learn::{QTable, greedy_set};
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

/// A comparison of two models that differ in their rewards.
#[derive(Debug, Clone, PartialEq)]
pub struct Preservation {
    /// Preserved, changed or inconclusive.
    pub verdict: Verdict,
    /// Reachable states whose greedy sets differ.
    pub states_changed: Vec<usize>,
    /// `max |Q_F + Φ − Q| / S` over reachable states: at most 1e-9 for a correct potential.
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
) -> Result<Preservation, PolicyValueError> {
    let reachable = plain.reachable();
    let q = PolicyIteration { gamma }.solve(plain)?;
    let q_shaped = PolicyIteration { gamma }.solve(shaped)?;
    let scale = scale(plain, shaped, &q, phi, &reachable);
    let (mut identity_error, mut close_call) = (0.0f64, false);
    let mut states_changed = Vec::new();
    let (mut sets, mut sets_shaped) = (Vec::new(), Vec::new());
    for s in 0..plain.n_states() {
        let (row, row_shaped) = (q.row(s), q_shaped.row(s));
        let (set, set_shaped) = (greedy_set(row, scale), greedy_set(row_shaped, scale));
        if reachable[s] {
            for (a, b) in row.iter().zip(row_shaped) {
                identity_error = identity_error.max((b + phi[s] - a).abs() / scale);
            }
            close_call |= has_close_gap(row, scale) || has_close_gap(row_shaped, scale);
            if set != set_shaped {
                states_changed.push(s);
            }
        }
        sets.push(set);
        sets_shaped.push(set_shaped);
    }
    let verdict = match (close_call, states_changed.is_empty()) {
        (true, _) => Verdict::Inconclusive,
        (false, true) => Verdict::Preserved,
        (false, false) => Verdict::Changed,
    };
    Ok(Preservation { verdict, states_changed, identity_error, plain: sets, shaped: sets_shaped })
}

/// `S = max(1, max |Q|, max |Φ|, max |F|)` over reachable states.
fn scale(
    plain: &FiniteMdp,
    shaped: &FiniteMdp,
    q: &QTable,
    phi: &[f64],
    reachable: &[bool],
) -> f64 {
    let mut scale = 1.0f64;
    for s in (0..plain.n_states()).filter(|&s| reachable[s]) {
        scale = scale.max(phi[s].abs());
        for a in 0..plain.n_actions() {
            scale = scale.max(q.get(s, a).abs());
            for (o, f) in plain.of(s, a).iter().zip(shaped.of(s, a)) {
                scale = scale.max((f.reward - o.reward).abs());
            }
        }
    }
    scale
}

/// Whether some action is below the best by an amount that is neither rounding nor certain.
fn has_close_gap(row: &[f64], scale: f64) -> bool {
    let best = row.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    row.iter().any(|q| {
        let gap = (best - q) / scale;
        gap > 1e-11 && gap < 1e-8
    })
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
        assert_eq!(
            preservation(&near, &near, 1.0, &[0.0; 3]).unwrap().verdict,
            Verdict::Inconclusive
        );
    }
}
