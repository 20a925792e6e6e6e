//! Results as claims see them: maps that refuse names they do not have, so that a misspelt
//! statistic is an error and not a claim that fails, or holds, for ever.

use std::rc::Rc;

use rhai::{Dynamic, Engine, EvalAltResult, Position};
use serde_json::Value;

use super::diagnostic::{Diagnostic, suggest};

/// A set of named values.
#[derive(Debug, Clone)]
struct Record {
    /// What it is, for messages: `the results`, `plain.auc`.
    what: Rc<str>,
    values: Rc<serde_json::Map<String, Value>>,
}

/// A JSON value as a script's; objects become records, called `what`.
pub(super) fn dynamic(what: &str, json: &Value) -> Dynamic {
    match json {
        Value::Null => Dynamic::UNIT,
        Value::Bool(b) => (*b).into(),
        Value::Number(n) => {
            n.as_i64().map_or_else(|| n.as_f64().unwrap_or(f64::NAN).into(), Dynamic::from)
        }
        Value::String(s) => s.clone().into(),
        Value::Array(a) => a.iter().map(|v| dynamic(what, v)).collect::<rhai::Array>().into(),
        Value::Object(o) => Dynamic::from(Record { what: what.into(), values: Rc::new(o.clone()) }),
    }
}

/// Registers the type: `r.name` and `r["name"]`.
pub(super) fn register(engine: &mut Engine) {
    engine.register_type_with_name::<Record>("results");
    engine.register_indexer_get(|record: &mut Record, name: &str| {
        if let Some(value) = record.values.get(name) {
            let what = if &*record.what == "the results" {
                name.to_string()
            } else {
                format!("{}.{name}", record.what)
            };
            return Ok(dynamic(&what, value));
        }
        let verb = if &*record.what == "the results" { "have" } else { "has" };
        let names: Vec<&str> = record.values.keys().map(String::as_str).collect();
        let d = Diagnostic::error(format!("{} {verb} no `{name}`", record.what))
            .maybe_hint(suggest(name, names));
        Err(Box::new(EvalAltResult::ErrorRuntime(Dynamic::from(d), Position::NONE)))
    });
}
