//! `runner parity FILE..`

use std::fmt::Write;
use std::path::PathBuf;

use clap::Args as ClapArgs;

use super::output::{note, out};
use super::{Failure, Outcome};
use crate::env::recording::{ParityReport, replay_file};

#[derive(Debug, ClapArgs)]
pub(super) struct Args {
    /// Recorded trajectories (.jsonl or .jsonl.gz)
    #[arg(required = true)]
    files: Vec<PathBuf>,
}

/// Replays every file; one that cannot be read does not hide the others.
pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let mut outcome = Outcome::Fine;
    let mut unreadable = None;
    let wide =
        args.files.iter().map(|f| f.display().to_string().chars().count()).max().unwrap_or(0);
    out(&format!(
        "{:<wide$}  {:>8} {:>8} {:>10} {:>12}  verdict\n",
        "file", "episodes", "steps", "mismatches", "largest"
    ))?;
    for file in &args.files {
        match replay_file(file) {
            Ok(report) => {
                out(&line(&file.display().to_string(), wide, &report))?;
                if !report.is_within_tolerance() {
                    outcome = Outcome::Failed;
                    note(&first(&report));
                }
            }
            Err(e) => {
                let failure = Failure::Message(format!("{}: {e}", file.display()), None);
                if let Some(earlier) = unreadable.replace(failure) {
                    super::output::failure(&earlier);
                }
            }
        }
    }
    match unreadable {
        Some(failure) => Err(failure),
        None => Ok(outcome),
    }
}

fn line(file: &str, wide: usize, r: &ParityReport) -> String {
    let verdict = match (r.is_exact(), r.is_within_tolerance()) {
        (true, _) => "exact",
        (false, true) => "within tolerance",
        (false, false) => "DIFFERS",
    };
    format!(
        "{file:<wide$}  {:>8} {:>8} {:>10} {:>12.3e}  {verdict}\n",
        r.episodes, r.steps, r.mismatches, r.largest_difference
    )
}

/// The first difference beyond the tolerance, in words.
fn first(r: &ParityReport) -> String {
    let mut text = String::new();
    if let Some(m) = &r.first_violation {
        let _ = write!(
            text,
            "  first beyond tolerance: line {}, seed {}, episode {}, step {}: {} is {:?}, recorded {:?}",
            m.line, m.seed, m.episode, m.step, m.field, m.got, m.expected
        );
    }
    text
}
