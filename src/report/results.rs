//! The results folder: what belongs to it, and the files derived from its units.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::columns::{EpisodeColumns, summary_lines};
use super::curves::{Curve, CurvesPlot, NATIVE_RETURN, START_VALUE, VALUE_ERROR, curves_svg};
use super::manifest::{file_name, manifest};
use super::runs::Runs;
use super::summary::VariantSummary;
use super::tensorboard;
use crate::experiment::{
    Audit, Execution, Store, StoreError, Unit, units, write_atomically, write_atomically_with,
};
use crate::script::{Plan, Variant};

/// The network that training has started from, if one was given.
pub(super) const START_FILE: &str = "start.safetensors";

/// A study's folder.
#[derive(Debug)]
pub struct Results {
    /// Where it is.
    pub folder: PathBuf,
    /// Its units.
    pub store: Store,
    /// The script whose results of the same name were here before, if it was another.
    pub replaces: Option<String>,
}

/// Why a folder cannot hold a study's results.
#[derive(Debug)]
pub struct FolderError {
    /// What is in the way.
    pub message: String,
    /// What to do.
    pub hint: Option<String>,
}

impl From<StoreError> for FolderError {
    fn from(e: StoreError) -> Self {
        Self { message: e.to_string(), hint: None }
    }
}

/// What was found out about a study.
#[derive(Debug)]
pub struct Findings {
    /// Statistics per variant.
    pub summaries: Vec<VariantSummary>,
    /// The verdict on each variant's shaping.
    pub audits: Vec<Audit>,
    /// Steps per second and thread, per variant, over all units whose time is known.
    pub steps_per_second: Vec<Option<f64>>,
}

impl Results {
    /// Opens `folder` for `plan`, making it if need be, and writes the manifest and the script
    /// first, so that what cannot be written is known before anything is run. With `fresh` the
    /// plan's own units are removed, and nothing else.
    ///
    /// # Errors
    /// If the folder holds something else, or cannot be written.
    ///
    /// # Panics
    /// Never: the manifest is plain data.
    pub fn open(folder: &Path, plan: &Plan, jobs: usize, fresh: bool) -> Result<Self, FolderError> {
        let replaces = owned_by(folder, plan)?;
        if let Some(name) = plan.sources.imports.keys().find(|name| is_ours(name)) {
            return Err(FolderError {
                message: format!("the imported file `{name}` has the name of one of the results"),
                hint: Some("call it something else, or put it into a folder".into()),
            });
        }
        std::fs::create_dir_all(folder).map_err(|e| FolderError {
            message: format!("{}: cannot be made: {e}", folder.display()),
            hint: Some("choose another place with --out DIR".into()),
        })?;
        let write = |name: &str, bytes: &[u8]| write_atomically(&folder.join(name), bytes);
        let text = serde_json::to_string_pretty(&manifest(plan, jobs)).expect("plain data");
        write("study.json", format!("{text}\n").as_bytes())?;
        write("script.rhai", plan.sources.script.text.as_bytes())?;
        let start = plan.variants.iter().find_map(|v| v.start.as_ref()?.file.as_ref());
        if let Some(start) = start {
            write(START_FILE, &start.bytes)?;
        }
        for (path, source) in &plan.sources.imports {
            let target = folder.join(path);
            if let Some(parent) = target.parent() {
                std::fs::create_dir_all(parent).map_err(|e| FolderError {
                    message: format!("{}: cannot be made: {e}", parent.display()),
                    hint: None,
                })?;
            }
            write_atomically(&target, source.text.as_bytes())?;
        }
        let store = Store::open(folder)?;
        if fresh {
            for unit in units(plan) {
                store.remove(&unit)?;
            }
        }
        Ok(Self { folder: folder.to_path_buf(), store, replaces })
    }

