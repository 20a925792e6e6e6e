//! `runner check SCRIPT..`

use std::fmt::Write;
use std::path::{Path, PathBuf};

use clap::Args as ClapArgs;

use super::output::{diagnostic, note, out};
use super::{Failure, Outcome};
use crate::experiment::{CallbackTier, Checked, check};
use crate::report::claims::rehearse;
use crate::script::{AdviceOn, Callback, Diagnostic, DiscretiserSpec, PhiOn, Plan, Variant, load};

#[derive(Debug, ClapArgs)]
pub(super) struct Args {
    /// The scripts
    #[arg(required = true)]
    scripts: Vec<PathBuf>,
}

/// Checks every script, so that one mistake does not hide the others.
pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let mut last = None;
    for script in &args.scripts {
        match checked(script) {
            Ok((plan, checked)) => {
                for warning in &plan.warnings {
                    diagnostic(warning);
                }
                for line in plan.printed.iter().chain(&checked.printed) {
                    note(line);
                }
                out(&describe(&plan, &checked.tiers))?;
            }
            Err(d) => {
                if let Some(earlier) = last.replace(d) {
                    diagnostic(&earlier);
                }
            }
        }
    }
    match last {
        Some(d) => Err(d.into()),
        None => Ok(Outcome::Fine),
    }
}

/// A script's plan, and what trying its callbacks out has brought to light.
fn checked(script: &Path) -> Result<(Plan, Checked), Diagnostic> {
    let plan = load(script)?;
    let checked = check(&plan)?;
    rehearse(&plan)?;
    Ok((plan, checked))
}

const MEMORY: &str = "writing to a string does not fail";

/// The plan in words; `tiers` says how each variant's callbacks are run.
fn describe(plan: &Plan, tiers: &[Vec<CallbackTier>]) -> String {
    let mut text = String::new();
    let units: usize = plan.variants.iter().map(|v| v.seeds.0.len()).sum();
    writeln!(
        text,
        "{}: study \"{}\", {}, {}",
        plan.sources.script.name,
        plan.name,
        counted(plan.variants.len(), "variant"),
        counted(units, "unit"),
    )
    .expect(MEMORY);
    for (variant, tiers) in plan.variants.iter().zip(tiers) {
        writeln!(text, "  {}", variant.name).expect(MEMORY);
        for (what, how) in rows(variant).into_iter().chain(runs(tiers)) {
            writeln!(text, "    {what:<12} {how}").expect(MEMORY);
        }
    }
    if let Some(baseline) = &plan.baseline {
        writeln!(text, "  baseline: {baseline}").expect(MEMORY);
    }
    for expectation in &plan.expectations {
        writeln!(text, "  expects: {}", expectation.text).expect(MEMORY);
    }
    text
}

/// Which callbacks are machine code, and why the others are not.
pub(super) fn runs(tiers: &[CallbackTier]) -> Vec<(&'static str, String)> {
    let (native, others): (Vec<_>, Vec<_>) = tiers.iter().partition(|t| t.is_native);
    let mut rows = Vec::new();
    if !native.is_empty() {
        let keys: Vec<&str> = native.iter().map(|t| t.key.as_str()).collect();
        rows.push(("native", keys.join(", ")));
    }
    rows.extend(others.iter().map(|t| ("not native", format!("{}: {}", t.key, t.how))));
    rows
}

