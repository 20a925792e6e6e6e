//! Which two of the state's numbers a picture spans, and where the others stand.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Value, json};

use super::stored::StoredError;
use crate::experiment::{Landscape, ListedState};
use crate::mdp::{Field, FieldKind};
use crate::script::{DiscretiserSpec, Variant, suggest};
use crate::shaping::Bins;

/// Places along an axis whose field is not cut into bins.
const UNBINNED: usize = 60;
/// The most places along an axis; of finer bins every second, third, … one is shown.
const MOST: usize = 400;

/// What the user wants to see.
#[derive(Debug, Clone, Default)]
pub struct Request {
    /// The fields across and along the page.
    pub fields: Option<(String, String)>,
    /// Where other fields stand.
    pub at: Vec<(String, f64)>,
}

/// An axis: one of the state's fields.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// The field's name; empty if there is nothing along this axis.
    pub name: String,
    /// Its index in the schema.
    pub field: usize,
    /// The lower end of the first place; for whole numbers the first of them.
    pub low: f64,
    /// The upper end of the last place; for whole numbers the last of them.
    pub high: f64,
    /// Number of places.
    pub n: usize,
    /// Whether the places are whole numbers.
    pub whole: bool,
    /// Whether it points down the page, as the rows of a map do.
    pub down: bool,
}

impl Axis {
    /// The value in the middle of a place.
    pub fn value(&self, place: usize) -> f64 {
        if self.whole {
            self.low + place as f64
        } else {
            self.low + (self.high - self.low) * ((place as f64 + 0.5) / self.n as f64)
        }
    }

    /// The values at the outer edges of the first and the last place.
    pub fn edges(&self) -> (f64, f64) {
        if self.whole { (self.low - 0.5, self.high + 0.5) } else { (self.low, self.high) }
    }

    fn whole(name: &str, field: usize, low: f64, high: f64) -> Self {
        let n = (high - low) as usize + 1;
        Self { name: name.into(), field, low, high, n, whole: true, down: name == "row" }
    }

    fn nothing() -> Self {
        Self {
            name: String::new(),
            field: usize::MAX,
            low: 0.0,
            high: 1.0,
            n: 1,
            whole: false,
            down: false,
        }
    }

    pub(super) fn json(&self) -> Value {
        json!({ "field": self.name, "low": self.low, "high": self.high, "n": self.n })
    }
}

/// Two axes, and where the other fields stand.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Across the page.
    pub x: Axis,
    /// Along the page.
    pub y: Axis,
    /// The other fields that matter.
    pub at: Vec<(String, f64)>,
    /// Whether it is the map of a grid world.
    pub is_map: bool,
    /// Values of all fields, the axes' aside.
    base: Vec<f64>,
    /// The fields at which states are told apart, the axes' aside.
    fixed: Vec<usize>,
}

impl Frame {
    /// The fields of the state at a place.
    pub(super) fn fields(&self, i: usize, j: usize) -> Vec<f64> {
        let mut fields = self.base.clone();
        for (axis, place) in [(&self.x, i), (&self.y, j)] {
            if let Some(field) = fields.get_mut(axis.field) {
                *field = axis.value(place);
            }
        }
        fields
    }

    /// The listed state at a place, if an episode can be and act in it.
    pub(super) fn listed(&self, states: &[ListedState], i: usize, j: usize) -> Option<usize> {
        let wanted = self.fields(i, j);
        let axes = [self.x.field, self.y.field].into_iter().filter(|&f| f < wanted.len());
        let matter: Vec<usize> = axes.chain(self.fixed.iter().copied()).collect();
        states.iter().position(|s| s.acts && matter.iter().all(|&f| s.fields[f] == wanted[f]))
    }
}

/// What there is to choose axes from.
struct Choice<'a> {
    landscape: &'a Landscape,
    variant: &'a Variant,
    /// Fields that tell states apart.
    telling: Vec<usize>,
}

