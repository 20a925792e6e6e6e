//! A results folder read back: the plan its manifest and its script stand for, and its units.
//! Nothing is written: a finished study in a read-only folder will do.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::results::{Findings, START_FILE, rate, read_times};
use super::runs::Runs;
use crate::experiment::play::session;
use crate::experiment::{
    Checkpoint, Learned, Model, SEMANTICS, Store, StoreError, StoredUnit, Unit, audit_variant,
    units,
};
use crate::script::{Diagnostic, Host, Plan, SeedList, Source, StartModel, Variant, load, suggest};

/// A study that was run, or begun.
#[derive(Debug)]
pub struct Stored {
    /// Its folder.
    pub folder: PathBuf,
    /// Its plan, as it was run: with the episodes and seeds of the run.
    pub plan: Plan,
    /// Its units, of which some may be missing.
    pub store: Store,
    /// Every unit of the plan.
    pub units: Vec<Unit>,
    /// The command that runs what is missing.
    resume: String,
}

/// Why a study cannot be read back.
#[derive(Debug)]
pub enum StoredError {
    /// The script's fault.
    Script(Box<Diagnostic>),
    /// Anything else, with advice if there is any.
    Message(String, Option<String>),
}

impl StoredError {
    fn new(message: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::Message(message.into(), Some(hint.into()))
    }
}

impl From<Diagnostic> for StoredError {
    fn from(d: Diagnostic) -> Self {
        Self::Script(Box::new(d))
    }
}

impl From<StoreError> for StoredError {
    fn from(e: StoreError) -> Self {
        Self::Message(e.to_string(), None)
    }
}

impl Stored {
    /// Opens the results folder `folder`.
    ///
    /// # Errors
    /// If it is none, or its script no longer is the one that was run: then its units speak of
    /// something else.
    pub fn open(folder: &Path) -> Result<Self, StoredError> {
        let shown = folder.display();
        let manifest = manifest_of(folder)?;
        if !folder.join("script.rhai").exists() {
            return Err(StoredError::new(
                format!("{shown}: was stopped before anything was run"),
                "run the script again, into the same folder",
            ));
        }
        let mut plan = load(&folder.join("script.rhai"))?;
        if let Some(name) = manifest["study"].as_str() {
            plan.name = name.to_string();
        }
        let identity = &manifest["identity"];
        if identity["semantics"] != SEMANTICS {
            return Err(StoredError::new(
                format!(
                    "{shown}: was written by runner {}, whose training differs from this one's",
                    identity["runner"].as_str().unwrap_or("of another version")
                ),
                "run the script again, into another folder",
            ));
        }
        let options = adopt(&mut plan, identity, folder);
        let units = units(&plan);
        if let Some(what) = difference(&plan, &units, identity) {
            return Err(StoredError::new(
                format!("{shown}: {what}, so that its units no longer belong to it"),
                format!(
                    "put back the script that was run, or run this one: runner exec \
                     {shown}/script.rhai --out NEW"
                ),
            ));
        }
        let script = identity["script"]["name"].as_str().unwrap_or("script.rhai");
        Ok(Self {
            folder: folder.to_path_buf(),
            resume: format!("runner exec {script} --out {shown}{options}"),
            plan,
            store: Store::read_only(folder),
            units,
        })
    }

    /// The index of the variant called `name`; without a name that of the first.
    ///
    /// # Errors
    /// If there is none of that name.
    pub fn variant(&self, name: Option<&str>) -> Result<usize, StoredError> {
        let Some(name) = name else { return Ok(0) };
        let variants = &self.plan.variants;
        variants.iter().position(|v| v.name == name).ok_or_else(|| {
            let names: Vec<&str> = variants.iter().map(|v| v.name.as_str()).collect();
            StoredError::Message(
                format!("{}: there is no variant `{name}`", self.folder.display()),
                suggest(name, names),
            )
        })
    }

    /// The unit of a variant that was trained with `seed`; without a seed the first.
    ///
    /// # Errors
    /// If the plan has no such seed.
    pub fn unit(&self, variant: usize, seed: Option<u64>) -> Result<&Unit, StoredError> {
        let mut own = self.units.iter().filter(|u| u.variant == variant);
        own.find(|u| seed.is_none_or(|seed| u.seed == seed)).ok_or_else(|| {
            let Variant { name, seeds, .. } = &self.plan.variants[variant];
            StoredError::new(
                format!("variant `{name}` was not trained with seed {}", seed.unwrap_or_default()),
                format!("its seeds are {}", ranges(&seeds.0)),
            )
        })
    }

