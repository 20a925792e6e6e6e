//! Experiments and studies while the script is still putting them together. Values are checked as
//! they come, with their places; what needs the whole (fields, callbacks, duplicates) is checked
//! when the plan is resolved.

use std::collections::BTreeMap;

use rhai::{Dynamic, FnPtr, Map};

use super::diagnostic::{Diagnostic, Place, suggest};
use super::features::FeaturesDraft;
use super::keys;
use super::params::{merge_agent, number, show, text, whole};
use super::plan::GoldenBudget;
use super::setting::{Entries, SettingDraft};
use super::shaping::ShapingDraft;
use super::value::MAX_DEPTH;
use crate::learn::ParamValue;
use crate::learn::registry::AgentSpec;

/// Where something was written, if that is known.
#[derive(Debug, Clone, Default)]
pub(super) struct Spot(pub(super) Option<Place>);

impl Spot {
    pub(super) fn place(&self) -> Option<Place> {
        self.0.clone()
    }
}

/// A value and where it was written.
#[derive(Debug, Clone)]
pub(super) struct Located<T> {
    pub(super) value: T,
    pub(super) spot: Spot,
}

/// `q_learning(#{ … })`.
#[derive(Debug, Clone)]
pub(super) struct AgentDraft {
    pub(super) spec: &'static AgentSpec,
    pub(super) params: BTreeMap<&'static str, ParamValue>,
    /// Parameters that are functions.
    pub(super) functions: BTreeMap<&'static str, Located<FnPtr>>,
}

/// `env("FrozenLake-v1", #{ … })`, or a bare id.
#[derive(Debug, Clone)]
pub(super) struct EnvDraft {
    pub(super) id: String,
    pub(super) kwargs: Entries,
}

/// One `[lo, hi, n]`.
#[derive(Debug, Clone)]
pub(super) struct BinDraft {
    /// The field's name, or its index in the array form.
    pub(super) field: Result<String, usize>,
    pub(super) lo: f64,
    pub(super) hi: f64,
    pub(super) n: usize,
    pub(super) spot: Spot,
}

/// `bins(…)`, `cells(…)`, `tiles(…)` or `fourier(…)`.
#[derive(Debug, Clone)]
pub(super) enum DiscretiserDraft {
    Bins(Vec<BinDraft>),
    Cells { shape: Vec<usize>, cell: FnPtr },
    Features(FeaturesDraft),
}

impl DiscretiserDraft {
    /// The fields that are cut up, with their ranges.
    pub(super) fn ranges(&self) -> &[BinDraft] {
        match self {
            Self::Bins(bins) => bins,
            Self::Features(features) => &features.ranges,
            Self::Cells { .. } => &[],
        }
    }
}

/// `experiment(#{ … })`.
#[derive(Debug, Clone, Default)]
pub(super) struct ExperimentDraft {
    pub(super) spot: Spot,
    pub(super) name: Option<Located<String>>,
    pub(super) env: Option<Located<EnvDraft>>,
    pub(super) agent: Option<Located<AgentDraft>>,
    pub(super) discretiser: Option<Located<DiscretiserDraft>>,
    pub(super) episodes: Option<u32>,
    pub(super) seeds: Option<Vec<u64>>,
    pub(super) max_steps: Option<u32>,
    pub(super) threshold: Option<f64>,
    pub(super) window: Option<u32>,
    pub(super) stop_when_solved: Option<Located<bool>>,
    pub(super) setting: SettingDraft,
    pub(super) shaping: ShapingDraft,
    pub(super) reward: Option<Located<FnPtr>>,
    pub(super) terms: BTreeMap<String, Located<FnPtr>>,
    pub(super) allowed: Option<Located<FnPtr>>,
    pub(super) notes: Option<String>,
}

/// `study(name, […])`.
#[derive(Debug, Clone)]
pub(super) struct StudyDraft {
    pub(super) name: String,
    pub(super) spot: Spot,
    pub(super) experiments: Vec<ExperimentDraft>,
    pub(super) expectations: Vec<(String, Located<FnPtr>)>,
    pub(super) baseline: Option<Located<String>>,
    pub(super) notes: Option<String>,
    pub(super) golden: GoldenBudget,
}

pub(super) fn wrong(key: &str, expected: &str, value: &Dynamic) -> Diagnostic {
    Diagnostic::error(format!("`{key}` is {expected}, got {}", show(value)))
}

pub(super) fn function(key: &str, signature: &str, value: &Dynamic) -> Result<FnPtr, Diagnostic> {
    value
        .clone()
        .flatten()
        .try_cast::<FnPtr>()
        .map(captured_now)
        .ok_or_else(|| wrong(key, &format!("a function {signature}"), value))
}

