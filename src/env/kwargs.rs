//! Constructor arguments: how an environment declares them, and how given ones are checked.

use serde_json::{Map, Value};

use super::error::{EnvError, list};

/// What an argument may be. `null` is admitted where the default is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum KwargKind {
    /// `true` or `false`.
    Bool,
    /// A finite number.
    Float,
    /// Exactly this many finite numbers.
    Floats(usize),
    /// One of these names.
    Choice(&'static [&'static str]),
    /// One of these names, or null.
    Name(&'static [&'static str]),
    /// A list of strings (each may also be a list of one-letter strings), or null.
    Rows,
}

/// One constructor argument of an environment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KwargSpec {
    /// Its name, as in Gymnasium.
    pub name: &'static str,
    /// What it may be.
    pub kind: KwargKind,
    /// Its default, as JSON.
    pub default: &'static str,
    /// One line: what it does.
    pub doc: &'static str,
}

impl KwargSpec {
    /// What values it takes, as a phrase that follows "must be".
    pub fn allowed(&self) -> String {
        match self.kind {
            KwargKind::Bool => "true or false".into(),
            KwargKind::Float => "a finite number".into(),
            KwargKind::Floats(n) => format!("a list of exactly {n} finite numbers"),
            KwargKind::Choice(names) => format!("one of {}", list(names)),
            KwargKind::Name(names) => format!("one of {}, or null", list(names)),
            KwargKind::Rows => "a list of strings, one per row, or null".into(),
        }
    }

    /// `value` in its one canonical form: floats as floats (never -0.0), rows as strings.
    fn canonical(&self, value: &Value) -> Result<Value, EnvError> {
        let canonical = match self.kind {
            KwargKind::Bool => value.as_bool().map(Value::from),
            KwargKind::Float => float(value),
            KwargKind::Floats(n) => value
                .as_array()
                .filter(|list| list.len() == n)
                .and_then(|list| list.iter().map(float).collect()),
            KwargKind::Name(_) | KwargKind::Rows if value.is_null() => Some(Value::Null),
            KwargKind::Choice(names) | KwargKind::Name(names) => {
                value.as_str().filter(|name| names.contains(name)).map(Value::from)
            }
            KwargKind::Rows => value.as_array().and_then(|rows| rows.iter().map(row).collect()),
        };
        canonical.ok_or_else(|| {
            let message = format!("`{}` must be {}, not {value}", self.name, self.allowed());
            EnvError::about(self.name, message)
        })
    }

    fn default_value(&self) -> Value {
        serde_json::from_str(self.default)
            .unwrap_or_else(|e| panic!("the default of `{}` is not JSON: {e}", self.name))
    }
}

fn float(value: &Value) -> Option<Value> {
    // Adding 0.0 turns -0.0 into 0.0: no environment tells them apart, and no hash should.
    value.as_f64().filter(|x| x.is_finite()).map(|x| Value::from(x + 0.0))
}

/// A row of a map: a string, or a list of one-letter strings.
fn row(value: &Value) -> Option<Value> {
    if let Some(letters) = value.as_array() {
        let one_letter = |letter: &Value| {
            letter.as_str().filter(|s| s.chars().count() == 1).map(ToOwned::to_owned)
        };
        return letters.iter().map(one_letter).collect::<Option<String>>().map(Value::from);
    }
    value.as_str().map(Value::from)
}

/// Every argument of an environment, checked: each declared one is there, in canonical form and
/// in alphabetical order, and nothing else is.
#[derive(Debug, Clone, PartialEq)]
pub struct Kwargs(Map<String, Value>);

impl Kwargs {
    /// Fills in defaults and checks names and types; ranges are the environment's business.
    ///
    /// # Errors
    /// On an unknown name, with a suggestion, or a value of the wrong type.
    pub fn resolve(
        owner: &str,
        specs: &[KwargSpec],
        given: &Map<String, Value>,
    ) -> Result<Self, EnvError> {
        let mut names: Vec<&str> = specs.iter().map(|spec| spec.name).collect();
        if let Some(key) = given.keys().find(|key| !names.contains(&key.as_str())) {
            return Err(EnvError::unknown_key(owner, "arguments", key, &names));
        }
        names.sort_unstable();
        let mut resolved = Map::new();
        for name in names {
            let Some(spec) = specs.iter().find(|spec| spec.name == name) else { continue };
            let value = given.get(name).cloned().unwrap_or_else(|| spec.default_value());
            resolved.insert(name.into(), spec.canonical(&value)?);
        }
        Ok(Self(resolved))
    }

