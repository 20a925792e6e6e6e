//! The unit store: one immutable folder per unit, `units/ab/<hash>/`, named by the hash of all
//! that can change its result.
//!
//! A unit is written into a temporary folder beside its place and renamed into it when complete;
//! `result.json`, written last, holds the sizes and hashes of the other files. After a crash at any
//! moment a unit is therefore absent or whole. There are no lock files: two processes that run the
//! same unit write the same bytes, and one of them finds the place taken.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::record::{EpisodeRow, UnitRecord};
use super::unit::Unit;
use crate::learn::{QTable, argmax_tol};
use crate::mdp::Ending;
use crate::script::Variant;

/// Layout of the unit files; raised when it changes.
const SCHEMA: u32 = 1;

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

    fn io(path: &Path, what: &str, error: &io::Error) -> Self {
        Self::new(path, format!("{what}: {error}"))
    }
}

impl std::fmt::Display for StoreError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.path.display(), self.message)
    }
}

impl std::error::Error for StoreError {}

/// Writes `bytes` to `path`, as [`write_atomically_with`].
///
/// # Errors
/// As [`write_atomically_with`].
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
    write_atomically_with(path, |file| file.write_all(bytes))
}

/// Writes a file so that `path` holds either what it held or all of the new content, whatever
/// happens: temporary file in the same folder, flush, fsync, rename, fsync of the folder.
///
/// # Errors
/// If any of these fails; the old file is then untouched.
pub fn write_atomically_with(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), StoreError> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let fail = |e: &io::Error| StoreError::io(path, "cannot be written", e);
    let file = tempfile::Builder::new()
        .prefix(&temporary_prefix())
        .tempfile_in(folder)
        .map_err(|e| fail(&e))?;
    let mut buffer = io::BufWriter::new(file);
    write(&mut buffer).map_err(|e| fail(&e))?;
    // `into_inner` flushes and says so if it cannot; dropping the buffer would not.
    let file = buffer.into_inner().map_err(|e| fail(e.error()))?;
    file.as_file().sync_all().map_err(|e| fail(&e))?;
    // Temporary files are private; results are as readable as any file the user makes.
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let readable = fs::Permissions::from_mode(0o644);
        file.as_file().set_permissions(readable).map_err(|e| fail(&e))?;
    }
    file.persist(path).map_err(|e| fail(&e.error))?;
    sync_folder(folder).map_err(|e| fail(&e))
}

fn sync_folder(folder: &Path) -> io::Result<()> {
    // Folders cannot be opened for syncing on every platform; where they cannot, the rename is as
    // durable as the platform makes it.
    if cfg!(unix) { File::open(folder)?.sync_all() } else { Ok(()) }
}

/// Names this process, so that leftovers of dead ones can be told from work in progress.
fn temporary_prefix() -> String {
    format!(".tmp-{}-{}-", host(), std::process::id())
}

fn host() -> String {
    let name = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let name: String = name.chars().filter(|c| c.is_ascii_alphanumeric()).collect();
    if name.is_empty() { "host".into() } else { name }
}

/// Whether `name` is a temporary of a process of this machine that no longer runs.
fn is_stale(name: &str) -> bool {
    let Some(rest) = name.strip_prefix(&format!(".tmp-{}-", host())) else { return false };
    let Some(pid) = rest.split('-').next().and_then(|p| p.parse::<u32>().ok()) else {
        return false;
    };
    pid != std::process::id()
        && cfg!(target_os = "linux")
        && !Path::new(&format!("/proc/{pid}")).exists()
}

/// What `result.json` says.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct ResultFile {
    schema: u32,
    unit: String,
    env: String,
    seed: u64,
    episodes: u32,
    steps: u64,
    /// Shape of the table of action values.
    states: usize,
    actions: usize,
    files: std::collections::BTreeMap<String, FileMark>,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct FileMark {
    bytes: u64,
    sha256: String,
}

fn mark(bytes: &[u8]) -> FileMark {
    let sha256 = Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect();
    FileMark { bytes: bytes.len() as u64, sha256 }
}

