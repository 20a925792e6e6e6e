//! `tiles(…)` and `fourier(…)`.

use std::rc::Rc;

use rhai::{Array, Dynamic, Engine, Map, NativeCallContext};

use super::{Call, Fallible};
use crate::script::diagnostic::Diagnostic;
use crate::script::draft::{BinDraft, DiscretiserDraft, Spot};
use crate::script::engine::Context;
use crate::script::features::FeaturesDraft;
use crate::script::params::{number, show, whole};
use crate::shaping::{FeatureKind, MAX_WEIGHTS};

/// The most tilings, and the highest order.
const MOST: i64 = 1024;

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
                    .map(|(i, value)| tiled(Err(i), value, &call.key(&i.to_string())))
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
        .map(|(key, value)| tiled(Ok(key.to_string()), value, &call.key(key)))
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
        Err(i) => format!("range number {}", i + 1),
    }
}

/// The `[lo, hi, n]` of a field that is tiled.
fn tiled(
    field: Result<String, usize>,
    value: &Dynamic,
    spot: &Spot,
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
