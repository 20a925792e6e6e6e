//! `runner exec SCRIPT`

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};

use clap::Args as ClapArgs;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};

use super::check::{callbacks, runs};
use super::output::{diagnostic, note, out, palette};
use super::{Failure, Outcome};
use crate::experiment::{
    Audit, ExecuteError, Execution, Progress, audit_variant, check, execute, start_from,
};
use crate::report::claims::{judge, rehearse};
use crate::report::closing::closing_table;
use crate::report::curve_text::curves_text;
use crate::report::results::{Findings, FolderError, Results};
use crate::report::tensorboard;
use crate::script::{Host, Plan, SeedList, load};

/// Signals that come within this time of the first are the same one.
const AT_ONCE: Duration = Duration::from_millis(200);

#[derive(Debug, ClapArgs)]
#[expect(clippy::struct_excessive_bools, reason = "flags of a command line")]
pub(super) struct Args {
    /// The script
    script: PathBuf,
    /// Folder for the results [default: results/<study>]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Run only the first N seeds of each variant, or as many more from 0 on
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    seeds: Option<u32>,
    /// Episodes per seed, instead of the script's
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000_000))]
    episodes: Option<u32>,
    /// A stored network that every network of the study starts from, in place of random ones
    #[arg(long, value_name = "MODEL")]
    from: Option<PathBuf>,
    /// Threads [default: all cores]; results do not depend on it
    #[arg(long, short, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// No progress bar and no table
    #[arg(long, short)]
    quiet: bool,
    /// Run everything again, even what is already there
    #[arg(long)]
    fresh: bool,
    /// Write the course of training for TensorBoard, into the folder `tensorboard` of the results
    #[arg(long)]
    tensorboard: bool,
    /// What `runner watch` starts: prints the curves too, and stops when stdin ends
    #[arg(long, hide = true)]
    watched: bool,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let mut plan = load(&args.script)?;
    restrict(&mut plan, args);
    if let Some(model) = &args.from {
        start_from(&mut plan, model)?;
    }
    say(&plan, args.quiet);
    let checked = check(&plan)?;
    for line in &checked.printed {
        note(line);
    }
    // Watched, every variant says it.
    if !args.quiet && !args.watched && crate::jit::is_enabled() {
        // Variants that share a callback say it once.
        let slow = checked.tiers.iter().flatten().filter(|tier| tier.is_slow);
        let lines: BTreeSet<String> =
            slow.map(|tier| format!("note: `{}` is not native: {}", tier.key, tier.how)).collect();
        for line in &lines {
            note(line);
        }
    }
    rehearse(&plan)?;
    let folder = args.out.clone().unwrap_or_else(|| Path::new("results").join(&plan.name));
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let jobs = args.jobs.map_or(cores, usize::from);
    let results = Results::open(&folder, &plan, jobs, args.fresh)
        .map_err(|FolderError { message, hint }| Failure::Message(message, hint))?;
    if let Some(other) = &results.replaces
        && !args.quiet
    {
        note(&format!(
            "{} held the results of {other}: its units stay, its tables and plots are replaced",
            folder.display()
        ));
    }
    let Some(execution) = train(&plan, &results, jobs, args)? else { return Ok(Outcome::Stopped) };
    let host = Host::open(&plan)?;
    let audits: Vec<Audit> =
        plan.variants.iter().map(|v| audit_variant(&host, v, None)).collect::<Result<_, _>>()?;
    let (findings, curves) = results.derive(&plan, &execution, audits)?;
    if args.tensorboard {
        tensorboard::write(&results, &plan, &execution.units)?;
    }
    if args.watched {
        let (ran, units) = (execution.finished.len(), execution.units.len());
        out(&format!("study \"{}\": {ran} of {units} units ran\n", plan.name))?;
        for (variant, tiers) in plan.variants.iter().zip(&checked.tiers) {
            for (what, how) in callbacks(variant).into_iter().chain(runs(tiers)) {
                out(&format!("  {}: {what} {how}\n", variant.name))?;
            }
        }
        out(&format!("{}\n", curves_text(&curves, palette())))?;
    }
    if !args.quiet {
        out(&closing_table(&plan, &findings).render())?;
    }
    let held = expectations(&plan, &host, &findings, args.quiet)?;
    if !args.quiet && !args.watched {
        note(&format!("results in {}", folder.display()));
        if args.tensorboard {
            let events = folder.join(tensorboard::FOLDER);
            note(&format!("to see them: tensorboard --logdir {}", events.display()));
        }
    }
    Ok(if held { Outcome::Fine } else { Outcome::Failed })
}

/// Applies `--seeds` and `--episodes`.
fn restrict(plan: &mut Plan, args: &Args) {
    for variant in &mut plan.variants {
        if let Some(episodes) = args.episodes {
            variant.episodes = episodes;
        }
        if let Some(n) = args.seeds {
            let n = n as usize;
            let own = &variant.seeds.0;
            variant.seeds = SeedList(if n <= own.len() {
                own[..n].to_vec()
            } else {
                let mut seeds = own.clone();
                seeds.extend((0..).filter(|s| !own.contains(s)).take(n - own.len()));
                seeds
            });
        }
    }
}

