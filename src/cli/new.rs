//! `runner new NAME`

use std::path::{Path, PathBuf};

use clap::Args as ClapArgs;

use super::output::note;
use super::{Failure, Outcome};
use crate::env::{self, EnvSpec};
use crate::experiment::write_atomically;
use crate::mdp::Schema;

#[derive(Debug, ClapArgs)]
pub(super) struct Args {
    /// Name of the study; the script is called NAME.rhai
    name: String,
    /// Environment to start from
    #[arg(long, value_name = "ID", default_value = "CartPole-v1")]
    env: String,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let (spec, remark) = env::find_with_note(&args.env)?;
    if let Some(remark) = remark {
        note(&remark);
    }
    let stem = args.name.strip_suffix(".rhai").unwrap_or(&args.name);
    let path = PathBuf::from(format!("{stem}.rhai"));
    let title = Path::new(stem).file_name().map(|n| n.to_string_lossy().into_owned());
    let title = title.filter(|t| !t.contains(['"', '\\'])).ok_or_else(|| {
        Failure::Message(format!("`{}` is not a name for a script", args.name), None)
    })?;
    if path.exists() {
        return Err(Failure::Message(format!("{} is already there", path.display()), None));
    }
    let env = spec.make(&serde_json::Map::new())?;
    let text = template(&title, spec, &env.schema());
    write_atomically(&path, text.as_bytes())?;
    note(&format!("{} is written; next: runner exec {}", path.display(), path.display()));
    Ok(Outcome::Fine)
}

/// A complete script for an environment: plain learning against a potential.
fn template(title: &str, spec: &EnvSpec, schema: &Schema) -> String {
    let EnvSpec { id, example, .. } = spec;
    let fields = schema.fields.iter().map(|f| f.name);
    let names: Vec<&str> = fields.chain(schema.facts.iter().map(|f| f.0)).collect();
    let discretiser = match example.bins {
        "" => String::new(),
        bins => format!("    discretiser: bins(#{{ {bins} }}),\n"),
    };
    format!(
        "// {title}: does a potential help in {id}?

const GAMMA = 0.99;

// What a state is worth, at a guess; it may use: {}.
// The host adds GAMMA * worth(s') - worth(s) to the reward, which cannot change the best policy.
fn worth(s) {{ {} }}

let plain = experiment(#{{
    name: \"plain\",
    env: \"{id}\",
    agent: q_learning(#{{ alpha: 0.1, gamma: GAMMA, epsilon: exponential(1.0, 0.995, 0.01) }}),
{discretiser}    episodes: 1000,
    seeds: 20,
}});

study(\"{title}\", [plain, plain.with(#{{ name: \"shaped\", potential: worth }})])
    .baseline(\"plain\")
",
        names.join(", "),
        example.potential
    )
}
