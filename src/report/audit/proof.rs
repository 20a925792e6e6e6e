//! Proofs and samples: ways from one state that are paid differently.

use super::lines::{LISTED, Lines, short};
use crate::audit::{Certificate, Divergence, Path, Pathwise, Walk, WalkStep};
use crate::experiment::{Continuous, Naming};
use crate::mdp::Ending;

/// The two walks of a certificate.
pub(super) fn proof(certificate: &Certificate, naming: &Naming, lines: &mut Lines) {
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
fn walked(walk: &Walk, left_out: usize, naming: &Naming) -> String {
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

/// What samples showed.
pub(super) fn sampled(continuous: &Continuous, lines: &mut Lines) {
    if let Some(found) = &continuous.pathwise {
        ways(found, &continuous.naming, lines);
    }
    if let Some(query) = &continuous.query {
        let text = match query.bound() {
            Some(bound) => format!(
                "none of {} random quadruples of states disagrees: at most {} % of such do (95 %)",
                query.quadruples,
                short(100.0 * bound)
            ),
            None => format!(
                "{} of {} random quadruples of states disagree, by up to {}; that may not matter, as \
                 episodes need not come to such states",
                query.violations,
                query.quadruples,
                short(query.difference)
            ),
        };
        lines.item("any states", &text);
    }
    if let Some(model) = &continuous.model {
        lines.item(
            "sampled",
            &format!(
                "{} cells, {} states of each: about that model, and only about it:",
                model.cells - model.excluded,
                model.samples
            ),
        );
        let policy = match (model.policy_preserved, model.states_changed, &model.unsolved) {
            (_, _, Some(why)) => why.clone(),
            (Some(true), ..) => "the same actions are optimal in every cell".into(),
            (_, Some(n), _) if n > 0 => {
                format!("other actions are optimal in {n} of {} cells", model.states)
            }
            _ => "some actions are too close for the numbers to decide".into(),
        };
        lines.more(&policy);
        if let Some(earned) = &model.true_return {
            lines.more(&format!(
                "true return {} of an optimal policy, {} of one that is optimal for the shaped \
                 reward",
                short(earned.optimal),
                short(earned.shaped)
            ));
        }
    }
}

/// What trajectories showed.
pub(super) fn ways(found: &Pathwise, naming: &Naming, lines: &mut Lines) {
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
                Ending::Terminated => "the end".to_string(),
                Ending::Truncated =>
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