fn rows(v: &Variant) -> Vec<(&'static str, String)> {
    // Those that are not as registered.
    let defaults = v.env.resolve_kwargs(&serde_json::Map::new()).unwrap_or_default();
    let changed = v.config.kwargs.iter().filter(|(k, x)| defaults.get(*k) != Some(x));
    let kwargs: Vec<String> = changed.map(|(k, x)| format!("{k}: {x}")).collect();
    let kwargs =
        if kwargs.is_empty() { String::new() } else { format!(" ({})", kwargs.join(", ")) };
    let params: Vec<String> = v.agent.in_effect().map(|(k, x)| format!("{k}: {x}")).collect();
    let limit =
        v.max_steps.map_or("without a step limit".into(), |n| format!("of at most {n} steps"));
    let mut rows = vec![
        ("environment", format!("{}{kwargs}", v.env.id)),
        ("agent", format!("{}({})", v.agent.spec.name, params.join(", "))),
    ];
    for line in v.setting() {
        rows.push(("setting", line));
    }
    match &v.discretiser {
        DiscretiserSpec::StateIndex | DiscretiserSpec::Raw => {}
        DiscretiserSpec::Bins(dims) => {
            let sizes: Vec<String> = dims.iter().map(|d| d.n.to_string()).collect();
            let cells: usize = dims.iter().map(|d| d.n).product();
            // The random agent's single cell is no discretiser of the user's.
            if cells > 1 {
                rows.push(("discretiser", format!("{} bins = {cells} cells", sizes.join(" × "))));
            }
        }
        DiscretiserSpec::Features(features) => {
            let n_actions = v.environment().map_or(0, |env| env.schema().actions.len());
            let weights = features.n_features().unwrap_or(0) * n_actions;
            rows.push(("discretiser", format!("{features}, {weights} weights")));
        }
        DiscretiserSpec::Cells { shape, cell } => {
            let cells: usize = shape.iter().product();
            rows.push(("discretiser", format!("{}, {cells} cells", at(cell))));
        }
    }
    let seeds = counted(v.seeds.0.len(), "seed");
    let episodes = counted(v.episodes as usize, "episode");
    let until = if v.stop_when_solved { ", each seed until solved" } else { "" };
    rows.push(("training", format!("{seeds} × {episodes} {limit}{until}")));
    let solved = v.threshold.map_or(String::new(), |x| format!(", solved at {x}"));
    rows.push((
        "measured",
        format!("rolling mean over {}{solved}", counted(v.window as usize, "episode")),
    ));
    if let Some(notes) = &v.notes {
        rows.push(("notes", notes.clone()));
    }
    rows.extend(callbacks(v));
    rows
}

/// The functions that shape what a variant learns from, and how each is called.
pub(super) fn callbacks(v: &Variant) -> Vec<(&'static str, String)> {
    let mut rows = Vec::new();
    if let Some(potential) = &v.potential {
        let on = match (&v.discretiser, v.potential_on) {
            (DiscretiserSpec::StateIndex, _) => "tabulated over the states",
            (DiscretiserSpec::Features(_) | DiscretiserSpec::Raw, _) => {
                "on the state itself, at every step: keeps the optimal policy, \
                 equals no initial values"
            }
            (_, PhiOn::Cell) => "once per cell, on its representative",
            (_, PhiOn::Raw) => "on the raw state, at every step",
        };
        let on = if v.is_dynamic() { format!("of every episode, {on}") } else { on.into() };
        rows.push(("potential", format!("{}, {on}", at(potential))));
    }
    rows.extend(shaping(v));
    if let Some(reward) = &v.reward {
        rows.push(("reward", at(reward)));
    }
    for (name, term) in &v.terms {
        rows.push(("term", format!("{name}: {}", at(term))));
    }
    rows
}

/// What shapes the reward besides a scripted potential.
fn shaping(v: &Variant) -> Vec<(&'static str, String)> {
    let mut rows = Vec::new();
    if let Some(eta) = v.shaping.learned {
        rows.push(("potential", format!("{eta:?} times the agent's own state values")));
    }
    if v.shaping.shift != 0.0 {
        let shift = v.shaping.shift;
        rows.push(("shift", format!("{shift:?} added to Φ, except of terminal states")));
    }
    if let Some(advice) = &v.shaping.advice {
        let on = match v.shaping.advice_on {
            AdviceOn::LookAhead => "looking ahead, choices corrected by it",
            AdviceOn::LookBack => "looking back",
        };
        rows.push(("advice", format!("{}, {on}", at(advice))));
    }
    rows
}

/// `1 seed`, `20 seeds`.
fn counted(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

fn at(callback: &Callback) -> String {
    match &callback.place {
        Some(p) => format!("{} (line {})", callback.label, p.line),
        None => callback.label.clone(),
    }
}
