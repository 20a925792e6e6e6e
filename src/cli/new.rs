//! `runner new NAME`

use std::fmt::Write;
use std::path::{Path, PathBuf};

use clap::Args as ClapArgs;

use super::output::note;
use super::{Failure, Outcome};
use crate::env;
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
    let spec = env::find(&args.env)?;
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
    let text = template(&title, spec.id, &env.schema(), env.finite().is_some());
    write_atomically(&path, text.as_bytes())?;
    note(&format!("{} is written; next: runner exec {}", path.display(), path.display()));
    Ok(Outcome::Fine)
}

/// A complete script for an environment: plain learning against a potential.
fn template(title: &str, id: &str, schema: &Schema, finite: bool) -> String {
    let mut text = format!("// {title}: does a potential help in {id}?\n\nconst GAMMA = 0.99;\n\n");
    let mut add = |line: String| {
        writeln!(text, "{line}").expect("writing to a string does not fail");
    };
    let names: Vec<&str> = schema.fields.iter().map(|f| f.name).collect();
    add(format!("// The state has: {}.", names.join(", ")));
    add("// The host adds GAMMA * potential(s') - potential(s) to the reward.".into());
    if schema.facts.iter().any(|f| f.0 == "goal_row") {
        add("fn potential(s) { -0.05 * (abs(s.row - s.goal_row) + abs(s.col - s.goal_col)) }"
            .into());
    } else {
        add(format!("fn potential(s) {{ -abs(s.{}) }}", names.last().unwrap_or(&"index")));
    }
    add("\nlet plain = experiment(#{".into());
    add("    name: \"plain\",".into());
    add(format!("    env: \"{id}\","));
    add("    agent: q_learning(#{ alpha: 0.1, gamma: GAMMA, epsilon: exponential(1.0, 0.995, 0.01) }),".into());
    if !finite {
        add("    discretiser: bins(#{".into());
        for f in &schema.fields {
            let lo = if f.low.is_finite() { f.low } else { -3.0 };
            let hi = if f.high.is_finite() { f.high } else { 3.0 };
            add(format!("        {}: [{lo:?}, {hi:?}, 12],", f.name));
        }
        add("    }),".into());
    }
    add("    episodes: 1000,\n    seeds: 20,\n});\n".into());
    add(format!(
        "study(\"{title}\", [plain, plain.with(#{{ name: \"shaped\", potential: potential }})])"
    ));
    add("    .baseline(\"plain\")".into());
    text
}