/// A unit read back.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredUnit {
    /// Its episodes.
    pub rows: Vec<EpisodeRow>,
    /// Its greedy policy and values: `(state, values)` of every state whose values were learned.
    pub q: Vec<(usize, Vec<f64>)>,
    /// Number of states and actions of the table.
    pub shape: (usize, usize),
}

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
        match fs::remove_dir_all(&folder) {
            Err(e) if e.kind() != io::ErrorKind::NotFound => {
                Err(StoreError::io(&folder, "cannot be removed", &e))
            }
            _ => Ok(()),
        }
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
        if !record.sweeps.is_empty() {
            files.push(("sweeps.csv", sweeps(&record.sweeps)));
        }
        let result = ResultFile {
            schema: SCHEMA,
            unit: unit.hash.clone(),
            env: variant.env.id.to_string(),
            seed: unit.seed,
            episodes: record.rows.len() as u32,
            steps: record.steps(),
            states: record.q.as_ref().map_or(0, QTable::n_states),
            actions: record.q.as_ref().map_or(0, QTable::n_actions),
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
        sync_folder(&shelf).map_err(|e| StoreError::io(&shelf, "cannot be synced", &e))
    }

    /// The unit's files, checked against `result.json`.
    fn verified(&self, unit: &Unit) -> Result<(ResultFile, Vec<(String, Vec<u8>)>), StoreError> {
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
        let mut stored =
            StoredUnit { rows: Vec::new(), q: Vec::new(), shape: (result.states, result.actions) };
        for (name, bytes) in &files {
            let bad = |what: String| StoreError::new(&folder.join(name), what);
            match name.as_str() {
                "monitor.csv" => stored.rows = read_monitor(bytes).map_err(bad)?,
                "policy.csv" => stored.q = read_policy(bytes, result.actions).map_err(bad)?,
                _ => {}
            }
        }
        Ok(stored)
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

/// A float as the shortest text that reads back as the same float.
fn float(x: f64) -> String {
    format!("{x:?}")
}

fn csv_bytes(writer: csv::Writer<Vec<u8>>) -> Vec<u8> {
    writer.into_inner().expect("writing to memory does not fail")
}

const NEVER: &str = "writing to memory does not fail";

/// Stable-Baselines3's monitor format: a JSON comment, then r, l, t and columns of our own. The
/// time t is 0: wall time would make two equal runs differ; it is in `timing.json`.
fn monitor(variant: &Variant, record: &UnitRecord) -> Vec<u8> {
    let mut bytes =
        format!("#{{\"t_start\": 0.0, \"env_id\": \"{}\"}}\n", variant.env.id).into_bytes();
    let mut csv = csv::Writer::from_writer(Vec::new());
    let mut header = vec!["r", "l", "t", "learned_return", "shaping", "epsilon", "ending"];
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
        line.extend(row.terms.iter().map(|x| float(*x)));
        csv.write_record(&line).expect(NEVER);
    }
    bytes.extend(csv_bytes(csv));
    bytes
}

fn read_monitor(bytes: &[u8]) -> Result<Vec<EpisodeRow>, String> {
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(bytes);
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
            ending: match line.get(6) {
                Some("terminated") => Ending::Terminated,
                Some("truncated") => Ending::Truncated,
                _ => return Err(bad()),
            },
            terms: (7..line.len()).map(number).collect::<Result<_, _>>()?,
        });
    }
    Ok(rows)
}

/// `state,greedy,q_0,…`: every state whose values differ from the initial ones, the states of a
/// finite environment all.
fn policy(variant: &Variant, q: &QTable) -> Vec<u8> {
    let initial =
        variant.agent.params.contains_key("initial_q").then(|| variant.agent.float("initial_q"));
    let all = matches!(variant.discretiser, crate::script::DiscretiserSpec::StateIndex);
    let mut csv = csv::Writer::from_writer(Vec::new());
    let mut header = vec!["state".to_string(), "greedy".to_string()];
    header.extend((0..q.n_actions()).map(|a| format!("q_{a}")));
    csv.write_record(&header).expect(NEVER);
    for s in 0..q.n_states() {
        let row = q.row(s);
        if !all && initial.is_some_and(|x| row.iter().all(|v| v.to_bits() == x.to_bits())) {
            continue;
        }
        let mut line = vec![s.to_string(), argmax_tol(row).to_string()];
        line.extend(row.iter().map(|x| float(*x)));
        csv.write_record(&line).expect(NEVER);
    }
    csv_bytes(csv)
}

fn read_policy(bytes: &[u8], n_actions: usize) -> Result<Vec<(usize, Vec<f64>)>, String> {
    let mut reader = csv::Reader::from_reader(bytes);
    let mut table = Vec::new();
    for (i, line) in reader.records().enumerate() {
        let line = line.map_err(|e| e.to_string())?;
        let bad = || format!("line {} cannot be read", i + 2);
        let state = line.get(0).and_then(|s| s.parse().ok()).ok_or_else(bad)?;
        let values: Option<Vec<f64>> = line.iter().skip(2).map(|s| s.parse().ok()).collect();
        table.push((state, values.filter(|v| v.len() == n_actions).ok_or_else(bad)?));
    }
    Ok(table)
}

fn sweeps(changes: &[f64]) -> Vec<u8> {
    let mut text = String::from("sweep,largest_change\n");
    for (i, change) in changes.iter().enumerate() {
        text.push_str(&format!("{},{}\n", i + 1, float(*change)));
    }
    text.into_bytes()
}
