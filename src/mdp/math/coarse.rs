//! A cosine for those who will round it to float32 anyway.

use super::trig::{DIRECT, nearest_point};

/// How far [`coarse_cos`] may be off: 2^-50.
pub const COARSE_ERROR: f64 = 1.0 / (1u64 << 50) as f64;

/// A number within [`COARSE_ERROR`] of the cosine of `x` radians, for |x| < 7.98; NaN beyond.
///
/// It takes two thirds of the time of [`cos`](super::cos) where the next argument waits for it, but
/// is not correctly rounded: it is for results that are rounded more coarsely, by callers that
/// check whether the error can reach the last bit (and then ask the correctly rounded one).
///
/// With the grid point a nearest to |x|, r = |x| - a, |r| <= 2^-7, C = cos a and S = sin a,
///
/// ```text
/// cos |x| = C (1 - r²/2 + r⁴/24) - S (r - r³/6 + r⁵/120) + e,
/// ```
///
/// where the terms left out make |e| < r⁶/720 + |r|⁷/5040 < 2^-51.4. Rounding C, C - S r and the
/// whole is 2^-54 each at most, everything else 2^-60 or less: 2^-52.3 together, so that the sum
/// stays below 2^-50.7.
#[inline]
#[must_use]
pub fn coarse_cos(x: f64) -> f64 {
    let size = x.abs();
    if size < DIRECT {
        let (point, r) = nearest_point(size);
        let (sin, cos) = point.rounded();
        let r2 = r * r;
        // As few operations after another as possible.
        let even = (r2 * (1.0 / 24.0) - 0.5) * (cos * r2);
        let sin_r = sin * r;
        let odd = (r2 * (1.0 / 120.0) - 1.0 / 6.0) * (sin_r * r2);
        (cos - sin_r) + (even - odd)
    } else {
        f64::NAN
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mdp::math::cos;
    use crate::mdp::streams::Stream;

    #[test]
    fn within_the_error_and_nan_beyond() {
        let mut stream = Stream::new(0, "coarse");
        let mut worst = 0.0f64;
        for _ in 0..1_000_000 {
            let x = (2.0 * stream.uniform() - 1.0) * 7.98;
            worst = worst.max((coarse_cos(x) - cos(x)).abs());
        }
        // The correctly rounded cosine is itself 2^-54 off.
        assert!(worst < COARSE_ERROR - 1e-16, "{worst:e}");
        assert!(worst > COARSE_ERROR / 8.0, "the bound is far too large for {worst:e}");
        assert_eq!(coarse_cos(0.0), 1.0);
        assert!([8.0, -9.0, f64::INFINITY, f64::NAN].iter().all(|&x| coarse_cos(x).is_nan()));
    }
}
