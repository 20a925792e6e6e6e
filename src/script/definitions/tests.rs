use serde_json::Value;

use super::*;
use crate::script::host::load_sources;
use crate::script::source::SourceSet;

fn file(path: &str) -> String {
    files().into_iter().find(|f| f.path == path).expect("it is there").text
}

/// The documentation and the text of every definition, in the file's order.
fn items(text: &str) -> Vec<(String, String)> {
    let blocks = text.split("\n\n");
    let parts = |block: &str| {
        let is_doc = |line: &&str| line.starts_with("///");
        let doc: Vec<&str> = block.lines().take_while(is_doc).collect();
        let rest: Vec<&str> = block.lines().skip(doc.len()).collect();
        (doc.join("\n"), rest.join("\n"))
    };
    blocks.map(parts).collect()
}

#[test]
fn everything_registered_is_defined_and_documented() {
    let text = file("runner.d.rhai");
    let items = items(&text);
    assert!(items.iter().all(|(doc, _)| doc.len() > 6), "something has no documentation");
    let defined = |start: &str| items.iter().find(|(_, item)| item.starts_with(start));
    for f in functions().iter().filter(|f| f.name != "with") {
        let n = items.iter().filter(|(_, i)| i.starts_with(&format!("fn {}(", f.name))).count();
        assert!(n >= f.calls.len(), "{} has {n} definitions", f.name);
    }
    for spec in AGENTS {
        let (doc, _) = defined(&format!("fn {}(", spec.name)).expect(spec.name);
        for p in spec.params {
            assert!(doc.contains(&format!("`{}: {}`", p.name, p.default)), "{doc}");
        }
    }
    let (doc, _) = defined("fn experiment(").unwrap();
    assert!(KEYS.iter().all(|key| doc.contains(&format!("- `{}` (", key.name))), "{doc}");
    for constant in CONSTANTS {
        assert!(defined(&format!("const {}: float;", constant.name)).is_some());
    }
    let (doc, _) = defined("fn env(").unwrap();
    for spec in specs() {
        assert!(doc.contains(&format!("`\"{}\"`", spec.id)));
        assert!(spec.kwargs().iter().all(|k| doc.contains(&format!("`{}: ", k.name))));
        let schema = spec.make(&Map::new()).unwrap().schema();
        let (_, state) = defined(&format!("type {} = #{{", state_type(spec.id))).expect(spec.id);
        for (name, kind) in schema
            .fields
            .iter()
            .map(|f| (f.name, f.kind))
            .chain(schema.facts.iter().map(|f| (f.0, f.1)))
        {
            let member = format!("\n    {name}: {}", type_of(kind));
            assert!(state.contains(&member), "{} has no{member}", spec.id);
        }
    }
    let (_, step) = defined("type Step = #{").unwrap();
    assert!(STEP_FIELDS.iter().all(|f| step.contains(&format!("    {}: {}", f.0, f.1))));
}

/// The file against the grammar of definition files, line by line: what follows `module static;`
/// are documented functions, constants and types, whose types are known.
#[test]
fn the_syntax_is_that_of_definition_files() {
    let text = file("runner.d.rhai");
    let items = items(&text);
    assert!(items[0].1 == "module static;", "{}", items[0].1);
    let known = |types: &str| {
        types.split(" | ").all(|t| {
            ["?", "int", "float", "bool", "String", "Array", "Map", "FnPtr"].contains(&t)
                || TYPES.iter().any(|(name, _)| *name == t)
        })
    };
    let is_name = |name: &str| {
        name.starts_with(|c: char| c.is_ascii_alphabetic())
            && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
    };
    for (_, item) in items[1..].iter().filter(|(_, item)| !item.starts_with("// fn with(")) {
        let whole = item.strip_suffix(';').unwrap_or_else(|| panic!("no end: {item}"));
        let (keyword, rest) = whole.split_once(' ').unwrap();
        match keyword {
            "const" => {
                let (name, of) = rest.split_once(": ").unwrap();
                assert!(is_name(name) && known(of), "{item}");
            }
            "type" => {
                let (name, of) = rest.split_once(" = ").unwrap();
                assert!(is_name(name), "{item}");
                assert!(of == "..." || (of.starts_with("#{\n") && of.ends_with("\n}")), "{item}");
                let members = of.lines().filter(|l| l.starts_with("    ") && !l.contains("///"));
                for member in members {
                    let (name, of) = member.trim_end_matches(',').split_once(": ").unwrap();
                    assert!(is_name(name.trim()) && known(of), "{member}");
                }
            }
            "fn" => {
                let (name, rest) = rest.split_once('(').unwrap();
                let (parameters, result) = rest.split_once(')').unwrap();
                assert!(is_name(name), "{item}");
                for parameter in parameters.split(", ").filter(|p| !p.is_empty()) {
                    let (name, of) = parameter.split_once(": ").unwrap();
                    assert!(is_name(name) && known(of), "{item}");
                }
                assert!(result.is_empty() || known(result.strip_prefix(" -> ").unwrap()), "{item}");
            }
            other => panic!("{other} is no definition"),
        }
    }
}

