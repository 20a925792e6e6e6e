//! Greedy choice with a tolerance, and choice among allowed actions.
//!
//! Rounding must not decide a tie: potential-based shaping leaves two equally good actions equal
//! in theory and apart in the last bit in practice, and from there on two learners that are the
//! same by theorem play different episodes. Values within 1e-9 of the largest count as tied, or
//! within `1e-12 |largest|` if that is more, and the first of the tied is taken.
//!
//! Adding a potential to all values of a state must not change what is tied either. Hence the
//! fixed width up to values of 1000, and above them one that is still hundreds of times what
//! rounding can add up to: two good actions converge to the same value through every distance,
//! and a width in proportion to the values would tie them sooner for one learner than for another.

use super::q_table::max;
use super::{QTable, Seen};
use crate::mdp::Action;

/// Width of a tie between values that are not large.
const TIE: f64 = 1e-9;
/// Width of a tie between large values, per unit.
const LARGE_TIE: f64 = 1e-12;

/// The smallest value that counts as tied with the largest, `best`.
#[inline]
fn threshold(best: f64) -> f64 {
    best - (LARGE_TIE * best.abs()).max(TIE)
}

/// The first action whose value is within the tie tolerance of the largest.
#[inline]
pub fn argmax_tol(row: &[f64]) -> Action {
    let threshold = threshold(max(row));
    row.iter().position(|&q| q >= threshold).unwrap_or(0)
}

/// All actions that are tied with the largest by the tolerance with which [`argmax_tol`] chooses,
/// in order.
pub fn tied(row: &[f64]) -> Vec<Action> {
    (0..row.len()).filter(|&a| is_greedy(row, 0, a)).collect()
}

/// Whether `action` is within the tie tolerance of the largest value among the actions that `s`
/// allows.
#[inline]
pub(super) fn is_greedy<S: Seen>(row: &[f64], s: S, action: Action) -> bool {
    row[action] >= threshold(max_allowed(row, s))
}

/// The largest value among the actions that `s` allows.
#[inline]
pub fn max_allowed<S: Seen>(row: &[f64], s: S) -> f64 {
    if !S::SHIELDED {
        return max(row);
    }
    let mut best = f64::NEG_INFINITY;
    for (a, &q) in row.iter().enumerate() {
        if s.allows(a) && q > best {
            best = q;
        }
    }
    best
}

/// The first action whose value is the largest among those that `s` allows, to the last bit: what
/// [`max_allowed`] is the value of.
#[inline]
pub(super) fn argmax_exact<S: Seen>(row: &[f64], s: S) -> Action {
    let best = max_allowed(row, s);
    (0..row.len()).find(|&a| s.allows(a) && row[a] == best).unwrap_or(0)
}

/// [`argmax_tol`] among the actions that `s` allows.
#[inline]
pub fn argmax_allowed<S: Seen>(row: &[f64], s: S) -> Action {
    if !S::SHIELDED {
        return argmax_tol(row);
    }
    let threshold = threshold(max_allowed(row, s));
    (0..row.len()).find(|&a| s.allows(a) && row[a] >= threshold).unwrap_or(0)
}

/// The action that `u` in [0, 1) picks from those that `s` allows, each with the same probability.
#[inline]
pub fn pick_allowed<S: Seen>(n_actions: usize, s: S, u: f64) -> Action {
    if !S::SHIELDED {
        return ((u * n_actions as f64) as usize).min(n_actions - 1);
    }
    let n = (0..n_actions).filter(|&a| s.allows(a)).count();
    let k = ((u * n as f64) as usize).min(n.saturating_sub(1));
    (0..n_actions).filter(|&a| s.allows(a)).nth(k).unwrap_or(0)
}

/// All actions within the tie tolerance of the largest, in order. `scale` widens the tolerance to
/// the size of the numbers that went into the values (their rounding errors do not shrink with a
/// difference): the tolerance is `1e-9 · max(1, scale)`.
pub fn greedy_set(row: &[f64], scale: f64) -> Vec<Action> {
    let threshold = max(row) - TIE * scale.max(1.0);
    (0..row.len()).filter(|&a| row[a] >= threshold).collect()
}

/// The greedy set of every state, with one tolerance for the table: `1e-9 · max(1, max |Q|)`.
pub fn greedy_sets(q: &QTable) -> Vec<Vec<Action>> {
    let scale = q.values().iter().fold(0.0f64, |m, v| m.max(v.abs()));
    (0..q.n_states()).map(|s| greedy_set(q.row(s), scale)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ties_go_to_the_first_and_rounding_does_not_break_them() {
        assert_eq!(argmax_tol(&[0.0, 0.0, 0.0]), 0);
        assert_eq!(argmax_tol(&[0.3, 0.1 + 0.2, 0.0]), 0, "0.1 + 0.2 is above 0.3 by an ulp only");
        assert_eq!(argmax_tol(&[0.0, 1e-8]), 1);
        assert_eq!(argmax_tol(&[1e6, 1e6 + 1e-7]), 0, "the tolerance grows with the values");
        assert_eq!(argmax_tol(&[500.0, 500.0 + 2e-9]), 1, "but not with small ones");
        assert_eq!(argmax_tol(&[-2.0, -1.0, -1.5]), 1);
    }

    #[test]
    fn greedy_sets_hold_every_tied_action() {
        assert_eq!(greedy_set(&[1.0, 1.0 + 1e-12, 0.5], 1.0), [0, 1]);
        assert_eq!(greedy_set(&[1.0, 1.0 + 1e-8, 0.5], 1.0), [1]);
        assert_eq!(greedy_set(&[1.0, 1.0 + 1e-8, 0.5], 1e3), [0, 1]);
    }
}
