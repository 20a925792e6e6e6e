//! Learning curves: one run's in numbers, and many runs' with a band.

use serde::{Deserialize, Serialize};

use super::bootstrap::Resamples;
use super::describe::{iqm, mean};
use super::interval::{Estimator, LEVEL, Method, interval_on};

/// How many points a [`curve_band`] has at most: one per two pixels of a wide plot.
const MAX_POINTS: usize = 400;

/// The mean of the last `window` returns at every episode, `[episodes]`; at the start, of what is
/// there.
///
/// # Panics
/// If `window` is 0.
pub fn rolling_mean(returns: &[f64], window: usize) -> Vec<f64> {
    (1..=returns.len()).map(|played| rolling_mean_at(returns, window, played)).collect()
}

/// [`rolling_mean`] after `played` episodes (1-based).
///
/// Every window is summed afresh: a running sum would carry its rounding, and one infinite
/// return, through the rest of the run.
///
/// # Panics
/// If `window` is 0, or `played` is 0 or more than there are returns.
pub fn rolling_mean_at(returns: &[f64], window: usize, played: usize) -> f64 {
    assert!(window > 0, "a rolling mean needs a window of at least one episode");
    assert!(played > 0, "episodes are counted from 1");
    mean(&returns[played.saturating_sub(window)..played])
}

/// The area under the learning curve per episode: the mean return over `episodes`. Higher means
/// sooner or better. NaN without episodes.
///
/// A run that stopped before is carried forward: episodes that it did not play count as much as its
/// last rolling mean over `window`, so that runs of unequal length can be compared.
///
/// # Panics
/// If `window` is 0 and the run stopped before.
pub fn auc(returns: &[f64], window: usize, episodes: usize) -> f64 {
    let played = returns.len();
    if played == 0 || played >= episodes {
        return mean(returns);
    }
    let carried = (episodes - played) as f64 * rolling_mean_at(returns, window, played);
    (returns.iter().sum::<f64>() + carried) / episodes as f64
}

/// Whether a task with these returns so far is solved now: whether the mean of the last `window` of
/// them is at least `threshold`. Only full windows count: a lucky first episode solves nothing.
///
/// # Panics
/// If `window` is 0 and there are returns.
pub fn is_solved(returns: &[f64], window: usize, threshold: f64) -> bool {
    let played = returns.len();
    played >= window.max(1) && rolling_mean_at(returns, window, played) >= threshold
}

/// After how many episodes (1-based, hence at least `window`) a task was first solved, as
/// [`is_solved`] has it; `None` if never.
///
/// # Panics
/// If `window` is 0 and there are returns.
pub fn first_solved(returns: &[f64], window: usize, threshold: f64) -> Option<usize> {
    (window.max(1)..=returns.len()).find(|&played| is_solved(&returns[..played], window, threshold))
}

/// How many resamples a band draws: half of a single interval's, being read by eye.
const RESAMPLES: usize = 1000;

/// Learning curves of several seeds, summarised point by point. All vectors are `[points]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CurveBand {
    /// Episodes played (1-based), ascending; the first and the last are always there.
    pub episode: Vec<usize>,
    /// The mean over seeds of the rolling mean.
    pub mean: Vec<f64>,
    /// The interquartile mean over seeds of the rolling mean.
    pub iqm: Vec<f64>,
    /// The lower limit of the pointwise 95 % interval of the IQM. Equal to the IQM where there is
    /// no interval: a single seed.
    pub low: Vec<f64>,
    /// The upper limit.
    pub high: Vec<f64>,
    /// How many seeds went in. Below two there is no band to draw.
    pub seeds: usize,
    /// How many of them stopped before the last episode and are carried forward.
    pub carried: usize,
    /// How the band was made; `None` below two seeds.
    pub method: Option<Method>,
}

