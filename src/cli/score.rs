//! `runner score SCRIPT`

use std::path::{Path, PathBuf};

use clap::Args as ClapArgs;

use super::audit::bar;
use super::output::{diagnostic, note, out};
use super::{Failure, Outcome};
use crate::experiment::{Thorough, score_variant};
use crate::report::score::{score_json, score_text};
use crate::script::{Host, load};

#[derive(Debug, ClapArgs)]
pub(super) struct Args {
    /// The script
    script: PathBuf,
    /// Folder of its results, to compare the ranking with [default: results/<study>, if it exists]
    #[arg(long, value_name = "DIR")]
    results: Option<PathBuf>,
    /// Print the scores as JSON
    #[arg(long)]
    json: bool,
    /// Threads [default: all cores]; results do not depend on it
    #[arg(long, short, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let plan = load(&args.script)?;
    let host = Host::open(&plan)?;
    for warning in &plan.warnings {
        diagnostic(warning);
    }
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let mut outcomes = Vec::with_capacity(plan.variants.len());
    for variant in &plan.variants {
        let bar = bar(&variant.name);
        let thorough = Thorough {
            plan: &plan,
            threads: args.jobs.map_or(cores, usize::from),
            progress: &|done, total| {
                bar.set_length(total as u64);
                bar.set_position(done as u64);
            },
        };
        let outcome = score_variant(&host, variant, thorough);
        bar.finish_and_clear();
        outcomes.push(outcome?);
    }
    for line in host.printed() {
        note(&line);
    }
    if args.json {
        let text = serde_json::to_string_pretty(&score_json(&plan, &outcomes))
            .map_err(|e| Failure::Message(e.to_string(), None))?;
        out(&format!("{text}\n"))?;
    } else {
        let folder = args.results.clone().unwrap_or_else(|| Path::new("results").join(&plan.name));
        let trained = summary(&folder, args.results.is_some())?;
        out(&score_text(&plan, &outcomes, trained.as_ref()))?;
    }
    Ok(Outcome::Fine)
}

/// What `summary.json` of a results folder says; `None` if there is none, unless it was asked for.
fn summary(folder: &Path, asked: bool) -> Result<Option<serde_json::Value>, Failure> {
    let path = folder.join("summary.json");
    let fail = |why: String| {
        let hint = "the folder is one that `runner exec` has filled".to_string();
        Failure::Message(format!("{}: {why}", path.display()), Some(hint))
    };
    match std::fs::read(&path) {
        Ok(bytes) => serde_json::from_slice(&bytes).map(Some).map_err(|e| fail(e.to_string())),
        Err(e) if asked => Err(fail(e.to_string())),
        Err(_) => Ok(None),
    }
}
