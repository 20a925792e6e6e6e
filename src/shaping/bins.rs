//! Uniform bins: exactly NumPy's `digitize(x, linspace(lo, hi, n + 1)) - 1`, clamped to `0..n`.

use super::{Discretiser, Fault, MAX_FIELDS};
use crate::mdp::Env;

/// One binned field.
#[derive(Debug, Clone, PartialEq)]
pub struct Dim {
    /// Which field of the state: an index into `Schema::fields`.
    pub field: usize,
    /// Left edge of the first bin; smaller values fall into it too.
    pub lo: f64,
    /// Right edge of the last bin; larger values fall into it too.
    pub hi: f64,
    /// Number of bins.
    pub n: usize,
}

/// Why bins cannot be made. `dim` is the position in the list that was given.
#[derive(Debug, Clone, PartialEq)]
pub struct BinsError {
    /// Which dimension is at fault.
    pub dim: usize,
    /// What is wrong with it.
    pub message: String,
}

/// A product of uniform bins over some of the state's fields. Cells are numbered row-major: the
/// last dimension varies fastest.
#[derive(Debug, Clone)]
pub struct Bins {
    dims: Vec<BinnedDim>,
    n_cells: usize,
}

#[derive(Debug, Clone)]
struct BinnedDim {
    field: usize,
    /// Cells from one bin to the next.
    stride: usize,
    /// The middle of the first bin: counted in bins from here, the nearest integer is the bin.
    first: f64,
    per_width: f64,
    /// The number of the last bin.
    last: f64,
    /// The edges of each bin, but NaN, beyond which there is nothing, at either end: the first and
    /// the last bin hold all that lies outside.
    bounds: Vec<[f64; 2]>,
    /// `n + 1` edges, as `numpy.linspace(lo, hi, n + 1)` computes them.
    edges: Vec<f64>,
}

/// The most cells a table may have, 2^24: with three actions that is 400 MB for every thread, and
/// no learner would visit so many.
pub const MAX_CELLS: usize = 1 << 24;

impl Bins {
    /// Bins over `dims`.
    ///
    /// # Errors
    /// If there is no dimension, one has `lo >= hi`, a bound is not finite, `n` is 0, the same
    /// field is binned twice, or the product of the `n` exceeds 2^28.
    pub fn new(dims: &[Dim]) -> Result<Self, BinsError> {
        let fail = |dim, message: String| Err(BinsError { dim, message });
        if dims.is_empty() {
            return fail(0, "bins need at least one field".into());
        }
        let mut n_cells = 1usize;
        let mut binned: Vec<BinnedDim> = Vec::with_capacity(dims.len());
        for (i, d) in dims.iter().enumerate() {
            if !(d.lo.is_finite() && d.hi.is_finite()) {
                return fail(
                    i,
                    format!("the bounds of a bin are finite, got {} and {}", d.lo, d.hi),
                );
            }
            if d.lo >= d.hi {
                return fail(
                    i,
                    format!("the lower bound {} is not below the upper {}", d.lo, d.hi),
                );
            }
            if !(d.hi - d.lo).is_finite() {
                return fail(i, format!("from {} to {} is too far for bins", d.lo, d.hi));
            }
            if d.n == 0 {
                return fail(i, "the number of bins is at least 1, got 0".into());
            }
            if binned.iter().any(|b| b.field == d.field) {
                return fail(i, "this field is binned twice".into());
            }
            n_cells = match n_cells.checked_mul(d.n) {
                Some(n) if n <= MAX_CELLS => n,
                _ => return fail(i, format!("more than {MAX_CELLS} cells: use fewer bins")),
            };
            for before in &mut binned {
                before.stride *= d.n;
            }
            binned.push(BinnedDim::new(d));
        }
        Ok(Self { dims: binned, n_cells })
    }

    /// Number of cells.
    pub fn n_cells(&self) -> usize {
        self.n_cells
    }

    /// The cell of a state, given all its fields.
    #[inline]
    pub fn index(&self, fields: &[f64]) -> usize {
        self.dims.iter().map(|d| d.bin(fields[d.field]) * d.stride).sum()
    }

    /// The centre of `cell`: overwrites the binned fields of `fields` and leaves the others.
    pub fn centre(&self, mut cell: usize, fields: &mut [f64]) {
        for d in self.dims.iter().rev() {
            let n = d.edges.len() - 1;
            let k = cell % n;
            cell /= n;
            fields[d.field] = f64::midpoint(d.edges[k], d.edges[k + 1]);
        }
    }
}

impl BinnedDim {
    fn new(d: &Dim) -> Self {
        let edges = linspace(d.lo, d.hi, d.n + 1);
        let mut bounds: Vec<[f64; 2]> = edges.windows(2).map(|w| [w[0], w[1]]).collect();
        bounds[0][0] = f64::NAN;
        bounds[d.n - 1][1] = f64::NAN;
        Self {
            field: d.field,
            stride: 1,
            first: d.lo + (d.hi - d.lo) / d.n as f64 / 2.0,
            per_width: d.n as f64 / (d.hi - d.lo),
            last: (d.n - 1) as f64,
            bounds,
            edges,
        }
    }