/// The rolling mean over `window` episodes of `returns` (`[seeds][episodes]`) across seeds, with a
/// pointwise 95 % interval of the IQM, up to `episodes`.
///
/// At most 400 evenly spaced episodes, the first and the last among them. The band is made by
/// [`Method::recommended`]: percentiles of the bootstrap, and the trimmed t below 5 seeds.
/// A run that stopped before is carried forward: it keeps its last rolling mean. Without it the rest
/// of the curve would speak of the seeds that learn slowest. No points if a run has no episodes.
/// Deterministic.
///
/// # Panics
/// If `window` is 0.
pub fn curve_band(returns: &[Vec<f64>], window: usize, episodes: usize) -> CurveBand {
    let seeds = returns.len();
    let shortest = returns.iter().map(Vec::len).min().unwrap_or(0);
    let episodes = if shortest == 0 { 0 } else { episodes };
    let method = Method::recommended(Estimator::Iqm, seeds);
    let episode = spread(episodes, MAX_POINTS);
    let points = episode.len();
    let mut band = CurveBand {
        episode,
        mean: Vec::with_capacity(points),
        iqm: Vec::with_capacity(points),
        low: Vec::with_capacity(points),
        high: Vec::with_capacity(points),
        seeds,
        carried: returns.iter().filter(|run| run.len() < episodes).count(),
        method: (seeds > 1).then_some(method),
    };
    // The same resamples at every point: whole runs are drawn, not single episodes.
    let resamples = Resamples::draw(seeds.max(1), RESAMPLES);
    for &played in &band.episode {
        let at = |run: &Vec<f64>| rolling_mean_at(run, window, played.min(run.len()));
        let values: Vec<f64> = returns.iter().map(at).collect();
        let centre = iqm(&values);
        let limits = interval_on(&values, Estimator::Iqm, method, LEVEL, &resamples);
        band.mean.push(mean(&values));
        band.iqm.push(centre);
        band.low.push(limits.map_or(centre, |i| i.low));
        band.high.push(limits.map_or(centre, |i| i.high));
    }
    band
}

