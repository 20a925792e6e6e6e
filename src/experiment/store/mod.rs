//! The unit store: one immutable folder per unit, `units/ab/<hash>/`, named by the hash of all
//! that can change its result.
//!
//! A unit is written into a temporary folder beside its place and renamed into it when complete;
//! `result.json`, written last, holds the sizes and hashes of the other files. After a crash at any
//! moment a unit is therefore absent or whole. There are no lock files: two processes that run the
//! same unit write the same bytes, and one of them finds the place taken.

mod atomic;
mod format;
mod learning;
mod model;
mod partial;
mod tensors;
mod weights;

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use self::atomic::{is_stale, sync_folder, temporary_prefix};
use self::format::{
    ResultFile, SCHEMA, StoredValue, initial_value, is_initial, mark, monitor, policy,
    read_monitor, read_policy, read_values, sweeps, values,
};
use self::learning::{learning, read_learning};
use self::model::model;
use self::weights::{Initial, weights};
use super::record::{EpisodeRow, Learned, UnitRecord, Values};
use super::unit::Unit;
use crate::learn::QTable;
use crate::learn::dqn::LogRow;
use crate::learn::dqn::Snapshot;
use crate::script::Variant;

pub use atomic::{write_atomically, write_atomically_with};
pub use model::{Checkpoint, Model, holds_model, read_model};
pub use weights::{holds_weights, read_weights};

/// A file could not be written or read, or holds something else than it should.
#[derive(Debug)]
pub struct StoreError {
    /// The file or folder.
    pub path: PathBuf,
    /// What happened.
    pub message: String,
}

impl StoreError {
    fn new(path: &Path, message: impl Into<String>) -> Self {
        Self { path: path.to_path_buf(), message: message.into() }
    }

    pub(crate) fn io(path: &Path, what: &str, error: &io::Error) -> Self {
        // Without the name of a temporary file, which says nothing to anybody.
        let text = error.to_string();
        Self::new(path, format!("{what}: {}", text.split(" at path ").next().unwrap_or(&text)))
    }
}

impl std::fmt::Display for StoreError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.path.display(), self.message)
    }
}

impl std::error::Error for StoreError {}

/// A unit read back.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredUnit {
    /// Its episodes.
    pub rows: Vec<EpisodeRow>,
    /// Its greedy policy and values: `(state, values)` of every state whose values were learned.
    /// Where values are linear, `(feature, weights)`.
    pub q: Vec<(usize, Vec<f64>)>,
    /// Its state values, if that is what was learned: `(state, value, exact value)`, of the same
    /// states.
    pub values: Vec<StoredValue>,
    /// Number of states (or features) and actions of the table; no actions if it holds state values.
    pub shape: (usize, usize),
}

impl StoredUnit {
    /// The values (or the weights), if the agent of `variant`, whose unit this is, keeps any.
    pub fn learned(&self, variant: &Variant) -> Option<Learned> {
        let (n_states, n_actions) = self.shape;
        let (initial, episodes) = (initial_value(variant), self.rows.len() as u32);
        if n_states == 0 {
            return None;
        }
        if let Some(initial) = Initial::of(variant, n_actions) {
            let mut experienced = vec![false; n_states];
            for (feature, row) in &self.q {
                experienced[*feature] = !initial.holds(*feature, row);
            }
            let weights = initial.filled(&self.q).weights().clone();
            return Some(Learned { values: Values::Q(weights), experienced, episodes });
        }
        if n_actions == 0 {
            let mut v = vec![initial.unwrap_or(0.0); n_states];
            let mut experienced = vec![false; n_states];
            for &(s, value, _) in &self.values {
                v[s] = value;
                experienced[s] = !is_initial(&[value], initial);
            }
            return Some(Learned { values: Values::V(v), experienced, episodes });
        }
        let mut q = QTable::new(n_states, n_actions, initial.unwrap_or(0.0));
        let mut experienced = vec![false; n_states];
        for (s, values) in &self.q {
            for (a, value) in values.iter().enumerate() {
                *q.get_mut(*s, a) = *value;
            }
            experienced[*s] = !is_initial(values, initial);
        }
        Some(Learned { values: Values::Q(q), experienced, episodes })
    }
}

