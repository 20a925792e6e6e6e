//! Reading typed values out of a script's maps.

use rhai::{Dynamic, FnPtr, Map};

use super::diagnostic::{Diagnostic, suggest};
use super::draft::{AgentDraft, Located, Spot, captured_now};
use super::errors::type_name;
use super::network;
use super::value::Value;
use crate::learn::registry::AgentSpec;
use crate::learn::{Exploration, ParamKind, ParamValue, Schedule, Widths};

/// What `visit_count(..)` returns: α = N(s, a)^−omega.
#[derive(Debug, Clone, Copy)]
pub(super) struct VisitCount {
    pub(super) omega: f64,
}

/// A value in words, for messages: `"abc"`, `3`, `a function`.
pub(super) fn show(value: &Dynamic) -> String {
    let value = value.clone().flatten();
    if value.is_string() {
        let text = value.into_string().unwrap_or_default();
        return match text.char_indices().nth(200) {
            Some((end, _)) => format!("{:?}…", &text[..end]),
            None => format!("{text:?}"),
        };
    }
    if value.is_unit() {
        return "()".into();
    }
    if value.is_fnptr() {
        return "a function".into();
    }
    if value.is_int() || value.is_bool() || value.is_float() || value.is_array() {
        let text = value.to_string();
        return if text.chars().count() > 60 { "an array".into() } else { text };
    }
    if let Some(parameter) = built(&value) {
        return parameter.to_string();
    }
    if value.is_map() {
        return "a map".into();
    }
    match value.type_name().rsplit("::").next().unwrap_or_default() {
        "ExperimentDraft" => "an experiment".into(),
        "AgentDraft" => "an agent".into(),
        "EnvDraft" => "an environment".into(),
        "DiscretiserDraft" => "a discretiser".into(),
        "StudyDraft" => "a study".into(),
        "LearnedPotential" => "a learned potential".into(),
        other => format!("a value of type {}", type_name(other)),
    }
}

/// A number, integers included.
pub(super) fn number(value: &Dynamic) -> Option<f64> {
    let value = value.clone().flatten();
    value.as_float().ok().or_else(|| value.as_int().ok().map(|i| i as f64))
}

/// A string.
pub(super) fn text(value: &Dynamic) -> Option<String> {
    let value = value.clone().flatten();
    value.is_string().then(|| value.into_string().unwrap_or_default())
}

/// A whole number from `min` to `max`.
pub(super) fn whole(what: &str, value: &Dynamic, min: i64, max: i64) -> Result<i64, Diagnostic> {
    match value.clone().flatten().as_int() {
        Ok(n) if (min..=max).contains(&n) => Ok(n),
        _ => Err(Diagnostic::error(format!(
            "{what} is a whole number from {min} to {max}, got {}",
            show(value)
        ))),
    }
}

/// A plain value as JSON, for constructor arguments.
pub(super) fn json(value: &Dynamic) -> Result<serde_json::Value, String> {
    fn convert(value: &Value) -> Result<serde_json::Value, String> {
        Ok(match value {
            Value::Unit => serde_json::Value::Null,
            Value::Bool(x) => (*x).into(),
            Value::Int(x) => (*x).into(),
            Value::Float(x) => serde_json::Number::from_f64(*x)
                .map(serde_json::Value::Number)
                .ok_or_else(|| format!("{x}: it must be finite"))?,
            Value::Char(x) => x.to_string().into(),
            Value::Str(x) => x.clone().into(),
            Value::Array(items) => {
                serde_json::Value::Array(items.iter().map(convert).collect::<Result<_, _>>()?)
            }
            Value::Map(entries) => serde_json::Value::Object(
                entries
                    .iter()
                    .map(|(k, v)| Ok((k.clone(), convert(v)?)))
                    .collect::<Result<_, String>>()?,
            ),
            Value::Fn { .. } => return Err("a function".into()),
        })
    }
    Value::freeze(value).and_then(|v| convert(&v))
}

