//! Confidence intervals for the mean and the interquartile mean over seeds.
//!
//! Which method is reported was chosen by simulation: the share of 1000 to 3000 nominal 95 %
//! intervals that hold the truth, and in brackets the 95th percentile of their width. "Bimodal" is a
//! standard normal of which a fifth is shifted by 10; "ties" has 40 % of the values at one point,
//! as where runs never reach the goal.
//!
//! | estimator, data, n | bootstrap-t | Student's t | percentile |
//! |---|---|---|---|
//! | mean, normal, 5 | .947 (8) | .958 (4) | .850 (2) |
//! | mean, bimodal, 10 | .880 (22) | .878 (8) | .866 (6) |
//! | mean, bimodal, 20 | .968 (8) | .916 (5) | .909 (4) |
//! | mean, lognormal, 20 | .907 (7) | .862 (4) | .847 (3) |
//! | IQM, normal, 4 | falls back | .930 (29) | .876 (4) |
//! | IQM, normal, 5 | falls back | .937 (7) | .915 (3) |
//! | IQM, ties, 5 | falls back | .809 (115) | .906 (35) |
//! | IQM, normal, 8 | .958 (70) | .935 (4) | .930 (2) |
//! | IQM, bimodal, 8 | .960 (646) | .948 (24) | .932 (10) |
//! | IQM, ties, 8 | .868 (575) | .845 (72) | .921 (32) |
//! | IQM, lognormal, 10 | .951 (10) | .925 (4) | .929 (4) |
//! | IQM, bimodal, 20 | .956 (25) | .952 (9) | .938 (6) |
//! | IQM, ties, 20 | .936 (60) | .914 (28) | .940 (21) |
//!
//! Hence [`Method::recommended`]: for the mean the bootstrap-t, up to ten values Student's t, which
//! covers as well there and is never absurdly wide. For the IQM the bootstrap-t buys nothing and is
//! at times absurdly wide, because the winsorised spread of a resample can be almost nothing;
//! there the percentile interval, whose coverage never collapses and which stays within the
//! values, and below 5 values the trimmed t.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::bootstrap::{self, Resamples};
use super::describe::{iqm, mean, quartile_cut};
use super::distributions::t_quantile;

/// The confidence level of everything reported: 95 %.
pub const LEVEL: f64 = 0.95;

/// How many resamples an interval draws.
pub const RESAMPLES: usize = 2000;

/// What is estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Estimator {
    /// The arithmetic mean.
    Mean,
    /// The interquartile mean, [`iqm`].
    Iqm,
}

impl Estimator {
    /// The estimate.
    pub fn of(self, values: &[f64]) -> f64 {
        match self {
            Self::Mean => mean(values),
            Self::Iqm => iqm(values),
        }
    }

    /// Its standard error: s / √n for the mean; for the IQM Tukey & McLaughlin's, from the
    /// winsorised sample. NaN below two values, or if one is not finite.
    pub fn standard_error(self, values: &[f64]) -> f64 {
        if values.len() < 2 || values.iter().any(|x| !x.is_finite()) {
            return f64::NAN;
        }
        // The sample is the resample that draws every value once.
        Resamples::from_indices(values.len(), &[(0..values.len()).collect()])
            .replicates(values, self)[0]
            .standard_error
    }

    /// The degrees of freedom that go with the standard error of `n` values: h − 1, of the h
    /// values that are not cut off.
    pub fn degrees_of_freedom(self, n: usize) -> f64 {
        (n - 2 * self.cut(n)) as f64 - 1.0
    }

    /// How many of `n` values are left out at either end.
    pub(super) fn cut(self, n: usize) -> usize {
        match self {
            Self::Mean => 0,
            Self::Iqm => quartile_cut(n),
        }
    }
}

/// How an interval was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Studentised bootstrap: the best coverage of the mean on small and skewed samples.
    BootstrapT,
    /// Quantiles of the bootstrap replicates. For the mean too narrow below about 20 values.
    Percentile,
    /// Percentile limits mirrored in the estimate.
    Basic,
    /// Bias-corrected and accelerated.
    Bca,
    /// estimate ± t · standard error; for the IQM Tukey & McLaughlin's trimmed t.
    StudentT,
}

/// From how many values on the bootstrap-t of the mean is worth its width.
const ENOUGH_FOR_BOOTSTRAP_T: usize = 11;

/// From how many values on the percentile interval of the IQM is the safest.
const ENOUGH_FOR_PERCENTILE: usize = 5;

impl Method {
    /// The method reported by default for an estimate from `n` values: for the mean Student's t up
    /// to 10 values and the bootstrap-t beyond; for the IQM Student's t below 5 values and the percentile interval from there.
    pub fn recommended(estimator: Estimator, n: usize) -> Self {
        match estimator {
            Estimator::Mean if n < ENOUGH_FOR_BOOTSTRAP_T => Self::StudentT,
            Estimator::Mean => Self::BootstrapT,
            Estimator::Iqm if n < ENOUGH_FOR_PERCENTILE => Self::StudentT,
            Estimator::Iqm => Self::Percentile,
        }
    }