    /// A unit's contents.
    ///
    /// # Errors
    /// If it is missing, or not what was written.
    pub fn load(&self, unit: &Unit) -> Result<StoredUnit, StoredError> {
        if !self.store.has(unit)? {
            return Err(StoredError::new(
                format!(
                    "seed {} of variant `{}` has not been run to its end yet",
                    unit.seed, self.plan.variants[unit.variant].name
                ),
                format!("to go on: {}", self.resume),
            ));
        }
        Ok(self.store.load(unit)?)
    }

    /// What a unit has learned.
    ///
    /// # Errors
    /// As [`Self::load`], and if its agent learns nothing.
    pub fn learned(&self, unit: &Unit) -> Result<Learned, StoredError> {
        let variant = &self.plan.variants[unit.variant];
        self.load(unit)?.learned(variant).ok_or_else(|| {
            let agent = variant.agent.spec.name;
            if variant.agent.is_network() {
                let (name, shown) = (&variant.name, self.folder.display());
                return StoredError::new(
                    format!("variant `{name}` has no table: its agent `{agent}` learns a network"),
                    format!("to see it play: runner play {shown} --variant {name}"),
                );
            }
            StoredError::new(
                format!(
                    "variant `{}` has no policy: its agent `{agent}` learns none",
                    variant.name
                ),
                format!("to see random play: runner rollout {} --policy random", variant.env.id),
            )
        })
    }

    /// A network of a unit whose agent learns such.
    ///
    /// # Errors
    /// As [`Self::load`], and if there is no such network.
    pub fn model(&self, unit: &Unit, which: Checkpoint) -> Result<Model, StoredError> {
        let variant = &self.plan.variants[unit.variant];
        self.load(unit)?;
        let path = self.store.path(unit).join(which.file_name());
        let bad = |what: &str| StoredError::Message(format!("{}: {what}", path.display()), None);
        let model = self.store.model(unit, which)?.ok_or_else(|| bad("is not there"))?;
        let session = session(variant).map_err(|e| StoredError::Message(e.message, e.hint))?;
        model.fits(&session).map_err(|what| bad(&what))?;
        Ok(model)
    }

    /// The units that are there, and if some are not, what is missing and how to go on.
    ///
    /// # Errors
    /// If a unit was changed after it was written.
    pub fn present(&self) -> Result<(Vec<Unit>, Option<String>), StoredError> {
        let mut present = Vec::new();
        let mut missing = Vec::new();
        for unit in &self.units {
            let list = if self.store.has(unit)? { &mut present } else { &mut missing };
            list.push(unit.clone());
        }
        let own = |i: usize| missing.iter().filter(move |u| u.variant == i).map(|u| u.seed);
        let lines: Vec<String> = self
            .plan
            .variants
            .iter()
            .enumerate()
            .filter_map(|(i, v)| {
                let seeds: Vec<u64> = own(i).collect();
                (!seeds.is_empty()).then(|| format!("{} (seeds {})", v.name, ranges(&seeds)))
            })
            .collect();
        let note = (!missing.is_empty()).then(|| {
            format!(
                "incomplete: {} of {} units are there; missing: {}\nto go on: {}",
                present.len(),
                self.units.len(),
                lines.join(", "),
                self.resume
            )
        });
        Ok((present, note))
    }

    /// The statistics of the variants of which some of `present`, units of this study, are there;
    /// with the plan that holds these variants alone.
    ///
    /// # Errors
    /// If a unit cannot be read or a callback fails.
    pub fn findings(&self, host: &Host, present: &[Unit]) -> Result<(Plan, Findings), StoredError> {
        let times = read_times(&self.folder);
        let mut plan = self.plan.clone();
        plan.variants.clear();
        let mut findings =
            Findings { summaries: Vec::new(), audits: Vec::new(), steps_per_second: Vec::new() };
        for (i, variant) in self.plan.variants.iter().enumerate() {
            let own: Vec<&Unit> = present.iter().filter(|u| u.variant == i).collect();
            if own.is_empty() {
                continue;
            }
            let mut runs = Runs::default();
            for unit in &own {
                runs.push(&self.load(unit)?);
            }
            findings.summaries.push(runs.summary(variant));
            findings.audits.push(audit_variant(host, variant, None)?);
            findings.steps_per_second.push(rate(&times, present, i));
            let seeds = SeedList(own.iter().map(|u| u.seed).collect());
            plan.variants.push(Variant { seeds, ..variant.clone() });
        }
        Ok((plan, findings))
    }
}

/// The folder's `study.json`.
fn manifest_of(folder: &Path) -> Result<Value, StoredError> {
    let shown = folder.display();
    let path = folder.join("study.json");
    match std::fs::read(&path) {
        Ok(bytes) => serde_json::from_slice(&bytes).map_err(|e| {
            StoredError::Message(format!("{}: is not a manifest ({e})", path.display()), None)
        }),
        Err(_) if folder.is_file() => Err(StoredError::new(
            format!("{shown}: is a file, not a results folder"),
            "a script is run by `runner exec`, which makes a folder of results",
        )),
        Err(_) => {
            let what = if folder.is_dir() {
                "is not a results folder: it has no study.json"
            } else {
                "there is no such folder"
            };
            let hint = match studies_near(folder).as_slice() {
                [] => "`runner exec SCRIPT` writes results".to_string(),
                near => format!("there is {}", near.join(", ")),
            };
            Err(StoredError::new(format!("{shown}: {what}"), hint))
        }
    }
}