    /// The arguments as JSON: what a configuration's hash is taken over.
    pub fn as_map(&self) -> &Map<String, Value> {
        &self.0
    }

    /// The same, without a copy.
    pub fn into_map(self) -> Map<String, Value> {
        self.0
    }

    /// A [`KwargKind::Bool`] argument.
    ///
    /// # Panics
    /// Like the other getters, if the environment did not declare `name` of that kind.
    pub fn bool(&self, name: &str) -> bool {
        self.get(name, Value::as_bool)
    }

    /// A [`KwargKind::Float`] argument.
    ///
    /// # Panics
    /// If it was not declared.
    pub fn float(&self, name: &str) -> f64 {
        self.get(name, Value::as_f64)
    }

    /// A [`KwargKind::Floats`] argument.
    ///
    /// # Panics
    /// If it was not declared.
    pub fn floats(&self, name: &str) -> Vec<f64> {
        self.get(name, |v| v.as_array()?.iter().map(Value::as_f64).collect())
    }

    /// A [`KwargKind::Choice`] argument.
    ///
    /// # Panics
    /// If it was not declared.
    pub fn choice(&self, name: &str) -> &str {
        self.get(name, Value::as_str)
    }

    /// A [`KwargKind::Name`] argument.
    ///
    /// # Panics
    /// If it was not declared.
    pub fn name(&self, name: &str) -> Option<&str> {
        self.get(name, |v| if v.is_null() { Some(None) } else { v.as_str().map(Some) })
    }

    /// A [`KwargKind::Rows`] argument.
    ///
    /// # Panics
    /// If it was not declared.
    pub fn rows(&self, name: &str) -> Option<Vec<String>> {
        let strings = |v: &Value| -> Option<Vec<String>> {
            v.as_array()?.iter().map(|row| row.as_str().map(ToOwned::to_owned)).collect()
        };
        self.get(name, |v| if v.is_null() { Some(None) } else { strings(v).map(Some) })
    }

    fn get<'a, T>(&'a self, name: &str, read: impl FnOnce(&'a Value) -> Option<T>) -> T {
        self.0
            .get(name)
            .and_then(read)
            .unwrap_or_else(|| panic!("`{name}` is not declared as an argument of this kind"))
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    const SPECS: &[KwargSpec] = &[
        KwargSpec { name: "speed", kind: KwargKind::Float, default: "0", doc: "" },
        KwargSpec { name: "desc", kind: KwargKind::Rows, default: "null", doc: "" },
        KwargSpec { name: "name", kind: KwargKind::Name(&["a", "b"]), default: "\"a\"", doc: "" },
        KwargSpec { name: "pay", kind: KwargKind::Floats(2), default: "[1, 0]", doc: "" },
        KwargSpec { name: "slip", kind: KwargKind::Bool, default: "true", doc: "" },
    ];

    fn resolve(given: &Value) -> Result<Kwargs, EnvError> {
        Kwargs::resolve("X-v0", SPECS, given.as_object().unwrap())
    }

    #[test]
    fn one_configuration_has_one_form() {
        let text = |given: Value| Value::from(resolve(&given).unwrap().into_map()).to_string();
        assert_eq!(
            text(json!({})),
            r#"{"desc":null,"name":"a","pay":[1.0,0.0],"slip":true,"speed":0.0}"#
        );
        assert_eq!(text(json!({"speed": 0, "slip": true})), text(json!({"speed": -0.0})));
        assert_eq!(text(json!({"desc": [["S", "G"]]})), text(json!({"desc": ["SG"]})));
    }

    #[test]
    fn wrong_types_name_the_argument_and_what_is_allowed() {
        for (given, key, message) in [
            (json!({"slip": 1}), "slip", "`slip` must be true or false, not 1"),
            (json!({"speed": "x"}), "speed", "`speed` must be a finite number, not \"x\""),
            (json!({"name": "c"}), "name", "`name` must be one of `a`, `b`, or null, not \"c\""),
            (
                json!({"pay": [1]}),
                "pay",
                "`pay` must be a list of exactly 2 finite numbers, not [1]",
            ),
            (
                json!({"desc": [1]}),
                "desc",
                "`desc` must be a list of strings, one per row, or null, not [1]",
            ),
        ] {
            let error = resolve(&given).unwrap_err();
            assert_eq!(error.message, message);
            assert_eq!(error.key.as_deref(), Some(key));
        }
    }
}
