//! `tiles(…)` and `fourier(…)`: discretisers that are none, but give features for linear values.

use std::rc::Rc;

use rhai::{Array, Dynamic, Engine, EvalAltResult, Map, NativeCallContext};

use super::builders::Call;
use super::diagnostic::Diagnostic;
use super::draft::{BinDraft, DiscretiserDraft, Located, Spot};
use super::engine::Context;
use super::params::{number, show, whole};
use super::world::field_of;
use crate::env::EnvSpec;
use crate::learn::AgentConfig;
use crate::learn::registry::AGENTS;
use crate::mdp::{FieldKind, Schema};
use crate::shaping::{Dim, FeatureKind, FeatureSpec, Features, MAX_WEIGHTS, Scale};

type Fallible<T> = Result<T, Box<EvalAltResult>>;

/// The most tilings, and the highest order.
const MOST: i64 = 1024;

/// `tiles(…)` or `fourier(…)` as it was written.
#[derive(Debug, Clone)]
pub(super) struct FeaturesDraft {
    kind: FeatureKind,
    /// The fields with their ranges and numbers of tiles, or the order.
    pub(super) ranges: Vec<BinDraft>,
    /// The order of the Fourier basis over all fields, where no range is written.
    order: Option<usize>,
}

/// Registers the builders.
pub(super) fn register(engine: &mut Engine, context: &Rc<Context>) {
    let c = context.clone();
    engine.register_fn("tiles", move |native: NativeCallContext, map: Map| -> Fallible<_> {
        let call = Call::new(&c, &native);
        call.finish(tiles_of_map(&call, &map))
    });
    let c = context.clone();
    engine.register_fn(
        "tiles",
        move |native: NativeCallContext, list: Array, tilings: Dynamic| -> Fallible<_> {
            let call = Call::new(&c, &native);
            call.finish((|| {
                let tilings = count("tilings", &tilings, &call.arg(1))?;
                let ranges = list.iter().enumerate();
                let ranges = ranges
                    .map(|(i, value)| tiled(Err(i), value, call.key(&i.to_string())))
                    .collect::<Result<_, _>>()?;
                Ok(draft(FeatureKind::Tiles(tilings), ranges, None))
            })())
        },
    );
    let c = context.clone();
    engine.register_fn("fourier", move |native: NativeCallContext, map: Map| -> Fallible<_> {
        let call = Call::new(&c, &native);
        call.finish(fourier_of_map(&call, &map))
    });
    let c = context.clone();
    engine.register_fn("fourier", move |native: NativeCallContext, order: i64| -> Fallible<_> {
        let call = Call::new(&c, &native);
        let order = call.finish(count("order", &order.into(), &call.arg(0)))?;
        Ok(draft(FeatureKind::Fourier, Vec::new(), Some(order)))
    });
}

fn draft(kind: FeatureKind, ranges: Vec<BinDraft>, order: Option<usize>) -> DiscretiserDraft {
    DiscretiserDraft::Features(FeaturesDraft { kind, ranges, order })
}

/// The number of tilings, or the order.
fn count(what: &str, value: &Dynamic, spot: &Spot) -> Result<usize, Diagnostic> {
    let n = whole(&format!("`{what}`"), value, 1, MOST).map_err(|d| d.at(spot.place()))?;
    Ok(n as usize)
}

fn tiles_of_map(call: &Call<'_>, map: &Map) -> Result<DiscretiserDraft, Diagnostic> {
    let tilings = map.get("tilings").ok_or_else(|| {
        Diagnostic::error("`tiles` does not say how many `tilings` there are")
            .hint("add, for example, `tilings: 8`")
    })?;
    let tilings = count("tilings", tilings, &call.key("tilings"))?;
    let fields = map.iter().filter(|(key, _)| *key != "tilings");
    let ranges = fields
        .map(|(key, value)| tiled(Ok(key.to_string()), value, call.key(key)))
        .collect::<Result<_, _>>()?;
    Ok(draft(FeatureKind::Tiles(tilings), ranges, None))
}

fn fourier_of_map(call: &Call<'_>, map: &Map) -> Result<DiscretiserDraft, Diagnostic> {
    let order = map.get("order").ok_or_else(|| {
        Diagnostic::error("`fourier` does not say which `order` it has")
            .hint("add, for example, `order: 3`")
    })?;
    let order = count("order", order, &call.key("order"))?;
    let mut ranges = Vec::new();
    for (key, value) in map.iter().filter(|(key, _)| *key != "order") {
        let (field, spot) = (Ok(key.to_string()), call.key(key));
        let wrong = || {
            Diagnostic::error(format!("`{key}` of `fourier` is [lo, hi], got {}", show(value)))
                .at(spot.place())
        };
        let list = value.read_lock::<Array>().ok_or_else(wrong)?;
        let [lo, hi] = list.as_slice() else { return Err(wrong()) };
        let (Some(lo), Some(hi)) = (number(lo), number(hi)) else { return Err(wrong()) };
        ranges.push(checked(BinDraft { field, lo, hi, n: order, spot })?);
    }
    let order = ranges.is_empty().then_some(order);
    Ok(draft(FeatureKind::Fourier, ranges, order))
}

/// What a field is called in messages.
fn label(field: &Result<String, usize>) -> String {
    match field {
        Ok(name) => format!("`{name}`"),
        Err(i) => format!("number {}", i + 1),
    }
}

