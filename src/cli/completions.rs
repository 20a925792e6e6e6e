//! `runner completions SHELL`

use clap::{Args as ClapArgs, CommandFactory};
use clap_complete::Shell;

use super::output::out;
use super::{Cli, Failure, Outcome};

#[derive(Debug, ClapArgs)]
pub(super) struct Args {
    /// The shell
    shell: Shell,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "runner", &mut script);
    out(&String::from_utf8_lossy(&script))?;
    Ok(Outcome::Fine)
}
