//! Variants against the study's baseline, paired by seed.

use super::closing::stopped;
use super::summary::VariantSummary;
use crate::script::Plan;
use crate::stats::{Estimator, interval, mean};

/// One line per variant that shares its seeds with the baseline: the mean difference of the final
/// returns, seed by seed, with its 95 % interval. Variants with the same seed share their
/// environment's stream, so that pairing takes out what luck they have in common.
pub fn against_baseline(plan: &Plan, summaries: &[VariantSummary]) -> Vec<String> {
    let Some(baseline) = &plan.baseline else { return Vec::new() };
    let Some(reference) = plan.variants.iter().position(|v| v.name == *baseline) else {
        return Vec::new();
    };
    let mut lines = Vec::new();
    for (i, variant) in plan.variants.iter().enumerate() {
        if i == reference || variant.seeds != plan.variants[reference].seeds {
            continue;
        }
        let pairs = summaries[i].final_returns.iter().zip(&summaries[reference].final_returns);
        let differences: Vec<f64> = pairs.map(|(a, b)| a - b).collect();
        let bounds = interval(&differences, Estimator::Mean)
            .map_or(String::new(), |i| format!(" [{:+.1}, {:+.1}]", i.low, i.high));
        let stopped = |i: usize| stopped(&plan.variants[i], &summaries[i]) > 0;
        let unequal = if stopped(i) || stopped(reference) {
            ", after unequal numbers of episodes"
        } else {
            ""
        };
        lines.push(format!(
            "{} against {baseline}: {:+.1}{bounds}, paired over {} seeds{unequal}",
            variant.name,
            mean(&differences),
            differences.len()
        ));
    }
    lines
}
