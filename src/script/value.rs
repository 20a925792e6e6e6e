//! Plain data: what constants and captured variables are turned into, so that a callback can be
//! rebuilt on another thread and be part of a hash.

use rhai::{Dynamic, FnPtr};
use serde::{Deserialize, Serialize};

/// How deeply values may be nested: deeper ones would overflow the stack.
pub(super) const MAX_DEPTH: usize = 64;

/// A constant or captured value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Value {
    /// `()`
    Unit,
    /// A truth value.
    Bool(bool),
    /// An integer.
    Int(i64),
    /// A float.
    Float(f64),
    /// A character.
    Char(char),
    /// A string.
    Str(String),
    /// An array.
    Array(Vec<Value>),
    /// A map, by key.
    Map(std::collections::BTreeMap<String, Value>),
    /// A function with the values it has captured.
    Fn {
        /// Its name; for closures one that Rhai made up, valid in this process only.
        name: String,
        /// Captured values: its leading arguments.
        captures: Vec<Value>,
    },
}

impl Value {
    /// Plain data from a script's value; shared variables are read now, and later changes of
    /// theirs are not seen.
    ///
    /// # Errors
    /// The name of the type, if it is not plain data.
    pub(super) fn freeze(value: &Dynamic) -> Result<Self, String> {
        Self::freeze_at(value, 0)
    }

    fn freeze_at(value: &Dynamic, depth: usize) -> Result<Self, String> {
        if depth > MAX_DEPTH {
            return Err("a value that holds itself, or is nested without end".into());
        }
        let value = value.clone().flatten();
        if value.is_unit() {
            return Ok(Self::Unit);
        }
        if let Ok(x) = value.as_bool() {
            return Ok(Self::Bool(x));
        }
        if let Ok(x) = value.as_int() {
            return Ok(Self::Int(x));
        }
        if let Ok(x) = value.as_float() {
            return Ok(Self::Float(x));
        }
        if let Ok(x) = value.as_char() {
            return Ok(Self::Char(x));
        }
        if value.is_string() {
            return Ok(Self::Str(value.into_string().unwrap_or_default()));
        }
        let inner = |v: &Dynamic| Self::freeze_at(v, depth + 1);
        if let Some(array) = value.read_lock::<rhai::Array>() {
            return array.iter().map(inner).collect::<Result<_, _>>().map(Self::Array);
        }
        if let Some(map) = value.read_lock::<rhai::Map>() {
            let entries = map.iter().map(|(k, v)| Ok((k.to_string(), inner(v)?)));
            return entries.collect::<Result<_, String>>().map(Self::Map);
        }
        if let Some(f) = value.read_lock::<FnPtr>() {
            let captures = f.iter_curry().map(inner).collect::<Result<_, _>>()?;
            return Ok(Self::Fn { name: f.fn_name().to_string(), captures });
        }
        Err(super::params::show(&value))
    }

    /// As [`Self::freeze`], of a function pointer.
    pub(super) fn freeze_fn(f: &FnPtr) -> Result<Self, String> {
        Self::freeze(&Dynamic::from(f.clone()))
    }

    /// The script's value again; `function` finds a script function by its name.
    pub(super) fn thaw(&self, function: &impl Fn(&str) -> Option<FnPtr>) -> Dynamic {
        match self {
            Self::Unit => Dynamic::UNIT,
            Self::Bool(x) => (*x).into(),
            Self::Int(x) => (*x).into(),
            Self::Float(x) => (*x).into(),
            Self::Char(x) => (*x).into(),
            Self::Str(x) => x.clone().into(),
            Self::Array(items) => {
                items.iter().map(|v| v.thaw(function)).collect::<rhai::Array>().into()
            }
            Self::Map(entries) => {
                let map: rhai::Map =
                    entries.iter().map(|(k, v)| (k.as_str().into(), v.thaw(function))).collect();
                map.into()
            }
            Self::Fn { name, captures } => {
                let Some(mut f) = function(name) else { return Dynamic::UNIT };
                for capture in captures {
                    f.add_curry(capture.thaw(function));
                }
                f.into()
            }
        }
    }
}
