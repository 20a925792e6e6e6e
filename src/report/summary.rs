//! What the runs of one variant come to, over seeds: the content of `summary.json`.

use serde::{Deserialize, Serialize};

use crate::stats::{
    Estimator, Interval, Method, auc, few_seeds_warning, first_solved, interval, iqm, mean, median,
    rolling_mean_at,
};

/// A quantity measured once per seed, summarised over seeds. Returns are native ones.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OverSeeds {
    /// The mean.
    pub mean: f64,
    /// The interquartile mean.
    pub iqm: f64,
    /// The lower limit of the 95 % interval of the IQM; `None` with fewer than two seeds.
    pub low: Option<f64>,
    /// The upper limit.
    pub high: Option<f64>,
    /// How the interval was made.
    pub method: Option<Method>,
}

impl OverSeeds {
    /// Summarises `values`, `[seeds]`.
    pub fn of(values: &[f64]) -> Self {
        let limits = interval(values, Estimator::Iqm);
        Self {
            mean: mean(values),
            iqm: iqm(values),
            low: limits.map(|i| i.low),
            high: limits.map(|i| i.high),
            method: limits.map(|i| i.method),
        }
    }

    /// The limits of the interval of the IQM, if there is one.
    pub fn limits(&self) -> Option<(f64, f64)> {
        self.low.zip(self.high)
    }

    /// The interval of the IQM, if there is one.
    pub fn interval(&self) -> Option<Interval> {
        Some(Interval { low: self.low?, high: self.high?, method: self.method? })
    }
}

/// How many seeds reached the threshold, and how soon.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Solved {
    /// Seeds whose rolling mean over a full window reached the threshold at least once.
    pub seeds: usize,
    /// The median over those seeds of the number of episodes it took; `None` if there are none.
    pub median_episode: Option<f64>,
    /// Episodes it took each seed, `[seeds]`; `None` for a seed that never got there.
    pub first_episode: Vec<Option<usize>>,
}

/// The statistics of one variant. Depends on the runs alone: no clock, no host.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct VariantSummary {
    /// The variant's name.
    pub name: String,
    /// Number of seeds.
    pub seeds: usize,
    /// Episodes per seed; a seed that stops when it has solved the task plays fewer.
    pub episodes: usize,
    /// The window of rolling means, in episodes.
    pub window: usize,
    /// The return that counts as solved, if the environment or the script names one.
    pub threshold: Option<f64>,
    /// The rolling mean at the last episode that each seed played.
    pub final_return: OverSeeds,
    /// Each seed's mean return over all episodes: the area under its learning curve, per episode.
    /// What a seed did not play counts as its last rolling mean.
    pub auc: OverSeeds,
    /// When the threshold was reached; `None` without a threshold.
    pub solved: Option<Solved>,
    /// The error of a predictor's values after the last episode: root mean square over the states
    /// that its policy reaches. `None` for other agents, and where the exact values are not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value_error: Option<OverSeeds>,
    /// The largest error among those states.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value_error_max: Option<OverSeeds>,
    /// The mean of the errors after each episode.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value_error_auc: Option<OverSeeds>,
    /// What a network believed in the first state of an episode beyond the discounted learned return
    /// that the episode brought: the mean over the last `window` episodes of each seed. `None` for
    /// other agents.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub overestimation: Option<OverSeeds>,
    /// Mean steps per episode, over all episodes that were played.
    pub mean_steps: f64,
    /// The values behind `final_return`, `[seeds]`.
    pub final_returns: Vec<f64>,
    /// What a reader has to know before believing the numbers.
    pub warnings: Vec<String>,
}

/// Summarises one variant.
///
/// `returns` are native returns, `[seeds][episodes]`; `lengths` steps per episode, the same shape;
/// `episodes` is how many a seed plays that does not stop early, `window` that of the rolling mean,
/// in episodes. A seed without episodes makes its final return NaN.
///
/// # Panics
/// If `window` is 0.
pub fn summarise(
    name: &str,
    returns: &[Vec<f64>],
    lengths: &[Vec<u32>],
    episodes: usize,
    window: usize,
    threshold: Option<f64>,
) -> VariantSummary {
    let final_returns: Vec<f64> = returns
        .iter()
        .map(|run| match run.len() {
            0 => f64::NAN,
            played => rolling_mean_at(run, window, played),
        })
        .collect();
    let areas: Vec<f64> = returns.iter().map(|run| auc(run, window, episodes)).collect();
    // Whole numbers: the sum is exact in any order.
    let steps: u64 = lengths.iter().flatten().map(|&n| u64::from(n)).sum();
    let episodes_in_all: usize = lengths.iter().map(Vec::len).sum();
    let mut warnings = warnings(returns.len(), &final_returns);
    let stopped = returns.iter().filter(|run| run.len() < episodes).count();
    if stopped > 0 {
        warnings.push(format!(
            "{stopped} of {} seeds stopped before episode {episodes}: their final return is the rolling \
             mean at which they did, and their area carries it forward",
            returns.len()
        ));
    }
    VariantSummary {
        name: name.to_owned(),
        seeds: returns.len(),
        episodes,
        window,
        threshold,
        final_return: OverSeeds::of(&final_returns),
        auc: OverSeeds::of(&areas),
        solved: threshold.map(|threshold| solved(returns, window, threshold)),
        value_error: None,
        value_error_max: None,
        value_error_auc: None,
        overestimation: None,
        mean_steps: steps as f64 / episodes_in_all as f64,
        final_returns,
        warnings,
    }
}