    /// The word used in files: `bootstrap-t`, `percentile`, `basic`, `bca`, `student-t`.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::BootstrapT => "bootstrap-t",
            Self::Percentile => "percentile",
            Self::Basic => "basic",
            Self::Bca => "bca",
            Self::StudentT => "student-t",
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// A confidence interval, in the units of the values.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// The lower limit.
    pub low: f64,
    /// The upper limit.
    pub high: f64,
    /// How it was made: the method asked for, or the one that had to stand in.
    pub method: Method,
}

/// The 95 % interval reported by default: [`Method::recommended`], on [`RESAMPLES`] resamples
/// where it is a bootstrap.
///
/// `None` below two values, or if one is not finite. Deterministic.
pub fn interval(values: &[f64], estimator: Estimator) -> Option<Interval> {
    interval_with(values, estimator, Method::recommended(estimator, values.len()), LEVEL)
}

/// An interval by a given method at a given level (0.95 for 95 %).
///
/// `None` below two values, or if one is not finite; of zero width if all values are equal. Where
/// the bootstrap-t has no finite answer (very few or heavily tied values), Student's t stands in,
/// and the result says so.
///
/// # Panics
/// If `level` is not between 0 and 1.
pub fn interval_with(
    values: &[f64],
    estimator: Estimator,
    method: Method,
    level: f64,
) -> Option<Interval> {
    let resamples = match method {
        Method::StudentT => 0,
        _ => RESAMPLES,
    };
    let resamples = Resamples::draw(values.len().max(1), resamples);
    interval_on(values, estimator, method, level, &resamples)
}

/// [`interval_with`] on given resamples: drawn once, they serve every point of a curve.
pub(super) fn interval_on(
    values: &[f64],
    estimator: Estimator,
    method: Method,
    level: f64,
    resamples: &Resamples,
) -> Option<Interval> {
    if values.len() < 2 || values.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let estimate = estimator.of(values);
    if values.iter().all(|&x| x == values[0]) {
        // The estimate of equal values may be off in its last bit; the values are not.
        return Some(Interval { low: values[0], high: values[0], method });
    }
    if method == Method::StudentT {
        return Some(student_t(values, estimator, level));
    }
    let replicates = resamples.replicates(values, estimator);
    if method == Method::BootstrapT {
        let standard_error = estimator.standard_error(values);
        let limits = bootstrap::studentised_limits(estimate, standard_error, &replicates, level);
        return Some(match limits {
            Some((low, high)) => Interval { low, high, method },
            None => student_t(values, estimator, level),
        });
    }
    let replicates: Vec<f64> = replicates.iter().map(|r| r.estimate).collect();
    let (low, high) = match method {
        Method::Basic => bootstrap::basic_limits(estimate, &replicates, level),
        Method::Bca => {
            let jackknife = jackknife(values, estimator);
            bootstrap::bca_limits(estimate, &replicates, &jackknife, level)
        }
        _ => bootstrap::percentile_limits(&replicates, level),
    };
    Some(Interval { low, high, method })
}

/// estimate ± t(h − 1) · standard error.
fn student_t(values: &[f64], estimator: Estimator, level: f64) -> Interval {
    let estimate = estimator.of(values);
    let t = t_quantile(f64::midpoint(1.0, level), estimator.degrees_of_freedom(values.len()));
    let half = t * estimator.standard_error(values);
    Interval { low: estimate - half, high: estimate + half, method: Method::StudentT }
}

/// The estimates that leave one value out each, in order.
fn jackknife(values: &[f64], estimator: Estimator) -> Vec<f64> {
    (0..values.len()).map(|i| estimator.of(&[&values[..i], &values[i + 1..]].concat())).collect()
}

