//! What editors can know of the script language: definition files for Rhai language servers, and
//! snippets. Made from the lists that the host itself works with, so that whatever is registered is
//! in them.
//!
//! The syntax is that of Rhai's definition files (`module static;` for what is known everywhere,
//! `fn name(parameter: type) -> result;`, doc comments in Markdown), as `Engine::definitions` writes
//! it and the language server reads it. They are written by hand because Rhai's own generator keeps
//! a description of every function in every engine, which each start of the command would pay for.

mod snippets;

use std::fmt::Write as _;

use serde_json::Map;

use super::functions::{CONSTANTS, Function, Group, functions};
use super::keys::KEYS;
use super::state::STEP_FIELDS;
use crate::env::{EnvSpec, specs};
use crate::learn::registry::{AGENTS, AgentSpec};
use crate::mdp::{Field, FieldKind};

/// Says in every file that it was made, and how.
pub const GENERATED: &str = "written by `runner definitions`: changes will be lost";

/// A file for an editor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EditorFile {
    /// Where it belongs, relative to the folder that the editor opens.
    pub path: &'static str,
    /// What it is.
    pub about: &'static str,
    /// Its text.
    pub text: String,
}

/// Every file.
pub fn files() -> Vec<EditorFile> {
    vec![
        EditorFile {
            path: "runner.d.rhai",
            about: "definitions for Rhai's language server",
            text: definitions(),
        },
        EditorFile {
            path: ".vscode/runner.code-snippets",
            about: "snippets for VS Code and editors that read its snippets",
            text: snippets::snippets(),
        },
    ]
}

const MEMORY: &str = "writing to a string does not fail";

/// What has a name of its own as a type, in the order of the file.
const TYPES: &[(&str, &str)] = &[
    ("Experiment", "One variant: what `experiment(..)` makes and `.with(..)` changes."),
    ("Study", "Variants to compare: what `study(..)` makes. A script ends in one."),
    ("Environment", "An environment with arguments: what `env(..)` makes."),
    ("Agent", "What learns or plans: `q_learning(..)`, `value_iteration(..)`, …"),
    ("Discretiser", "State → cell, or → features: `bins`, `cells`, `tiles`, `fourier`."),
    ("Schedule", "A number that changes while training: `constant`, `linear`, `exponential`."),
    ("StepSize", "A step size that goes by visits: `visit_count(..)`."),
    ("BehaviourPolicy", "How actions are explored: `softmax(..)`, `ucb(..)`."),
    ("LearnedPotential", "The learner's own values as a potential: `learned(eta)`."),
    ("Range", "Numbers to loop over: `0..5`, `range(0, 100, 10)`."),
];

/// The definition file.
fn definitions() -> String {
    let mut text = format!("/// The script language of `runner`; {GENERATED}.\nmodule static;\n");
    for (name, about) in TYPES {
        documented(&mut text, about, &format!("type {name} = ...;"));
    }
    for spec in specs() {
        state(&mut text, spec);
    }
    step(&mut text);
    for constant in CONSTANTS {
        documented(&mut text, constant.doc, &format!("const {}: float;", constant.name));
    }
    for function in functions() {
        for (i, call) in function.calls.iter().enumerate() {
            let parameters: Vec<String> =
                call.parameters.iter().map(|p| format!("{}: {}", p.name, p.types)).collect();
            let result = match call.result {
                "()" => String::new(),
                // The language server shows a choice of results as none.
                result if result.contains(" | ") => " -> ?".into(),
                result => format!(" -> {result}"),
            };
            let line = format!("fn {}({}){result};", function.name, parameters.join(", "));
            // Rhai reserves the word, and its language server knows nothing else of it.
            let line = if function.name == "with" { format!("// {line}") } else { line };
            documented(&mut text, &about(&function, i), &line);
        }
    }
    text
}

/// Appends `line` below `doc`, as a doc comment.
fn documented(text: &mut String, doc: &str, line: &str) {
    text.push('\n');
    for doc in doc.lines() {
        let doc = format!("/// {doc}");
        writeln!(text, "{}", doc.trim_end()).expect(MEMORY);
    }
    writeln!(text, "{line}").expect(MEMORY);
}

/// The documentation of a function's `call`.
fn about(function: &Function, call: usize) -> String {
    let mut text = format!("`{}`\n\n{}\n", function.signature, function.doc);
    let mut add = |more: &str| {
        text.push('\n');
        text.push_str(more);
    };
    match function.name {
        "experiment" => add(&keys()),
        "with" => add("Keys are those of `experiment`; `()` goes back to a key's default.\n"),
        "env" => add(&environments()),
        "expect" => add(CLAIMS),
        _ => {}
    }
    if let Some(spec) = AGENTS.iter().find(|a| a.name == function.name) {
        // The signature would repeat all of them.
        text = format!("{}\n\n{}", function.doc, parameters(spec));
    }
    let example = function.calls[call].example;
    if !example.is_empty() {
        write!(text, "\n```rhai\n{example}\n```").expect(MEMORY);
    }
    if function.group == Group::Standard {
        text.push_str("\nRhai's own: <https://rhai.rs/book>");
    }
    text.trim_end().to_string()
}