/// Gives a closure its own copy of what it captured, and of what that captured in turn. Rhai's
/// closures share their variables: those made in a loop would all see the loop variable's last
/// value.
pub(super) fn captured_now(mut f: FnPtr) -> FnPtr {
    detach(&mut f, 0);
    f
}

/// Deeper values than this are left as they are; freezing refuses them.
fn detach(f: &mut FnPtr, depth: usize) {
    for value in f.iter_curry_mut() {
        *value = detached(value, depth + 1);
    }
}

fn detached(value: &Dynamic, depth: usize) -> Dynamic {
    let value = value.clone().flatten();
    if depth > MAX_DEPTH {
        return value;
    }
    if let Some(mut f) = value.clone().try_cast::<FnPtr>() {
        detach(&mut f, depth);
        return f.into();
    }
    if let Some(array) = value.read_lock::<rhai::Array>() {
        return array.iter().map(|v| detached(v, depth + 1)).collect::<rhai::Array>().into();
    }
    if let Some(map) = value.read_lock::<Map>() {
        return map
            .iter()
            .map(|(k, v)| (k.clone(), detached(v, depth + 1)))
            .collect::<Map>()
            .into();
    }
    value
}

impl ExperimentDraft {
    /// Merges the keys of `map` into the draft; `spot` finds the place of a (dotted) key.
    pub(super) fn merge(
        &mut self,
        map: &Map,
        spot: &dyn Fn(&str) -> Spot,
    ) -> Result<(), Diagnostic> {
        for (key, value) in map {
            self.set(key, value, spot).map_err(|d| d.at(spot(key).place()))?;
        }
        Ok(())
    }

    fn set(
        &mut self,
        key: &str,
        value: &Dynamic,
        spot: &dyn Fn(&str) -> Spot,
    ) -> Result<(), Diagnostic> {
        let located = |f: FnPtr| Located { value: f, spot: spot(key) };
        let removed = value.is_unit();
        match key {
            "name" => self.name = Some(Located { value: self.name_of(value)?, spot: spot(key) }),
            "env" => self.set_env(value, spot)?,
            "agent" => self.set_agent(value, spot)?,
            "discretiser" if removed => self.discretiser = None,
            "discretiser" => {
                let draft = value.clone().flatten().try_cast::<DiscretiserDraft>();
                let value = draft.ok_or_else(|| {
                    wrong(key, "bins(..), cells(..), tiles(..) or fourier(..)", value)
                })?;
                self.discretiser = Some(Located { value, spot: spot(key) });
            }
            "episodes" => {
                self.episodes = Some(whole(&format!("`{key}`"), value, 1, 100_000_000)? as u32);
            }
            "seeds" => self.seeds = Some(seeds(value)?),
            "max_steps" => {
                self.max_steps = Some(whole(&format!("`{key}`"), value, 0, 1_000_000_000)? as u32);
            }
            "window" => self.window = Some(whole(&format!("`{key}`"), value, 1, 1_000_000)? as u32),
            "threshold" if removed => self.threshold = None,
            "threshold" => {
                let finite = number(value).filter(|x| x.is_finite());
                self.threshold = Some(finite.ok_or_else(|| wrong(key, "a finite number", value))?);
            }
            "stop_when_solved" if removed => self.stop_when_solved = None,
            "stop_when_solved" => {
                let stop = value.clone().flatten().as_bool();
                let stop = stop.map_err(|_| wrong(key, "true or false", value))?;
                self.stop_when_solved = Some(Located { value: stop, spot: spot(key) });
            }
            "reward" if removed => self.reward = None,
            "reward" => self.reward = Some(located(function(key, "(t) -> number", value)?)),
            "allowed" if removed => self.allowed = None,
            "allowed" => self.allowed = Some(located(function(key, "(s, a) -> bool", value)?)),
            "terms" if removed => self.terms.clear(),
            "terms" => self.set_terms(value, spot)?,
            "notes" => {
                self.notes = Some(notes(value)?);
            }
            key if SettingDraft::knows(key) => self.setting.set(key, value, spot)?,
            key if ShapingDraft::knows(key) => self.shaping.set(key, value, spot(key))?,
            unknown => {
                return Err(Diagnostic::error(format!("an experiment has no key `{unknown}`"))
                    .maybe_hint(suggest(unknown, keys::names())));
            }
        }
        Ok(())
    }

    #[expect(clippy::unused_self, reason = "reads as the other setters do")]
    fn name_of(&self, value: &Dynamic) -> Result<String, Diagnostic> {
        text(value).filter(|s| is_name(s)).ok_or_else(|| {
            wrong("name", "a string of 1 to 80 characters, without / or line breaks, not beginning or ending with a blank", value)
        })
    }

