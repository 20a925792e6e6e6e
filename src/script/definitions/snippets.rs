//! Snippets in VS Code's format, which needs no language server and which other editors read too.

use serde_json::{Map, Value, json};

use super::GENERATED;
use crate::env::{EnvSpec, specs};
use crate::learn::registry::{AGENTS, AgentSpec};
use crate::script::functions::{Call, Function, Group, functions};

/// The file: JSON with a comment above it.
pub(super) fn snippets() -> String {
    let mut all = Map::new();
    let mut add = |name: String, prefix: &str, body: Vec<String>, about: &str| {
        let snippet = json!({
            "scope": "rhai",
            "prefix": prefix,
            "body": body,
            "description": about,
        });
        all.insert(name, snippet);
    };
    for spec in specs() {
        let prefix = format!("experiment {}", spec.id);
        add(prefix.clone(), &prefix, experiment(spec), spec.summary);
    }
    for function in functions() {
        if let Some(spec) = AGENTS.iter().find(|a| a.name == function.name) {
            add(spec.name.to_string(), spec.name, agent(spec), spec.doc);
        } else if function.group == Group::Builder {
            let body = vec![called(&function)];
            add(function.name.to_string(), function.name, body, function.doc);
        }
    }
    add(
        "rhai-analyzer".into(),
        "externs",
        externs(),
        "what rhai-analyzer should know of runner's functions: once in a script",
    );
    let text = serde_json::to_string_pretty(&Value::Object(all)).expect("plain data");
    format!("// Snippets for the scripts of `runner`; {GENERATED}.\n{text}\n")
}

/// `text` as it stands: what a snippet would read as a placeholder is escaped.
fn plain(text: &str) -> String {
    text.chars().fold(String::new(), |mut text, c| {
        if matches!(c, '$' | '}' | '\\') {
            text.push('\\');
        }
        text.push(c);
        text
    })
}

/// A placeholder: the `i`-th stop, with a default.
fn stop(i: usize, default: &str) -> String {
    format!("${{{i}:{}}}", plain(default))
}

/// An experiment in an environment.
fn experiment(spec: &EnvSpec) -> Vec<String> {
    let bins = match spec.example.bins {
        "" => None,
        bins => Some(format!("    discretiser: bins(#{{ {bins} }}),")),
    };
    let mut lines = vec![
        format!("let {} = experiment(#{{", stop(1, "plain")),
        format!("    name: \"{}\",", stop(2, "plain")),
        format!("    env: \"{}\",", spec.id),
        format!(
            "    agent: q_learning(#{{ alpha: {}, gamma: {}, epsilon: {} \\}}),",
            stop(3, "0.1"),
            stop(4, "0.99"),
            stop(5, "exponential(1.0, 0.995, 0.01)")
        ),
    ];
    lines.extend(bins.map(|line| plain(&line)));
    lines.push(format!("    episodes: {},", stop(6, "500")));
    lines.push(format!("    seeds: {},", stop(7, "20")));
    lines.push("\\});$0".into());
    lines
}

/// An agent with all of its parameters at their defaults.
fn agent(spec: &AgentSpec) -> Vec<String> {
    let params = spec.params.iter().enumerate();
    let params: Vec<String> = params
        .map(|(i, p)| format!("    {}: {},", p.name, stop(i + 1, &p.default.to_string())))
        .collect();
    let open = format!("{}(#{{", spec.name);
    std::iter::once(open).chain(params).chain(["\\})$0".to_string()]).collect()
}

/// A builder with what its parameters are written as.
fn called(function: &Function) -> String {
    let Call { parameters, example, .. } = function.calls[0];
    // A pattern with dots is not Rhai; the example is.
    if parameters.iter().any(|p| p.written.contains("..")) {
        return format!("{}$0", plain(example));
    }
    let parameters = &parameters[usize::from(function.is_method)..];
    let stops = parameters.iter().enumerate().map(|(i, p)| {
        let quoted = p.types == "String";
        let default = match p.written {
            "map" => "#{ $0 }".to_string(),
            written => stop(i + 1, written),
        };
        if quoted { format!("\"{default}\"") } else { default.replace(" }", " \\}") }
    });
    format!("{}({})", function.name, stops.collect::<Vec<_>>().join(", "))
}

/// Directives in comments, by which rhai-analyzer learns of a host's functions and constants.
fn externs() -> Vec<String> {
    let functions = functions();
    let names = functions.iter().filter(|f| !f.is_method && f.group != Group::Standard);
    let names = names.map(|f| f.name).chain(super::CONSTANTS.iter().map(|c| c.name));
    names.map(|name| format!("// rhai: extern {name}: any")).collect()
}
