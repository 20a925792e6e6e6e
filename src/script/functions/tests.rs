use std::collections::BTreeSet;
use std::path::Path;

use rhai::Dynamic;

use super::*;
use crate::script::engine::{Context, engine};
use crate::script::source::SourceSet;

/// What `script` gives, and the name of its type.
fn eval(script: &str) -> Result<(Dynamic, String), String> {
    let engine = engine(&Context::new(SourceSet::from_text("test.rhai", script)));
    let value = engine.eval::<Dynamic>(script).map_err(|e| e.to_string())?;
    let of = engine.map_type_name(value.type_name()).to_string();
    Ok((value, of))
}

/// A type of the definitions as the engine calls it.
fn of_engine(definition: &str) -> String {
    match definition {
        "int" => "i64".into(),
        "float" => "f64".into(),
        "Range" => "range".into(),
        name => name.chars().fold(String::new(), |mut text, c| {
            if c.is_uppercase() && !text.is_empty() {
                text.push(' ');
            }
            text.extend(c.to_lowercase());
            text
        }),
    }
}

fn fits(definition: &str, of: &str) -> bool {
    definition.split(" | ").any(|t| t == "?" || of.starts_with(&of_engine(t)))
}

/// Every combination of arguments that the types admit, as script text.
fn arguments(parameters: &[Parameter]) -> Vec<Vec<&'static str>> {
    let values = |types: &str| -> Vec<&'static str> {
        types
            .split(" | ")
            .map(|t| match t {
                "int" => "2",
                "float" => "0.5",
                other => panic!("a call without an example takes a {other}"),
            })
            .collect()
    };
    parameters.iter().fold(vec![Vec::new()], |rows, parameter| {
        let extended = |row: &Vec<&'static str>| -> Vec<Vec<&'static str>> {
            let with = |value| row.iter().copied().chain([value]).collect();
            values(parameter.types).into_iter().map(with).collect()
        };
        rows.iter().flat_map(extended).collect()
    })
}

#[test]
fn every_function_exists_and_takes_what_is_said_of_it() {
    let mut calls = 0;
    for f in functions().iter().filter(|f| f.group != Group::Agent) {
        for call in f.calls {
            let scripts: Vec<String> = if call.example.is_empty() {
                let arguments = arguments(call.parameters);
                arguments.iter().map(|a| format!("{}({})", f.name, a.join(", "))).collect()
            } else {
                assert!(call.example.contains(&format!("{}(", f.name)), "{}", call.example);
                vec![call.example.to_string()]
            };
            for script in scripts {
                let (_, of) = eval(&script).unwrap_or_else(|e| panic!("{script}: {e}"));
                assert!(fits(call.result, &of), "{script} is a {of}, not a {}", call.result);
                calls += 1;
            }
        }
    }
    assert!(calls > 120, "{calls}");
}

#[test]
fn every_agent_takes_its_own_defaults() {
    for f in functions().iter().filter(|f| f.group == Group::Agent) {
        assert_eq!(eval(&format!("{}()", f.name)).unwrap().1, "agent");
        let (_, of) = eval(&f.signature).unwrap_or_else(|e| panic!("{}: {e}", f.signature));
        assert_eq!(of, "agent", "{}", f.signature);
    }
}

/// Names that are registered without being for scripts to call: Rhai calls them, or they take the
/// place of something that scripts must not have.
const OUR_OWN: [&str; 5] = ["to_debug", "name", "sleep", "get_fn_metadata_list", "replace"];

/// The names that the sources of the host register: every literal after `register_fn(`, in
/// `numeric.rs` those of its tables, and the functions that machine code can call.
fn registered() -> BTreeSet<String> {
    fn scan(folder: &Path, found: &mut BTreeSet<String>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                scan(&path, found);
                continue;
            }
            let text = std::fs::read_to_string(&path).unwrap();
            let code: String = text.lines().map(str::trim).collect();
            let mut before = vec!["register_fn(\""];
            if path.ends_with("numeric.rs") {
                before.extend(["(\"", "power!(\""]);
            }
            for before in before {
                let names = code.split(before).skip(1).filter_map(|rest| rest.split('"').next());
                let is_name = |n: &&str| n.chars().all(|c| c.is_ascii_lowercase() || c == '_');
                found.extend(names.filter(is_name).map(str::to_string));
            }
        }
    }
    let mut found = BTreeSet::new();
    scan(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src/script"), &mut found);
    found.extend(crate::jit::math::UNARY.iter().map(|(name, _)| name.to_string()));
    found
}

#[test]
fn nothing_that_is_registered_is_missing() {
    let registered = registered();
    assert!(["experiment", "tiles", "sinh", "pow", "max"].iter().all(|n| registered.contains(*n)));
    let known = functions();
    let missing: Vec<&String> = registered
        .iter()
        .filter(|n| known.iter().all(|f| f.name != *n) && !OUR_OWN.contains(&n.as_str()))
        .collect();
    assert!(missing.is_empty(), "not in the list of functions: {missing:?}");
}

#[test]
fn constants_are_what_they_are_said_to_be() {
    for constant in CONSTANTS {
        let (value, _) = eval(constant.name).unwrap();
        assert_eq!(value.as_float(), Ok(constant.value), "{}", constant.name);
    }
}

#[test]
fn signatures_are_written_as_calls() {
    let of = |name: &str| functions().into_iter().find(|f| f.name == name).unwrap().signature;
    assert_eq!(of("with"), "experiment.with(map)");
    assert_eq!(of("cells"), "cells(n, |s| i) or cells([n1, n2], |s| [i, j])");
    assert_eq!(of("clamp"), "clamp(x, lo, hi)");
    assert_eq!(of("log"), "log(x) or log(x, base)");
}