    /// The bin of `x`: a guess by multiplication, put right against the exact edges, so that the
    /// answer is NumPy's binary search's without its branches. NaN goes to the last bin, as there.
    #[inline]
    fn bin(&self, x: f64) -> usize {
        /// Added to a number from 0 to 2^32, it leaves the nearest integer in the sum's low bits:
        /// a conversion, which would have to mind NaN and overflow, takes three times as long.
        const ROUNDER: f64 = (1u64 << 52) as f64;
        let guess = (x - self.first) * self.per_width;
        // Not `min` and `max`: NaN must become the last bin, and these are one instruction each.
        let guess = if guess < self.last { guess } else { self.last };
        let guess = if guess > 0.0 { guess } else { 0.0 };
        let mut k = (guess + ROUNDER).to_bits() as u32 as usize;
        loop {
            let [lower, upper] = self.bounds[k];
            if x < lower {
                k -= 1;
            } else if x >= upper {
                k += 1;
            } else {
                return k;
            }
        }
    }
}

/// `numpy.linspace(lo, hi, num)`, bit for bit: `i * step + lo`, and exactly `hi` at the end.
fn linspace(lo: f64, hi: f64, num: usize) -> Vec<f64> {
    let step = (hi - lo) / (num - 1) as f64;
    let mut edges: Vec<f64> = (0..num).map(|i| i as f64 * step + lo).collect();
    edges[num - 1] = hi;
    edges
}

impl<E: Env> Discretiser<E> for Bins {
    /// Where states have indices, bins are the exception.
    const FAST: bool = !E::INDEXED;

    type State = usize;

    fn n_cells(&self) -> usize {
        self.n_cells
    }

    #[inline]
    fn see(&mut self, env: &E, obs: &E::Obs) -> Result<usize, Fault> {
        let mut fields = [0.0; MAX_FIELDS];
        env.fields(obs, &mut fields);
        Ok(self.index(&fields))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bins(lo: f64, hi: f64, n: usize) -> Bins {
        Bins::new(&[Dim { field: 0, lo, hi, n }]).unwrap()
    }

    /// `numpy.digitize` as its documentation defines it: how many edges are <= x.
    fn digitize(x: f64, edges: &[f64]) -> usize {
        edges.iter().filter(|&&e| e <= x).count()
    }

    #[test]
    fn edges_are_numpys() {
        // Printed by NumPy 2.4.6.
        assert_eq!(
            linspace(-2.4, 2.4, 13),
            [
                -2.4,
                -2.0,
                -1.6,
                -1.2,
                -0.8,
                -0.400_000_000_000_000_13,
                0.0,
                0.399_999_999_999_999_9,
                0.799_999_999_999_999_8,
                1.199_999_999_999_999_7,
                1.599_999_999_999_999_6,
                1.999_999_999_999_999_6,
                2.4
            ]
        );
        assert_eq!(
            linspace(0.0, 0.3, 4),
            [0.0, 0.099_999_999_999_999_99, 0.199_999_999_999_999_98, 0.3]
        );
        let velocity = linspace(-0.07, 0.07, 41);
        assert_eq!(
            [velocity[3], velocity[20], velocity[37]],
            [-0.059_500_000_000_000_004, 0.0, 0.059_500_000_000_000_025]
        );
    }

    #[test]
    fn a_bin_is_where_digitize_puts_it_at_every_edge_and_next_to_it() {
        for (lo, hi, n) in [(-2.4, 2.4, 12), (-0.5, 0.5, 24), (-1.2, 0.6, 40), (0.0, 0.3, 7)] {
            let b = bins(lo, hi, n);
            let edges = linspace(lo, hi, n + 1);
            for &e in &edges {
                for x in [e, e.next_up(), e.next_down(), e + 1e-3, e - 1e-3, e * 1e9] {
                    let expected = digitize(x, &edges).saturating_sub(1).min(n - 1);
                    assert_eq!(b.index(&[x]), expected, "{x} in {lo}..{hi} / {n}");
                }
            }
            assert_eq!(b.index(&[f64::NEG_INFINITY]), 0);
            assert_eq!(b.index(&[f64::INFINITY]), n - 1);
            assert_eq!(b.index(&[f64::NAN]), n - 1);
        }
    }

    #[test]
    fn cells_are_row_major_and_their_centres_fall_into_them() {
        let b = Bins::new(&[
            Dim { field: 2, lo: -1.0, hi: 1.0, n: 3 },
            Dim { field: 0, lo: 0.0, hi: 8.0, n: 4 },
        ])
        .unwrap();
        assert_eq!(b.n_cells(), 12);
        assert_eq!(b.index(&[5.0, 9.0, 0.9]), 2 * 4 + 2);
        let mut fields = [0.0, 7.0, 0.0];
        for cell in 0..12 {
            b.centre(cell, &mut fields);
            assert_eq!(b.index(&fields), cell);
            assert_eq!(fields[1], 7.0);
        }
    }

    #[test]
    fn nonsense_is_refused_with_its_dimension() {
        let dim = |lo, hi, n| Dim { field: 0, lo, hi, n };
        for bad in
            [dim(1.0, 1.0, 3), dim(2.0, 1.0, 3), dim(0.0, f64::INFINITY, 3), dim(0.0, 1.0, 0)]
        {
            let ok = Dim { field: 1, ..dim(0.0, 1.0, 2) };
            assert_eq!(Bins::new(&[ok, bad]).unwrap_err().dim, 1);
        }
        assert!(Bins::new(&[]).is_err());
        assert!(Bins::new(&[dim(0.0, 1.0, 2), dim(0.0, 1.0, 2)]).is_err());
        assert!(Bins::new(&[dim(0.0, 1.0, 1 << 29)]).is_err());
    }
}