/// The frames of a variant's pictures: one, or one per value of a remaining field that has two
/// common ones. Fields that nobody chose stand where the most was learned: `learned` lists the rows
/// of the table that hold anything.
///
/// # Errors
/// If `request` names a field that there is not, or one that cannot be an axis.
pub(super) fn frames(
    landscape: &Landscape,
    variant: &Variant,
    request: &Request,
    learned: &[usize],
) -> Result<Vec<Frame>, StoredError> {
    let choice = Choice { landscape, variant, telling: telling(landscape, variant) };
    let (x, y) = choice.axes(request)?;
    let mut base = match landscape.states.as_deref().map(acting) {
        // Values that occur together: a state from the middle of the list.
        Some(states) if !states.is_empty() => states[states.len() / 2].fields.clone(),
        _ => choice.middle(),
    };
    for (name, value) in &request.at {
        let field = choice.field(name)?;
        if field == x.field || field == y.field {
            return Err(StoredError::Message(
                format!("--at {name}: is an axis of the picture"),
                Some("choose the axes with --fields".into()),
            ));
        }
        choice.check_value(name, field, *value)?;
        base[field] = *value;
    }
    let fixed: Vec<usize> =
        choice.telling.iter().copied().filter(|&f| f != x.field && f != y.field).collect();
    choice.stand_where_learned(&mut base, &fixed, request, learned)?;
    let is_map = landscape.schema.grid.as_ref().is_some_and(|grid| {
        landscape.states.is_some()
            && (x.name.as_str(), y.name.as_str()) == ("col", "row")
            && (y.n, x.n) == (grid.rows.len(), grid.rows[0].chars().count())
    });
    let mut bases = vec![base];
    for &f in &fixed {
        let name = choice.fields()[f].name;
        let values = choice.values(f);
        if values.len() == 2
            && values.iter().all(|v| choice.is_common(f, *v))
            && request.at.iter().all(|(n, _)| n != name)
        {
            bases = bases
                .iter()
                .flat_map(|base| values.iter().map(|v| set(base.clone(), f, *v)))
                .collect();
        }
    }
    let at = |base: &[f64]| {
        // A map's states are told apart by their places alone.
        let fixed = fixed.iter().filter(|_| !is_map);
        fixed.map(|&f| (choice.fields()[f].name.to_string(), base[f])).collect()
    };
    let fixed_of_map = if is_map { Vec::new() } else { fixed.clone() };
    Ok(bases
        .into_iter()
        .take(4)
        .map(|base| Frame {
            x: x.clone(),
            y: y.clone(),
            at: at(&base),
            is_map,
            base,
            fixed: fixed_of_map.clone(),
        })
        .collect())
}

fn set(mut fields: Vec<f64>, field: usize, value: f64) -> Vec<f64> {
    fields[field] = value;
    fields
}

fn acting(states: &[ListedState]) -> Vec<&ListedState> {
    states.iter().filter(|s| s.acts).collect()
}

/// The fields that tell states apart: those with bins or features; on finite environments the first whole
/// numbers that do (a state's index does too, but says nothing); else all.
fn telling(landscape: &Landscape, variant: &Variant) -> Vec<usize> {
    let fields = &landscape.schema.fields;
    let cut: Vec<usize> =
        (0..fields.len()).filter(|&f| variant.discretiser.dim(f).is_some()).collect();
    if !cut.is_empty() {
        return cut;
    }
    let Some(states) = &landscape.states else { return (0..fields.len()).collect() };
    if landscape.schema.grid.is_some() {
        let place = |name| fields.iter().position(|f| f.name == name);
        return [place("row"), place("col")].into_iter().flatten().collect();
    }
    let mut telling: Vec<usize> =
        (0..fields.len()).filter(|&f| fields[f].kind == FieldKind::Int).collect();
    let (index, last_first): (Vec<usize>, Vec<usize>) =
        telling.iter().rev().partition(|&&f| distinct(states, &[f]) == states.len());
    for f in index.into_iter().chain(last_first) {
        let rest: Vec<usize> = telling.iter().copied().filter(|&g| g != f).collect();
        if distinct(states, &rest) == states.len() {
            telling = rest;
        }
    }
    telling
}

