//! `weights.csv`: the weights of linear action values, with what their features are.
//!
//! ```text
//! #{"env":"MountainCar-v0","actions":["left","none","right"],"frame_skip":1,"kind":{"tiles":8},…}
//! feature,w_0,w_1,w_2
//! 17,-0.25,-0.125,0.0
//! ```
//!
//! Features whose weights are still the initial ones are left out.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::StoreError;
use super::format::{NEVER, Rows, csv_bytes, float, row};
use crate::learn::{LinearQ, QTable};
use crate::mdp::Schema;
use crate::script::{DiscretiserSpec, Variant};
use crate::shaping::{Dim, FeatureKind, FeatureSpec, Features};

/// The first line: what the weights belong to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Header {
    env: String,
    actions: Vec<String>,
    frame_skip: u32,
    kind: FeatureKind,
    /// Name, lower and upper bound, number of tiles or order.
    fields: Vec<(String, f64, f64, usize)>,
    /// The value that every state started with.
    initial: f64,
}

/// The weights that features start with, a row each.
pub(super) struct Initial {
    features: Features,
    value: f64,
    n_actions: usize,
}

impl Initial {
    /// Those of `variant`, if its values are linear in features.
    pub(super) fn of(variant: &Variant, n_actions: usize) -> Option<Self> {
        let DiscretiserSpec::Features(spec) = &variant.discretiser else { return None };
        let features = Features::new(spec).expect("checked when the plan was resolved");
        Some(Self { features, value: variant.agent.float("initial_q"), n_actions })
    }

    /// Whether the weights of `feature` still are what they were at first.
    pub(super) fn holds(&self, feature: usize, row: &[f64]) -> bool {
        let initial = self.features.level(feature, self.value);
        row.iter().all(|w| w.to_bits() == initial.to_bits())
    }

    /// All weights, `rows` in their places.
    pub(super) fn filled(self, rows: &Rows) -> LinearQ {
        let mut weights =
            LinearQ::new(self.features.clone(), self.n_actions, self.value).weights().clone();
        for (feature, row) in rows {
            for (a, w) in row.iter().enumerate() {
                *weights.get_mut(*feature, a) = *w;
            }
        }
        LinearQ::from_weights(self.features, weights)
    }
}

fn columns(n_actions: usize) -> Vec<String> {
    let weights = (0..n_actions).map(|a| format!("w_{a}"));
    std::iter::once("feature".to_string()).chain(weights).collect()
}

/// The file of `variant`, whose unit has learned `weights`.
pub(super) fn weights(variant: &Variant, weights: &QTable) -> Vec<u8> {
    let DiscretiserSpec::Features(spec) = &variant.discretiser else {
        unreachable!("weights are learned of features only")
    };
    let initial = Initial::of(variant, weights.n_actions()).expect("there are features");
    let schema = variant.environment().expect("it has been made before").schema();
    let name = |d: &Dim| (schema.fields[d.field].name.to_string(), d.lo, d.hi, d.n);
    let header = Header {
        env: variant.env.id.to_string(),
        actions: schema.actions.clone(),
        frame_skip: variant.frame_skip,
        kind: spec.kind,
        fields: spec.dims.iter().map(name).collect(),
        initial: initial.value,
    };
    let mut bytes = format!("#{}\n", serde_json::to_string(&header).expect(NEVER)).into_bytes();
    let mut csv = csv::Writer::from_writer(Vec::new());
    csv.write_record(columns(weights.n_actions())).expect(NEVER);
    for feature in 0..weights.n_states() {
        let row = weights.row(feature);
        if !initial.holds(feature, row) {
            let mut line = vec![feature.to_string()];
            line.extend(row.iter().map(|w| float(*w)));
            csv.write_record(&line).expect(NEVER);
        }
    }
    bytes.extend(csv_bytes(csv));
    bytes
}

/// Reads the weights of `shape` `(features, actions)` that [`weights`] wrote.
pub(super) fn read(bytes: &[u8], shape: (usize, usize)) -> Result<Rows, String> {
    let (n_features, n_actions) = shape;
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(bytes);
    let columns = columns(n_actions);
    if *reader.headers().map_err(|e| e.to_string())? != columns {
        let columns = columns.join(",");
        return Err(format!("holds no weights of {n_actions} actions: there is no `{columns}`"));
    }
    let mut rows = Rows::new();
    for (i, line) in reader.records().enumerate() {
        let line = line.map_err(|e| e.to_string())?;
        let next = row(&line, "feature", n_features, 1, &rows);
        rows.push(next.map_err(|what| format!("line {}: {what}", i + 3))?);
    }
    Ok(rows)
}

/// Whether a file's text begins as a `weights.csv` does.
pub fn holds_weights(path: &Path) -> bool {
    std::fs::read(path).is_ok_and(|bytes| bytes.starts_with(b"#{"))
}

/// Reads a `weights.csv` for an environment that `schema` describes: the values, and for how many
/// steps an action is played.
///
/// # Errors
/// If it cannot be read, is something else, or belongs to an environment with other fields or
/// actions.
pub fn read_weights(path: &Path, schema: &Schema) -> Result<(LinearQ, u32), StoreError> {
    let bytes = std::fs::read(path).map_err(|e| StoreError::io(path, "cannot be read", &e))?;
    let bad = |what: String| StoreError::new(path, what);
    let first = bytes.split(|b| *b == b'\n').next().unwrap_or_default();
    let header: Header = serde_json::from_slice(first.get(1..).unwrap_or_default())
        .map_err(|e| bad(format!("its first line does not say what its features are ({e})")))?;
    if header.actions != schema.actions {
        return Err(bad(format!(
            "is about the actions {} of {}, here they are {}",
            header.actions.join(", "),
            header.env,
            schema.actions.join(", ")
        )));
    }
    let mut dims = Vec::with_capacity(header.fields.len());
    for (name, lo, hi, n) in &header.fields {
        let field = schema.fields.iter().position(|f| f.name == name);
        let field =
            field.ok_or_else(|| bad(format!("is about a field `{name}`, which is not there")))?;
        dims.push(Dim { field, lo: *lo, hi: *hi, n: *n });
    }
    let spec = FeatureSpec { kind: header.kind, dims };
    let features = Features::new(&spec).map_err(|e| bad(format!("line 1: {}", e.message)))?;
    if !header.initial.is_finite() || header.frame_skip == 0 {
        return Err(bad("line 1: the initial value is not finite, or no frame is played".into()));
    }
    let shape = (features.n_features(), schema.actions.len());
    let rows = read(&bytes, shape).map_err(bad)?;
    let initial = Initial { features, value: header.initial, n_actions: shape.1 };
    Ok((initial.filled(&rows), header.frame_skip))
}
