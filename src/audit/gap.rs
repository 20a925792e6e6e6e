//! Telling ties from differences.
//!
//! Each model is read on its own scale S, the largest of its |Q|, |r| and |Φ|, for that is what
//! rounding errors are relative to: gaps below `1e-11 S` are ties, gaps above `1e-8 S` are not, and
//! between the two nothing is certain.

use super::pair::Solved;

/// How far an action is below the best: nothing, something, or too close to call.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Gap {
    Tie,
    Unclear,
    Real,
}

/// The widths of a tie and of a difference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scale {
    /// S.
    pub(super) size: f64,
    /// How far a value may be from the exact one.
    bound: f64,
}

impl Scale {
    /// Of a solved task; `largest` is the largest of the other numbers that went into it.
    pub(super) fn new(solved: &Solved, largest: f64) -> Self {
        let optimum = &solved.optimum;
        let size = optimum.q.iter().fold(solved.largest.max(largest), |m, q| m.max(q.abs()));
        Self { size, bound: optimum.bound.unwrap_or(0.0) }
    }

    /// The least difference that is one.
    pub(super) fn real(&self) -> f64 {
        (1e-8 * self.size).max(4.0 * self.bound)
    }

    pub(super) fn judge(&self, gap: f64) -> Gap {
        match gap {
            gap if gap <= 1e-11 * self.size => Gap::Tie,
            gap if gap >= self.real() => Gap::Real,
            _ => Gap::Unclear,
        }
    }

    /// The gap of action `a` of a row.
    pub(super) fn gap(&self, row: &[f64], a: usize) -> Gap {
        self.judge(best(row) - row[a])
    }

    /// Which pairs are not clearly below the best of their state.
    pub(super) fn tied(&self, q: &[f64], n_actions: usize) -> Vec<bool> {
        let rows = q.chunks_exact(n_actions);
        rows.flat_map(|row| (0..n_actions).map(|a| self.gap(row, a) != Gap::Real)).collect()
    }
}

/// The largest value of a row.
pub(super) fn best(row: &[f64]) -> f64 {
    row.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}
