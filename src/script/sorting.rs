//! Sorting arrays. Rhai's own lets the standard library sort, which panics if a comparison contradicts
//! itself (a script's may, and so do NaNs), and goes on when one fails.

use std::cmp::Ordering;

use rhai::{Array, Dynamic, Engine, EvalAltResult, FnPtr, NativeCallContext, Position};

use super::diagnostic::Diagnostic;
use super::params::show;

type Fallible<T> = Result<T, Box<EvalAltResult>>;

/// Registers `sort`, `sort_by` and `sort_desc` over the standard library's.
pub(super) fn register(engine: &mut Engine) {
    for name in ["sort", "sort_by"] {
        engine.register_fn(name, |native: NativeCallContext, array: &mut Array, f: FnPtr| {
            let exceeds = |a: &Dynamic, b: &Dynamic| {
                exceeds(&f.call_within_context(&native, (a.clone(), b.clone()))?)
            };
            *array = merge_sorted(array, &exceeds)?;
            Ok(()) as Fallible<()>
        });
    }
    engine.register_fn("sort", |array: &mut Array| sort(array, Ordering::Greater));
    engine.register_fn("sort_desc", |array: &mut Array| sort(array, Ordering::Less));
}

/// What a script's comparison says: a positive integer or `false` if the first value comes later.
fn exceeds(said: &Dynamic) -> Fallible<bool> {
    let later = said.as_int().map(|n| n > 0).or_else(|_| said.as_bool().map(|first| !first));
    later.map_err(|_| {
        let d = Diagnostic::error(format!(
            "a comparison returns an integer, or true if the first value is not the larger, not {}",
            show(said)
        ));
        Box::new(EvalAltResult::ErrorRuntime(Dynamic::from(d), Position::NONE))
    })
}

fn sort(array: &mut Array, later: Ordering) -> Fallible<()> {
    let sortable = |v: &Dynamic| {
        v.is_int() || v.is_float() || v.is_char() || v.is_string() || v.is_bool() || v.is_unit()
    };
    let Some(first) = array.first() else { return Ok(()) };
    let kind = first.type_id();
    if array.iter().any(|v| v.type_id() != kind) {
        let what = "elements of different types cannot be sorted".into();
        return Err(Box::new(EvalAltResult::ErrorFunctionNotFound(what, Position::NONE)));
    }
    // Rhai leaves arrays of anything else as they are.
    if sortable(first) {
        *array = merge_sorted(array, &|a, b| Ok(order(a, b) == later))?;
    }
    Ok(())
}

/// The order of two values of one type; NaN comes last.
fn order(a: &Dynamic, b: &Dynamic) -> Ordering {
    if let (Ok(a), Ok(b)) = (a.as_float(), b.as_float()) {
        return a.partial_cmp(&b).unwrap_or_else(|| a.is_nan().cmp(&b.is_nan()));
    }
    if let (Ok(a), Ok(b)) = (a.as_immutable_string_ref(), b.as_immutable_string_ref()) {
        return a.cmp(&b);
    }
    let whole = |v: &Dynamic| {
        v.as_int()
            .ok()
            .or(v.as_char().ok().map(|c| i64::from(u32::from(c))))
            .or_else(|| v.as_bool().ok().map(i64::from))
    };
    whole(a).cmp(&whole(b))
}

/// `items` in order, equal ones as they were: merge sort, which ends whatever `exceeds` says.
fn merge_sorted(
    items: &[Dynamic],
    exceeds: &impl Fn(&Dynamic, &Dynamic) -> Fallible<bool>,
) -> Fallible<Array> {
    if items.len() < 2 {
        return Ok(items.to_vec());
    }
    let (left, right) = items.split_at(items.len() / 2);
    let mut left = merge_sorted(left, exceeds)?.into_iter().peekable();
    let mut right = merge_sorted(right, exceeds)?.into_iter().peekable();
    let mut sorted = Vec::with_capacity(items.len());
    while let (Some(a), Some(b)) = (left.peek(), right.peek()) {
        let next = if exceeds(a, b)? { right.next() } else { left.next() };
        sorted.extend(next);
    }
    sorted.extend(left.chain(right));
    Ok(sorted)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sorted(script: &str) -> String {
        let mut engine = Engine::new();
        register(&mut engine);
        engine.eval::<Dynamic>(script).unwrap().to_string()
    }

    #[test]
    fn sorts_as_the_standard_library_does_and_never_panics() {
        assert_eq!(sorted("let a = [3, 1, 2]; a.sort(); a"), "[1, 2, 3]");
        assert_eq!(sorted("let a = [3, 1, 2]; a.sort_desc(); a"), "[3, 2, 1]");
        assert_eq!(sorted("let a = ['c', 'a']; a.sort(); a"), "['a', 'c']");
        assert_eq!(sorted(r#"let a = ["b", "a", "c"]; a.sort(); a"#), r#"["a", "b", "c"]"#);
        assert_eq!(sorted("let a = [true, false]; a.sort(); a"), "[false, true]");
        assert_eq!(sorted("let a = [2.5, 0.0/0.0, 1.0]; a.sort(); a"), "[1.0, 2.5, NaN]");
        // Equal ones stay as they were.
        let by_tens = "let a = [21, 12, 22, 11]; a.sort(|x, y| x / 10 - y / 10); a";
        assert_eq!(sorted(by_tens), "[12, 11, 21, 22]");
        assert_eq!(sorted("let a = [3, 1, 2]; a.sort_by(|x, y| x <= y); a"), "[1, 2, 3]");
        let n = "let a = []; for i in 0..500 { a.push(i) }";
        for lie in ["1", "-1", "(x * 7919 + y * 104729) % 3 - 1"] {
            assert_eq!(sorted(&format!("{n} a.sort(|x, y| {lie}); a.len()")), "500");
        }
        let nans = "for i in 0..500 { a[i] = if i % 3 == 0 { 0.0 / 0.0 } else { -i.to_float() } }";
        assert_eq!(sorted(&format!("{n} {nans} a.sort(); a.len()")), "500");
    }

    #[test]
    fn a_failing_comparison_ends_it() {
        let mut engine = Engine::new();
        register(&mut engine);
        let error = engine.run("let a = [2, 1]; a.sort(|x, y| throw 5)").unwrap_err();
        assert!(error.to_string().contains('5'), "{error}");
        assert!(engine.run("let a = [2, 1]; a.sort(|x, y| \"more\")").is_err());
        assert!(engine.run("let a = [2, \"1\"]; a.sort()").is_err());
    }
}
