//! The Fourier basis (Konidaris, Osentoski & Thomas 2011, "Value function approximation in
//! reinforcement learning using the Fourier basis").
//!
//! `xᵢ(s) = cos(π cⁱ · s)`, one feature for every vector cⁱ of whole numbers from 0 to the order,
//! s being the fields scaled to [0, 1]. Each gets the step size `α / ‖cⁱ‖`, the constant one α.

use super::Active;
use crate::mdp::math::cos;
use crate::shaping::{Dim, MAX_FIELDS};

/// The Fourier basis over some of the state's fields.
#[derive(Debug, Clone)]
pub struct Fourier {
    dims: Vec<Scaled>,
    /// πcⁱ, shape `[n_features, n_dims]`; the last field's coefficient varies fastest.
    frequencies: Vec<f64>,
    /// The share of the step size that a feature gets, `1 / ‖cⁱ‖`.
    shares: Vec<f64>,
}

#[derive(Debug, Clone)]
struct Scaled {
    field: usize,
    lo: f64,
    range: f64,
}

impl Scaled {
    /// How far along its range the field is, from 0 to 1; NaN counts as the end, as in bins.
    #[inline]
    fn place(&self, fields: &[f64]) -> f64 {
        let share = (fields[self.field] - self.lo) / self.range;
        let share = if share < 1.0 { share } else { 1.0 };
        if share > 0.0 { share } else { 0.0 }
    }
}

pub(super) fn n_features(dims: &[Dim]) -> Option<usize> {
    dims.iter().try_fold(1usize, |product, d| product.checked_mul(d.n.checked_add(1)?))
}

impl Fourier {
    /// `dims` has been checked; their `n` is the order.
    pub(super) fn new(dims: &[Dim]) -> Self {
        let n = n_features(dims).expect("the number has been checked");
        let mut frequencies = Vec::with_capacity(n * dims.len());
        let mut shares = Vec::with_capacity(n);
        let mut c = vec![0usize; dims.len()];
        for _ in 0..n {
            frequencies.extend(c.iter().map(|&c| std::f64::consts::PI * c as f64));
            let square: usize = c.iter().map(|c| c * c).sum();
            shares.push(if square == 0 { 1.0 } else { 1.0 / (square as f64).sqrt() });
            for (c, d) in c.iter_mut().zip(dims).rev() {
                if *c < d.n {
                    *c += 1;
                    break;
                }
                *c = 0;
            }
        }
        let scaled = |d: &Dim| Scaled { field: d.field, lo: d.lo, range: d.hi - d.lo };
        Self { dims: dims.iter().map(scaled).collect(), frequencies, shares }
    }

    pub(super) fn n_features(&self) -> usize {
        self.shares.len()
    }

    #[inline]
    pub(super) fn share(&self, feature: usize) -> f64 {
        self.shares[feature]
    }

    pub(super) fn active(&self) -> Active {
        let n = self.n_features();
        Active { index: (0..n as u32).collect(), value: vec![1.0; n], step: vec![1.0; n] }
    }

    #[inline]
    pub(super) fn see(&self, fields: &[f64], active: &mut Active) {
        let mut places = [0.0; MAX_FIELDS];
        for (place, d) in places.iter_mut().zip(&self.dims) {
            *place = d.place(fields);
        }
        let active = active.value.iter_mut().zip(&mut active.step);
        let rows = self.frequencies.chunks_exact(self.dims.len()).zip(&self.shares);
        for ((value, step), (row, own)) in active.zip(rows) {
            let mut angle = 0.0;
            for (place, frequency) in places.iter().zip(row) {
                angle += frequency * place;
            }
            *value = cos(angle);
            *step = *value * own;
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::shaping::{Active, Dim, FeatureKind, FeatureSpec, Features};

    fn fourier(dims: &[(f64, f64, usize)]) -> Features {
        let dims = dims.iter().enumerate();
        let dims = dims.map(|(field, &(lo, hi, n))| Dim { field, lo, hi, n }).collect();
        Features::new(&FeatureSpec { kind: FeatureKind::Fourier, dims }).unwrap()
    }

    fn seen(features: &Features, fields: &[f64]) -> Active {
        let mut active = features.active();
        features.see(fields, &mut active);
        active
    }

    #[test]
    fn features_by_hand() {
        let features = fourier(&[(0.0, 2.0, 1), (-1.0, 1.0, 2)]);
        assert_eq!(features.n_features(), 6);
        // c = (0,0), (0,1), (0,2), (1,0), (1,1), (1,2), at s = (1/2, 1/4).
        let active = seen(&features, &[1.0, -0.5]);
        let root = 0.5f64.sqrt();
        let expected = [1.0, root, 0.0, 0.0, -root, -1.0];
        for (x, e) in active.value.iter().zip(expected) {
            assert!((x - e).abs() < 1e-15, "{:?}", active.value);
        }
        let norms = [1.0, 1.0, 2.0, 1.0, 2f64.sqrt(), 5f64.sqrt()];
        for ((step, x), norm) in active.step.iter().zip(&active.value).zip(norms) {
            assert!((step * norm - x).abs() < 1e-15);
        }
    }

    #[test]
    fn numbers_beyond_the_range_count_as_its_ends() {
        let features = fourier(&[(0.0, 1.0, 3)]);
        assert_eq!(seen(&features, &[-5.0]).value, [1.0; 4]);
        assert_eq!(seen(&features, &[9.0]).value, [1.0, -1.0, 1.0, -1.0]);
        assert_eq!(seen(&features, &[f64::NAN]).value, [1.0, -1.0, 1.0, -1.0]);
    }

    #[test]
    fn the_features_of_one_field_are_orthogonal_over_its_range() {
        // ∫₀¹ cos(πix) cos(πjx) dx = 0 for i ≠ j; the midpoint rule is exact for such sums.
        let features = fourier(&[(0.0, 1.0, 4)]);
        let mut gram = [[0.0; 5]; 5];
        for k in 0..16 {
            let x = seen(&features, &[(f64::from(k) + 0.5) / 16.0]).value;
            for (i, j) in (0..5).flat_map(|i| (0..5).map(move |j| (i, j))) {
                gram[i][j] += x[i] * x[j] / 16.0;
            }
        }
        for (i, row) in gram.iter().enumerate() {
            for (j, product) in row.iter().enumerate() {
                let expected = match (i == j, i) {
                    (false, _) => 0.0,
                    (true, 0) => 1.0,
                    (true, _) => 0.5,
                };
                assert!((product - expected).abs() < 1e-14, "{i} {j}: {product}");
            }
        }
    }
}
