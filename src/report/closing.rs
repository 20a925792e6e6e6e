//! What closes a study in the terminal: the table of its variants, with notes.

use super::compare::against_baseline;
use super::results::Findings;
use super::summary::VariantSummary;
use super::table::{StudyTable, TableRow};
use crate::script::{Plan, Variant};

/// How many seeds of a variant stopped before its last episode.
pub(super) fn stopped(variant: &Variant, summary: &VariantSummary) -> usize {
    let solved = summary.solved.as_ref().filter(|_| variant.stop_when_solved);
    let first = solved.iter().flat_map(|solved| solved.first_episode.iter().flatten());
    first.filter(|episode| **episode < summary.episodes).count()
}

/// The table of a study's findings.
pub fn closing_table(plan: &Plan, findings: &Findings) -> StudyTable {
    let rows = findings.summaries.iter().enumerate().map(|(i, summary)| {
        TableRow::new(summary, findings.steps_per_second[i], findings.audits[i].label())
    });
    let mut windows: Vec<u32> = plan.variants.iter().map(|v| v.window).collect();
    windows.sort_unstable();
    windows.dedup();
    let over = match windows[..] {
        [1] => "native return of the last episode".to_string(),
        [n] => format!("native return, rolling mean over the last {n} episodes"),
        _ => "native return, rolling mean over each variant's own window".to_string(),
    };
    let mut notes = vec![format!("final: {over} of training, exploration included")];
    if findings.summaries.iter().any(|s| s.value_error.is_some()) {
        notes.push(
            "value error: of V after the last episode, root mean square over the states that the \
             policy reaches; IQM over seeds"
                .into(),
        );
    }
    if findings.summaries.iter().any(|s| s.overestimation.is_some()) {
        notes.push(
            "overest.: what the network believed of an episode's first state beyond the discounted \
             learned return that followed, mean over the last episodes; IQM over seeds"
                .into(),
        );
    }
    let stopped: Vec<String> = plan
        .variants
        .iter()
        .zip(&findings.summaries)
        .map(|(v, s)| (stopped(v, s), s))
        .filter(|(n, _)| *n > 0)
        .map(|(n, s)| format!("{} ({n} of {} seeds)", s.name, s.seeds))
        .collect();
    if !stopped.is_empty() {
        notes.push(format!(
            "stopped when solved: {}; their final return is the mean that reached the threshold, \
             not what more training would give",
            stopped.join(", ")
        ));
    }
    // Nobody can act on a verdict that says only that there is none.
    let undecided = plan.variants.iter().zip(&findings.audits);
    let undecided = undecided.filter(|(_, audit)| audit.policy_preserved.is_none());
    notes.extend(
        undecided
            .map(|(v, audit)| format!("{}: {}, {}", v.name, audit.verdict.as_str(), audit.basis)),
    );
    notes.extend(against_baseline(plan, &findings.summaries));
    StudyTable { rows: rows.collect(), notes }
}