/// The `[lo, hi, n]` of a field that is tiled.
fn tiled(
    field: Result<String, usize>,
    value: &Dynamic,
    spot: Spot,
) -> Result<BinDraft, Diagnostic> {
    let label = label(&field);
    let wrong = || {
        Diagnostic::error(format!("{label} of `tiles` is [lo, hi, n], got {}", show(value)))
            .at(spot.place())
    };
    let list = value.read_lock::<Array>().ok_or_else(wrong)?;
    let [lo, hi, n] = list.as_slice() else { return Err(wrong()) };
    let (Some(lo), Some(hi)) = (number(lo), number(hi)) else { return Err(wrong()) };
    let n = whole(&format!("the number of tiles of {label}"), n, 1, MAX_WEIGHTS as i64)
        .map_err(|d| d.at(spot.place()))? as usize;
    checked(BinDraft { field, lo, hi, n, spot: spot.clone() })
}

/// The range of a field, which goes upwards and is finite.
fn checked(range: BinDraft) -> Result<BinDraft, Diagnostic> {
    let BinDraft { field, lo, hi, spot, .. } = &range;
    if lo >= hi || !lo.is_finite() || !hi.is_finite() {
        return Err(Diagnostic::error(format!(
            "{} goes from {lo} to {hi}: the lower bound must be below the upper, both finite",
            label(field)
        ))
        .at(spot.place()));
    }
    Ok(range)
}

/// What features are resolved against.
pub(super) struct Surroundings<'a> {
    pub(super) spec: &'static EnvSpec,
    pub(super) schema: &'a Schema,
    pub(super) normalise: &'a [Scale],
    pub(super) agent: &'a Located<AgentConfig>,
}

/// The features of `draft`, their ranges in physical units; what there is to say about them goes to
/// `warnings`.
pub(super) fn resolve(
    draft: &FeaturesDraft,
    spot: &Spot,
    at: &Surroundings<'_>,
    warnings: &mut Vec<Diagnostic>,
) -> Result<FeatureSpec, Diagnostic> {
    let Surroundings { spec, schema, normalise, agent } = at;
    if agent.value.spec.linear.is_none() {
        let able = AGENTS.iter().filter(|a| a.linear.is_some()).map(|a| a.name);
        return Err(Diagnostic::error(format!(
            "`{}` cannot learn values that are linear in features",
            agent.value.spec.name
        ))
        .at(agent.spot.place())
        .hint(format!("these can: {}", able.collect::<Vec<_>>().join(", "))));
    }
    let mut dims = match draft.order {
        Some(order) => all_fields(order, at)?,
        None => {
            let mut dims = Vec::with_capacity(draft.ranges.len());
            for range in &draft.ranges {
                let field = field_of(range, schema, spec, "range")?;
                let scale = normalise.iter().find(|scale| scale.field == field);
                let physical = |x| scale.map_or(x, |scale: &Scale| scale.physical(x));
                let (lo, hi) = (physical(range.lo), physical(range.hi));
                dims.push(Dim { field, lo, hi, n: range.n });
            }
            dims
        }
    };
    dims.sort_by_key(|d| d.field);
    let features = FeatureSpec { kind: draft.kind, dims };
    let n_actions = schema.actions.len();
    let weights = features.n_features().and_then(|n| n.checked_mul(n_actions));
    if weights.is_none_or(|n| n > MAX_WEIGHTS) {
        let weights = weights.map_or("too many".into(), |n| n.to_string());
        return Err(Diagnostic::error(format!(
            "{features}, are {weights} weights for {n_actions} actions: {MAX_WEIGHTS} is the most"
        ))
        .hint(match draft.kind {
            FeatureKind::Tiles(_) => "use fewer tiles, tilings or fields",
            FeatureKind::Fourier => "use a lower order or fewer fields",
        }));
    }
    Features::new(&features).map_err(|e| Diagnostic::error(e.message))?;
    warnings.extend(alike(&features, schema).map(|d| d.at(spot.place())));
    Ok(features)
}

/// Every field that is a number, with the range that it is normalised from or has by itself.
fn all_fields(order: usize, at: &Surroundings<'_>) -> Result<Vec<Dim>, Diagnostic> {
    let fields = at.schema.fields.iter().enumerate();
    let numbers = fields.filter(|(_, f)| f.kind != FieldKind::Letter);
    let ranges = numbers.map(|(field, f)| {
        let scale = at.normalise.iter().find(|scale| scale.field == field);
        let [lo, hi] = scale.map_or([f.low, f.high], |scale| [scale.low, scale.high]);
        if lo.is_finite() && hi.is_finite() {
            return Ok(Dim { field, lo, hi, n: order });
        }
        Err(Diagnostic::error(format!(
            "`{}` of {} goes from {lo} to {hi}: the Fourier basis needs a finite range",
            f.name, at.spec.id
        ))
        .hint(format!(
            "name the fields: fourier(#{{ order: {order}, {}: [-1.0, 1.0], .. }})",
            f.name
        )))
    });
    ranges.collect()
}

/// Tilings that are offset alike along a field: there they tell states apart no better than one.
fn alike(features: &FeatureSpec, schema: &Schema) -> Option<Diagnostic> {
    let FeatureKind::Tiles(tilings) = features.kind else { return None };
    let different = |j: usize| tilings / gcd(tilings, 2 * j + 1);
    let (j, d) = features.dims.iter().enumerate().find(|(j, _)| different(*j) < tilings)?;
    Some(
        Diagnostic::warning(format!(
            "of {tilings} tilings only {} differ along `{}`",
            different(j),
            schema.fields[d.field].name
        ))
        .note(format!("along this field tilings are offset by {} parts of a tile", 2 * j + 1))
        .hint(
            "take a power of two, at least four times the number of fields \
             (Sutton & Barto 9.5.4)",
        ),
    )
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}