/// Reads a `policy.csv` that holds every one of `n_states` states: what a unit of a finite
/// environment leaves behind.
///
/// # Errors
/// If it cannot be read or is something else: the line is named.
pub fn read_table(path: &Path, n_states: usize, n_actions: usize) -> Result<QTable, StoreError> {
    let bytes = fs::read(path).map_err(|e| StoreError::io(path, "cannot be read", &e))?;
    let bad = |what: String| StoreError::new(path, what);
    let rows = read_policy(&bytes, (n_states, n_actions)).map_err(bad)?;
    if let Some(missing) = (0..n_states).find(|s| rows.get(*s).is_none_or(|row| row.0 != *s)) {
        return Err(bad(format!("state {missing} of {n_states} is missing, or not in its place")));
    }
    let values = rows.into_iter().flat_map(|(_, values)| values).collect();
    Ok(QTable::from_values(n_actions, values))
}

/// Names and contents.
type Files = Vec<(String, Vec<u8>)>;

/// The units of a results folder.
#[derive(Debug, Clone)]
pub struct Store {
    root: PathBuf,
}

impl Store {
    /// The store in the results folder `results`; makes it, and removes temporaries that dead
    /// processes left behind.
    ///
    /// # Errors
    /// If the folder cannot be made or read.
    pub fn open(results: &Path) -> Result<Self, StoreError> {
        let root = results.join("units");
        fs::create_dir_all(&root).map_err(|e| StoreError::io(&root, "cannot be made", &e))?;
        let mut folders = vec![results.to_path_buf(), root.clone()];
        folders.extend(entries(&root)?.into_iter().filter(|p| p.is_dir()));
        for folder in folders {
            for path in entries(&folder)? {
                let name = path.file_name().map(|n| n.to_string_lossy().into_owned());
                if name.is_some_and(|n| is_stale(&n)) {
                    // Another process may be cleaning up too: gone is gone.
                    let _ = if path.is_dir() {
                        fs::remove_dir_all(&path)
                    } else {
                        fs::remove_file(&path)
                    };
                }
            }
        }
        Ok(Self { root })
    }

    /// The store in the results folder `results`, to be read only: nothing is made, nothing is
    /// cleaned up, and a folder that cannot be written to will do.
    pub fn read_only(results: &Path) -> Self {
        Self { root: results.join("units") }
    }

    /// Where a unit lies.
    pub fn path(&self, unit: &Unit) -> PathBuf {
        self.root.join(&unit.hash[..2]).join(&unit.hash)
    }

    /// Whether the unit is there and whole.
    ///
    /// # Errors
    /// If it is there but has been changed: the file is named.
    pub fn has(&self, unit: &Unit) -> Result<bool, StoreError> {
        let folder = self.path(unit);
        if !folder.join("result.json").is_file() {
            return Ok(false);
        }
        self.verified(unit).map(|_| true)
    }

    /// Removes a unit.
    ///
    /// # Errors
    /// If it is there and cannot be removed.
    pub fn remove(&self, unit: &Unit) -> Result<(), StoreError> {
        let folder = self.path(unit);
        let _ = fs::remove_file(folder.with_extension("partial"));
        match fs::remove_dir_all(&folder) {
            Err(e) if e.kind() != io::ErrorKind::NotFound => {
                Err(StoreError::io(&folder, "cannot be removed", &e))
            }
            _ => Ok(()),
        }
    }

    /// What a unit had come to when it was interrupted, if that is there and whole.
    pub(super) fn partial(&self, unit: &Unit) -> Option<Snapshot> {
        partial::decode(&unit.hash, &fs::read(self.path(unit).with_extension("partial")).ok()?)
    }

    /// Keeps what a unit has come to.
    ///
    /// # Errors
    /// If it cannot be written.
    pub(super) fn put_partial(&self, unit: &Unit, snapshot: &Snapshot) -> Result<(), StoreError> {
        let path = self.path(unit).with_extension("partial");
        let shelf = self.root.join(&unit.hash[..2]);
        fs::create_dir_all(&shelf).map_err(|e| StoreError::io(&shelf, "cannot be made", &e))?;
        write_atomically(&path, &partial::encode(&unit.hash, snapshot))
    }

