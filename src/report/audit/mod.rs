//! A verdict on a shaping, with its proof: [`audit_text`] for the terminal, [`audit_json`] for
//! programs.

mod consequences;
mod json;
mod lines;
mod proof;

pub use json::audit_json;

use crate::audit::Strict;
use crate::experiment::{Audit, AuditVerdict, Exact};
use crate::mdp::Grid;
use crate::script::Variant;
use consequences::{consequences, similarity};
pub(super) use lines::short;
use lines::{LISTED, Lines};
use proof::{proof, sampled, ways};

/// The report on one variant.
pub fn audit_text(variant: &Variant, audit: &Audit) -> String {
    let mut lines = Lines::default();
    lines.item("verdict", &headline(audit));
    lines.item("basis", &audit.basis);
    if let Some(exact) = &audit.exact {
        exactly(exact, audit, &mut lines);
    }
    if let Some(continuous) = &audit.continuous {
        sampled(continuous, &mut lines);
    }
    if let Some(remark) = audit.remark {
        lines.item("note", remark);
    }
    if let Some(instead) = &audit.instead {
        lines.item("instead", instead);
    }
    format!("{}\n{}", variant.name, lines.0)
}

/// The verdict, and what becomes of the optimal policy.
fn headline(audit: &Audit) -> String {
    let policy = match (audit.policy_preserved, audit.states_changed) {
        _ if audit.verdict == AuditVerdict::Unshaped => return "unshaped".into(),
        (Some(true), _) => "the optimal policy is preserved".to_string(),
        (Some(false), Some(n)) => {
            let of = audit.exact.as_ref().map_or(String::new(), |e| format!(" of {}", e.states));
            format!("the optimal policy CHANGES in {n}{of} states")
        }
        (Some(false), None) => "the optimal policy CHANGES".into(),
        (None, _) => "the optimal policy was not compared".into(),
    };
    let verdict = match audit.verdict {
        AuditVerdict::NotPotentialBased => "NOT potential-based",
        AuditVerdict::PotentialBased => "potential-based",
        AuditVerdict::NoViolationFound => "no violation found",
        AuditVerdict::Unshaped | AuditVerdict::Inconclusive => "inconclusive",
    };
    format!("{verdict}; {policy}")
}

fn exactly(exact: &Exact, audit: &Audit, lines: &mut Lines) {
    if let Some(strict) = &exact.strict {
        transitions(strict, lines);
        if let Some(certificate) = &strict.certificate {
            proof(certificate, &exact.naming, lines);
        }
    }
    if let Some(found) = &exact.pathwise {
        ways(found, &exact.naming, lines);
    }
    // Of a potential there is nothing more to tell.
    if audit.verdict == AuditVerdict::PotentialBased {
        return;
    }
    similarity(exact, lines);
    changed(exact, lines);
    consequences(exact, lines);
}

fn transitions(strict: &Strict, lines: &mut Lines) {
    let text = if strict.violations == 0 {
        format!("all {} agree with one potential", strict.transitions)
    } else {
        format!(
            "{} of {} disagree with every potential, by up to {}",
            strict.violations,
            strict.transitions,
            short(strict.largest_error)
        )
    };
    lines.item("transitions", &text);
}

/// The states whose greedy actions differ: drawn where there is a map, else listed.
fn changed(exact: &Exact, lines: &mut Lines) {
    let Some(compared) = exact.preservation.as_ref().filter(|p| !p.states_changed.is_empty())
    else {
        return;
    };
    let naming = &exact.naming;
    if let Some(grid) = &naming.schema.grid {
        lines.item("changes", "greedy actions, without > with shaping, where they differ:");
        for line in drawn(grid, &compared.states_changed, &compared.plain, &compared.shaped) {
            lines.drawn(&line);
        }
        return;
    }
    lines.item("changes", "greedy actions, without > with shaping:");
    let names =
        |set: &[usize]| set.iter().map(|&a| naming.action(a)).collect::<Vec<_>>().join(" or ");
    for &s in compared.states_changed.iter().take(LISTED) {
        lines.more(&format!(
            "{}: {} > {}",
            naming.state(s),
            names(&compared.plain[s]),
            names(&compared.shaped[s])
        ));
    }
    if compared.states_changed.len() > LISTED {
        lines.more(&format!("… {} more states", compared.states_changed.len() - LISTED));
    }
}

fn drawn(
    grid: &Grid,
    changed: &[usize],
    plain: &[Vec<usize>],
    shaped: &[Vec<usize>],
) -> Vec<String> {
    let arrows = |set: &[usize]| set.iter().map(|&a| grid.arrows[a]).collect::<String>();
    let cols = grid.rows.first().map_or(0, |row| row.chars().count());
    let cell = |s: usize, tile: char| {
        if changed.contains(&s) {
            format!("{tile} {}>{}", arrows(&plain[s]), arrows(&shaped[s]))
        } else {
            tile.to_string()
        }
    };
    let cells: Vec<Vec<String>> = grid
        .rows
        .iter()
        .enumerate()
        .map(|(r, row)| row.chars().enumerate().map(|(c, tile)| cell(r * cols + c, tile)).collect())
        .collect();
    let width = |c: usize| cells.iter().map(|row| row[c].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..cols).map(width).collect();
    let line = |row: &Vec<String>| {
        let padded = row.iter().zip(&widths).map(|(cell, &width)| format!("{cell:<width$}"));
        padded.collect::<Vec<_>>().join("  ").trim_end().to_string()
    };
    cells.iter().map(line).collect()
}
