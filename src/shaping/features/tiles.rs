//! Tile coding (Albus 1981; Sutton & Barto 2018, section 9.5.4).
//!
//! Each of m tilings cuts every field's range into tiles of width (hi − lo) / n. They are offset
//! from one another asymmetrically, by the displacement vector (1, 3, 5, …) that Miller and Glanz
//! (1996) recommend: tiling t by t · (2j + 1) / m of a tile along field j, whole tiles of which
//! do not matter. A state lies in exactly one tile of each tiling, so exactly m features are 1, and
//! states share as many of them as they are close.
//!
//! Tiles are numbered without hashing: an offset tiling needs n + 1 tiles to cover the range.

use super::Active;
use crate::shaping::Dim;

/// Tilings over some of the state's fields.
#[derive(Debug, Clone)]
pub struct Tiles {
    dims: Vec<TiledDim>,
    n_tilings: usize,
    /// 1 / m.
    share: f64,
    /// Tiles of one tiling.
    per_tiling: usize,
}

#[derive(Debug, Clone)]
struct TiledDim {
    field: usize,
    lo: f64,
    /// Where a state is, is told to an m-th part of a tile: how many of these there are to a unit of
    /// the field.
    per_unit: f64,
    /// The number of the last such part in the range.
    last: f64,
    /// Tiles from one to the next along this field.
    stride: usize,
    /// How many m-th parts of a tile each tiling is offset by.
    offsets: Vec<usize>,
}

/// The tiles that a tiling needs along a field.
fn across(n: usize, n_tilings: usize) -> Option<usize> {
    n.checked_add(usize::from(n_tilings > 1))
}

pub(super) fn n_features(dims: &[Dim], n_tilings: usize) -> Option<usize> {
    dims.iter().try_fold(n_tilings, |product, d| product.checked_mul(across(d.n, n_tilings)?))
}

impl Tiles {
    /// `dims` has been checked.
    pub(super) fn new(dims: &[Dim], n_tilings: usize) -> Self {
        let mut per_tiling = 1;
        let mut tiled: Vec<TiledDim> = Vec::with_capacity(dims.len());
        for (j, d) in dims.iter().enumerate().rev() {
            tiled.push(TiledDim {
                field: d.field,
                lo: d.lo,
                per_unit: (d.n * n_tilings) as f64 / (d.hi - d.lo),
                last: (d.n * n_tilings - 1) as f64,
                stride: per_tiling,
                offsets: (0..n_tilings).map(|t| t * (2 * j + 1) % n_tilings).collect(),
            });
            per_tiling *= d.n + usize::from(n_tilings > 1);
        }
        tiled.reverse();
        Self { dims: tiled, n_tilings, share: 1.0 / n_tilings as f64, per_tiling }
    }

    /// Number of tilings, which is how many features are 1 in each state.
    pub fn n_tilings(&self) -> usize {
        self.n_tilings
    }

    pub(super) fn n_features(&self) -> usize {
        self.n_tilings * self.per_tiling
    }

    /// A step is shared among the tilings: α moves the value of the state itself by α times the
    /// error.
    #[inline]
    pub(super) fn share(&self) -> f64 {
        self.share
    }

    pub(super) fn active(&self) -> Active {
        let m = self.n_tilings;
        Active { index: vec![0; m], value: vec![1.0; m], step: vec![self.share; m] }
    }

