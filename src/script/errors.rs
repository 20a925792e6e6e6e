//! Rhai's errors as diagnostics, in the words of this language rather than Rust's.

use rhai::{EvalAltResult, ParseErrorType, Position};

use super::diagnostic::{Diagnostic, Place, nearest};
use super::engine::Context;
use super::functions::{CONSTANTS, functions};
use super::params::show;
use super::sandbox;
use super::watch::Stop;

/// Words of other languages, and what they are here.
const FOREIGN: &[(&str, &str)] = &[
    ("True", "write `true`"),
    ("False", "write `false`"),
    ("None", "write `()`"),
    ("null", "write `()`"),
    ("elif", "write `else if`"),
    ("and", "write `&&`"),
    ("or", "write `||`"),
    ("not", "write `!`"),
    ("lambda", "write `|s| …`"),
    ("def", "functions are written `fn name(s) { … }`"),
    ("function", "functions are written `fn name(s) { … }`"),
];

/// Functions that other languages have and this one leaves out on purpose.
const LEFT_OUT: &[(&str, &str)] = &[
    ("timestamp", "scripts see no clock: a plan is the same every time"),
    ("rand", "scripts draw no random numbers: a plan is the same every time"),
    ("random", "scripts draw no random numbers: a plan is the same every time"),
    ("open_file", "scripts read no files but those they import"),
];

fn of<'a>(list: &[(&str, &'a str)], name: &str) -> Option<&'a str> {
    list.iter().find(|(word, _)| *word == name).map(|(_, hint)| *hint)
}

/// A syntax error as a diagnostic.
pub(super) fn parse_diagnostic(
    context: &Context,
    source: &str,
    error: &ParseErrorType,
    position: Position,
) -> Diagnostic {
    let place = context.place(Some(source), position);
    let d = match error {
        ParseErrorType::VariableUndefined(name) => undefined(context, source, name),
        other => Diagnostic::error(lower_first(&other.to_string()))
            .maybe_hint(place.as_ref().and_then(|place| syntax_hint(context, place))),
    };
    context.sources.borrow().annotate(d.at(place))
}

/// What may be meant by the line on which the parser gave up.
fn syntax_hint(context: &Context, place: &Place) -> Option<String> {
    let line = context.sources.borrow().line(place)?;
    if let Some(hint) = line.split_whitespace().next().and_then(|word| of(FOREIGN, word)) {
        return Some(hint.to_string());
    }
    let mut rest = line.chars().skip(place.column.saturating_sub(1));
    (rest.next() == Some(':') && rest.next() != Some(':'))
        .then(|| "maps are written `#{ key: value }`".to_string())
}

fn undefined(context: &Context, source: &str, name: &str) -> Diagnostic {
    let all = functions();
    if let Some(known) = all.iter().find(|f| f.name == name) {
        return Diagnostic::error(format!("`{name}` is a function: call it"))
            .hint(format!("it is called as {}", known.signature));
    }
    let d = Diagnostic::error(format!("there is no variable or function `{name}` here"));
    let syntax = context.syntax.borrow();
    let Some(syntax) = syntax.get(source) else { return d };
    if syntax.variables.iter().any(|v| v == name) {
        return d.hint(format!(
            "functions see constants only: write `const {name} = …`, or use a closure |s| …"
        ));
    }
    if let Some(hint) = of(FOREIGN, name) {
        return d.hint(hint);
    }
    let own = syntax.constants.iter().chain(&syntax.variables).map(String::as_str);
    let own = own.chain(syntax.functions.iter().map(|f| f.0.as_str()));
    let known = own.chain(all.iter().map(|f| f.name));
    let best = nearest(name, known.chain(CONSTANTS.iter().map(|c| c.name)));
    d.maybe_hint(best.map(|b| format!("did you mean `{b}`?")))
}

fn lower_first(text: &str) -> String {
    let mut chars = text.chars();
    match chars.next() {
        Some(c) => c.to_lowercase().chain(chars).collect(),
        None => String::new(),
    }
}

