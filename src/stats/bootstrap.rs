//! The bootstrap: resamples drawn with replacement, an estimator's replicates on them, and the
//! limits that each method reads from the replicates (Efron & Tibshirani 1993).
//!
//! A resample is held as a count per value instead of as a list of indices: values are then sorted
//! once, and a trimmed mean of a resample is one walk along them.

use super::describe::{mean, quantile_sorted, sorted, variance};
use super::distributions::{normal_cdf, normal_quantile};
use super::interval::Estimator;
use crate::mdp::streams::Stream;

/// Resamples of `n` values: how often each value was drawn, `[resamples][n]`.
#[derive(Debug, Clone)]
pub struct Resamples {
    n: usize,
    counts: Vec<u32>,
}

impl Resamples {
    /// Draws `resamples` times `n` values with replacement.
    ///
    /// The stream depends on nothing: equal `n` gives equal resamples. Results are reproducible,
    /// the points of a learning curve share their noise (a band is smooth, not jagged), and so do
    /// two variants with the same seeds.
    ///
    /// # Panics
    /// If `n` is 0.
    pub fn draw(n: usize, resamples: usize) -> Self {
        assert!(n > 0, "there is nothing to draw from");
        let mut stream = Stream::new(0, "stats/bootstrap");
        let mut counts = vec![0; n * resamples];
        for row in counts.chunks_exact_mut(n) {
            for _ in 0..n {
                row[stream.below(n)] += 1;
            }
        }
        Self { n, counts }
    }

    /// Resamples given by their indices, each row `n` numbers below `n`: to replay another
    /// program's bootstrap.
    ///
    /// # Panics
    /// If a row has another length than `n`, or an index is not below `n`.
    pub fn from_indices(n: usize, rows: &[Vec<usize>]) -> Self {
        let mut counts = vec![0; n * rows.len()];
        for (indices, row) in rows.iter().zip(counts.chunks_exact_mut(n)) {
            assert_eq!(indices.len(), n, "a resample has as many values as the sample");
            for &i in indices {
                row[i] += 1;
            }
        }
        Self { n, counts }
    }

    /// The estimator on every resample of `values` (all finite), in the order of the resamples.
    ///
    /// # Panics
    /// If `values` has another length than the sample these resamples were made for.
    pub fn replicates(&self, values: &[f64], estimator: Estimator) -> Vec<Replicate> {
        assert_eq!(values.len(), self.n, "these resamples were drawn for another sample size");
        let mut order: Vec<usize> = (0..self.n).collect();
        order.sort_unstable_by(|&i, &j| values[i].total_cmp(&values[j]));
        // Sums of squares are formed about the mean: a return of −10000 ± 1 keeps its digits.
        let origin = mean(values);
        let ascending: Vec<(usize, f64)> =
            order.into_iter().map(|i| (i, values[i] - origin)).collect();
        let cut = estimator.cut(self.n);
        self.counts
            .chunks_exact(self.n)
            .map(|counts| {
                let (estimate, standard_error) = trimmed(&ascending, counts, self.n, cut);
                Replicate { estimate: origin + estimate, standard_error }
            })
            .collect()
    }
}

/// An estimate on one resample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Replicate {
    /// The estimate.
    pub estimate: f64,
    /// Its standard error, as estimated from the same resample; 0 exactly if the values that
    /// count in it are all equal.
    pub standard_error: f64,
}

