//! What a shaping does to whoever follows it.

use super::lines::{LISTED, Lines, short};
use crate::audit::{Cycle, Finding, Scaling};
use crate::experiment::{Exact, Naming};

/// How the learned reward relates to the native one.
pub(super) fn similarity(exact: &Exact, lines: &mut Lines) {
    if let Some(expected) = exact.expected.as_ref().filter(|e| e.finding == Finding::Holds) {
        let off = short(expected.largest_advantage);
        lines.item("expectation", &format!("potential-based on average (advantages up to {off}): values and greedy policies are as with a potential"));
    }
    if let Some(Scaling { finding: Finding::Holds, factor: Some(k), .. }) = exact.scaling {
        lines.item("scale", &format!("{} times the native reward, plus a potential", short(k)));
    }
    if let Some(distance) = exact.starc {
        lines.item(
            "distance",
            &format!(
                "{} from the native reward (STARC: 0 equivalent, 1 opposite)",
                short(distance)
            ),
        );
    }
}

/// What the shaping does to whoever follows it.
pub(super) fn consequences(exact: &Exact, lines: &mut Lines) {
    let naming = &exact.naming;
    if let Some(change) = &exact.change {
        let best = if (change.best - change.worst).abs() <= 1e-9 * change.optimal.abs().max(1.0) {
            String::new()
        } else {
            format!(" ({} at best)", short(change.best))
        };
        lines.item(
            "true return",
            &format!(
                "{} of an optimal policy, {} of one that is optimal for the shaped reward{best}",
                short(change.optimal),
                short(change.worst)
            ),
        );
        let (before, after) = (change.optimal_endings.goal, change.worst_endings.goal);
        if (before - after).abs() > 1e-9 {
            lines.more(&format!(
                "the best ending is reached with probability {} instead of {}",
                short(after),
                short(before)
            ));
        }
        if change.largest_loss > 1e-9 {
            lines.more(&format!(
                "the most is lost in {}: {}",
                naming.state(change.worst_state),
                short(change.largest_loss)
            ));
        }
    }
    if let Some(critical) = &exact.critical {
        let size = match critical.k {
            None => "nothing is lost however large it is".to_string(),
            Some(k) if k <= 0.0 => "something is lost however small it is".to_string(),
            Some(k) => format!("nothing is lost below {} times what is added", short(k)),
        };
        let ties = if critical.breaks_ties {
            "; it tells actions apart that are equally good, however small it is"
        } else {
            ""
        };
        lines.item("critical", &format!("{size}{ties}"));
    }
    if let Some(hacking) = &exact.hacking {
        lines.item("loop", &format!("{}, for ever", turn(&hacking.cycle, naming)));
        lines.more(&format!(
            "worth {} there instead of {} for the task, in true reward {} instead of {}; episodes \
             come to it with probability {}",
            short(hacking.learned),
            short(hacking.learned_optimal),
            short(hacking.native),
            short(hacking.native_optimal),
            short(hacking.reached)
        ));
    }
    if let Some(cycle) = &exact.endless {
        lines.item(
            "loop",
            &format!(
                "{}, for ever: without discounting there is no limit to what it pays",
                turn(cycle, naming)
            ),
        );
    }
    if let Some(task) =
        exact.broken_task.as_ref().filter(|_| exact.hacking.is_none() && !harmless(exact))
    {
        lines.item(
            "would break",
            &format!(
                "a task that pays {} for {} in {}, nothing elsewhere on the way, and fines detours: \
                 with the term, {} there is better by {}",
                short(task.reward),
                naming.action(task.paid),
                naming.state(task.start),
                naming.action(task.tempting),
                short(task.margin)
            ),
        );
    }
}

/// Whether the learned reward is a multiple of the native one.
fn harmless(exact: &Exact) -> bool {
    matches!(exact.scaling, Some(Scaling { finding: Finding::Holds, .. }))
}

/// One turn of a loop, and what it brings.
fn turn(cycle: &Cycle, naming: &Naming) -> String {
    let per = if cycle.deterministic { "turn" } else { "step on average" };
    let brings =
        format!("+{} per {per}, {} of it in true reward", short(cycle.gain), short(cycle.native));
    if !cycle.deterministic {
        return format!("{} states are never left: {brings}", cycle.states.len());
    }
    let n = cycle.states.len();
    let step = |i: usize| {
        let change = naming.change(cycle.states[i], cycle.states[(i + 1) % n]);
        format!("{} ({change})", naming.action(cycle.actions[i]))
    };
    let mut steps: Vec<String> = (0..n.min(LISTED)).map(step).collect();
    if n > LISTED {
        steps.push(format!("… {} more", n - LISTED));
    }
    format!("in {}: {}: {brings}", naming.state(cycle.states[0]), steps.join(", "))
}