/// Results folders in `folder`, or if it does not exist beside it.
fn studies_near(folder: &Path) -> Vec<String> {
    let place = match folder.parent() {
        _ if folder.is_dir() => folder,
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("results"),
    };
    let Ok(entries) = std::fs::read_dir(place) else { return Vec::new() };
    let mut found: Vec<String> = entries
        .filter_map(|e| Some(e.ok()?.path()))
        .filter(|p| p.join("study.json").is_file())
        .map(|p| p.display().to_string())
        .collect();
    found.sort();
    found.truncate(8);
    found
}

/// Gives the plan's variants the episodes, seeds and networks with which they were run (`exec
/// --episodes`, `--seeds` and `--from` change them); returns these options.
fn adopt(plan: &mut Plan, identity: &Value, folder: &Path) -> String {
    let mut options = [const { String::new() }; 3];
    for variant in &mut plan.variants {
        let Some(run) = manifest_variant(identity, &variant.name) else { continue };
        if let Some(seeds) = run["seeds"].as_array() {
            let seeds = SeedList(seeds.iter().filter_map(Value::as_u64).collect());
            if seeds != variant.seeds {
                options[0] = format!(" --seeds {}", seeds.0.len());
                variant.seeds = seeds;
            }
        }
        if let Some(n) = run["identity"]["episodes"].as_u64().and_then(|n| u32::try_from(n).ok())
            && n != variant.episodes
        {
            options[1] = format!(" --episodes {n}");
            variant.episodes = n;
        }
        if let Some(digest) = run["identity"]["start"]["sha256"].as_str() {
            options[2] = format!(" --from {}", folder.join(START_FILE).display());
            variant.start = Some(StartModel { digest: digest.to_string(), file: None });
        }
    }
    options.concat()
}

fn manifest_variant<'a>(identity: &'a Value, name: &str) -> Option<&'a Value> {
    identity["variants"].as_array()?.iter().find(|v| v["name"] == name)
}

/// How the script differs from the one that was run, if that reaches a unit. What changes none
/// (a comment, a claim) is no difference.
fn difference(plan: &Plan, units: &[Unit], identity: &Value) -> Option<String> {
    let names = |list: &Value| -> Vec<String> {
        let names = list.as_array().into_iter().flatten();
        names.filter_map(|v| v["name"].as_str().map(str::to_string)).collect()
    };
    let run = names(&identity["variants"]);
    let now: Vec<&str> = plan.variants.iter().map(|v| v.name.as_str()).collect();
    let changed = plan.variants.iter().enumerate().find(|(i, v)| {
        let own = units.iter().filter(|u| u.variant == *i).map(|u| Value::from(u.hash.as_str()));
        manifest_variant(identity, &v.name).is_none_or(|run| run["units"] != own.collect::<Value>())
    });
    if changed.is_none() && run == now {
        return None;
    }
    let edited = |source: &Source, recorded: &Value| recorded["sha256"] != source.sha256();
    let sources = &plan.sources;
    let import = sources.imports.iter().find(|(path, s)| edited(s, &identity["imports"][path]));
    let file = match import {
        _ if edited(&sources.script, &identity["script"]) => "script.rhai".to_string(),
        Some((path, _)) => path.clone(),
        None => {
            return Some(
                "its script is the one that was run, but study.json was changed, or written by \
                 another version of runner"
                    .into(),
            );
        }
    };
    let what = match changed {
        Some((_, v)) if run.contains(&v.name) => format!("variant `{}` is another now", v.name),
        Some((_, v)) => format!("variant `{}` was not run", v.name),
        None => "it has other variants now".into(),
    };
    Some(format!("{file} was changed after the run: {what}"))
}

/// `0-19, 30`: numbers in ascending order, runs of them shortened.
fn ranges(numbers: &[u64]) -> String {
    let mut sorted = numbers.to_vec();
    sorted.sort_unstable();
    let runs = sorted.chunk_by(|a, b| a + 1 == *b).map(|run| match run {
        [one] => one.to_string(),
        [first, .., last] => format!("{first}-{last}"),
        [] => String::new(),
    });
    runs.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_seeds_are_shortened() {
        assert_eq!(ranges(&[0, 1, 2, 7, 9, 10]), "0-2, 7, 9-10");
        assert_eq!(ranges(&[5]), "5");
        assert_eq!(ranges(&[]), "");
    }
}
