//! Everything that an agent needs to go on as if it had never stopped.

use std::collections::BTreeMap;

use serde::Serialize;
use serde::de::DeserializeOwned;

/// Named arrays and values.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Snapshot {
    /// Arrays of float32.
    pub singles: BTreeMap<String, Vec<f32>>,
    /// Arrays of float64.
    pub doubles: BTreeMap<String, Vec<f64>>,
    /// Other values, as JSON.
    pub values: BTreeMap<String, String>,
}

impl Snapshot {
    /// Keeps a value.
    ///
    /// # Panics
    /// If the value cannot be written as JSON.
    pub fn put<T: Serialize>(&mut self, name: &str, value: &T) {
        let json = serde_json::to_string(value).expect("numbers, lists and maps can be written");
        self.values.insert(name.into(), json);
    }

    /// A value that was kept; `None` if there is none, or it is of another kind.
    pub fn get<T: DeserializeOwned>(&self, name: &str) -> Option<T> {
        serde_json::from_str(self.values.get(name)?).ok()
    }

    /// Copies an array that was kept to where it belongs; `None` if it does not fit.
    pub fn copy(&self, name: &str, to: &mut [f32]) -> Option<()> {
        let from = self.singles.get(name)?;
        (from.len() == to.len()).then(|| to.copy_from_slice(from))
    }
}
