//! `runner golden SCRIPT..`

use std::path::{Path, PathBuf};

use clap::Args as ClapArgs;
use similar::TextDiff;

use super::output::{note, out};
use super::{Failure, Outcome};
use crate::experiment::{golden, write_atomically};
use crate::script::load;

#[derive(Debug, ClapArgs)]
pub(super) struct Args {
    /// The scripts
    #[arg(required = true)]
    scripts: Vec<PathBuf>,
    /// Folder of the golden files
    #[arg(long, value_name = "DIR", default_value = "golden")]
    dir: PathBuf,
    /// Write what is learned now as the new golden files
    #[arg(long)]
    accept: bool,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let mut outcome = Outcome::Fine;
    for script in &args.scripts {
        let stem = script.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        let path = args.dir.join(format!("{stem}.txt"));
        let text = golden::text(&load(script)?)?;
        if args.accept {
            accept(&path, &text)?;
        } else if !compare(&path, &text)? {
            outcome = Outcome::Failed;
        }
    }
    Ok(outcome)
}

fn read(path: &Path) -> Result<Option<String>, Failure> {
    match std::fs::read_to_string(path) {
        Ok(text) => Ok(Some(text)),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(e) => Err(Failure::Message(format!("{}: {e}", path.display()), None)),
    }
}

fn accept(path: &Path, text: &str) -> Result<(), Failure> {
    if read(path)?.as_deref() == Some(text) {
        note(&format!("{}: unchanged", path.display()));
        return Ok(());
    }
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)
            .map_err(|e| Failure::Message(format!("{}: {e}", folder.display()), None))?;
    }
    write_atomically(path, text.as_bytes())?;
    note(&format!("{}: written", path.display()));
    Ok(())
}

/// Whether the golden file says what was learned; if not, prints the difference.
fn compare(path: &Path, text: &str) -> Result<bool, Failure> {
    let Some(expected) = read(path)? else {
        note(&format!("{}: there is no such file; --accept writes it", path.display()));
        return Ok(false);
    };
    if expected == text {
        note(&format!("{}: ok", path.display()));
        return Ok(true);
    }
    let name = path.display().to_string();
    let diff = TextDiff::from_lines(&expected, text);
    out(&diff.unified_diff().header(&name, "learned now").to_string())?;
    note(&format!("{name}: differs; if the change is meant, run again with --accept"));
    Ok(false)
}
