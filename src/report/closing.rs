//! What closes a study in the terminal: the table of its variants, with notes.

use super::compare::against_baseline;
use super::results::Findings;
use super::table::{StudyTable, TableRow};
use crate::script::Plan;

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