/// How many states can be told apart by these fields, all of them whole numbers.
fn distinct(states: &[ListedState], fields: &[usize]) -> usize {
    let key = |s: &ListedState| fields.iter().map(|&f| s.fields[f] as i64).collect::<Vec<_>>();
    states.iter().map(key).collect::<BTreeSet<_>>().len()
}

impl Choice<'_> {
    fn fields(&self) -> &[Field] {
        &self.landscape.schema.fields
    }

    /// A field's index by its name.
    fn field(&self, name: &str) -> Result<usize, StoredError> {
        self.fields().iter().position(|f| f.name == name).ok_or_else(|| {
            let names: Vec<&str> = self.fields().iter().map(|f| f.name).collect();
            let id = self.variant.env.id;
            StoredError::Message(format!("{id} has no field `{name}`"), suggest(name, names))
        })
    }

    /// The values of a field in which an episode can act; empty where states are not listed.
    fn values(&self, field: usize) -> Vec<f64> {
        let Some(states) = &self.landscape.states else { return Vec::new() };
        let mut values: Vec<f64> = acting(states).iter().map(|s| s.fields[field]).collect();
        values.sort_by(f64::total_cmp);
        values.dedup();
        values
    }

    /// Whether a tenth or more of the states have this value: a rare one is worth no picture.
    fn is_common(&self, field: usize, value: f64) -> bool {
        let states = acting(self.landscape.states.as_deref().unwrap_or_default());
        10 * states.iter().filter(|s| s.fields[field] == value).count() >= states.len()
    }

    fn check_value(&self, name: &str, field: usize, value: f64) -> Result<(), StoredError> {
        let values = self.values(field);
        if values.is_empty() || values.contains(&value) {
            return Ok(());
        }
        let values: Vec<String> = values.iter().map(f64::to_string).collect();
        Err(StoredError::Message(
            format!("--at {name}={value}: no episode is ever there"),
            Some(format!("`{name}` takes the values {}", values.join(", "))),
        ))
    }

    /// Moves the `fixed` fields of `base` that nobody chose to where the most was learned.
    fn stand_where_learned(
        &self,
        base: &mut [f64],
        fixed: &[usize],
        request: &Request,
        learned: &[usize],
    ) -> Result<(), StoredError> {
        let mut chosen = Vec::new();
        for (name, _) in &request.at {
            chosen.push(self.field(name)?);
        }
        // The value of a field in a row of the table: a state's own, or the middle of its bin.
        let bins = match &self.variant.discretiser {
            DiscretiserSpec::Bins(dims) => Bins::new(dims).ok(),
            _ => None,
        };
        let fields_of = |row: usize| {
            if let Some(states) = &self.landscape.states {
                return states.get(row).filter(|s| s.acts).map(|s| s.fields.clone());
            }
            let mut fields = base.to_vec();
            bins.as_ref()?.centre(row, &mut fields);
            Some(fields)
        };
        // Rows are counted under the place at which their fixed fields stand, in an order of their
        // own, so that of equals the first is taken.
        let mut counts: BTreeMap<Vec<u64>, (usize, usize)> = BTreeMap::new();
        for &row in learned {
            let Some(fields) = fields_of(row) else { continue };
            if chosen.iter().all(|&f| self.is_beside(f, fields[f], base[f])) {
                let place = fixed.iter().map(|&f| fields[f].to_bits()).collect();
                counts.entry(place).or_insert((0, row)).0 += 1;
            }
        }
        let mut best: Option<(usize, usize)> = None;
        for &(count, row) in counts.values() {
            if best.is_none_or(|(most, first)| (count, first) > (most, row)) {
                best = Some((count, row));
            }
        }
        let Some(fields) = best.and_then(|(_, row)| fields_of(row)) else { return Ok(()) };
        for &f in fixed.iter().filter(|f| !chosen.contains(f)) {
            if !self.is_beside(f, fields[f], base[f]) {
                base[f] = fields[f];
            }
        }
        Ok(())
    }

    /// Whether `value` of a field is in the bin whose middle is `middle`, or the same if there are
    /// no bins.
    fn is_beside(&self, field: usize, middle: f64, value: f64) -> bool {
        let bin = match &self.variant.discretiser {
            DiscretiserSpec::Bins(dims) => dims.iter().find(|d| d.field == field),
            _ => None,
        };
        let slack = bin.map_or(0.0, |d| (d.hi - d.lo) / d.n as f64 / 2.0);
        (middle - value).abs() <= slack
    }

    /// Where fields stand that nobody chose: in the middle of their bins, or of their range.
    fn middle(&self) -> Vec<f64> {
        let mut fields = self.landscape.middle();
        for (f, value) in fields.iter_mut().enumerate() {
            if let Some(d) = self.variant.discretiser.dim(f) {
                *value = f64::midpoint(d.lo, d.hi);
            }
        }
        fields
    }

    /// The two axes: those asked for, or the two fields with the most places, the one with fewer
    /// across. A field called `row` goes down the page.
    fn axes(&self, request: &Request) -> Result<(Axis, Axis), StoredError> {
        if let Some((x, y)) = &request.fields {
            if x == y {
                return Err(StoredError::Message(
                    format!("--fields {x},{y}: the two axes are different fields"),
                    None,
                ));
            }
            return Ok((self.axis(self.field(x)?)?, self.axis(self.field(y)?)?));
        }
        let mut axes: Vec<Axis> = self.telling.iter().filter_map(|&f| self.axis(f).ok()).collect();
        // Of axes with as many places, those of fields that are cut most finely.
        let parts = |field| self.variant.discretiser.dim(field).map_or(0, |d| d.n);
        axes.sort_by_key(|axis| std::cmp::Reverse((axis.n, parts(axis.field))));
        axes.truncate(2);
        axes.sort_by_key(|axis| (axis.down, axis.n, axis.field));
        let mut axes = axes.into_iter();
        let Some(x) = axes.next() else {
            let id = self.variant.env.id;
            return Err(StoredError::Message(
                format!("{id} has no field with a finite range to draw an axis for"),
                None,
            ));
        };
        Ok((x, axes.next().unwrap_or_else(Axis::nothing)))
    }

    fn axis(&self, field: usize) -> Result<Axis, StoredError> {
        let Field { name, kind, low, high, .. } = self.fields()[field];
        if let DiscretiserSpec::Bins(dims) = &self.variant.discretiser
            && let Some(d) = dims.iter().find(|d| d.field == field)
        {
            let n = d.n / d.n.div_ceil(MOST);
            let (low, high) = (d.lo, d.hi);
            return Ok(Axis { name: name.into(), field, low, high, n, whole: false, down: false });
        }
        // A map is drawn whole; elsewhere what no episode meets is left out.
        let own = self.values(field);
        let is_map = self.landscape.schema.grid.is_some();
        let (low, high) = match (own.first(), own.last(), self.variant.discretiser.dim(field)) {
            (Some(&low), Some(&high), _) if !is_map => (low, high),
            (_, _, Some(d)) if kind == FieldKind::Float => (d.lo, d.hi),
            _ => (low, high),
        };
        if !(low.is_finite() && high.is_finite()) || kind == FieldKind::Letter {
            return Err(StoredError::Message(
                format!("`{name}` cannot be an axis: it has neither bins nor a finite range"),
                None,
            ));
        }
        if kind == FieldKind::Int && high - low < MOST as f64 {
            return Ok(Axis::whole(name, field, low, high));
        }
        Ok(Axis { name: name.into(), field, low, high, n: UNBINNED, whole: false, down: false })
    }
}