/// What a claim can speak of.
const CLAIMS: &str = "`r.<variant>` has what `summary.json` has: `final_return` and `auc` (each \
                      with `mean`, `iqm`, `low`, `high`), `solved.seeds`, \
                      `solved.median_episode`, `mean_steps`, `seeds`, `episodes`, and `audit` \
                      (`verdict`, `policy_preserved`, `states_changed`).\n";

/// The keys of an experiment, as a list.
fn keys() -> String {
    KEYS.iter().fold("Its keys:\n\n".to_string(), |mut text, key| {
        writeln!(text, "- `{}` ({}): {}", key.name, key.kind, key.doc).expect(MEMORY);
        text
    })
}

/// An agent's parameters, as a list.
fn parameters(spec: &AgentSpec) -> String {
    if spec.params.is_empty() {
        return "It has no parameters.\n".into();
    }
    spec.params.iter().fold("Its parameters and their defaults:\n\n".into(), |mut text, p| {
        let function =
            p.function.map_or(String::new(), |signature| format!(", or {}", signature.text));
        let allowed = p.kind.allowed();
        writeln!(text, "- `{}: {}`: {} ({allowed}{function})", p.name, p.default, p.doc)
            .expect(MEMORY);
        text
    })
}

/// The environments with their arguments, as a list.
fn environments() -> String {
    specs().iter().fold("The environments and their arguments:\n\n".into(), |mut text, spec| {
        writeln!(text, "- `\"{}\"`: {}", spec.id, spec.summary).expect(MEMORY);
        for arg in spec.kwargs() {
            writeln!(text, "  - `{}: {}`: {}", arg.name, arg.default, arg.doc).expect(MEMORY);
        }
        text
    })
}

/// `CartPoleV1State`, the type of an environment's states.
fn state_type(id: &str) -> String {
    let letters: String = id
        .split(|c: char| !c.is_alphanumeric())
        .map(|word| {
            let mut chars = word.chars();
            chars.next().map_or(String::new(), |c| c.to_uppercase().chain(chars).collect())
        })
        .collect();
    format!("{letters}State")
}

/// The type of a field in scripts.
fn type_of(kind: FieldKind) -> &'static str {
    match kind {
        FieldKind::Float => "float",
        FieldKind::Int => "int",
        FieldKind::Letter => "String",
    }
}

/// What values a field takes, for its documentation.
fn range(field: &Field) -> String {
    // Bounds of a `Box` are float32, and read as such.
    let bound = |x: f64| match field.kind {
        FieldKind::Float if x.abs() >= f64::from(f32::MAX) => {
            if x > 0.0 {
                "∞".into()
            } else {
                "-∞".to_string()
            }
        }
        FieldKind::Float => format!("{}", x as f32),
        FieldKind::Int | FieldKind::Letter => format!("{x}"),
    };
    match field.kind {
        FieldKind::Letter => String::new(),
        _ => format!(", from {} to {}", bound(field.low), bound(field.high)),
    }
}

/// The type of the states of an environment.
fn state(text: &mut String, spec: &EnvSpec) {
    // Made with its defaults, it is the one that `list envs` shows.
    let Ok(env) = spec.make(&Map::new()) else { return };
    let schema = env.schema();
    let name = state_type(spec.id);
    let actions: Vec<String> =
        schema.actions.iter().enumerate().map(|(i, a)| format!("{i} {a}")).collect();
    let about = format!(
        "A state `s` of {}: {}.\n\nBy position too: `s[0]` is `s.{}`. Actions: {}.",
        spec.id,
        spec.summary,
        schema.fields[0].name,
        actions.join(", ")
    );
    let mut members = String::new();
    for (i, field) in schema.fields.iter().enumerate() {
        writeln!(members, "    /// `s[{i}]`: {}{}", field.doc, range(field)).expect(MEMORY);
        writeln!(members, "    {}: {},", field.name, type_of(field.kind)).expect(MEMORY);
    }
    for (name, kind, value) in &schema.facts {
        let doc = format!("The same in every state: {value} with the default arguments");
        writeln!(members, "    /// {doc}\n    {name}: {},", type_of(*kind)).expect(MEMORY);
    }
    documented(
        text,
        &about,
        &format!("type {name} = #{{\n{}\n}};", members.trim_end_matches(",\n")),
    );
}

/// The type of the steps that rewards and terms receive.
fn step(text: &mut String) {
    let members: Vec<String> = STEP_FIELDS
        .iter()
        .map(|(name, of, doc)| format!("    /// {doc}\n    {name}: {of}"))
        .collect();
    documented(
        text,
        "A step `t`, as `reward` and `terms` receive it.",
        &format!("type Step = #{{\n{}\n}};", members.join(",\n")),
    );
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
