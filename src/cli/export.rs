//! `runner export MODEL`

use std::path::{Path, PathBuf};

use clap::Args as ClapArgs;
use serde_json::{Map, Value, json};

use super::output::{note, out};
use super::{Failure, Outcome};
use crate::experiment::{Model, write_atomically};
use crate::report::onnx::onnx;

#[derive(Debug, ClapArgs)]
pub(super) struct Args {
    /// The model.safetensors or best.safetensors of a unit of a results folder
    model: PathBuf,
    /// Write it as an ONNX model: observations to action values
    #[arg(long, value_name = "FILE", required_unless_present = "json")]
    onnx: Option<PathBuf>,
    /// Replace FILE if it is there
    #[arg(long, requires = "onnx")]
    force: bool,
    /// Print what the model belongs to and what its weights are called
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let model = Model::read(&args.model)?;
    if let Some(path) = &args.onnx {
        vacant(path, args.force)?;
        let bytes = onnx(&model);
        write_atomically(path, &bytes)?;
        note(&format!("{} ({} kB)", path.display(), bytes.len().div_ceil(1000)));
    }
    if args.json {
        let text = serde_json::to_string_pretty(&described(&model)).expect("plain data");
        out(&format!("{text}\n"))?;
    }
    Ok(Outcome::Fine)
}

/// Refuses to write over a file, unless that is wanted.
fn vacant(path: &Path, force: bool) -> Result<(), Failure> {
    let (what, hint) = if path.is_dir() {
        ("is a folder", "give the name of a file")
    } else if path.exists() && !force {
        ("is already there", "--force replaces it")
    } else {
        return Ok(());
    };
    Err(Failure::Message(format!("--onnx: `{}` {what}", path.display()), Some(hint.into())))
}

/// The manifest, what is JSON in it as such, and the weights by name.
fn described(model: &Model) -> Value {
    let entry = |(name, text): (&String, &String)| {
        let value = match serde_json::from_str(text) {
            Ok(value @ (Value::Object(_) | Value::Array(_))) => value,
            _ => Value::from(text.as_str()),
        };
        (name.clone(), value)
    };
    let tensors = model.net.tensors();
    json!({
        "manifest": model.manifest.iter().map(entry).collect::<Map<_, _>>(),
        "tensors": tensors.iter().map(|t| json!({ "name": t.name, "shape": t.shape }))
            .collect::<Vec<_>>(),
    })
}