/// The trimmed mean of `n` values and its standard error, `cut` values being left out at either
/// end. `ascending` holds the distinct members with their places in `counts`.
///
/// The standard error is Tukey & McLaughlin's (1963), √(SSD / (h(h − 1))): h = n − 2·cut values
/// remain, and SSD is the sum of squared deviations of the winsorised sample, in which the values
/// cut off are replaced by the outermost that remain. With no cut it is s / √n.
pub(super) fn trimmed(
    ascending: &[(usize, f64)],
    counts: &[u32],
    n: usize,
    cut: usize,
) -> (f64, f64) {
    let (mut seen, mut low, mut high) = (0, None, 0.0);
    let (mut sum, mut squares) = (0.0, 0.0);
    for &(i, value) in ascending {
        let start = seen;
        seen += counts[i] as usize;
        let inside = seen.min(n - cut).saturating_sub(start.max(cut));
        if inside > 0 {
            low = low.or(Some(value));
            high = value;
            let inside = inside as f64;
            sum += inside * value;
            squares += inside * value * value;
        }
    }
    let low = low.unwrap_or(high);
    let kept = (n - 2 * cut) as f64;
    if low == high {
        return (low, 0.0);
    }
    let cut = cut as f64;
    let winsorised_sum = sum + cut * (low + high);
    let deviations =
        squares + cut * (low * low + high * high) - winsorised_sum * winsorised_sum / n as f64;
    (sum / kept, (deviations.max(0.0) / (kept * (kept - 1.0))).sqrt())
}

/// Percentile limits: the (1 − level)/2 and (1 + level)/2 quantiles of the replicates.
pub fn percentile_limits(replicates: &[f64], level: f64) -> (f64, f64) {
    let replicates = sorted(replicates);
    let (lower, upper) = tails(level);
    (quantile_sorted(&replicates, lower), quantile_sorted(&replicates, upper))
}

/// Basic (reverse percentile) limits: the percentile limits mirrored in the estimate, 2θ̂ − q.
pub fn basic_limits(estimate: f64, replicates: &[f64], level: f64) -> (f64, f64) {
    let (low, high) = percentile_limits(replicates, level);
    (2.0 * estimate - high, 2.0 * estimate - low)
}

/// Bias-corrected and accelerated limits (Efron 1987), as SciPy computes them: z₀ from the share
/// of replicates below the estimate (ties count half), the acceleration from `jackknife`, the
/// estimates that leave one value out.
///
/// Falls back to the percentile limits where the correction does not exist: all replicates on one
/// side of the estimate.
pub fn bca_limits(estimate: f64, replicates: &[f64], jackknife: &[f64], level: f64) -> (f64, f64) {
    let (z0, acceleration) = bca_correction(estimate, replicates, jackknife);
    if !z0.is_finite() {
        return percentile_limits(replicates, level);
    }
    let replicates = sorted(replicates);
    let limit = |tail: f64| {
        let z = z0 + normal_quantile(tail);
        let p = normal_cdf(z0 + z / (1.0 - acceleration * z));
        quantile_sorted(&replicates, p)
    };
    let (lower, upper) = tails(level);
    (limit(lower), limit(upper))
}

/// The bias correction z₀ and the acceleration of [`bca_limits`].
fn bca_correction(estimate: f64, replicates: &[f64], jackknife: &[f64]) -> (f64, f64) {
    let below = replicates.iter().filter(|&&r| r < estimate).count() as f64;
    let ties = replicates.iter().filter(|&&r| r == estimate).count() as f64;
    let z0 = normal_quantile((below + 0.5 * ties) / replicates.len() as f64);
    let centre = mean(jackknife);
    let (mut squares, mut cubes) = (0.0, 0.0);
    for leave_one_out in jackknife {
        let u = centre - leave_one_out;
        squares += u * u;
        cubes += u * u * u;
    }
    // No spread among the jackknife estimates: no skewness to correct for.
    let acceleration = if squares > 0.0 { cubes / (6.0 * squares * squares.sqrt()) } else { 0.0 };
    (z0, acceleration)
}

