//! The keys of an experiment that say how its environment is set up and wrapped: attributes, reset
//! options, real-valued actions, frame skip, reward clipping, observation scaling.

use std::collections::BTreeMap;

use rhai::{Array, Dynamic, FnPtr, Map};

use super::diagnostic::{Diagnostic, suggest};
use super::draft::{DiscretiserDraft, Located, Spot, wrong};
use super::params::{json, number, show, whole};
use crate::env::{EnvSpec, MAX_ACTIONS};
use crate::mdp::{FieldKind, Schema};
use crate::shaping::Scale;

/// A map of plain values that a later `.with` merges into; `()` removes an entry.
#[derive(Debug, Clone, Default)]
pub(super) struct Entries {
    pub(super) values: serde_json::Map<String, serde_json::Value>,
    pub(super) spots: BTreeMap<String, Spot>,
}

impl Entries {
    pub(super) fn merge(
        &mut self,
        map: &Map,
        spot: impl Fn(&str) -> Spot,
    ) -> Result<(), Diagnostic> {
        for (key, value) in map {
            let place = spot(key);
            if value.is_unit() {
                self.values.remove(key.as_str());
                continue;
            }
            let value = json(value).map_err(|what| {
                Diagnostic::error(format!("`{key}` cannot be {what}")).at(place.place())
            })?;
            self.values.insert(key.to_string(), value);
            self.spots.insert(key.to_string(), place);
        }
        Ok(())
    }
}

/// Real-valued actions, as a script gives them.
#[derive(Debug, Clone)]
pub(super) enum ActionsDraft {
    /// `[[-1.0], [0.0], [1.0]]`.
    Rows(Vec<Vec<f64>>),
    /// `cells(n, |i| [..])`: the numbers of action i.
    Scripted(usize, FnPtr),
}

/// `normalise: true`, or ranges by field.
#[derive(Debug, Clone)]
pub(super) enum NormaliseDraft {
    /// Every field, from the range of the observation space.
    All,
    /// The fields named, from these ranges.
    Ranges(Vec<(String, [f64; 2], Spot)>),
}

/// What an experiment says about its environment beyond its id and arguments.
#[derive(Debug, Clone, Default)]
pub(super) struct SettingDraft {
    pub(super) attributes: Entries,
    pub(super) reset_options: Entries,
    pub(super) actions: Option<Located<ActionsDraft>>,
    pub(super) frame_skip: Option<u32>,
    pub(super) clip_reward: Option<Located<[f64; 2]>>,
    pub(super) normalise: Option<Located<NormaliseDraft>>,
}

impl SettingDraft {
    /// Whether `key` is one of those that [`Self::set`] reads.
    pub(super) fn knows(key: &str) -> bool {
        const KEYS: [&str; 6] =
            ["attributes", "reset_options", "actions", "frame_skip", "clip_reward", "normalise"];
        KEYS.contains(&key)
    }

    /// Sets `key`; `()` goes back to its default.
    pub(super) fn set(
        &mut self,
        key: &str,
        value: &Dynamic,
        spot: &dyn Fn(&str) -> Spot,
    ) -> Result<(), Diagnostic> {
        let here = || spot(key);
        if value.is_unit() {
            match key {
                "attributes" => self.attributes = Entries::default(),
                "reset_options" => self.reset_options = Entries::default(),
                "actions" => self.actions = None,
                "frame_skip" => self.frame_skip = None,
                "clip_reward" => self.clip_reward = None,
                _ => self.normalise = None,
            }
            return Ok(());
        }
        match key {
            "attributes" | "reset_options" => {
                let map = value.read_lock::<Map>().ok_or_else(|| wrong(key, "a map", value))?;
                let entries = match key {
                    "attributes" => &mut self.attributes,
                    _ => &mut self.reset_options,
                };
                entries.merge(&map, |name| spot(&format!("{key}.{name}")))?;
            }
            "actions" => {
                self.actions = Some(Located { value: actions(value)?, spot: here() });
            }
            "frame_skip" => {
                self.frame_skip = Some(whole("`frame_skip`", value, 1, 1_000_000)? as u32);
            }
            "clip_reward" => {
                let range = pair(value).filter(|[low, high]| low < high);
                let range = range
                    .ok_or_else(|| wrong(key, "a range [low, high] with low < high", value))?;
                self.clip_reward = Some(Located { value: range, spot: here() });
            }
            _ => {
                let draft = normalise(value, spot)?;
                self.normalise = draft.map(|value| Located { value, spot: here() });
            }
        }
        Ok(())
    }
}

/// `[low, high]`, both finite.
fn pair(value: &Dynamic) -> Option<[f64; 2]> {
    let list = value.read_lock::<Array>()?;
    let [low, high] = list.as_slice() else { return None };
    let finite = |x| number(x).filter(|x| x.is_finite());
    Some([finite(low)?, finite(high)?])
}

