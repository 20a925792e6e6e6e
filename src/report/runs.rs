//! The runs of one variant, gathered seed by seed.

use super::curves::Curve;
use super::summary::{OverSeeds, VariantSummary, summarise};
use crate::experiment::StoredUnit;
use crate::script::Variant;
use crate::stats::{curve_band, mean};

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
    }

    /// Whether there are errors of values.
    pub(super) fn has_errors(&self) -> bool {
        !self.errors.is_empty()
    }

    /// Their statistics.
    pub(super) fn summary(&self, variant: &Variant) -> VariantSummary {
        let Variant { name, threshold, .. } = variant;
        let (episodes, window) = (variant.episodes as usize, variant.window as usize);
        let summary = summarise(name, &self.returns, &self.lengths, episodes, window, *threshold);
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

    /// The learning curve of the native returns. It ends where every seed has stopped.
    pub(super) fn curve(&self, variant: &Variant) -> Curve {
        let longest = self.returns.iter().map(Vec::len).max().unwrap_or(0);
        let band = curve_band(&self.returns, variant.window as usize, longest);
        Curve { name: variant.name.clone(), band }
    }

    /// The curve of the errors.
    pub(super) fn error_curve(&self, variant: &Variant) -> Curve {
        let band = curve_band(&self.errors, 1, variant.episodes as usize);
        Curve { name: variant.name.clone(), band }
    }
}