fn solved(returns: &[Vec<f64>], window: usize, threshold: f64) -> Solved {
    let first_episode: Vec<Option<usize>> =
        returns.iter().map(|run| first_solved(run, window, threshold)).collect();
    let reached: Vec<f64> = first_episode.iter().flatten().map(|&n| n as f64).collect();
    Solved {
        seeds: reached.len(),
        median_episode: (!reached.is_empty()).then(|| median(&reached)),
        first_episode,
    }
}

fn warnings(seeds: usize, final_returns: &[f64]) -> Vec<String> {
    let mut warnings: Vec<String> = few_seeds_warning(seeds).into_iter().collect();
    let diverged = final_returns.iter().filter(|r| !r.is_finite()).count();
    if diverged > 0 {
        warnings.push(format!(
            "{diverged} of {seeds} seeds ended with a return that is not a finite number: \
             no interval is given"
        ));
    }
    warnings
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four seeds of four episodes: the second half of the task is solved by two of them.
    fn runs() -> (Vec<Vec<f64>>, Vec<Vec<u32>>) {
        let returns = vec![
            vec![0.0, 0.0, 10.0, 10.0],
            vec![0.0, 10.0, 10.0, 10.0],
            vec![0.0, 0.0, 0.0, 2.0],
            vec![0.0, 0.0, 4.0, 0.0],
        ];
        (returns, vec![vec![5, 5, 5, 5], vec![10; 4], vec![20; 4], vec![1, 2, 3, 4]])
    }

    #[test]
    fn a_variant_by_hand() {
        let (returns, lengths) = runs();
        let s = summarise("plain", &returns, &lengths, 4, 2, Some(9.0));
        assert_eq!(s.final_returns, [10.0, 10.0, 1.0, 2.0]);
        // The IQM of four drops the least and the greatest: (2 + 10) / 2.
        assert_eq!((s.final_return.mean, s.final_return.iqm), (5.75, 6.0));
        // Areas 5, 7.5, 0.5, 1.
        assert_eq!((s.auc.mean, s.auc.iqm), (3.5, 3.0));
        let solved = s.solved.unwrap();
        assert_eq!(solved.first_episode, [Some(4), Some(3), None, None]);
        assert_eq!((solved.seeds, solved.median_episode), (2, Some(3.5)));
        // 20 + 40 + 80 + 10 steps in 16 episodes.
        assert_eq!(s.mean_steps, 9.375);
        assert_eq!((s.seeds, s.episodes, s.window, s.threshold), (4, 4, 2, Some(9.0)));
        assert!(s.warnings[0].starts_with("with 4 seeds"));
    }

    #[test]
    fn seeds_that_stop_when_solved_stay_comparable() {
        let (mut returns, mut lengths) = runs();
        // The second seed reaches the threshold with the third episode and stops.
        returns[1].pop();
        lengths[1].pop();
        let s = summarise("plain", &returns, &lengths, 4, 2, Some(9.0));
        let all = summarise("plain", &runs().0, &runs().1, 4, 2, Some(9.0));
        // It would have gone on as it stopped: nothing but the steps differs.
        assert_eq!((s.episodes, &s.auc, &s.final_returns), (4, &all.auc, &all.final_returns));
        assert_eq!(s.solved, all.solved);
        // 20 + 30 + 80 + 10 steps in 15 episodes.
        assert_eq!(s.mean_steps, 140.0 / 15.0);
        let warned = |s: &VariantSummary| s.warnings.iter().any(|w| w.starts_with("1 of 4 seeds"));
        assert!(warned(&s) && !warned(&all));
        // Stopped at a lower mean, it is carried forward at that.
        returns[1] = vec![0.0, 8.0];
        lengths[1] = vec![10; 2];
        let s = summarise("plain", &returns, &lengths, 4, 2, Some(4.0));
        assert_eq!(s.final_returns[1], 4.0);
        // Areas 5, (8 + 2 * 4) / 4, 0.5, 1.
        assert_eq!(s.auc.mean, 10.5 / 4.0);
    }

    #[test]
    fn never_solved_one_seed_and_no_threshold() {
        let (returns, lengths) = runs();
        let s = summarise("plain", &returns[2..3], &lengths[2..3], 4, 2, Some(9.0));
        assert_eq!(s.solved.unwrap().median_episode, None);
        assert_eq!((s.final_return.low, s.final_return.method), (None, None));
        assert!(s.warnings[0].contains("no interval"));
        assert_eq!(summarise("plain", &returns, &lengths, 4, 2, None).solved, None);
    }

    #[test]
    fn a_diverged_seed_is_named_not_hidden() {
        let (mut returns, lengths) = runs();
        returns[2][3] = f64::NAN;
        let s = summarise("plain", &returns, &lengths, 4, 2, Some(9.0));
        assert!(s.final_return.iqm.is_nan() && s.final_return.interval().is_none());
        assert!(s.warnings.iter().any(|w| w.starts_with("1 of 4 seeds ended")), "{:?}", s.warnings);
    }

    #[test]
    fn the_file_reads_back_and_repeats() {
        let returns: Vec<Vec<f64>> =
            (0..12).map(|s| (0..50).map(|e| f64::from(e * (s % 5)) / 7.0).collect()).collect();
        let lengths = vec![vec![3; 50]; 12];
        let write = || {
            let summary = summarise("plain", &returns, &lengths, 50, 20, Some(20.0));
            (serde_json::to_string(&summary).unwrap(), summary)
        };
        let (text, summary) = write();
        assert_eq!(text, write().0);
        assert_eq!(serde_json::from_str::<VariantSummary>(&text).unwrap(), summary);
        assert!(text.contains(r#""method":"percentile""#));
        assert!(summary.warnings.is_empty());
    }
}
