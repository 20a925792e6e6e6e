//! What is known of the values of expressions: between which bounds they lie. Arithmetic of integers
//! that cannot overflow, and indices that cannot be outside, need no check.
//!
//! The bounds belong to values of Cranelift's form, of which each is computed in one place: they hold
//! wherever it is used, through locals too.

use cranelift_codegen::entity::SecondaryMap;
use cranelift_codegen::ir::Value;

use crate::jit::ir::{Binary, Compare, Table, Unary};

/// What is known of a value.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) enum Range {
    /// Nothing.
    #[default]
    Any,
    /// An integer, from one bound to the other.
    Int(i64, i64),
    /// A float, from one bound to the other, or NaN if the last says so.
    Float(f64, f64, bool),
}

/// What is known of all values.
pub(super) type Ranges = SecondaryMap<Value, Range>;

impl Range {
    /// The bounds of an integer.
    pub(super) fn int(self) -> (i64, i64) {
        match self {
            Self::Int(lo, hi) => (lo, hi),
            _ => (i64::MIN, i64::MAX),
        }
    }

    fn float(self) -> (f64, f64, bool) {
        match self {
            Self::Float(lo, hi, nan) => (lo, hi, nan),
            _ => (f64::NEG_INFINITY, f64::INFINITY, true),
        }
    }

    pub(super) fn constant(x: f64) -> Self {
        if x.is_nan() { Self::Any } else { Self::Float(x, x, false) }
    }

    /// Of the elements of a table.
    pub(super) fn of(table: &Table) -> Self {
        match table {
            Table::Float(_) => Self::Any,
            Table::Int(list) => list
                .iter()
                .map(|x| Self::Int(*x, *x))
                .reduce(|a, b| {
                    let ((a, b), (c, d)) = (a.int(), b.int());
                    Self::Int(a.min(c), b.max(d))
                })
                .unwrap_or_default(),
        }
    }

    /// Of an operation on a value of this range.
    pub(super) fn unary(self, op: Unary) -> Self {
        match op {
            Unary::Floor | Unary::Ceil | Unary::Trunc => {
                let (lo, hi, nan) = self.float();
                let round = match op {
                    Unary::Floor => f64::floor,
                    Unary::Ceil => f64::ceil,
                    _ => f64::trunc,
                };
                Self::Float(round(lo), round(hi), nan)
            }
            Unary::FloatToInt => {
                let (lo, hi, nan) = self.float();
                let (lo, hi) = (lo as i64, hi as i64);
                if nan { Self::Int(lo.min(0), hi.max(0)) } else { Self::Int(lo, hi) }
            }
            Unary::IntToFloat => {
                let (lo, hi) = self.int();
                Self::Float(lo as f64, hi as f64, false)
            }
            Unary::NegInt => {
                let (lo, hi) = self.int();
                Self::Int(hi.saturating_neg(), lo.saturating_neg())
            }
            Unary::AbsInt => {
                let (lo, hi) = self.int();
                let (a, b) = (lo.saturating_abs(), hi.saturating_abs());
                Self::Int(if lo <= 0 && hi >= 0 { 0 } else { a.min(b) }, a.max(b))
            }
            _ => Self::Any,
        }
    }

    /// Of an operation on values of two ranges, and whether it cannot overflow.
    pub(super) fn binary(self, op: Binary, other: Self) -> (Self, bool) {
        match op {
            Binary::Least | Binary::Greatest => (self.preferred(op, other), true),
            Binary::AddInt | Binary::SubInt | Binary::MulInt => {
                let ((a, b), (c, d)) = (self.int(), other.int());
                let of = |x: i64, y: i64| {
                    let (x, y) = (i128::from(x), i128::from(y));
                    match op {
                        Binary::AddInt => x + y,
                        Binary::SubInt => x - y,
                        _ => x * y,
                    }
                };
                let corners = [of(a, c), of(a, d), of(b, c), of(b, d)];
                let lo = corners.into_iter().fold(corners[0], i128::min);
                let hi = corners.into_iter().fold(corners[0], i128::max);
                let clip = |x: i128| x.clamp(i64::MIN.into(), i64::MAX.into()) as i64;
                let exact = i128::from(clip(lo)) == lo && i128::from(clip(hi)) == hi;
                (Self::Int(clip(lo), clip(hi)), exact)
            }
            Binary::MinInt | Binary::MaxInt => {
                let ((a, b), (c, d)) = (self.int(), other.int());
                let of = if op == Binary::MinInt { i64::min } else { i64::max };
                (Self::Int(of(a, c), of(b, d)), true)
            }
            Binary::RemInt => {
                let ((lo, hi), (c, d)) = (self.int(), other.int());
                let most = c.unsigned_abs().max(d.unsigned_abs()).saturating_sub(1) as i64;
                let below = if lo >= 0 { 0 } else { -most };
                (Self::Int(below, if hi <= 0 { 0 } else { most }), false)
            }
            _ => (Self::Any, false),
        }
    }

    /// Whether integers of two ranges compare so, if all do or none.
    pub(super) fn decides(self, how: Compare, other: Self) -> Option<bool> {
        let ((a, b), (c, d)) = (self.int(), other.int());
        let decided = match how {
            Compare::Lt | Compare::Ge if b < c => true,
            Compare::Lt | Compare::Ge if a >= d => false,
            Compare::Le | Compare::Gt if b <= c => true,
            Compare::Le | Compare::Gt if a > d => false,
            _ => return None,
        };
        Some(decided == matches!(how, Compare::Lt | Compare::Le))
    }

    /// The second if it is beyond the first, else the first; so too if one of them is NaN.
    fn preferred(self, op: Binary, other: Self) -> Self {
        let ((a, b, nan), (c, d, other_nan)) = (self.float(), other.float());
        if op == Binary::Least {
            Self::Float(a.min(c), if other_nan { b } else { b.min(d) }, nan)
        } else {
            Self::Float(if other_nan { a } else { a.max(c) }, b.max(d), nan)
        }
    }
}

#[cfg(test)]
mod tests;