    /// Writes every derived file: `timing.json`, `episodes.csv`, `summary.json`, `summary.csv`,
    /// `curves.svg`, and where a variant learns a network `values.svg`. All but the first depend on the plan alone.
    ///
    /// # Errors
    /// If a unit cannot be read or a file cannot be written.
    pub fn derive(
        &self,
        plan: &Plan,
        execution: &Execution,
        audits: Vec<Audit>,
    ) -> Result<(Findings, CurvesPlot), StoreError> {
        let steps_per_second = self.timing(plan, execution)?;
        let mut all = Vec::new();
        let path = self.folder.join("episodes.csv");
        let mut failed = None;
        write_atomically_with(&path, |file| {
            let mut csv = csv::Writer::from_writer(file);
            let columns = EpisodeColumns::of(plan);
            csv.write_record(columns.header())?;
            for i in 0..plan.variants.len() {
                let mut runs = Runs::default();
                for unit in execution.units.iter().filter(|u| u.variant == i) {
                    let stored = match self.store.load(unit) {
                        Ok(stored) => stored,
                        Err(e) => {
                            failed = Some(e);
                            return Err(std::io::Error::other("a unit cannot be read"));
                        }
                    };
                    for (episode, row) in stored.rows.iter().enumerate() {
                        csv.write_record(columns.line(plan, unit, episode, row))?;
                    }
                    runs.push(&stored);
                }
                all.push(runs);
            }
            csv.flush()
        })
        .map_err(|e| failed.take().unwrap_or(e))?;
        let runs = || plan.variants.iter().zip(&all);
        let summaries: Vec<VariantSummary> = runs().map(|(v, runs)| runs.summary(v)).collect();
        self.summary(plan, &summaries, &audits)?;
        let plot = plot(plan, &all);
        write_atomically(&self.folder.join("curves.svg"), curves_svg(&plot).as_bytes())?;
        let path = self.folder.join("values.svg");
        match values_plot(plan, &all) {
            Some(values) => write_atomically(&path, curves_svg(&values).as_bytes())?,
            // That of another study of the same name, which was here before.
            None if path.exists() => {
                std::fs::remove_file(&path)
                    .map_err(|e| StoreError::io(&path, "cannot be removed", &e))?;
            }
            None => {}
        }
        Ok((Findings { summaries, audits, steps_per_second }, plot))
    }

    fn summary(
        &self,
        plan: &Plan,
        summaries: &[VariantSummary],
        audits: &[Audit],
    ) -> Result<(), StoreError> {
        let variants: Vec<Value> =
            summaries.iter().zip(audits).map(|(s, a)| variant_json(s, a)).collect();
        let text = serde_json::to_string_pretty(&json!({
            "study": plan.name,
            "baseline": plan.baseline,
            "variants": variants,
        }))
        .expect("plain data");
        write_atomically(&self.folder.join("summary.json"), format!("{text}\n").as_bytes())?;
        let path = self.folder.join("summary.csv");
        write_atomically_with(&path, |file| {
            let mut csv = csv::Writer::from_writer(file);
            for line in summary_lines(summaries, audits) {
                csv.write_record(line)?;
            }
            csv.flush()
        })
    }

    /// Adds the new units' times to `timing.json`; returns steps per second per variant.
    fn timing(&self, plan: &Plan, execution: &Execution) -> Result<Vec<Option<f64>>, StoreError> {
        let path = self.folder.join("timing.json");
        let mut times = read_times(&self.folder);
        for f in &execution.finished {
            times.insert(f.unit.hash.clone(), (f.steps, f.seconds));
        }
        let text = serde_json::to_string_pretty(&times).expect("plain data");
        write_atomically(&path, format!("{text}\n").as_bytes())?;
        Ok((0..plan.variants.len()).map(|i| rate(&times, &execution.units, i)).collect())
    }
}

/// The learning curves of `plan`: returns, or where every variant predicts, the errors of its values.
fn plot(plan: &Plan, all: &[Runs]) -> CurvesPlot {
    let runs = || plan.variants.iter().zip(all);
    let title = plan.name.clone();
    if all.iter().all(Runs::has_errors) {
        let curves = runs().enumerate().map(|(i, (v, runs))| runs.error_curve(i, v)).collect();
        return CurvesPlot {
            title,
            quantity: VALUE_ERROR,
            window: Some(1),
            threshold: None,
            curves,
        };
    }
    let first = &plan.variants[0];
    let shared = plan.variants.iter().all(|v| v.threshold == first.threshold);
    CurvesPlot {
        title,
        quantity: NATIVE_RETURN,
        window: same_window(plan.variants.iter()),
        threshold: first.threshold.filter(|_| shared),
        curves: runs().enumerate().map(|(i, (v, runs))| runs.curve(i, v)).collect(),
    }
}

