//! `runner audit SCRIPT`

use std::path::PathBuf;

use clap::Args as ClapArgs;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::output::{diagnostic, note, out};
use super::{Failure, Outcome};
use crate::experiment::{Audit, Thorough, audit_variant};
use crate::report::audit::{audit_json, audit_text};
use crate::report::claims::{broken_promises, judge_audits, rehearse};
use crate::script::{Host, load};

#[derive(Debug, ClapArgs)]
pub(super) struct Args {
    /// The script
    script: PathBuf,
    /// Only this variant (repeatable)
    #[arg(long, value_name = "NAME")]
    variant: Vec<String>,
    /// Print the findings as JSON
    #[arg(long)]
    json: bool,
    /// Leave out the models of discretised environments, which take seconds
    #[arg(long)]
    quick: bool,
    /// Threads [default: all cores]; results do not depend on it
    #[arg(long, short, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let plan = load(&args.script)?;
    rehearse(&plan)?;
    let host = Host::open(&plan)?;
    for warning in &plan.warnings {
        diagnostic(warning);
    }
    let names: Vec<&str> = plan.variants.iter().map(|v| v.name.as_str()).collect();
    if let Some(unknown) = args.variant.iter().find(|name| !names.contains(&name.as_str())) {
        return Err(Failure::Message(
            format!("no variant is called `{unknown}`"),
            Some(format!("one of: {}", names.join(", "))),
        ));
    }
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let mut audits: Vec<Audit> = Vec::with_capacity(plan.variants.len());
    let asked = |name: &String| args.variant.is_empty() || args.variant.contains(name);
    let variants: Vec<_> = plan.variants.iter().filter(|v| asked(&v.name)).collect();
    for variant in &variants {
        let bar = bar(&variant.name);
        let thorough = Thorough {
            plan: &plan,
            threads: args.jobs.map_or(cores, usize::from),
            progress: &|done, total| {
                bar.set_length(total as u64);
                bar.set_position(done as u64);
            },
        };
        let audit = audit_variant(&host, variant, (!args.quick).then_some(thorough));
        bar.finish_and_clear();
        let audit = audit?;
        if !args.json {
            out(&format!("{}\n", audit_text(variant, &audit)))?;
        }
        audits.push(audit);
    }
    for line in host.printed() {
        note(&line);
    }
    let mut held = true;
    if args.variant.is_empty() {
        for (text, holds) in judge_audits(&plan, &host, &audits) {
            note(&format!("{} {text}", if holds { "ok    " } else { "FAILED" }));
            held &= holds;
        }
    }
    for broken in broken_promises(&variants, &audits) {
        note(&format!("FAILED {broken}"));
        held = false;
    }
    if args.json {
        let text = serde_json::to_string_pretty(&audit_json(&plan, &variants, &audits))
            .map_err(|e| Failure::Message(e.to_string(), None))?;
        out(&format!("{text}\n"))?;
    }
    Ok(if held { Outcome::Fine } else { Outcome::Failed })
}

/// Progress of one variant's audit, shown if it has several parts.
pub(super) fn bar(name: &str) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(0), ProgressDrawTarget::stderr());
    if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {percent} %") {
        bar.set_style(style);
    }
    bar.set_message(format!("sampling {name}"));
    bar
}