    fn set_env(&mut self, value: &Dynamic, spot: &dyn Fn(&str) -> Spot) -> Result<(), Diagnostic> {
        if let Some(id) = text(value) {
            let value = EnvDraft { id, kwargs: Entries::default() };
            self.env = Some(Located { value, spot: spot("env") });
        } else if let Some(draft) = value.clone().flatten().try_cast::<EnvDraft>() {
            self.env = Some(Located { value: draft, spot: spot("env") });
        } else if let (Some(map), Some(env)) = (value.read_lock::<Map>(), self.env.as_mut()) {
            env.value.kwargs.merge(&map, |key| spot(&format!("env.{key}")))?;
        } else {
            return Err(wrong("env", "an environment's id or env(id, #{..})", value));
        }
        Ok(())
    }

    fn set_agent(
        &mut self,
        value: &Dynamic,
        spot: &dyn Fn(&str) -> Spot,
    ) -> Result<(), Diagnostic> {
        if let Some(draft) = value.clone().flatten().try_cast::<AgentDraft>() {
            self.agent = Some(Located { value: draft, spot: spot("agent") });
        } else if let (Some(map), Some(agent)) = (value.read_lock::<Map>(), self.agent.as_mut()) {
            merge_agent(&mut agent.value, &map, |key| spot(&format!("agent.{key}")))?;
        } else {
            let names: Vec<&str> = crate::learn::registry::AGENTS.iter().map(|a| a.name).collect();
            let hint = match text(value).filter(|name| names.contains(&name.as_str())) {
                Some(name) => format!("write `{name}(#{{ .. }})`, without quotes"),
                None => format!("one of: {}", names.join(", ")),
            };
            return Err(wrong("agent", "an agent", value).hint(hint));
        }
        Ok(())
    }

    fn set_terms(
        &mut self,
        value: &Dynamic,
        spot: &dyn Fn(&str) -> Spot,
    ) -> Result<(), Diagnostic> {
        let map = value
            .read_lock::<Map>()
            .ok_or_else(|| wrong("terms", "a map of functions #{ name: |t| number, .. }", value))?;
        for (name, value) in map.iter() {
            let spot = spot(&format!("terms.{name}"));
            let place = spot.place();
            if TAKEN_COLUMNS.contains(&name.as_str()) {
                return Err(Diagnostic::error(format!(
                    "a term cannot be called `{name}`: episodes.csv has such a column already"
                ))
                .at(place));
            }
            if !is_name(name) {
                return Err(Diagnostic::error(
                    "a term's name has 1 to 80 characters, no / or line breaks, and neither begins \
                     nor ends with a blank",
                )
                .at(place));
            }
            if value.is_unit() {
                self.terms.remove(name.as_str());
                continue;
            }
            let f = function(name, "(t) -> number", value).map_err(|d| d.at(place))?;
            self.terms.insert(name.to_string(), Located { value: f, spot });
        }
        Ok(())
    }
}

/// Characters of a rationale.
const MAX_NOTES: usize = 10_000;

/// The rationale of an experiment or a study.
pub(super) fn notes(value: &Dynamic) -> Result<String, Diagnostic> {
    text(value).filter(|text| text.chars().nth(MAX_NOTES).is_none()).ok_or_else(|| {
        wrong("notes", &format!("a string of at most {MAX_NOTES} characters"), value)
    })
}

/// Columns of `episodes.csv` that no term may take.
const TAKEN_COLUMNS: [&str; 12] = [
    "value_error",
    "start_value",
    "start_return",
    "variant",
    "seed",
    "episode",
    "steps",
    "return",
    "learned_return",
    "shaping",
    "epsilon",
    "ending",
];

/// Whether `name` can stand in tables and in a file's name.
pub(super) fn is_name(name: &str) -> bool {
    let length = name.chars().count();
    (1..=80).contains(&length)
        && name.trim() == name
        && name != "."
        && name != ".."
        && !name.chars().any(|c| c.is_control() || c == '/' || c == '\\')
}

/// `20` → 0..20; `[3, 5]` → 3, 5.
fn seeds(value: &Dynamic) -> Result<Vec<u64>, Diagnostic> {
    let expected = "a number of seeds from 1 to 100000, or an array of different seeds";
    if let Some(array) = value.read_lock::<rhai::Array>() {
        let seeds: Option<Vec<u64>> =
            array.iter().map(|v| v.as_int().ok().and_then(|i| u64::try_from(i).ok())).collect();
        let seeds =
            seeds.filter(|s| !s.is_empty()).ok_or_else(|| wrong("seeds", expected, value))?;
        let mut sorted = seeds.clone();
        sorted.sort_unstable();
        if let Some([seed, _]) = sorted.array_windows().find(|[a, b]| a == b) {
            return Err(Diagnostic::error(format!("seed {seed} is listed twice")));
        }
        return Ok(seeds);
    }
    match value.as_int() {
        Ok(n @ 1..=100_000) => Ok((0..n as u64).collect()),
        _ => Err(wrong("seeds", expected, value)),
    }
}
