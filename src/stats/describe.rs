//! Descriptions of a sample: location, spread, quantiles.

/// The arithmetic mean, x̄ = Σxᵢ / n. NaN for an empty slice.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The unbiased sample variance, s² = Σ(xᵢ − x̄)² / (n − 1), in squared units. NaN below two values.
///
/// Computed about the first value, so that equal values have a variance of exactly 0 (about a
/// rounded mean it would be some 10⁻³²).
pub fn variance(values: &[f64]) -> f64 {
    let n = values.len();
    if n < 2 {
        return f64::NAN;
    }
    let origin = values[0];
    let centre = values.iter().map(|x| x - origin).sum::<f64>() / n as f64;
    let squares: f64 = values.iter().map(|x| (x - origin - centre) * (x - origin - centre)).sum();
    squares / (n - 1) as f64
}

/// The standard error of the mean, s / √n. NaN below two values.
pub fn standard_error(values: &[f64]) -> f64 {
    (variance(values) / values.len() as f64).sqrt()
}

/// The `q`-quantile (`q` in [0, 1]) by NumPy's default `linear` method, type 7 of Hyndman & Fan
/// (1996): the value at position q·(n − 1) of the sorted sample, interpolated linearly.
///
/// NaN for an empty slice, or if any value is NaN.
///
/// # Panics
/// If `q` is outside [0, 1].
pub fn quantile(values: &[f64], q: f64) -> f64 {
    if values.iter().any(|x| x.is_nan()) {
        return f64::NAN;
    }
    quantile_sorted(&sorted(values), q)
}

/// The median: the 0.5-[`quantile`].
pub fn median(values: &[f64]) -> f64 {
    quantile(values, 0.5)
}

/// [`quantile`] of a sample that is already sorted and free of NaN.
pub(super) fn quantile_sorted(sorted: &[f64], q: f64) -> f64 {
    assert!((0.0..=1.0).contains(&q), "a quantile's level lies in [0, 1], not at {q}");
    let Some(last) = sorted.len().checked_sub(1) else {
        return f64::NAN;
    };
    let position = q * last as f64;
    let below = (position.floor() as usize).min(last);
    let (low, high) = (sorted[below], sorted[(below + 1).min(last)]);
    // Interpolating between two equal infinities would give NaN.
    if low == high {
        return low;
    }
    let (t, gap) = (position - below as f64, high - low);
    // NumPy interpolates from the nearer end, which makes the result monotonic in q.
    if t >= 0.5 { high - gap * (1.0 - t) } else { low + gap * t }
}

/// The interquartile mean: the mean of the middle half, ⌊n / 4⌋ values being left out at either end.
///
/// This is SciPy's `trim_mean(x, 0.25)`, which rliable recommends for scores over seeds (Agarwal
/// et al. 2021): robust to a lucky or a collapsed seed, and far less wasteful than the median.
/// NaN for an empty slice, or if any value is NaN.
pub fn iqm(values: &[f64]) -> f64 {
    if values.iter().any(|x| x.is_nan()) {
        return f64::NAN;
    }
    let cut = quartile_cut(values.len());
    let values = sorted(values);
    mean(&values[cut..values.len() - cut])
}

/// How many of `n` values the interquartile mean leaves out at either end (SciPy floors).
pub(super) fn quartile_cut(n: usize) -> usize {
    n / 4
}

/// A sorted copy. `total_cmp` agrees with `<` on numbers; callers have dealt with NaN.
pub(super) fn sorted(values: &[f64]) -> Vec<f64> {
    let mut values = values.to_vec();
    values.sort_unstable_by(f64::total_cmp);
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_by_hand() {
        let x = [2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0];
        assert_eq!(mean(&x), 5.0);
        assert_eq!(variance(&x), 32.0 / 7.0);
        assert_eq!(standard_error(&x), (4.0f64 / 7.0).sqrt());
        // A third summed three times is not one: the variance of equal values must not notice.
        assert_eq!(variance(&[0.1; 3]), 0.0);
        assert!(mean(&[]).is_nan() && variance(&[1.0]).is_nan() && standard_error(&[1.0]).is_nan());
    }

    #[test]
    fn quantiles_are_numpys() {
        // np.quantile(x, [.025, .5, .975]), NumPy 2.4.
        let x = [3.0, 1.0, 4.0, 1.0, 5.0, 9.0, 2.0, 6.0];
        assert_eq!(quantile(&x, 0.025), 1.0);
        assert_eq!(quantile(&x, 0.5), 3.5);
        assert_eq!(quantile(&x, 0.975), 8.475_000_000_000_001);
        // Interpolated from the nearer end: from the lower one it would be 0.16999999999999998.
        assert_eq!(quantile(&[0.1, 0.2], 0.7), 0.17);
        assert_eq!((quantile(&x, 0.0), quantile(&x, 1.0)), (1.0, 9.0));
        assert_eq!(quantile(&[7.0], 0.3), 7.0);
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
    }

    #[test]
    fn iqm_is_scipys_trimmed_mean() {
        // scipy.stats.trim_mean(x, 0.25), SciPy 1.17.
        assert_eq!(iqm(&[1.0, 2.0, 3.0]), 2.0);
        assert_eq!(iqm(&[1.0, 2.0, 3.0, 10.0]), 2.5);
        assert_eq!(iqm(&[1.0, 2.0, 3.0, 4.0, 100.0]), 3.0);
        assert_eq!(iqm(&[0.0, 1.0, 2.0, 3.0, 4.0, 50.0, 60.0]), 12.0);
        let x = [5.0, 1.0, 9.0, 2.0, 7.0, 3.0, 8.0, 0.0, 4.0, 100.0];
        assert_eq!(iqm(&x), 4.833_333_333_333_333);
    }

    #[test]
    fn nan_is_never_sorted_away_and_infinities_are_ordered() {
        let nan = [1.0, f64::NAN, 3.0, 4.0];
        assert!(quantile(&nan, 0.0).is_nan() && median(&nan).is_nan() && iqm(&nan).is_nan());
        assert!(mean(&nan).is_nan() && variance(&nan).is_nan());
        assert!(median(&[]).is_nan() && iqm(&[]).is_nan());
        // One seed diverged: the middle half is still there.
        assert_eq!(iqm(&[f64::NEG_INFINITY, 1.0, 3.0, 4.0]), 2.0);
        assert_eq!(quantile(&[f64::INFINITY, f64::INFINITY, 0.0], 0.75), f64::INFINITY);
    }

    #[test]
    #[should_panic(expected = "lies in [0, 1]")]
    fn a_percentage_is_not_a_level() {
        quantile(&[1.0], 97.5);
    }
}
