//! Functions that scripts can call: one list for suggestions, `list functions`, the editor's
//! definitions and the docs. Agents are added from their own registry.

mod builders;
mod mathematics;
mod standard;

use crate::learn::registry::AGENTS;

/// What a function is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Group {
    /// Builds the plan, or a part of it.
    Builder,
    /// Makes an agent.
    Agent,
    /// Works on numbers.
    Mathematics,
    /// One of Rhai's own, of which there are more.
    Standard,
}

/// A parameter of a function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Parameter {
    /// Its name.
    pub name: &'static str,
    /// Its type as definition files write it: `float`, `int | float`, `?` for any.
    pub types: &'static str,
    /// How it is written in signatures.
    pub written: &'static str,
}

/// A way to call a function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Call {
    /// What it takes; the receiver is the first where it is called as a method.
    pub parameters: &'static [Parameter],
    /// The type of its result, as definition files write it; `()` for none.
    pub result: &'static str,
    /// Script text that calls it; empty where the signature says it all.
    pub example: &'static str,
}

/// A function of the script language.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Function {
    /// Its name.
    pub name: &'static str,
    /// What it is for.
    pub group: Group,
    /// Whether it is called as a method of its first parameter.
    pub is_method: bool,
    /// How it may be called.
    pub calls: &'static [Call],
    /// How it is called, in words.
    pub signature: String,
    /// What it does.
    pub doc: &'static str,
}

/// A function as the tables list it.
struct Known {
    name: &'static str,
    is_method: bool,
    calls: &'static [Call],
    doc: &'static str,
}

const fn function(name: &'static str, calls: &'static [Call], doc: &'static str) -> Known {
    Known { name, is_method: false, calls, doc }
}

const fn method(name: &'static str, calls: &'static [Call], doc: &'static str) -> Known {
    Known { name, is_method: true, calls, doc }
}

const fn call(
    parameters: &'static [Parameter],
    result: &'static str,
    example: &'static str,
) -> Call {
    Call { parameters, result, example }
}

/// A parameter that is written by its name.
const fn arg(name: &'static str, types: &'static str) -> Parameter {
    Parameter { name, types, written: name }
}

/// A parameter of which a pattern says more.
const fn pattern(name: &'static str, types: &'static str, written: &'static str) -> Parameter {
    Parameter { name, types, written }
}

/// A constant that is always defined.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Constant {
    /// Its name.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// What it is.
    pub doc: &'static str,
}

/// Constants that are always defined; a script's own of the same name come first.
pub const CONSTANTS: &[Constant] = &[
    Constant { name: "PI", value: std::f64::consts::PI, doc: "π, half a turn in radians" },
    Constant { name: "E", value: std::f64::consts::E, doc: "the base of natural logarithms" },
    Constant { name: "INF", value: f64::INFINITY, doc: "positive infinity" },
];

/// How agents are called.
const AGENT_CALLS: &[Call] =
    &[call(&[], "Agent", ""), call(&[pattern("parameters", "Map", "map")], "Agent", "")];

/// Every function, builders first, then agents, then mathematics, then Rhai's own.
pub fn functions() -> Vec<Function> {
    let listed = |known: &'static [Known], group: Group| {
        known.iter().map(move |&Known { name, is_method, calls, doc }| Function {
            name,
            group,
            is_method,
            calls,
            signature: signature(name, is_method, calls),
            doc,
        })
    };
    let agents = AGENTS.iter().map(|spec| {
        let params: Vec<String> =
            spec.params.iter().map(|p| format!("{}: {}", p.name, p.default)).collect();
        Function {
            name: spec.name,
            group: Group::Agent,
            is_method: false,
            calls: AGENT_CALLS,
            signature: format!("{}(#{{ {} }})", spec.name, params.join(", ")),
            doc: spec.doc,
        }
    });
    listed(builders::BUILDERS, Group::Builder)
        .chain(agents)
        .chain(listed(mathematics::MATHEMATICS, Group::Mathematics))
        .chain(listed(standard::STANDARD, Group::Standard))
        .collect()
}

/// Whether there is a mathematical function called `name`.
pub(super) fn is_mathematical(name: &str) -> bool {
    mathematics::MATHEMATICS.iter().any(|f| f.name == name)
}

/// `cells(n, |s| i) or cells([n1, n2], |s| [i, j])`: calls that are written alike once.
fn signature(name: &str, is_method: bool, calls: &[Call]) -> String {
    let mut written: Vec<String> = Vec::new();
    for call in calls {
        let (receiver, rest) = match call.parameters {
            [receiver, rest @ ..] if is_method => (format!("{}.", receiver.written), rest),
            all => (String::new(), all),
        };
        let rest: Vec<&str> = rest.iter().map(|p| p.written).collect();
        let text = format!("{receiver}{name}({})", rest.join(", "));
        if !written.contains(&text) {
            written.push(text);
        }
    }
    written.join(" or ")
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