    /// Keeps the logs of a unit that failed, for its user to look at. Returns where they are.
    ///
    /// # Errors
    /// If they cannot be written.
    pub(super) fn put_failed(
        &self,
        unit: &Unit,
        variant: &Variant,
        record: &UnitRecord,
    ) -> Result<PathBuf, StoreError> {
        let folder = self.path(unit).with_extension("failed");
        fs::create_dir_all(&folder).map_err(|e| StoreError::io(&folder, "cannot be made", &e))?;
        write_atomically(&folder.join("monitor.csv"), &monitor(variant, record))?;
        write_atomically(&folder.join("learning.csv"), &learning(&record.log))?;
        Ok(folder)
    }

    /// Stores a unit. If another process has stored it meanwhile, its copy stands.
    ///
    /// # Errors
    /// If anything cannot be written, for example because the disk is full; nothing half-written
    /// remains in the unit's place.
    pub fn commit(
        &self,
        unit: &Unit,
        variant: &Variant,
        record: &UnitRecord,
    ) -> Result<(), StoreError> {
        let folder = self.path(unit);
        let shelf = self.root.join(&unit.hash[..2]);
        fs::create_dir_all(&shelf).map_err(|e| StoreError::io(&shelf, "cannot be made", &e))?;
        let temporary = tempfile::Builder::new()
            .prefix(&temporary_prefix())
            .tempdir_in(&shelf)
            .map_err(|e| StoreError::io(&shelf, "cannot hold a temporary folder", &e))?;
        let mut files = vec![("monitor.csv", monitor(variant, record))];
        if let Some(q) = &record.q {
            files.push(("policy.csv", policy(variant, q)));
        }
        if let Some(w) = &record.weights {
            files.push(("weights.csv", weights(variant, w)));
        }
        if let Some(v) = &record.values {
            files.push(("values.csv", values(variant, v)));
        }
        if !record.sweeps.is_empty() {
            files.push(("sweeps.csv", sweeps(&record.sweeps)));
        }
        for network in &record.networks {
            let bytes = model((unit, variant), network);
            files.push((network.which.file_name(), bytes));
        }
        if !record.networks.is_empty() {
            files.push(("learning.csv", learning(&record.log)));
        }
        let result = ResultFile {
            schema: SCHEMA,
            unit: unit.hash.clone(),
            env: variant.env.id.to_string(),
            seed: unit.seed,
            episodes: record.rows.len() as u32,
            steps: record.steps(),
            states: record
                .q
                .as_ref()
                .map_or(record.values.as_ref().map_or(0, |v| v.v.len()), QTable::n_states),
            actions: record.q.as_ref().or(record.weights.as_ref()).map_or(0, QTable::n_actions),
            features: record.weights.as_ref().map_or(0, QTable::n_states),
            files: files.iter().map(|(name, bytes)| ((*name).into(), mark(bytes))).collect(),
        };
        let mut text = serde_json::to_vec_pretty(&result)
            .map_err(|e| StoreError::new(&folder, e.to_string()))?;
        text.push(b'\n');
        files.push(("result.json", text));
        for (name, bytes) in &files {
            let path = temporary.path().join(name);
            let written = File::create(&path).and_then(|mut f| {
                f.write_all(bytes).and_then(|()| f.flush()).and_then(|()| f.sync_all())
            });
            written.map_err(|e| StoreError::io(&folder.join(name), "cannot be written", &e))?;
        }
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let readable = fs::Permissions::from_mode(0o755);
            fs::set_permissions(temporary.path(), readable)
                .map_err(|e| StoreError::io(&folder, "cannot be made readable", &e))?;
        }
        let renamed = fs::rename(temporary.path(), &folder);
        if renamed.is_err() && !folder.join("result.json").is_file() {
            // Something unfinished is in the way: no unit of ours, since ours appear whole.
            let _ = fs::remove_dir_all(&folder);
            fs::rename(temporary.path(), &folder)
                .map_err(|e| StoreError::io(&folder, "cannot be put in place", &e))?;
        }
        sync_folder(&shelf).map_err(|e| StoreError::io(&shelf, "cannot be synced", &e))?;
        // What is left of earlier attempts says nothing any more; it is in nobody's way either.
        let _ = fs::remove_file(folder.with_extension("partial"));
        let _ = fs::remove_dir_all(folder.with_extension("failed"));
        Ok(())
    }

    /// The unit's files, checked against `result.json`.
    fn verified(&self, unit: &Unit) -> Result<(ResultFile, Files), StoreError> {
        let folder = self.path(unit);
        let path = folder.join("result.json");
        let corrupt = |path: &Path, what: &str| {
            StoreError::new(
                path,
                format!("{what}; remove the unit's folder, or run with --fresh, to run it again"),
            )
        };
        let text = fs::read(&path).map_err(|e| StoreError::io(&path, "cannot be read", &e))?;
        let result: ResultFile = serde_json::from_slice(&text)
            .map_err(|e| corrupt(&path, &format!("is damaged ({e})")))?;
        if result.schema != SCHEMA || result.unit != unit.hash || result.seed != unit.seed {
            return Err(corrupt(&path, "belongs to another unit or version"));
        }
        let mut files = Vec::new();
        for (name, expected) in &result.files {
            let path = folder.join(name);
            let bytes = fs::read(&path).map_err(|e| StoreError::io(&path, "cannot be read", &e))?;
            if mark(&bytes) != *expected {
                return Err(corrupt(&path, "was changed after it was written"));
            }
            files.push((name.clone(), bytes));
        }
        Ok((result, files))
    }

    /// Reads a unit back.
    ///
    /// # Errors
    /// If it is missing, damaged or edited.
    pub fn load(&self, unit: &Unit) -> Result<StoredUnit, StoreError> {
        let (result, files) = self.verified(unit)?;
        let folder = self.path(unit);
        let shape = (result.states + result.features, result.actions);
        let mut stored = StoredUnit { rows: Vec::new(), q: Vec::new(), values: Vec::new(), shape };
        for (name, bytes) in &files {
            let bad = |what: String| StoreError::new(&folder.join(name), what);
            match name.as_str() {
                "monitor.csv" => stored.rows = read_monitor(bytes).map_err(bad)?,
                "weights.csv" => stored.q = weights::read(bytes, shape).map_err(bad)?,
                "policy.csv" => stored.q = read_policy(bytes, stored.shape).map_err(bad)?,
                "values.csv" => {
                    stored.values = read_values(bytes, stored.shape.0).map_err(bad)?;
                }
                _ => {}
            }
        }
        Ok(stored)
    }

    /// A unit's network; `None` if it has no such.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn model(&self, unit: &Unit, which: Checkpoint) -> Result<Option<Model>, StoreError> {
        self.file(unit, which.file_name(), Model::decode)
    }

    /// What was written down of a network's learning; nothing if the unit has learned none.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn learning(&self, unit: &Unit) -> Result<Vec<LogRow>, StoreError> {
        Ok(self.file(unit, "learning.csv", read_learning)?.unwrap_or_default())
    }

    /// What a file of a unit holds, if there is one of this name.
    fn file<T>(
        &self,
        unit: &Unit,
        name: &str,
        read: impl FnOnce(&[u8]) -> Result<T, String>,
    ) -> Result<Option<T>, StoreError> {
        let (_, files) = self.verified(unit)?;
        let Some((_, bytes)) = files.iter().find(|file| file.0 == name) else { return Ok(None) };
        read(bytes).map(Some).map_err(|what| StoreError::new(&self.path(unit).join(name), what))
    }
}

fn entries(folder: &Path) -> Result<Vec<PathBuf>, StoreError> {
    let fail = |e: io::Error| StoreError::io(folder, "cannot be read", &e);
    let mut paths = Vec::new();
    for entry in fs::read_dir(folder).map_err(fail)? {
        paths.push(entry.map_err(fail)?.path());
    }
    Ok(paths)
}
