//! Discretisers.

use std::rc::Rc;

use rhai::{Array, Dynamic, Engine, FnPtr, Map, NativeCallContext};

use super::super::diagnostic::Diagnostic;
use super::super::draft::{BinDraft, DiscretiserDraft, Spot, captured_now};
use super::super::engine::Context;
use super::super::params::{number, show, whole};
use super::Call;
use crate::shaping::MAX_CELLS;

pub(super) fn register(engine: &mut Engine, context: &Rc<Context>) {
    engine.register_type_with_name::<DiscretiserDraft>("discretiser");
    let c = context.clone();
    engine.register_fn("bins", move |native: NativeCallContext, map: Map| {
        let call = Call::new(&c, &native);
        let dims = map.iter().map(|(key, value)| bin(Ok(key.to_string()), value, call.key(key)));
        call.finish(dims.collect::<Result<_, _>>().map(DiscretiserDraft::Bins))
    });
    let c = context.clone();
    engine.register_fn("bins", move |native: NativeCallContext, list: Array| {
        let call = Call::new(&c, &native);
        let dims =
            list.iter().enumerate().map(|(i, value)| bin(Err(i), value, call.key(&i.to_string())));
        call.finish(dims.collect::<Result<_, _>>().map(DiscretiserDraft::Bins))
    });
    let c = context.clone();
    engine.register_fn("cells", move |native: NativeCallContext, n: i64, cell: FnPtr| {
        let call = Call::new(&c, &native);
        call.finish(
            shape(&[n.into()])
                .map_err(|d| d.at(call.arg(0).place()))
                .map(|shape| DiscretiserDraft::Cells { shape, cell: captured_now(cell) }),
        )
    });
    let c = context.clone();
    engine.register_fn("cells", move |native: NativeCallContext, sizes: Array, cell: FnPtr| {
        let call = Call::new(&c, &native);
        call.finish(
            shape(&sizes)
                .map_err(|d| d.at(call.arg(0).place()))
                .map(|shape| DiscretiserDraft::Cells { shape, cell: captured_now(cell) }),
        )
    });
}

fn bin(field: Result<String, usize>, value: &Dynamic, spot: Spot) -> Result<BinDraft, Diagnostic> {
    let label = || match &field {
        Ok(name) => format!("`{name}`"),
        Err(i) => format!("number {}", i + 1),
    };
    let wrong = || {
        Diagnostic::error(format!("bin {} is [lo, hi, n], got {}", label(), show(value)))
            .at(spot.place())
    };
    let list = value.read_lock::<Array>().ok_or_else(wrong)?;
    let [lo, hi, n] = list.as_slice() else { return Err(wrong()) };
    let (Some(lo), Some(hi)) = (number(lo), number(hi)) else { return Err(wrong()) };
    let n = whole(&format!("the number of bins of {}", label()), n, 1, MAX_CELLS as i64)
        .map_err(|d| d.at(spot.place()))? as usize;
    if lo >= hi || !lo.is_finite() || !hi.is_finite() {
        return Err(Diagnostic::error(format!(
            "bin {} goes from {lo} to {hi}: the lower bound must be below the upper, both finite",
            label()
        ))
        .at(spot.place()));
    }
    Ok(BinDraft { field, lo, hi, n, spot })
}

fn shape(sizes: &[Dynamic]) -> Result<Vec<usize>, Diagnostic> {
    if sizes.is_empty() {
        return Err(Diagnostic::error("`cells` needs at least one size"));
    }
    let sizes: Vec<usize> = sizes
        .iter()
        .map(|n| whole("the number of cells", n, 1, MAX_CELLS as i64).map(|n| n as usize))
        .collect::<Result<_, _>>()?;
    let total = sizes.iter().try_fold(1usize, |product, n| product.checked_mul(*n));
    if total.is_none_or(|n| n > MAX_CELLS) {
        return Err(Diagnostic::error(format!("more than {MAX_CELLS} cells: use fewer")));
    }
    Ok(sizes)
}