/// A run-time error as a diagnostic, with the innermost place.
pub(super) fn diagnostic(
    context: &Context,
    error: &EvalAltResult,
    source: Option<&str>,
) -> Diagnostic {
    let mut error = error;
    let mut source = source.map(str::to_string);
    let mut place = None;
    loop {
        // The innermost position that is known wins; the source changes with the function.
        place = context.place(source.as_deref(), error.position()).or(place);
        match error {
            EvalAltResult::ErrorInFunctionCall(_, file, inner, _) => {
                if !file.is_empty() {
                    source = Some(file.clone());
                }
                error = inner;
            }
            EvalAltResult::ErrorInModule(_, inner, _) => error = inner,
            _ => break,
        }
    }
    let d = match error {
        EvalAltResult::ErrorRuntime(value, _) => match value.clone().try_cast::<Diagnostic>() {
            Some(d) => d,
            None => Diagnostic::error(format!("the script threw {}", show(value))),
        },
        EvalAltResult::ErrorParsing(error, position) => {
            let file = source.unwrap_or_else(|| context.sources.borrow().script.name.to_string());
            return parse_diagnostic(context, &file, error, *position);
        }
        EvalAltResult::ErrorFunctionNotFound(signature, _) => not_found(context, signature),
        EvalAltResult::ErrorTerminated(token, _) => {
            sandbox::stopped(token).map_or_else(used_up, Stop::diagnostic)
        }
        EvalAltResult::ErrorTooManyOperations(_) => used_up(),
        EvalAltResult::ErrorStackOverflow(_) => Diagnostic::error("calls are nested too deeply")
            .hint("does a function call itself without end?"),
        EvalAltResult::ErrorVariableNotFound(name, _) => {
            let d = Diagnostic::error(format!("there is no variable `{name}` here"));
            d.maybe_hint(
                name.contains("::").then(|| {
                    format!("a module's function is handed over in a closure: |s| {name}(s)")
                }),
            )
        }
        EvalAltResult::ErrorModuleNotFound(alias, _) => {
            Diagnostic::error(format!("nothing is imported as `{alias}`"))
                .hint(format!("begin the script with `import \"file\" as {alias};`"))
        }
        EvalAltResult::ErrorDotExpr(what, _) => property(what),
        EvalAltResult::ErrorUnboundThis(_) => Diagnostic::error("there is no `this` here")
            .hint("take the state as an argument: fn name(s) { … }"),
        EvalAltResult::ErrorDataRace(..) => {
            Diagnostic::error("a value is used by a closure while a method of it is running")
                .hint("keep the closure's name for it apart: `let base = …;` before the call")
        }
        other => {
            let text = other.to_string();
            Diagnostic::error(lower_first(text.split(" (line ").next().unwrap_or(&text)))
        }
    };
    context.sources.borrow().annotate(d.at(place))
}

fn used_up() -> Diagnostic {
    Diagnostic::error("the operation budget is used up").hint("is there an endless loop?")
}

/// `Unknown property 'size' - a getter is not registered for type 'i64'`, in other words.
fn property(what: &str) -> Diagnostic {
    let quoted: Vec<&str> = what.split('\'').skip(1).step_by(2).collect();
    match quoted.as_slice() {
        [name, of, ..] => {
            Diagnostic::error(format!("a value of type {} has no property `{name}`", type_name(of)))
        }
        _ => Diagnostic::error(format!("no such property: {what}")),
    }
}

/// A type as scripts know it.
pub(super) fn type_name(rust: &str) -> &str {
    match rust.trim().rsplit("::").next().unwrap_or(rust) {
        "i64" => "integer",
        "f64" => "float",
        "&str | ImmutableString | String" | "ImmutableString" | "String" | "&str" => "string",
        "State" => "state",
        "Step" => "step",
        "FnPtr" | "Fn" => "function",
        "char" => "character",
        other => other,
    }
}

/// No function of that name takes those arguments.
fn not_found(context: &Context, signature: &str) -> Diagnostic {
    let (name, args) = signature.split_once(" (").unwrap_or((signature, ")"));
    let args = args.strip_suffix(')').unwrap_or(args);
    let types: Vec<&str> = args.split(", ").filter(|a| !a.is_empty()).map(type_name).collect();
    let args = types.join(", ");
    let bare = name.rsplit("::").next().unwrap_or(name);
    let all = functions();
    if let Some(known) = all.iter().find(|f| f.name == name) {
        return Diagnostic::error(format!("`{name}` cannot be called with ({args})"))
            .hint(format!("it is called as {}", known.signature));
    }
    if !bare.starts_with(|c: char| c.is_alphabetic() || c == '_') {
        return Diagnostic::error(format!("`{name}` cannot be applied to ({args})"));
    }
    let syntax = context.syntax.borrow();
    let own: Vec<&(String, usize)> = syntax.values().flat_map(|s| &s.functions).collect();
    let mut arities: Vec<usize> =
        own.iter().filter(|(n, _)| n == bare).map(|(_, arity)| *arity).collect();
    arities.sort_unstable();
    if !arities.is_empty() {
        let hand_over = format!("to hand the function over, write `{name}` without parentheses");
        return Diagnostic::error(format!(
            "`{name}` takes {} argument{}, here it gets {}",
            arities.iter().map(usize::to_string).collect::<Vec<_>>().join(" or "),
            if arities == [1] { "" } else { "s" },
            types.len()
        ))
        .maybe_hint(types.is_empty().then_some(hand_over));
    }
    let d = Diagnostic::error(format!("there is no function `{name}` that takes ({args})"));
    if let Some(hint) = of(LEFT_OUT, name) {
        return d.hint(hint);
    }
    let known = own.iter().map(|(n, _)| n.as_str()).chain(all.iter().map(|f| f.name));
    let best = nearest(bare, known);
    d.maybe_hint(best.map(|b| format!("did you mean `{b}`?")))
}