/// What networks believed at the start of episodes, and what these brought; `None` if no variant
/// learns one.
fn values_plot(plan: &Plan, all: &[Runs]) -> Option<CurvesPlot> {
    let networks =
        || plan.variants.iter().zip(all).enumerate().filter(|(_, (_, r))| r.has_starts());
    let curves: Vec<Curve> =
        networks().flat_map(|(i, (v, runs))| runs.start_curves(i, v)).collect();
    (!curves.is_empty()).then(|| CurvesPlot {
        title: plan.name.clone(),
        quantity: START_VALUE,
        window: same_window(networks().map(|(_, (v, _))| v)),
        threshold: None,
        curves,
    })
}

/// The window of rolling means, if it is the same for all.
fn same_window<'a>(mut variants: impl Iterator<Item = &'a Variant>) -> Option<usize> {
    let first = variants.next()?.window;
    variants.all(|v| v.window == first).then_some(first as usize)
}

/// How many steps a unit made and how many seconds it took, by its hash.
type Times = BTreeMap<String, (u64, f64)>;

/// What `timing.json` says. Times are a circumstance: a file that cannot be read counts as empty.
pub(super) fn read_times(folder: &Path) -> Times {
    let bytes = std::fs::read(folder.join("timing.json")).ok();
    bytes.and_then(|b| serde_json::from_slice(&b).ok()).unwrap_or_default()
}

/// Steps per second over a variant's units whose time is known.
pub(super) fn rate(times: &Times, units: &[Unit], variant: usize) -> Option<f64> {
    let own = units.iter().filter(|u| u.variant == variant);
    let (steps, seconds) = own
        .filter_map(|u| times.get(&u.hash))
        .fold((0u64, 0.0), |(steps, seconds), t| (steps + t.0, seconds + t.1));
    (seconds > 0.0).then(|| steps as f64 / seconds)
}

/// A variant's statistics and verdict as one JSON object: what expectations see as `r.<name>`.
///
/// # Panics
/// Never: both are plain data.
pub fn variant_json(summary: &VariantSummary, audit: &Audit) -> Value {
    let mut value = serde_json::to_value(summary).expect("plain data");
    value["audit"] = serde_json::to_value(audit).expect("plain data");
    value
}

/// Refuses a folder that holds another study or something else altogether; returns the name of the
/// script that a study of the same name came from, if it was another.
fn owned_by(folder: &Path, plan: &Plan) -> Result<Option<String>, FolderError> {
    let refuse = |message: String| {
        Err(FolderError {
            message: format!("{}: {message}", folder.display()),
            hint: Some("choose another place with --out DIR".into()),
        })
    };
    if folder.exists() && !folder.is_dir() {
        return refuse("is a file, not a results folder".into());
    }
    let manifest = folder.join("study.json");
    let Ok(bytes) = std::fs::read(&manifest) else {
        let ours = |name: &str| name.starts_with(".tmp-");
        let occupied = std::fs::read_dir(folder).is_ok_and(|mut entries| {
            entries.any(|e| e.is_ok_and(|e| !ours(&e.file_name().to_string_lossy())))
        });
        return if occupied {
            refuse("is not empty and not a results folder".into())
        } else {
            Ok(None)
        };
    };
    match serde_json::from_slice::<Value>(&bytes) {
        Ok(old) if old["study"] == plan.name.as_str() => {
            let name = old["identity"]["script"]["name"].as_str().map(str::to_string);
            Ok(name.filter(|name| *name != file_name(&plan.sources.script)))
        }
        Ok(old) => refuse(format!(
            "holds the results of the study {}, not of \"{}\"",
            old["study"], plan.name
        )),
        Err(e) => refuse(format!("study.json is not a manifest ({e})")),
    }
}

/// Whether an import, copied beside the script, would overwrite a file of the results.
fn is_ours(path: &str) -> bool {
    const FILES: [&str; 9] = [
        "study.json",
        "script.rhai",
        START_FILE,
        "episodes.csv",
        "summary.json",
        "summary.csv",
        "curves.svg",
        "values.svg",
        "timing.json",
    ];
    let folder = path.split('/').next().unwrap_or(path);
    FILES.contains(&path) || ["units", tensorboard::FOLDER].contains(&folder)
}
