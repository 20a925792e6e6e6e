//! The command line: one file a subcommand. Each parses, calls the library and prints.
//!
//! Machine-readable output goes to stdout, everything for humans to stderr. Exit codes: 0 fine;
//! 1 it ran, but an expectation, a golden file or a parity check failed; 2 bad input or usage;
//! 75 stopped, can be resumed.

mod audit;
mod check;
mod completions;
mod definitions;
mod exec;
mod export;
mod golden;
mod list;
mod new;
mod output;
mod parity;
mod play;
mod rollout;
mod score;
mod screen;
mod show;
mod supervise;
mod view;
mod watch;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::report::stored::StoredError;
use crate::script::Diagnostic;

/// A scriptable reinforcement-learning experiment runner.
#[derive(Debug, Parser)]
#[command(name = "runner", version, about, arg_required_else_help = true)]
struct Cli {
    /// Interpret all callbacks of scripts: slower, with the same results
    #[arg(long, global = true)]
    no_jit: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run a script: train every variant under every seed, compare, plot
    Exec(exec::Args),
    /// Compile scripts, call every callback on sampled states, print the plan
    Check(check::Args),
    /// Run a script again at every save, and show what came of it
    Watch(watch::Args),
    /// Say whether each shaping keeps the optimal policy, and prove it
    Audit(audit::Args),
    /// Rank the potentials of a study before training
    Score(score::Args),
    /// List environments, agents, functions, keys or examples
    List(list::Args),
    /// Play actions in an environment and print what happens
    Rollout(rollout::Args),
    /// Show a results folder: its table, and pictures of what was learned
    Show(show::Args),
    /// Play what a unit of a results folder has learned
    Play(play::Args),
    /// Write a network that was learned as an ONNX model
    Export(export::Args),
    /// Replay recorded Gymnasium trajectories and compare
    Parity(parity::Args),
    /// Compare what scripts learn with their golden files
    Golden(golden::Args),
    /// Write a new script to start from
    New(new::Args),
    /// Print shell completions
    Completions(completions::Args),
    /// Write what editors can know of scripts: definitions for language servers, snippets
    Definitions(definitions::Args),
}

/// How a command came out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Outcome {
    /// All is well: exit code 0.
    Fine,
    /// It ran, and something checked did not hold: exit code 1.
    Failed,
    /// Stopped by a signal, to be resumed: exit code 75 (`EX_TEMPFAIL`).
    Stopped,
}

/// Bad input or usage: exit code 2. What to tell the user.
#[derive(Debug)]
enum Failure {
    /// A mistake in a script.
    Script(Box<Diagnostic>),
    /// Anything else, with advice if there is any.
    Message(String, Option<String>),
    /// The reader of our output has gone away: nothing is wrong.
    BrokenPipe,
}

impl From<Diagnostic> for Failure {
    fn from(d: Diagnostic) -> Self {
        Self::Script(Box::new(d))
    }
}

impl From<std::io::Error> for Failure {
    fn from(e: std::io::Error) -> Self {
        if e.kind() == std::io::ErrorKind::BrokenPipe {
            Self::BrokenPipe
        } else {
            Self::Message(e.to_string(), None)
        }
    }
}

impl From<crate::env::EnvError> for Failure {
    fn from(e: crate::env::EnvError) -> Self {
        Self::Message(e.message, e.hint)
    }
}

impl From<crate::experiment::StoreError> for Failure {
    fn from(e: crate::experiment::StoreError) -> Self {
        Self::Message(e.to_string(), None)
    }
}

impl From<crate::env::rollout::RolloutError> for Failure {
    fn from(e: crate::env::rollout::RolloutError) -> Self {
        use crate::env::rollout::RolloutError;
        match e {
            RolloutError::Env(e) => e.into(),
            RolloutError::Io(e) => e.into(),
            RolloutError::Policy(e) => match e.downcast::<Diagnostic>() {
                Ok(d) => Self::Script(d),
                Err(e) => Self::Message(e.to_string(), None),
            },
        }
    }
}

impl From<StoredError> for Failure {
    fn from(e: StoredError) -> Self {
        match e {
            StoredError::Script(d) => Self::Script(d),
            StoredError::Message(message, hint) => Self::Message(message, hint),
        }
    }
}

impl Command {
    /// Whether it may run what a script's author wrote.
    fn runs_scripts(&self) -> bool {
        match self {
            Self::Exec(_)
            | Self::Check(_)
            | Self::Audit(_)
            | Self::Score(_)
            | Self::Show(_)
            | Self::Play(_)
            | Self::Export(_)
            | Self::Golden(_) => true,
            // Each pass of `watch` is a process that does.
            Self::Watch(_)
            | Self::List(_)
            | Self::Rollout(_)
            | Self::Parity(_)
            | Self::New(_)
            | Self::Completions(_)
            | Self::Definitions(_) => false,
        }
    }
}

/// Parses the arguments, runs the command, maps its outcome to an exit code.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    if cli.command.runs_scripts() { supervise::supervised(|| outcome(cli)) } else { outcome(cli) }
}

fn outcome(cli: Cli) -> ExitCode {
    match run(cli) {
        Ok(Outcome::Fine) | Err(Failure::BrokenPipe) => ExitCode::SUCCESS,
        Ok(Outcome::Failed) => ExitCode::from(1),
        Ok(Outcome::Stopped) => ExitCode::from(75),
        Err(failure) => {
            output::failure(&failure);
            ExitCode::from(2)
        }
    }
}

fn run(cli: Cli) -> Result<Outcome, Failure> {
    if cli.no_jit {
        crate::jit::disable();
    }
    match cli.command {
        Command::Exec(args) => exec::run(&args),
        Command::Watch(args) => watch::run(&args),
        Command::Check(args) => check::run(&args),
        Command::Audit(args) => audit::run(&args),
        Command::Score(args) => score::run(&args),
        Command::List(args) => list::run(&args),
        Command::Rollout(args) => rollout::run(&args),
        Command::Show(args) => show::run(&args),
        Command::Play(args) => play::run(&args),
        Command::Export(args) => export::run(&args),
        Command::Parity(args) => parity::run(&args),
        Command::Golden(args) => golden::run(&args),
        Command::New(args) => new::run(&args),
        Command::Completions(args) => completions::run(&args),
        Command::Definitions(args) => definitions::run(&args),
    }
}