/// Warnings, and what the script printed.
fn say(plan: &Plan, quiet: bool) {
    for warning in &plan.warnings {
        diagnostic(warning);
    }
    if !quiet {
        for line in &plan.printed {
            note(line);
        }
    }
}

/// Runs the plan's units with a progress bar; `None` if it was stopped.
fn train(
    plan: &Plan,
    results: &Results,
    jobs: usize,
    args: &Args,
) -> Result<Option<Execution>, Failure> {
    // The signal handler outlives this function.
    let progress: &'static Progress = Box::leak(Box::default());
    // A second handler cannot be set; only one run happens per process.
    let mut asked = None::<Instant>;
    let _ = ctrlc::set_handler(move || {
        // Those who signal a whole group of processes reach this one twice: by its parent too.
        let again = asked.is_some_and(|asked| asked.elapsed() > AT_ONCE);
        asked.get_or_insert_with(Instant::now);
        if progress.stop.swap(true, Ordering::Relaxed) && again {
            #[expect(clippy::disallowed_methods, reason = "asked twice: at once, and for good")]
            std::process::exit(75);
        }
    });
    let total: u64 =
        plan.variants.iter().map(|v| u64::from(v.episodes) * v.seeds.0.len() as u64).sum();
    if args.watched {
        std::thread::spawn(|| stop_when_stdin_ends(&progress.stop));
    }
    let bar = bar(total, args.quiet, progress);
    let result = std::thread::scope(|scope| {
        let (done, wait) = std::sync::mpsc::channel::<()>();
        let bar = &bar;
        scope.spawn(move || {
            // Ends at once when the sender is dropped: a short run need not wait for the next look.
            while wait.recv_timeout(Duration::from_millis(50)) == Err(RecvTimeoutError::Timeout) {
                bar.set_position(progress.episodes.load(Ordering::Relaxed));
            }
        });
        let result = execute(plan, &results.store, jobs, progress);
        drop(done);
        result
    });
    bar.finish_and_clear();
    match result {
        Ok(execution) => Ok(Some(execution)),
        Err(ExecuteError::Script(d)) => Err(Failure::Script(d)),
        Err(ExecuteError::Store(e)) => Err(e.into()),
        Err(ExecuteError::Interrupted { done, total }) => {
            let networks = plan.variants.iter().any(|v| v.agent.is_network());
            let begun = if networks { "; networks under way are kept too" } else { "" };
            note(&format!(
                "stopped: {done} of {total} units are stored in {}{begun}\nto go on: {}",
                results.folder.display(),
                resume(args)
            ));
            Ok(None)
        }
    }
}

/// Raises `stop` when whoever started this closes stdin, or is no more.
fn stop_when_stdin_ends(stop: &AtomicBool) {
    // Nothing is written to it; an error is an end too.
    let _ = std::io::copy(&mut std::io::stdin().lock(), &mut std::io::sink());
    stop.store(true, Ordering::Relaxed);
}

/// The command that goes on where this one stopped.
fn resume(args: &Args) -> String {
    let mut command = format!("runner exec {}", args.script.display());
    let mut add = |flag: &str, value: Option<String>| {
        if let Some(value) = value {
            let _ = write!(command, " {flag} {value}");
        }
    };
    add("--out", args.out.as_ref().map(|p| p.display().to_string()));
    add("--seeds", args.seeds.map(|n| n.to_string()));
    add("--episodes", args.episodes.map(|n| n.to_string()));
    add("--from", args.from.as_ref().map(|p| p.display().to_string()));
    add("--jobs", args.jobs.map(|n| n.to_string()));
    if args.tensorboard {
        command.push_str(" --tensorboard");
    }
    command
}

fn bar(total: u64, quiet: bool, progress: &'static Progress) -> ProgressBar {
    let bar = ProgressBar::new(total);
    if quiet {
        bar.set_draw_target(ProgressDrawTarget::hidden());
    }
    let steps = move |state: &ProgressState, w: &mut dyn std::fmt::Write| {
        let seconds = state.elapsed().as_secs_f64().max(1e-9);
        let rate = progress.steps.load(Ordering::Relaxed) as f64 / seconds;
        let _ = write!(w, "{:.1} M steps/s", rate / 1e6);
    };
    let style = ProgressStyle::with_template(
        "{bar:30} {human_pos}/{human_len} episodes  {steps}  {eta} left",
    )
    .map(|style| style.with_key("steps", steps));
    if let Ok(style) = style {
        bar.set_style(style);
    }
    bar
}

/// Checks every claim; returns whether all hold.
fn expectations(
    plan: &Plan,
    host: &Host,
    findings: &Findings,
    quiet: bool,
) -> Result<bool, Failure> {
    let mut all = true;
    for (text, holds) in judge(plan, host, findings)? {
        all &= holds;
        if !quiet || !holds {
            out(&format!("{} {text}\n", if holds { "ok    " } else { "FAILED" }))?;
        }
    }
    for line in host.printed() {
        note(&line);
    }
    Ok(all)
}