/// What to tell someone who compares on `seeds` seeds; `None` from 10 on.
pub fn few_seeds_warning(seeds: usize) -> Option<String> {
    match seeds {
        0 => Some("no seed has finished: there is nothing to report yet".into()),
        1 => Some("1 seed shows one run, not the algorithm: no interval is given; use 20".into()),
        2..10 => Some(format!(
            "with {seeds} seeds a 95 % interval is only a rough guide: where a few runs go much \
             better or worse than the rest, it misses the truth far more often than 5 % of the \
             time; use 20"
        )),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mdp::streams::Stream;
    use crate::stats::distributions::normal_quantile;

    const METHODS: [Method; 5] =
        [Method::BootstrapT, Method::Percentile, Method::Basic, Method::Bca, Method::StudentT];

    fn close(actual: f64, expected: f64) {
        assert!((actual - expected).abs() <= 1e-12 * expected.abs(), "{actual} is not {expected}");
    }

    #[test]
    fn students_t_by_hand() {
        // x̄ = 3, s² = 2.5, se = √0.5, t(0.975; 4) = 2.7764451051977987.
        let x = [1.0, 2.0, 3.0, 4.0, 5.0];
        let i = interval_with(&x, Estimator::Mean, Method::StudentT, 0.95).unwrap();
        close(i.low, 3.0 - 2.776_445_105_197_798_7 * 0.5f64.sqrt());
        close(i.high, 3.0 + 2.776_445_105_197_798_7 * 0.5f64.sqrt());
    }

    #[test]
    fn the_trimmed_t_by_hand() {
        // Kept: 2, 3, 4 (h = 3). Winsorised: 2, 2, 3, 4, 4 about 3: SSD = 4; se = √(4 / (3·2)).
        let x = [1.0, 100.0, 3.0, 2.0, 4.0];
        close(Estimator::Iqm.standard_error(&x), (2.0f64 / 3.0).sqrt());
        // t(0.975; 2) = 4.302652729749462.
        let i = interval_with(&x, Estimator::Iqm, Method::StudentT, 0.95).unwrap();
        close(i.high, 3.0 + 4.302_652_729_749_462 * (2.0f64 / 3.0).sqrt());
        assert_eq!(i.method, Method::StudentT);
    }

    #[test]
    fn the_standard_error_of_the_mean_is_the_usual_one() {
        let x = [2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0];
        close(Estimator::Mean.standard_error(&x), crate::stats::standard_error(&x));
        assert!(Estimator::Mean.standard_error(&[1.0]).is_nan());
    }

    #[test]
    fn the_defaults() {
        let x: Vec<f64> = (0..20).map(f64::from).collect();
        assert_eq!(interval(&x, Estimator::Mean).unwrap().method, Method::BootstrapT);
        assert_eq!(interval(&x[..10], Estimator::Mean).unwrap().method, Method::StudentT);
        assert_eq!(interval(&x, Estimator::Iqm).unwrap().method, Method::Percentile);
        assert_eq!(interval(&x[..4], Estimator::Iqm).unwrap().method, Method::StudentT);
    }

    #[test]
    fn no_interval_from_one_value_or_from_infinities() {
        for method in METHODS {
            for x in [&[][..], &[1.0], &[1.0, f64::NAN, 2.0], &[1.0, f64::INFINITY, 2.0]] {
                assert_eq!(interval_with(x, Estimator::Mean, method, 0.95), None);
                assert_eq!(interval_with(x, Estimator::Iqm, method, 0.95), None);
            }
        }
    }

    #[test]
    fn equal_values_give_an_interval_of_no_width() {
        // The mean of three tenths is not a tenth in binary: the limits are the values themselves.
        assert_ne!(crate::stats::mean(&[0.1; 3]), 0.1);
        for method in METHODS {
            for estimator in [Estimator::Mean, Estimator::Iqm] {
                let i = interval_with(&[0.1; 3], estimator, method, 0.95).unwrap();
                assert_eq!((i.low, i.high), (0.1, 0.1), "{method}");
            }
        }
    }

    #[test]
    fn every_method_gives_finite_ordered_limits_on_tied_and_tiny_samples() {
        let tied = [-200.0, -200.0, -200.0, -200.0, -200.0, -200.0, -200.0, -120.0];
        for method in METHODS {
            for x in [&tied[..], &[1.0, 2.0], &[1.0, 2.0, 4.0], &[0.0, 0.0, 1.0]] {
                for estimator in [Estimator::Mean, Estimator::Iqm] {
                    let i = interval_with(x, estimator, method, 0.95).unwrap();
                    assert!(i.low.is_finite() && i.low <= i.high, "{method} {x:?}: {i:?}");
                }
            }
        }
        // A third of the resamples of eight values lacks the odd one: no quantile of t* there.
        let i = interval_with(&tied, Estimator::Mean, Method::BootstrapT, 0.95).unwrap();
        assert_eq!(i.method, Method::StudentT);
    }

    #[test]
    fn intervals_are_deterministic_and_blind_to_order() {
        let x = [3.0, 1.0, 4.0, 1.0, 5.0, 9.0, 2.0, 6.0, 5.0, 3.0];
        for method in METHODS {
            let make = || interval_with(&x, Estimator::Mean, method, 0.95).unwrap();
            assert_eq!(make(), make());
        }
        let wide = interval_with(&x, Estimator::Mean, Method::BootstrapT, 0.99).unwrap();
        let narrow = interval_with(&x, Estimator::Mean, Method::BootstrapT, 0.8).unwrap();
        assert!(wide.low < narrow.low && narrow.high < wide.high);
    }

    #[test]
    fn nineteen_in_twenty_intervals_hold_the_truth() {
        for (estimator, n) in [(Estimator::Mean, 8), (Estimator::Iqm, 4), (Estimator::Iqm, 20)] {
            let mut stream = Stream::new(1, "coverage");
            let held = (0..400)
                .filter(|_| {
                    let x: Vec<f64> = (0..n).map(|_| normal_quantile(stream.uniform())).collect();
                    let i = interval(&x, estimator).unwrap();
                    i.low <= 0.0 && 0.0 <= i.high
                })
                .count();
            // 380 expected, with a standard deviation of 4.4.
            assert!((365..=395).contains(&held), "{estimator:?} of {n}: {held} of 400");
        }
    }

    #[test]
    fn few_seeds_are_named() {
        assert!(few_seeds_warning(1).unwrap().contains("no interval"));
        assert!(few_seeds_warning(5).unwrap().starts_with("with 5 seeds a 95 % interval"));
        assert_eq!(few_seeds_warning(10), None);
    }
}