#[test]
fn states_are_described_with_their_ranges() {
    let text = file("runner.d.rhai");
    let start = text.find("type CartPoleV1State = #{").unwrap();
    let state = &text[start..start + text[start..].find("};").unwrap()];
    assert!(state.contains("from -4.8 to 4.8\n    x: float"), "{state}");
    assert!(state.contains("from -∞ to ∞\n    x_dot: float"), "{state}");
    let start = text.find("type FrozenLakeV1State = #{").unwrap();
    assert!(
        text[start..].contains(
            "/// The same in every state: 3 with the default arguments\n    goal_row: int"
        )
    );
}

/// What an editor makes of a snippet's body when every default is taken.
fn expanded(body: &Value) -> String {
    fn parse(chars: &mut std::iter::Peekable<std::str::Chars<'_>>, inside: bool) -> String {
        let mut text = String::new();
        while let Some(c) = chars.next() {
            match c {
                '\\' => text.extend(chars.next()),
                '}' if inside => return text,
                '$' => {
                    let braced = chars.next_if_eq(&'{').is_some();
                    while chars.next_if(char::is_ascii_digit).is_some() {}
                    if braced {
                        assert_eq!(chars.next(), Some(':'), "a placeholder has a default");
                        text.push_str(&parse(chars, true));
                    }
                }
                c => text.push(c),
            }
        }
        assert!(!inside, "a placeholder has no end");
        text
    }
    let lines: Vec<&str> = body.as_array().unwrap().iter().map(|l| l.as_str().unwrap()).collect();
    parse(&mut lines.join("\n").chars().peekable(), false)
}

#[test]
fn snippets_of_experiments_and_agents_are_scripts_that_load() {
    let text = file(".vscode/runner.code-snippets");
    let (comment, json) = text.split_once('\n').unwrap();
    assert!(comment.starts_with("// ") && comment.contains(GENERATED));
    let snippets: serde_json::Map<String, Value> = serde_json::from_str(json).unwrap();
    let load = |script: &str| {
        load_sources(SourceSet::from_text("snippet.rhai", script), "snippet")
            .unwrap_or_else(|d| panic!("{}\n{script}", d.render(false)))
    };
    for spec in specs() {
        let body = expanded(&snippets[&format!("experiment {}", spec.id)]["body"]);
        let plan = load(&format!("{body}\nplain"));
        assert_eq!(plan.variants[0].env.id, spec.id);
    }
    for spec in AGENTS {
        let body = expanded(&snippets[spec.name]["body"]);
        assert_eq!(body.matches(": ").count(), spec.params.len(), "{body}");
        // A finite environment suits all of them but the networks' shape.
        load(&format!("experiment(#{{ env: \"FrozenLake-v1\", agent: {body} }})"));
    }
    for f in functions().iter().filter(|f| f.group == Group::Builder) {
        let body = expanded(&snippets[f.name]["body"]);
        assert!(body.starts_with(&format!("{}(", f.name)) && body.ends_with(')'), "{body}");
    }
}
