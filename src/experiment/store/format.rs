//! The files of a unit: `monitor.csv`, `policy.csv`, `values.csv`, `sweeps.csv`, and the marks in
//! `result.json`. `weights.csv` has a file of its own.

use std::fmt::Write;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::experiment::hex;
use crate::experiment::record::{EpisodeRow, StartValue, StateValues, UnitRecord};
use crate::learn::planning::Sweep;
use crate::learn::{ParamValue, QTable, argmax_tol};
use crate::mdp::Ending;
use crate::script::{DiscretiserSpec, Variant};

/// Layout of the unit files; raised when it changes.
pub(super) const SCHEMA: u32 = 1;

/// What `result.json` says.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct ResultFile {
    pub(super) schema: u32,
    pub(super) unit: String,
    pub(super) env: String,
    pub(super) seed: u64,
    pub(super) episodes: u32,
    pub(super) steps: u64,
    /// Shape of the table of action values; no actions if it holds state values.
    pub(super) states: usize,
    pub(super) actions: usize,
    /// Where values are linear in features, the number of these; no states then.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub(super) features: usize,
    pub(super) files: std::collections::BTreeMap<String, FileMark>,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks for it")]
fn is_zero(n: &usize) -> bool {
    *n == 0
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct FileMark {
    bytes: u64,
    sha256: String,
}

pub(super) fn mark(bytes: &[u8]) -> FileMark {
    FileMark { bytes: bytes.len() as u64, sha256: hex(&Sha256::digest(bytes)) }
}

/// A float as the shortest text that reads back as the same float.
pub(super) fn float(x: f64) -> String {
    format!("{x:?}")
}

pub(super) fn csv_bytes(writer: csv::Writer<Vec<u8>>) -> Vec<u8> {
    writer.into_inner().expect("writing to memory does not fail")
}

pub(super) const NEVER: &str = "writing to memory does not fail";

/// The column of a predictor's errors.
const VALUE_ERROR: &str = "value_error";

/// The columns of what a network believed at the start of an episode and what that brought.
const START: [&str; 2] = ["start_value", "start_return"];

/// Stable-Baselines3's monitor format: a JSON comment, then r, l, t and columns of our own. The
/// time t is 0: wall time would make two equal runs differ; it is in `timing.json`.
pub(super) fn monitor(variant: &Variant, record: &UnitRecord) -> Vec<u8> {
    let mut bytes =
        format!("#{{\"t_start\": 0.0, \"env_id\": \"{}\"}}\n", variant.env.id).into_bytes();
    let mut csv = csv::Writer::from_writer(Vec::new());
    let mut header = vec!["r", "l", "t", "learned_return", "shaping", "epsilon", "ending"];
    let has_errors = record.rows.iter().any(|row| row.value_error.is_some());
    if has_errors {
        header.push(VALUE_ERROR);
    }
    let has_starts = record.rows.iter().any(|row| row.start.is_some());
    if has_starts {
        header.extend(START);
    }
    header.extend(variant.terms.keys().map(String::as_str));
    csv.write_record(&header).expect(NEVER);
    for row in &record.rows {
        let mut line = vec![
            float(row.native),
            row.steps.to_string(),
            "0".into(),
            float(row.learned),
            float(row.shaping),
            float(row.epsilon),
            row.ending.as_str().to_string(),
        ];
        if has_errors {
            line.push(row.value_error.map_or_else(String::new, float));
        }
        if has_starts {
            let start = |of: fn(&StartValue) -> f64| row.start.map_or(0.0, |start| of(&start));
            line.extend([float(start(|s| s.believed)), float(start(|s| s.brought))]);
        }
        line.extend(row.terms.iter().map(|x| float(*x)));
        csv.write_record(&line).expect(NEVER);
    }
    bytes.extend(csv_bytes(csv));
    bytes
}

pub(super) fn read_monitor(bytes: &[u8]) -> Result<Vec<EpisodeRow>, String> {
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(bytes);
    let has_errors = reader.headers().is_ok_and(|header| header.get(7) == Some(VALUE_ERROR));
    let has_starts = reader.headers().is_ok_and(|header| header.get(7) == Some(START[0]));
    let first_term = 7 + usize::from(has_errors) + if has_starts { 2 } else { 0 };
    let mut rows = Vec::new();
    for (i, line) in reader.records().enumerate() {
        let line = line.map_err(|e| e.to_string())?;
        let bad = || format!("episode {i} cannot be read");
        let number = |k: usize| line.get(k).and_then(|s| s.parse::<f64>().ok()).ok_or_else(bad);
        rows.push(EpisodeRow {
            native: number(0)?,
            steps: line.get(1).and_then(|s| s.parse().ok()).ok_or_else(bad)?,
            learned: number(3)?,
            shaping: number(4)?,
            epsilon: number(5)?,
            value_error: match line.get(7) {
                Some(x) if has_errors && !x.is_empty() => Some(number(7)?),
                _ => None,
            },
            start: if has_starts {
                Some(StartValue { believed: number(7)?, brought: number(8)? })
            } else {
                None
            },
            ending: match line.get(6) {
                Some("terminated") => Ending::Terminated,
                Some("truncated") => Ending::Truncated,
                _ => return Err(bad()),
            },
            terms: (first_term..line.len()).map(number).collect::<Result<_, _>>()?,
        });
    }
    Ok(rows)
}

/// The value that a variant's table starts with; `None` if states differ in that, and for planners,
/// which leave none of it.
pub(super) fn initial_value(variant: &Variant) -> Option<f64> {
    let params = &variant.agent.params;
    match params.get("initial_q").or_else(|| params.get("initial_v")) {
        Some(ParamValue::Float(x)) => Some(*x),
        _ => None,
    }
}

/// Whether a row still holds the initial value everywhere: nothing was learned there.
pub(super) fn is_initial(row: &[f64], initial: Option<f64>) -> bool {
    initial.is_some_and(|x| row.iter().all(|v| v.to_bits() == x.to_bits()))
}

/// `state,greedy,q_0,…`: every state whose values differ from the initial ones, the states of a
/// finite environment all.
pub(super) fn policy(variant: &Variant, q: &QTable) -> Vec<u8> {
    let initial = initial_value(variant);
    let all = matches!(variant.discretiser, DiscretiserSpec::StateIndex);
    let mut csv = csv::Writer::from_writer(Vec::new());
    let mut header = vec!["state".to_string(), "greedy".to_string()];
    header.extend((0..q.n_actions()).map(|a| format!("q_{a}")));
    csv.write_record(&header).expect(NEVER);
    for s in 0..q.n_states() {
        let row = q.row(s);
        if !all && is_initial(row, initial) {
            continue;
        }
        let mut line = vec![s.to_string(), argmax_tol(row).to_string()];
        line.extend(row.iter().map(|x| float(*x)));
        csv.write_record(&line).expect(NEVER);
    }
    csv_bytes(csv)
}

/// Reads what [`policy`] writes, for a table of `shape` `(states, actions)`.
pub(super) fn read_policy(bytes: &[u8], shape: (usize, usize)) -> Result<Rows, String> {
    let (n_states, n_actions) = shape;
    let mut reader = csv::Reader::from_reader(bytes);
    let mut header = vec!["state".to_string(), "greedy".to_string()];
    header.extend((0..n_actions).map(|a| format!("q_{a}")));
    let found = reader.headers().map_err(|e| e.to_string())?;
    if *found != header {
        return Err(format!(
            "is no policy of {n_actions} actions: its header is not `{}`",
            header.join(",")
        ));
    }
    let mut table = Rows::new();
    for (i, line) in reader.records().enumerate() {
        let line = line.map_err(|e| e.to_string())?;
        let bad = |what: String| format!("line {}: {what}", i + 2);
        let (state, values) = row(&line, "state", n_states, 2, &table).map_err(bad)?;
        if line[1] != *argmax_tol(&values).to_string() {
            return Err(bad(format!(
                "`greedy` is {}, but by its values it is {}",
                &line[1],
                argmax_tol(&values)
            )));
        }
        table.push((state, values));
    }
    Ok(table)
}

/// Numbered rows of values, in ascending order.
pub(super) type Rows = Vec<(usize, Vec<f64>)>;

/// A line that begins with the number of a `what`, of which there are `n`, and has values from
/// column `from` on; `table` holds the lines before it.
pub(super) fn row(
    line: &csv::StringRecord,
    what: &str,
    n: usize,
    from: usize,
    table: &Rows,
) -> Result<(usize, Vec<f64>), String> {
    let number = line.get(0).and_then(|s| s.parse().ok());
    let number = number.ok_or_else(|| format!("the {what} is no number"))?;
    if number >= n {
        return Err(format!("there is no {what} {number} among {n}"));
    }
    if table.last().is_some_and(|(before, _)| *before >= number) {
        return Err(format!("the {what}s are not in ascending order"));
    }
    let values = line.iter().skip(from).map(|s| s.parse().ok().filter(|v: &f64| v.is_finite()));
    let values: Option<Vec<f64>> = values.collect();
    Ok((number, values.ok_or("a value is no finite number")?))
}

const VALUES_HEADER: [&str; 3] = ["state", "v", "exact"];

/// `state,v,exact`: the states that [`policy`] lists; `exact` is empty where the policy does not lead
/// and without a model.
pub(super) fn values(variant: &Variant, values: &StateValues) -> Vec<u8> {
    let initial = initial_value(variant);
    let all = matches!(variant.discretiser, DiscretiserSpec::StateIndex);
    let mut csv = csv::Writer::from_writer(Vec::new());
    csv.write_record(VALUES_HEADER).expect(NEVER);
    for (s, &v) in values.v.iter().enumerate() {
        if all || !is_initial(&[v], initial) {
            let exact = values.exact.get(s).copied().flatten().map_or_else(String::new, float);
            csv.write_record([s.to_string(), float(v), exact]).expect(NEVER);
        }
    }
    csv_bytes(csv)
}

/// A state with its value and the exact one.
pub(super) type StoredValue = (usize, f64, Option<f64>);

/// Reads what [`values`] writes, for `n_states`.
pub(super) fn read_values(bytes: &[u8], n_states: usize) -> Result<Vec<StoredValue>, String> {
    let mut reader = csv::Reader::from_reader(bytes);
    if *reader.headers().map_err(|e| e.to_string())? != VALUES_HEADER[..] {
        return Err(format!(
            "holds no state values: its header is not `{}`",
            VALUES_HEADER.join(",")
        ));
    }
    let mut values = Vec::new();
    for (i, line) in reader.records().enumerate() {
        let line = line.map_err(|e| e.to_string())?;
        let state = line[0].parse().ok().filter(|s| *s < n_states);
        let (v, exact) = (line[1].parse().ok(), Some(&line[2]).filter(|x| !x.is_empty()));
        let exact = exact.map(str::parse::<f64>).transpose();
        match (state, v, exact) {
            (Some(state), Some(v), Ok(exact)) => values.push((state, v, exact)),
            _ => return Err(format!("line {}: no state among {n_states} with its value", i + 2)),
        }
    }
    Ok(values)
}

/// `sweep,largest_change,error_bound,switched`: how a planner came to its solution; empty what is not
/// known.
pub(super) fn sweeps(sweeps: &[Sweep]) -> Vec<u8> {
    let mut text = String::from("sweep,largest_change,error_bound,switched\n");
    for (i, Sweep { change, bound, switched }) in sweeps.iter().enumerate() {
        let bound = bound.map_or_else(String::new, float);
        let switched = switched.map_or_else(String::new, |n| n.to_string());
        writeln!(text, "{},{},{bound},{switched}", i + 1, float(*change)).expect(NEVER);
    }
    text.into_bytes()
}
