//! A verdict on a shaping, with its proof, for the terminal.

use std::fmt::Write;

use crate::audit::{Certificate, Divergence, Path, Pathwise, Strict, Walk, WalkStep};
use crate::experiment::{Audit, AuditVerdict, Exact, Naming};
use crate::mdp::Grid;
use crate::script::Variant;

const MEMORY: &str = "writing to a string does not fail";
/// States, steps and runs of actions that are listed one by one.
const LISTED: usize = 12;
/// Characters of a line, without what it is about.
const WIDTH: usize = 84;

/// Lines of a report, indented.
#[derive(Default)]
pub(super) struct Lines(String);

impl Lines {
    /// A line that begins with what it is about.
    pub(super) fn item(&mut self, what: &str, text: &str) {
        let mut label = what;
        for line in wrapped(text) {
            writeln!(self.0, "  {label:<12} {line}").expect(MEMORY);
            label = "";
        }
    }

    /// A line that belongs to the item before.
    pub(super) fn more(&mut self, text: &str) {
        for (i, line) in wrapped(text).iter().enumerate() {
            let indent = if i == 0 { "" } else { "    " };
            writeln!(self.0, "  {:<12} {indent}{line}", "").expect(MEMORY);
        }
    }

    /// A line that must not be broken, of a drawing.
    fn drawn(&mut self, text: &str) {
        writeln!(self.0, "  {:<12} {text}", "").expect(MEMORY);
    }
}

/// `text` in lines of [`WIDTH`] characters, broken at blanks.
fn wrapped(text: &str) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        let line = lines.last_mut().expect("there is one at least");
        if !line.is_empty() && line.chars().count() + 1 + word.chars().count() > WIDTH {
            lines.push(word.to_string());
        } else {
            if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(word);
        }
    }
    lines
}

/// The report on one variant.
pub fn audit_text(variant: &Variant, audit: &Audit) -> String {
    let mut lines = Lines::default();
    lines.item("verdict", &headline(audit));
    lines.item("basis", &audit.basis);
    if let Some(exact) = &audit.exact {
        exactly(exact, audit, &mut lines);
    }
    if let Some(continuous) = &audit.continuous
        && let Some(found) = &continuous.pathwise
    {
        ways(found, &continuous.naming, &mut lines);
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
    if let Some(earned) = &audit.true_return {
        lines.item(
            "true return",
            &format!(
                "{:.4} of an optimal policy, {:.4} of one that is optimal for the shaped reward",
                earned.optimal, earned.shaped
            ),
        );
    }
    changed(exact, lines);
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

fn proof(certificate: &Certificate, naming: &Naming, lines: &mut Lines) {
    lines.item(
        "proof",
        &format!(
            "two ways on from {}, which a potential would pay the same:",
            naming.state(certificate.start)
        ),
    );
    let (one, other) = (&certificate.direct, &certificate.detour);
    // How the two go on alike.
    let same = |(a, b): &(&WalkStep, &WalkStep)| (a.state, a.action) == (b.state, b.action);
    let alike = one.steps.iter().rev().zip(other.steps.iter().rev()).take_while(same).count();
    let tail = if alike > 1 && one.repeats_from.is_none() { alike } else { 0 };
    lines.more(&format!("shaped by {}: {}", short(one.sum), walked(one, 0, naming)));
    lines.more(&format!("shaped by {}: {}", short(other.sum), walked(other, tail, naming)));
}

/// A walk as its actions, what each changes and what shaping adds, but for the last `left_out`.
pub(super) fn walked(walk: &Walk, left_out: usize, naming: &Naming) -> String {
    let step = |(i, step): (usize, &WalkStep)| {
        let change = if step.terminated {
            "the end".into()
        } else {
            naming.change(step.state, step.next_state)
        };
        let paid = match short(step.shaping) {
            zero if zero == "0" => String::new(),
            paid if step.shaping > 0.0 => format!(" +{paid}"),
            paid => format!(" {paid}"),
        };
        let round = if walk.repeats_from == Some(i) { "[for ever: " } else { "" };
        format!("{round}{} ({change}){paid}", naming.action(step.action))
    };
    let own = walk.steps.len() - left_out;
    let mut steps: Vec<String> =
        walk.steps[..own].iter().enumerate().take(LISTED).map(step).collect();
    if own > LISTED {
        steps.push(format!("… {} more", own - LISTED));
    }
    if left_out > 0 {
        steps.push("then the same".into());
    }
    let close = if walk.repeats_from.is_some() { "]" } else { "" };
    format!("{}{close}", steps.join(", "))
}

/// What trajectories showed.
fn ways(found: &Pathwise, naming: &Naming, lines: &mut Lines) {
    lines.item(
        "trajectories",
        &format!(
            "{} played, {} compared; sums of shaping from one state differ by up to {}",
            found.trajectories,
            found.comparisons,
            short(found.spread.max(0.0))
        ),
    );
    if let Some(d) = &found.step_dependence {
        let [(early, f), (late, g)] = d.paid;
        lines.item("time", "the same transition is paid differently at different steps:");
        lines.more(&format!(
            "{}, from {} to {}: {} at t.step = {early}, {} at t.step = {late}",
            naming.action(d.action),
            naming.fields(&d.state),
            naming.fields(&d.next_state),
            short(f),
            short(g)
        ));
    }
    if let Some(violation) = &found.violation {
        divergence(violation, naming, lines);
    }
}

fn divergence(violation: &Divergence, naming: &Naming, lines: &mut Lines) {
    lines.item(
        "proof",
        &format!(
            "two ways on from {}, which a potential would pay the same:",
            naming.fields(&violation.start)
        ),
    );
    for path in &violation.trajectories {
        lines.more(&format!(
            "shaped by {} in all: {}, then {}",
            short(path.sum),
            actions(path, naming),
            match path.ending {
                crate::mdp::Ending::Terminated => "the end".to_string(),
                crate::mdp::Ending::Truncated =>
                    format!("on for ever (what follows counts less than {})", short(path.rest)),
            }
        ));
    }
}

/// `12 × left, 3 × right`.
fn actions(path: &Path, naming: &Naming) -> String {
    let run = |&(action, times): &(usize, u32)| format!("{times} × {}", naming.action(action));
    let mut runs: Vec<String> = path.actions.iter().take(LISTED).map(run).collect();
    if path.actions.len() > LISTED {
        runs.push(format!("… ({} steps in all)", path.steps));
    }
    runs.join(", ")
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

/// A number with four significant digits at most, without the noise of rounding errors.
pub(super) fn short(x: f64) -> String {
    if x == 0.0 || x.abs() < 1e-12 {
        return "0".into();
    }
    let magnitude = crate::mdp::math::log10(x.abs()).floor();
    if !(-4.0..6.0).contains(&magnitude) {
        return format!("{x:.3e}");
    }
    let decimals = (3.0 - magnitude).clamp(0.0, 8.0) as usize;
    let text = format!("{x:.decimals$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_string()
    } else {
        text
    }
}