/// Studentised limits, the bootstrap-t (Efron 1979; Hall 1988): with t* = (θ* − θ̂) / se* over the
/// resamples, [θ̂ − q(t*, upper)·se, θ̂ − q(t*, lower)·se].
///
/// A resample without spread has t* = ±∞, which takes its place among the others. `None` if the
/// quantile itself falls among those: with so few or so tied values this method has no finite
/// answer.
pub fn studentised_limits(
    estimate: f64,
    standard_error: f64,
    replicates: &[Replicate],
    level: f64,
) -> Option<(f64, f64)> {
    let mut ratios: Vec<f64> = replicates
        .iter()
        .map(|r| {
            let difference = r.estimate - estimate;
            if difference == 0.0 { 0.0 } else { difference / r.standard_error }
        })
        .collect();
    ratios.sort_unstable_by(f64::total_cmp);
    let (lower, upper) = tails(level);
    let low = estimate - quantile_sorted(&ratios, upper) * standard_error;
    let high = estimate - quantile_sorted(&ratios, lower) * standard_error;
    (low.is_finite() && high.is_finite()).then_some((low, high))
}

/// The bootstrap estimate of the standard error: the standard deviation of the replicates.
pub fn standard_error_of(replicates: &[f64]) -> f64 {
    variance(replicates).sqrt()
}

/// The levels of the two limits: 0.025 and 0.975 for 0.95.
fn tails(level: f64) -> (f64, f64) {
    assert!(level > 0.0 && level < 1.0, "a confidence level lies between 0 and 1, not at {level}");
    ((1.0 - level) / 2.0, f64::midpoint(1.0, level))
}