fn actions(value: &Dynamic) -> Result<ActionsDraft, Diagnostic> {
    let expected = "an array of actions such as [[-1.0], [0.0], [1.0]], bins([[lo, hi, n], ..]) or \
                    cells(n, |i| [..])";
    if let Some(list) = value.read_lock::<Array>() {
        let row = |item: &Dynamic| match item.read_lock::<Array>() {
            Some(numbers) => numbers.iter().map(number).collect(),
            None => number(item).map(|x| vec![x]),
        };
        let rows: Option<Vec<Vec<f64>>> = list.iter().map(row).collect();
        return rows
            .map(ActionsDraft::Rows)
            .ok_or_else(|| wrong("actions", "an array of numbers or of arrays of numbers", value));
    }
    match value.clone().flatten().try_cast::<DiscretiserDraft>() {
        Some(DiscretiserDraft::Cells { shape, cell }) => match shape.as_slice() {
            [n] if *n <= MAX_ACTIONS => Ok(ActionsDraft::Scripted(*n, cell)),
            _ => Err(Diagnostic::error(format!(
                "scripted actions are cells(n, |i| [..]) with one n of at most {MAX_ACTIONS}"
            ))),
        },
        Some(DiscretiserDraft::Bins(bins)) => {
            let mut rows = vec![Vec::new()];
            for bin in bins {
                if bin.field.is_ok() {
                    return Err(Diagnostic::error("the numbers of an action have no names")
                        .at(bin.spot.place())
                        .hint("give a bin for each, in order: bins([[lo, hi, n], ..])"));
                }
                if rows.len().saturating_mul(bin.n) > MAX_ACTIONS {
                    return Err(Diagnostic::error(format!("more than {MAX_ACTIONS} actions"))
                        .at(bin.spot.place()));
                }
                let levels = levels(bin.lo, bin.hi, bin.n);
                rows = rows
                    .iter()
                    .flat_map(|row| levels.iter().map(|&x| [row.as_slice(), &[x]].concat()))
                    .collect();
            }
            Ok(ActionsDraft::Rows(rows))
        }
        _ => Err(wrong("actions", expected, value)),
    }
}

/// `n` evenly spaced numbers from `lo` to `hi`, both included; the middle if there is one only.
fn levels(lo: f64, hi: f64, n: usize) -> Vec<f64> {
    match n {
        1 => vec![f64::midpoint(lo, hi)],
        n => (0..n)
            .map(|i| if i == n - 1 { hi } else { lo + (hi - lo) * i as f64 / (n - 1) as f64 })
            .collect(),
    }
}

fn normalise(
    value: &Dynamic,
    spot: &dyn Fn(&str) -> Spot,
) -> Result<Option<NormaliseDraft>, Diagnostic> {
    if let Ok(all) = value.as_bool() {
        return Ok(all.then_some(NormaliseDraft::All));
    }
    let Some(map) = value.read_lock::<Map>() else {
        return Err(wrong(
            "normalise",
            "true or a map of ranges #{ field: [low, high], .. }",
            value,
        ));
    };
    let mut ranges = Vec::new();
    for (field, range) in map.iter() {
        let place = spot(&format!("normalise.{field}"));
        let range = pair(range).filter(|[low, high]| low < high && (high - low).is_finite());
        let range = range.ok_or_else(|| {
            Diagnostic::error(format!(
                "the range of `{field}` is [low, high] with low < high, got {}",
                map.get(field).map(show).unwrap_or_default()
            ))
            .at(place.place())
        })?;
        ranges.push((field.to_string(), range, place));
    }
    Ok(Some(NormaliseDraft::Ranges(ranges)))
}

impl NormaliseDraft {
    /// The scale of each field that is normalised: to -1 at the low end of its range, 1 at the high.
    pub(super) fn scales(
        &self,
        schema: &Schema,
        spec: &EnvSpec,
        place: &Spot,
    ) -> Result<Vec<Scale>, Diagnostic> {
        match self {
            Self::All => {
                let fields = schema.fields.iter().enumerate();
                fields
                    .filter(|(_, field)| field.kind == FieldKind::Float)
                    .map(|(i, field)| {
                        if field.low.is_finite() && field.high.is_finite() {
                            return Ok(Scale { field: i, low: field.low, high: field.high });
                        }
                        let name = field.name;
                        Err(Diagnostic::error(format!("`{name}` of {} has no bounds", spec.id))
                            .at(place.place())
                            .hint(format!(
                                "state its range: `normalise: #{{ {name}: [lo, hi], .. }}`"
                            )))
                    })
                    .collect()
            }
            Self::Ranges(ranges) => {
                let names: Vec<&str> = schema.fields.iter().map(|f| f.name).collect();
                let mut scales = Vec::with_capacity(ranges.len());
                for (name, [low, high], spot) in ranges {
                    let field = names.iter().position(|known| known == name).ok_or_else(|| {
                        Diagnostic::error(format!("the state of {} has no field `{name}`", spec.id))
                            .at(spot.place())
                            .maybe_hint(suggest(name, names.iter().copied()))
                    })?;
                    if schema.fields[field].kind != FieldKind::Float {
                        return Err(Diagnostic::error(format!("`{name}` is no real number"))
                            .at(spot.place()));
                    }
                    scales.push(Scale { field, low: *low, high: *high });
                }
                scales.sort_by_key(|scale| scale.field);
                Ok(scales)
            }
        }
    }
}
