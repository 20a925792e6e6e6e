//! The runs of one variant, gathered seed by seed.

use super::curves::Curve;
use super::summary::{OverSeeds, VariantSummary, summarise};
use crate::experiment::{StartValue, StoredUnit};
use crate::script::Variant;
use crate::stats::{CurveBand, curve_band, mean, rolling_mean_at};

/// What tables and plots need of a variant's units.
#[derive(Debug, Default)]
pub(super) struct Runs {
    /// Native returns, `[seeds][episodes]`.
    returns: Vec<Vec<f64>>,
    /// Steps, the same shape.
    lengths: Vec<Vec<u32>>,
    /// Errors of the values, the same shape; where none was computed, the one before. Empty unless
    /// the agent predicts values that are known.
    errors: Vec<Vec<f64>>,
    /// The largest error of a state after the last episode, `[seeds]`.
    largest: Vec<f64>,
    /// What a network believed at the start of each episode, the shape of `returns`; empty unless
    /// the agent learns one.
    believed: Vec<Vec<f64>>,
    /// What these episodes brought.
    brought: Vec<Vec<f64>>,
}

impl Runs {
    /// Adds a seed.
    pub(super) fn push(&mut self, unit: &StoredUnit) {
        self.returns.push(unit.rows.iter().map(|r| r.native).collect());
        self.lengths.push(unit.rows.iter().map(|r| r.steps).collect());
        let known = unit.rows.iter().scan(None, |last, row| {
            *last = row.value_error.or(*last);
            Some(*last)
        });
        if let Some(errors) = known.collect::<Option<Vec<f64>>>().filter(|e| !e.is_empty()) {
            self.errors.push(errors);
            let errors = unit.values.iter().filter_map(|(_, v, exact)| Some((v - (*exact)?).abs()));
            self.largest.push(errors.fold(0.0, f64::max));
        }
        let starts = unit.rows.iter().map(|row| row.start).collect::<Option<Vec<StartValue>>>();
        if let Some(starts) = starts.filter(|starts| !starts.is_empty()) {
            self.believed.push(starts.iter().map(|s| s.believed).collect());
            self.brought.push(starts.iter().map(|s| s.brought).collect());
        }
    }

    /// Whether there are errors of values.
    pub(super) fn has_errors(&self) -> bool {
        !self.errors.is_empty()
    }

    /// Whether a network said what it believed at the start of episodes.
    pub(super) fn has_starts(&self) -> bool {
        !self.believed.is_empty()
    }

    /// Their statistics.
    pub(super) fn summary(&self, variant: &Variant) -> VariantSummary {
        let Variant { name, threshold, .. } = variant;
        let (episodes, window) = (variant.episodes as usize, variant.window as usize);
        let mut summary =
            summarise(name, &self.returns, &self.lengths, episodes, window, *threshold);
        if self.has_starts() {
            let last = |run: &Vec<f64>| rolling_mean_at(run, window, run.len());
            let seeds = self.believed.iter().zip(&self.brought);
            let beyond: Vec<f64> = seeds.map(|(v, g)| last(v) - last(g)).collect();
            summary.overestimation = Some(OverSeeds::of(&beyond));
        }
        if self.errors.is_empty() {
            return summary;
        }
        let last: Vec<f64> = self.errors.iter().filter_map(|run| run.last().copied()).collect();
        let areas: Vec<f64> = self.errors.iter().map(|run| mean(run)).collect();
        VariantSummary {
            value_error: Some(OverSeeds::of(&last)),
            value_error_max: Some(OverSeeds::of(&self.largest)),
            value_error_auc: Some(OverSeeds::of(&areas)),
            ..summary
        }
    }

    /// The learning curve of the native returns, of the `i`-th variant. It ends where every seed has
    /// stopped.
    pub(super) fn curve(&self, i: usize, variant: &Variant) -> Curve {
        let band = curve_band(&self.returns, variant.window as usize, self.longest());
        Curve { name: variant.name.clone(), look: i, dashed: false, band }
    }

    /// The curve of the errors.
    pub(super) fn error_curve(&self, i: usize, variant: &Variant) -> Curve {
        let band = curve_band(&self.errors, 1, variant.episodes as usize);
        Curve { name: variant.name.clone(), look: i, dashed: false, band }
    }

    /// What was believed at the start of episodes, and what these brought, of the `i`-th variant.
    pub(super) fn start_curves(&self, i: usize, variant: &Variant) -> [Curve; 2] {
        let window = variant.window as usize;
        let of = |what: &str, values: &[Vec<f64>], dashed| {
            let band = curve_band(values, window, self.longest());
            // No thin line of the mean beside each: two a variant are enough.
            let band = CurveBand { mean: band.iqm.clone(), ..band };
            Curve { name: format!("{}: {what}", variant.name), look: i, dashed, band }
        };
        [of("believed", &self.believed, false), of("brought", &self.brought, true)]
    }

    /// How many episodes the seed played that played most.
    fn longest(&self) -> usize {
        self.returns.iter().map(Vec::len).max().unwrap_or(0)
    }
}