/// At most `most` (at least 2) of the numbers `1..=n`, evenly spread, with both ends.
pub(crate) fn spread(n: usize, most: usize) -> Vec<usize> {
    if n <= most {
        return (1..=n).collect();
    }
    // Rounded to the nearest in integers; consecutive ones differ because n > most.
    (0..most).map(|i| 1 + (i * (n - 1) + (most - 1) / 2) / (most - 1)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mdp::streams::Stream;

    #[test]
    fn rolling_means_start_with_what_is_there() {
        let x = [1.0, 3.0, 8.0, 4.0];
        assert_eq!(rolling_mean(&x, 3), [1.0, 2.0, 4.0, 5.0]);
        assert_eq!(rolling_mean(&x, 1), x);
        assert_eq!(rolling_mean(&x, 100), [1.0, 2.0, 4.0, 4.0]);
        assert!(rolling_mean(&[], 3).is_empty());
    }

    #[test]
    fn an_infinite_return_leaves_with_its_window() {
        let x = [f64::NEG_INFINITY, 1.0, 2.0, 3.0];
        assert_eq!(rolling_mean(&x, 2)[1..], [f64::NEG_INFINITY, 1.5, 2.5]);
    }

    #[test]
    fn solved_counts_full_windows_only() {
        let x = [500.0, 0.0, 10.0, 20.0, 30.0];
        assert_eq!(first_solved(&x, 2, 15.0), Some(2));
        assert_eq!(first_solved(&x, 2, 250.0), Some(2));
        assert_eq!(first_solved(&x, 2, 250.1), None);
        assert_eq!(first_solved(&x[1..], 2, 15.0), Some(3));
        assert_eq!(first_solved(&x, 6, 0.0), None);
        // Never of NaN.
        assert_eq!(first_solved(&[f64::NAN; 5], 1, 0.0), None);
        // Now, not once.
        assert!(is_solved(&x[..2], 2, 15.0) && !is_solved(&x[..4], 2, 15.1));
        assert!(!is_solved(&x[..1], 2, 15.0) && !is_solved(&[], 1, 0.0));
    }

    #[test]
    fn area_is_per_episode_and_carries_short_runs_forward() {
        assert_eq!(auc(&[0.0, 0.0, 3.0, 3.0], 2, 4), 1.5);
        // The same run stopped after the third episode, when its rolling mean was 1.5; a window
        // longer than the run is the run.
        assert_eq!(auc(&[0.0, 0.0, 3.0], 2, 4), (3.0 + 1.5) / 4.0);
        assert_eq!(auc(&[0.0, 0.0, 3.0], 2, 9), (3.0 + 6.0 * 1.5) / 9.0);
        assert_eq!(auc(&[0.0, 0.0, 3.0], 20, 9), 1.0);
        assert!(auc(&[], 2, 9).is_nan());
    }

    #[test]
    fn points_are_spread_evenly_with_both_ends() {
        assert_eq!(spread(5, 400), [1, 2, 3, 4, 5]);
        assert_eq!(spread(9, 5), [1, 3, 5, 7, 9]);
        let points = spread(1003, 400);
        assert_eq!((points[0], points[399], points.len()), (1, 1003, 400));
        assert!(points.windows(2).all(|w| (2..=3).contains(&(w[1] - w[0]))));
        assert!(spread(0, 400).is_empty());
    }

    #[test]
    fn a_band_by_hand() {
        // At episode 2 with a window of 2: rolling means 1, 2, 4, 101. The IQM keeps 2 and 4.
        let returns: Vec<Vec<f64>> =
            [1.0, 2.0, 4.0, 101.0].iter().map(|&m| vec![m - 1.0, m + 1.0]).collect();
        let band = curve_band(&returns, 2, 2);
        assert_eq!(band.episode, [1, 2]);
        assert_eq!((band.mean[1], band.iqm[1]), (27.0, 3.0));
        // The trimmed t: winsorised 2, 2, 4, 4, SSD = 4, se = √(4 / 2), t(0.975; 1) = 12.70620….
        assert!((band.high[1] - (3.0 + 12.706_204_736_174_7 * 2.0f64.sqrt())).abs() < 1e-11);
        assert_eq!(band.method, Some(Method::StudentT));
    }

    #[test]
    fn one_seed_has_no_band() {
        let band = curve_band(&[vec![1.0, 2.0]], 1, 2);
        assert_eq!((band.low, band.high), (band.iqm.clone(), band.iqm));
        assert_eq!((band.seeds, band.carried, band.method), (1, 0, None));
        assert!(curve_band(&[], 20, 5).episode.is_empty());
        assert!(curve_band(&[vec![], vec![1.0]], 20, 5).episode.is_empty());
    }

    #[test]
    fn runs_that_stopped_keep_their_last_rolling_mean() {
        // The first stops after two episodes with a rolling mean of (2 + 4) / 2.
        let runs = [vec![2.0, 4.0], vec![0.0, 0.0, 10.0, 10.0]];
        let band = curve_band(&runs, 2, 4);
        assert_eq!(band.episode, [1, 2, 3, 4]);
        assert_eq!(band.mean, [1.0, 1.5, 4.0, 6.5]);
        assert_eq!((band.seeds, band.carried), (2, 1));
        // Up to an episode that both reached there is nothing to carry.
        let both = curve_band(&runs, 2, 2);
        assert_eq!((both.mean, both.carried), (vec![1.0, 1.5], 0));
    }

    #[test]
    fn many_seeds_get_a_percentile_band_around_the_iqm() {
        let mut stream = Stream::new(3, "test");
        let returns: Vec<Vec<f64>> =
            (0..20).map(|_| (0..900).map(|_| stream.uniform()).collect()).collect();
        let band = curve_band(&returns, 20, 900);
        assert_eq!(band.episode.len(), 400);
        assert_eq!(band.method, Some(Method::Percentile));
        assert!((0..400).all(|i| band.low[i] < band.iqm[i] && band.iqm[i] < band.high[i]));
        assert_eq!(band, curve_band(&returns, 20, 900));
    }
}