    #[inline]
    pub(super) fn see(&self, fields: &[f64], active: &mut Active) {
        for (t, index) in active.index.iter_mut().enumerate() {
            *index = (t * self.per_tiling) as u32;
        }
        for d in &self.dims {
            let part = (fields[d.field] - d.lo) * d.per_unit;
            // Not `min`: NaN is put at the end, as in bins. A conversion cuts off what is below 0.
            let part = if part < d.last { part } else { d.last } as usize;
            for (index, offset) in active.index.iter_mut().zip(&d.offsets) {
                *index += ((part + offset) / self.n_tilings * d.stride) as u32;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::shaping::{Active, Dim, FeatureKind, FeatureSpec, Features};

    fn tiles(dims: &[(f64, f64, usize)], tilings: usize) -> Features {
        let dims = dims.iter().enumerate();
        let dims = dims.map(|(field, &(lo, hi, n))| Dim { field, lo, hi, n }).collect();
        Features::new(&FeatureSpec { kind: FeatureKind::Tiles(tilings), dims }).unwrap()
    }

    fn seen(features: &Features, fields: &[f64]) -> Active {
        let mut active = features.active();
        features.see(fields, &mut active);
        active
    }

    fn shared(a: &Active, b: &Active) -> usize {
        a.index.iter().zip(&b.index).filter(|(a, b)| a == b).count()
    }

    #[test]
    fn tiles_by_hand() {
        // Two tilings of two tiles over 0..2: the second begins half a tile to the left.
        let features = tiles(&[(0.0, 2.0, 2)], 2);
        assert_eq!(features.n_features(), 6);
        let index = |x: f64| seen(&features, &[x]).index;
        assert_eq!(index(0.0), [0, 3]);
        assert_eq!(index(0.49), [0, 3]);
        assert_eq!(index(0.5), [0, 4]);
        assert_eq!(index(1.0), [1, 4]);
        assert_eq!(index(1.5), [1, 5]);
        for beyond in [2.0, 7.0, f64::INFINITY, f64::NAN] {
            assert_eq!(index(beyond), [1, 5], "{beyond}");
        }
        assert_eq!(index(-3.0), [0, 3]);
    }

    #[test]
    fn every_state_has_one_tile_in_each_tiling_and_alpha_is_shared() {
        let features = tiles(&[(-1.2, 0.6, 8), (-0.07, 0.07, 8)], 8);
        // 8 tilings, an offset one of 9 x 9 tiles.
        assert_eq!(features.n_features(), 648);
        for i in 0..100 {
            let (x, v) = (f64::from(i) * 0.018 - 1.2, f64::from(i * 37 % 100) * 0.0014 - 0.07);
            let active = seen(&features, &[x, v]);
            assert_eq!((active.index.len(), active.value.as_slice()), (8, [1.0; 8].as_slice()));
            for (t, &i) in active.index.iter().enumerate() {
                assert_eq!(i as usize / 81, t);
            }
            assert_eq!(active.step.iter().sum::<f64>(), 1.0);
        }
    }

    #[test]
    fn states_generalise_as_far_as_a_tile_reaches_and_alike_in_every_direction() {
        // In units of a tile; far from the edges, clamping aside.
        let features = tiles(&[(0.0, 8.0, 8), (0.0, 8.0, 8)], 8);
        let at = |x: f64, y: f64| seen(&features, &[x, y]);
        let centre = at(4.01, 4.01);
        // An eighth of a tile changes one tiling, along either field.
        for k in 0..8 {
            let d = f64::from(k) / 8.0;
            assert_eq!(shared(&centre, &at(4.01 + d, 4.01)), 8 - k as usize);
            assert_eq!(shared(&centre, &at(4.01, 4.01 - d)), 8 - k as usize);
        }
        assert_eq!(shared(&centre, &at(5.01, 4.01)), 0);
        // Asymmetric offsets: along neither diagonal do all tilings change at once, as they would
        // with the displacement vector (1, 1).
        let most = |sign: f64| {
            let step = |k: i32| {
                let (a, b) = (f64::from(k) / 8.0, f64::from(k + 1) / 8.0);
                8 - shared(&at(2.01 + a, 5.01 + sign * a), &at(2.01 + b, 5.01 + sign * b))
            };
            (0..8).map(step).max()
        };
        assert_eq!((most(1.0), most(-1.0)), (Some(2), Some(2)));
    }

    #[test]
    fn the_partition_is_that_of_the_books_own_code() {
        // Sutton's tiles3: along field j, tiling t counts (⌊m x⌋ + t (2j + 1)) div m, in units of a
        // tile. Two states share a tile here exactly if they do there.
        let m = 8i64;
        let features = tiles(&[(0.0, 4.0, 4), (0.0, 3.0, 3), (0.0, 2.0, 2)], m as usize);
        let book = |x: [f64; 3], t: i64| {
            let coordinate = |j: usize| {
                ((x[j] * m as f64).floor() as i64 + t * (2 * j as i64 + 1)).div_euclid(m)
            };
            [coordinate(0), coordinate(1), coordinate(2)]
        };
        let states: Vec<[f64; 3]> = (0..120)
            .map(|i| {
                let part = |k: i32, n: i32| f64::from(i * k % (16 * n)) / 16.0;
                [part(7, 4), part(11, 3), part(5, 2)]
            })
            .collect();
        for a in &states {
            for b in &states {
                let (seen_a, seen_b) = (seen(&features, a), seen(&features, b));
                for t in 0..m {
                    let here = seen_a.index[t as usize] == seen_b.index[t as usize];
                    assert_eq!(here, book(*a, t) == book(*b, t), "{a:?} {b:?} {t}");
                }
            }
        }
    }
}
