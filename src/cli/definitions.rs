//! `runner definitions`

use std::path::PathBuf;

use clap::Args as ClapArgs;

use super::output::out;
use super::{Failure, Outcome};
use crate::experiment::write_atomically;
use crate::script::definitions::{GENERATED, files};

#[derive(Debug, ClapArgs)]
pub(super) struct Args {
    /// The folder that the editor opens, made if need be
    #[arg(long, value_name = "DIR", default_value = ".")]
    out: PathBuf,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let files: Vec<_> = files().into_iter().map(|f| (args.out.join(f.path), f)).collect();
    // All of them or none.
    for (path, _) in &files {
        let there = std::fs::read_to_string(path);
        if path.exists() && !there.is_ok_and(|text| text.contains(GENERATED)) {
            return Err(Failure::Message(
                format!("{} is there already, and not from `runner definitions`", path.display()),
                Some("move it away, or give another folder with --out DIR".into()),
            ));
        }
    }
    for (path, file) in &files {
        if let Some(folder) = path.parent().filter(|p| !p.as_os_str().is_empty()) {
            std::fs::create_dir_all(folder).map_err(|e| {
                Failure::Message(format!("{}: cannot be made: {e}", folder.display()), None)
            })?;
        }
        write_atomically(path, file.text.as_bytes())?;
        out(&format!("{}\n    {}\n", path.display(), file.about))?;
    }
    Ok(Outcome::Fine)
}