/// What other programs computed from fixed resamples: `tests/data/statistics.json`.
#[cfg(test)]
pub(super) fn reference() -> serde_json::Value {
    serde_json::from_str(include_str!("../../tests/data/statistics.json")).unwrap()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::iqm;

    /// The reference's numbers under a path such as `/scipy/values`.
    fn numbers(path: &str) -> Vec<f64> {
        let json = reference();
        serde_json::from_value(json.pointer(path).unwrap().clone()).unwrap()
    }

    /// Its resamples, `[resamples][n]`: one base-12 digit per index.
    fn indices(path: &str) -> Vec<Vec<usize>> {
        let json = reference();
        let rows: Vec<String> =
            serde_json::from_value(json.pointer(path).unwrap().clone()).unwrap();
        let digit = |c: char| c.to_digit(12).unwrap() as usize;
        rows.iter().map(|row| row.chars().map(digit).collect()).collect()
    }

    fn close(actual: f64, expected: f64) {
        assert!((actual - expected).abs() <= 1e-12 * expected.abs(), "{actual} is not {expected}");
    }

    fn estimates(replicates: &[Replicate]) -> Vec<f64> {
        replicates.iter().map(|r| r.estimate).collect()
    }

    #[test]
    fn rliables_percentile_intervals_replay() {
        // Three tasks, resampled within each: the index of run r in task t is 3r + t.
        let scores: Vec<Vec<f64>> =
            serde_json::from_value(reference()["rliable"]["scores"].clone()).unwrap();
        let scores = scores.concat();
        let mut rows = indices("/rliable/resamples");
        for row in &mut rows {
            for (place, i) in row.iter_mut().enumerate() {
                *i = 3 * *i + place % 3;
            }
        }
        assert_eq!((rows.len(), scores.len()), (200, 30));
        let resamples = Resamples::from_indices(scores.len(), &rows);
        for (estimator, name) in [(Estimator::Iqm, "iqm"), (Estimator::Mean, "mean")] {
            let replicates = estimates(&resamples.replicates(&scores, estimator));
            for (r, first) in replicates.iter().zip(numbers(&format!("/rliable/first_{name}s"))) {
                close(*r, first);
            }
            let (low, high) = percentile_limits(&replicates, 0.95);
            let expected = numbers(&format!("/rliable/percentile_{name}"));
            close(low, expected[0]);
            close(high, expected[1]);
            close(estimator.of(&scores), reference()["rliable"][name].as_f64().unwrap());
        }
    }

    #[test]
    fn scipys_bootstrap_replays() {
        let x = numbers("/scipy/values");
        let resamples = Resamples::from_indices(x.len(), &indices("/scipy/resamples"));
        let replicates = estimates(&resamples.replicates(&x, Estimator::Mean));
        assert_eq!(replicates.len(), 999);
        close(
            standard_error_of(&replicates),
            reference()["scipy"]["standard_error"].as_f64().unwrap(),
        );
        let leave_out = |i: usize| mean(&[&x[..i], &x[i + 1..]].concat());
        let jackknife: Vec<f64> = (0..x.len()).map(leave_out).collect();
        let estimate = mean(&x);
        let (z0, acceleration) = bca_correction(estimate, &replicates, &jackknife);
        close(z0, reference()["scipy"]["z0"].as_f64().unwrap());
        close(acceleration, reference()["scipy"]["acceleration"].as_f64().unwrap());
        for (name, (low, high)) in [
            ("percentile", percentile_limits(&replicates, 0.95)),
            ("basic", basic_limits(estimate, &replicates, 0.95)),
            ("bca", bca_limits(estimate, &replicates, &jackknife, 0.95)),
        ] {
            let expected = numbers(&format!("/scipy/{name}"));
            close(low, expected[0]);
            close(high, expected[1]);
        }
        let t =
            crate::stats::interval_with(&x, Estimator::Mean, crate::stats::Method::StudentT, 0.95);
        close(t.unwrap().low, numbers("/scipy/student_t")[0]);
        close(t.unwrap().high, numbers("/scipy/student_t")[1]);
    }

    #[test]
    fn replicates_are_the_estimates_of_the_written_out_resamples() {
        let x = numbers("/scipy/values");
        let rows = indices("/scipy/resamples");
        let resamples = Resamples::from_indices(x.len(), &rows);
        for estimator in [Estimator::Mean, Estimator::Iqm] {
            for (row, r) in rows.iter().zip(resamples.replicates(&x, estimator)) {
                let written: Vec<f64> = row.iter().map(|&i| x[i]).collect();
                close(r.estimate, estimator.of(&written));
                close(r.standard_error, estimator.standard_error(&written));
            }
        }
        close(iqm(&x), reference()["scipy"]["iqm"].as_f64().unwrap());
    }

    #[test]
    fn studentised_limits_by_hand() {
        // Two resamples: t* = −1 and +2; at level 0.5 the quartiles are −0.25 and 1.25.
        let replicate = |estimate, standard_error| Replicate { estimate, standard_error };
        let replicates = [replicate(9.0, 1.0), replicate(11.0, 0.5)];
        let limits = studentised_limits(10.0, 2.0, &replicates, 0.5);
        assert_eq!(limits, Some((7.5, 10.5)));
        // A resample without spread on one side: no finite limit on the other.
        let stuck = [replicate(9.0, 0.0), replicate(11.0, 0.5)];
        assert_eq!(studentised_limits(10.0, 2.0, &stuck, 0.5), None);
    }

    #[test]
    fn resamples_draw_every_value_equally_often() {
        let resamples = Resamples::draw(5, 2000);
        let drawn = |i: usize| resamples.counts.iter().skip(i).step_by(5).sum::<u32>();
        // 2000 expected, with a standard deviation of 40.
        assert!((0..5).all(|i| (1800..2200).contains(&drawn(i))));
        assert!(resamples.counts.chunks(5).all(|row| row.iter().sum::<u32>() == 5));
        assert_eq!(resamples.counts, Resamples::draw(5, 2000).counts);
    }

    #[test]
    fn replicates_equal_to_the_estimate_count_half() {
        // One below, two ties, one above: no bias.
        let (z0, _) = bca_correction(2.0, &[1.0, 2.0, 2.0, 3.0], &[1.0, 2.0, 3.0]);
        assert_eq!(z0, 0.0);
    }

    #[test]
    fn bca_without_a_correction_is_the_percentile() {
        let replicates = [1.0, 2.0, 3.0];
        assert_eq!(
            bca_limits(0.0, &replicates, &[1.0, 1.0], 0.95),
            percentile_limits(&replicates, 0.95)
        );
    }
}