/// Merges a map into an agent's parameters; `spot` finds the place of a key.
pub(super) fn merge_agent(
    agent: &mut AgentDraft,
    map: &Map,
    spot: impl Fn(&str) -> Spot,
) -> Result<(), Diagnostic> {
    let spec: &AgentSpec = agent.spec;
    for (key, value) in map {
        let place = || spot(key).place();
        let Some(param) = spec.params.iter().find(|p| p.name == key.as_str()) else {
            let names: Vec<&str> = spec.params.iter().map(|p| p.name).collect();
            let plain = key.to_lowercase().replace('-', "_");
            let alias = spec.aliases.iter().find(|(other, _)| **other == plain);
            let alias = alias.map(|(_, name)| format!("here it is called `{name}`"));
            return Err(Diagnostic::error(format!("`{}` has no parameter `{key}`", spec.name))
                .at(place())
                .maybe_hint(alias.or_else(|| suggest(key, names))));
        };
        if let (Some(_), Some(f)) = (param.function, value.clone().flatten().try_cast::<FnPtr>()) {
            let value = captured_now(f);
            agent.functions.insert(param.name, Located { value, spot: spot(key) });
            agent.params.insert(param.name, ParamValue::Function);
            continue;
        }
        let accepted = param.kind.accept(raw(value, param.kind)).ok_or_else(|| {
            let function = match param.function {
                Some(signature) => format!(", or a function {}", signature.text),
                None => String::new(),
            };
            Diagnostic::error(format!(
                "`{key}` of `{}` is {}{function}, got {}",
                spec.name,
                param.kind.allowed(),
                show(value)
            ))
            .at(place())
        })?;
        agent.functions.remove(param.name);
        agent.params.insert(param.name, accepted);
    }
    if map.contains_key("epsilon") {
        let line = network::EXPLORATION.into_iter().find(|name| {
            agent.params.get(name).is_some_and(|x| *x != ParamValue::Word(ParamKind::NONE))
        });
        if let Some(name) = line {
            return Err(Diagnostic::error(format!("`epsilon` plays no part with `{name}`"))
                .at(spot("epsilon").place())
                .hint(format!("leave out one of them, or say `{name}: {:?}`", ParamKind::NONE)));
        }
    }
    match agent.params.get("exploration") {
        Some(ParamValue::Exploration(Exploration::EpsilonGreedy)) | None => Ok(()),
        Some(policy) if map.contains_key("epsilon") => {
            Err(Diagnostic::error(format!("`epsilon` plays no part with {policy}"))
                .at(spot("epsilon").place())
                .hint("leave it out, or say `exploration: \"epsilon_greedy\"`"))
        }
        Some(_) => Ok(()),
    }
}

/// A script's value as a parameter's, NaN if it is nothing that a parameter can be.
fn raw(value: &Dynamic, kind: ParamKind) -> ParamValue {
    let flat = value.clone().flatten();
    if let Ok(n) = flat.as_int() {
        return u64::try_from(n).map_or(ParamValue::Float(n as f64), ParamValue::Int);
    }
    if let Ok(x) = flat.as_float() {
        return ParamValue::Float(x);
    }
    if let Ok(yes) = flat.as_bool() {
        return ParamValue::Bool(yes);
    }
    if let (Some(word), ParamKind::Word(words)) = (text(&flat), kind) {
        let known = words.iter().find(|known| **known == word);
        return known.map_or(ParamValue::Float(f64::NAN), |word| ParamValue::Word(word));
    }
    if let (ParamKind::Maybe { .. }, Some(ParamKind::NONE)) = (kind, text(&flat).as_deref()) {
        return ParamValue::Word(ParamKind::NONE);
    }
    if let (ParamKind::Widths, Ok(list)) = (kind, flat.clone().into_array()) {
        let widths: Option<Vec<u64>> =
            list.iter().map(|n| u64::try_from(n.clone().flatten().as_int().ok()?).ok()).collect();
        let widths = widths.and_then(|widths| Widths::new(&widths));
        return widths.map_or(ParamValue::Float(f64::NAN), ParamValue::Widths);
    }
    if let (ParamKind::Exploration, Some(Exploration::DEFAULT)) = (kind, text(&flat).as_deref()) {
        return ParamValue::Exploration(Exploration::EpsilonGreedy);
    }
    built(&flat).unwrap_or(ParamValue::Float(f64::NAN))
}

/// What a function has built as the value of a parameter.
fn built(value: &Dynamic) -> Option<ParamValue> {
    let cast = value.clone();
    cast.try_cast::<Schedule>()
        .map(ParamValue::Schedule)
        .or_else(|| value.clone().try_cast().map(ParamValue::Exploration))
        .or_else(|| {
            let VisitCount { omega } = value.clone().try_cast()?;
            Some(ParamValue::VisitCount { omega })
        })
}

/// The `#{ steps: true }` at the end of a schedule; `spot` finds the place of a key.
pub(super) fn per_step(options: &Map, spot: impl Fn(&str) -> Spot) -> Result<bool, Diagnostic> {
    let mut steps = false;
    for (key, value) in options {
        let place = || spot(key).place();
        if key != "steps" {
            return Err(Diagnostic::error(format!("a schedule has no option `{key}`"))
                .at(place())
                .hint("the only one is `steps: true`"));
        }
        steps = value.clone().flatten().as_bool().map_err(|_| {
            Diagnostic::error(format!("`steps` is true or false, got {}", show(value))).at(place())
        })?;
    }
    Ok(steps)
}
