//! `runner list envs|agents|functions|keys|examples`

use std::fmt::Write;
use std::path::Path;

use clap::{Args as ClapArgs, ValueEnum};

use super::output::out;
use super::{Failure, Outcome};
use crate::env::specs;
use crate::learn::registry::AGENTS;
use crate::mdp::ActionSpace;
use crate::script::functions::{Group, functions as registered};
use crate::script::keys::KEYS;

#[derive(Debug, ClapArgs)]
pub(super) struct Args {
    /// What to list
    what: What,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum What {
    /// Environments with their arguments
    Envs,
    /// Agents with their parameters
    Agents,
    /// Functions that scripts can call
    Functions,
    /// Keys of an experiment
    Keys,
    /// Example scripts in ./scripts
    Examples,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let text = match args.what {
        What::Envs => envs()?,
        What::Agents => agents(),
        What::Functions => functions(),
        What::Keys => keys(),
        What::Examples => examples(),
    };
    out(&text)?;
    Ok(Outcome::Fine)
}

const MEMORY: &str = "writing to a string does not fail";

/// Builders and agents with a line of their own for what they do; functions of numbers, which say
/// less, in columns.
fn functions() -> String {
    let all = registered();
    let mut text = String::new();
    let headings = [
        (Group::Builder, "Building the plan"),
        (Group::Agent, "Agents"),
        (Group::Mathematics, "Mathematics"),
        (Group::Standard, "Rhai's own, among others"),
    ];
    for (group, heading) in headings {
        let functions = all.iter().filter(|f| f.group == group);
        let columns = matches!(group, Group::Mathematics | Group::Standard);
        writeln!(text, "{}{heading}", if text.is_empty() { "" } else { "\n" }).expect(MEMORY);
        for f in functions {
            if columns {
                writeln!(text, "  {:<41} {}", f.signature, f.doc).expect(MEMORY);
            } else {
                writeln!(text, "  {}\n      {}", f.signature, f.doc).expect(MEMORY);
            }
        }
    }
    text
}

fn envs() -> Result<String, Failure> {
    let mut text = String::new();
    for spec in specs() {
        let limit = spec.max_steps.map_or("no step limit".into(), |n| format!("{n} steps"));
        let solved = spec.reward_threshold.map_or(String::new(), |x| format!(", solved at {x}"));
        writeln!(text, "{}\n    {} ({limit}{solved})", spec.id, spec.summary).expect(MEMORY);
        let env = spec.make(&serde_json::Map::new())?;
        let schema = env.schema();
        let fields: Vec<&str> =
            schema.fields.iter().map(|f| f.name).chain(schema.facts.iter().map(|f| f.0)).collect();
        writeln!(text, "    state: {}", fields.join(", ")).expect(MEMORY);
        let named = |open: &str, close: &str| {
            let actions = schema.actions.iter().enumerate();
            let actions: Vec<_> = actions.map(|(i, a)| format!("{i} {open}{a}{close}")).collect();
            actions.join(", ")
        };
        match env.action_space() {
            ActionSpace::Discrete(_) => {
                writeln!(text, "    actions: {}", named("", "")).expect(MEMORY);
            }
            ActionSpace::Box { low, high } => {
                let bounds = low.iter().zip(high).map(|(low, high)| format!("[{low}, {high}]"));
                let bounds = bounds.collect::<Vec<_>>().join(" × ");
                writeln!(text, "    actions: real numbers in {bounds}").expect(MEMORY);
                writeln!(text, "    an agent chooses among: {}", named("[", "]")).expect(MEMORY);
            }
        }
        for arg in spec.kwargs() {
            writeln!(text, "    {} = {}: {}", arg.name, arg.default, arg.doc).expect(MEMORY);
        }
        for (what, names) in
            [("attributes", spec.attributes), ("reset options", spec.reset_options)]
        {
            if !names.is_empty() {
                writeln!(text, "    {what}: {}", names.join(", ")).expect(MEMORY);
            }
        }
    }
    Ok(text)
}

fn agents() -> String {
    let mut text = String::new();
    for spec in AGENTS {
        writeln!(text, "{}\n    {}", spec.name, spec.doc).expect(MEMORY);
        for p in spec.params {
            writeln!(text, "    {} = {}: {} ({})", p.name, p.default, p.doc, p.kind.allowed())
                .expect(MEMORY);
        }
    }
    text
}

fn keys() -> String {
    KEYS.iter().fold(String::new(), |mut text, key| {
        writeln!(text, "{}: {}\n    {}", key.name, key.kind, key.doc).expect(MEMORY);
        text
    })
}

/// The scripts in `./scripts`, each with its first comment line.
fn examples() -> String {
    let Ok(entries) = std::fs::read_dir(Path::new("scripts")) else {
        return "there is no folder scripts/ here; `runner new NAME` writes a script\n".into();
    };
    let mut paths: Vec<_> = entries
        .filter_map(|e| e.ok().map(|e| e.path()))
        .filter(|p| p.extension().is_some_and(|x| x == "rhai"))
        .collect();
    paths.sort();
    let mut text = String::new();
    for path in paths {
        let source = std::fs::read_to_string(&path).unwrap_or_default();
        let about = source.lines().find_map(|l| l.strip_prefix("// ")).unwrap_or_default();
        writeln!(text, "{}\n    {about}", path.display()).expect(MEMORY);
    }
    text
}
