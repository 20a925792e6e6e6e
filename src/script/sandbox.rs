//! What Rhai's limits leave open: functions that block, allocate before their result is measured,
//! or show names that differ from one process to the next.

use std::rc::Rc;

use rhai::{Array, Dynamic, Engine, EvalAltResult, FnPtr, ImmutableString, Map, Position};

use super::diagnostic::Diagnostic;
use super::engine::Context;

type Fallible<T> = Result<T, Box<EvalAltResult>>;

fn fail<T>(diagnostic: Diagnostic) -> Fallible<T> {
    Err(Box::new(EvalAltResult::ErrorRuntime(Dynamic::from(diagnostic), Position::NONE)))
}

/// Registers the safe versions over the standard library's.
pub(super) fn register(engine: &mut Engine, context: &Rc<Context>) {
    operations(engine, context);
    no_clock(engine);
    strings(engine);
    function_names(engine);
}

/// Counts operations across the calls that native functions make back into the script.
fn operations(engine: &mut Engine, context: &Rc<Context>) {
    let context = context.clone();
    engine.on_progress(move |_| {
        let n = context.operations.get() + 1;
        context.operations.set(n);
        (n > context.max_operations.get()).then_some(Dynamic::UNIT)
    });
}

/// Closures in closures that a variable may hold, and values one may have captured by `curry`.
const MAX_NESTING: usize = 32;
/// Values that are looked at to find out.
const MAX_LOOKED_AT: usize = 10_000;

/// Whether a variable holds a closure around closures around …: they are dropped by recursion,
/// and 100,000 of them overflow the stack, which nothing can catch.
pub(super) fn too_deep(value: &Dynamic) -> bool {
    fn deep(value: &Dynamic, depth: usize, budget: &mut usize) -> bool {
        if depth > MAX_NESTING {
            return true;
        }
        if *budget == 0 {
            return false;
        }
        *budget -= 1;
        if let Some(f) = value.read_lock::<FnPtr>() {
            return f.iter_curry().count() > MAX_NESTING
                || f.iter_curry().any(|v| deep(v, depth + 1, budget));
        }
        if let Some(array) = value.read_lock::<Array>() {
            return array.iter().any(|v| deep(v, depth + 1, budget));
        }
        if let Some(map) = value.read_lock::<Map>() {
            return map.values().any(|v| deep(v, depth + 1, budget));
        }
        false
    }
    // Only closures are looked into: arrays and maps have limits of their own, and may be large.
    value.read_lock::<FnPtr>().is_some() && deep(value, 0, &mut { MAX_LOOKED_AT })
}

/// The error about it.
pub(super) fn nested<T>() -> Fallible<T> {
    fail(
        Diagnostic::error(format!("closures are nested more than {MAX_NESTING} deep"))
            .hint("does one capture itself, again and again?"),
    )
}

fn no_clock(engine: &mut Engine) {
    let sleep = |_: Dynamic| {
        fail::<()>(
            Diagnostic::error("scripts cannot sleep")
                .hint("they see no clock: a plan is the same every time"),
        )
    };
    engine.register_fn("sleep", move |seconds: i64| sleep(seconds.into()));
    engine.register_fn("sleep", move |seconds: f64| sleep(seconds.into()));
}

/// `replace` computes the length of its result before it builds it: 60 KB in which each of 60,000
/// letters is replaced by 60 KB would otherwise take 3.6 GB first and be refused then.
fn strings(engine: &mut Engine) {
    let max = engine.max_string_size();
    let replace = move |text: &mut ImmutableString, find: &str, by: &str| -> Fallible<()> {
        let found = text.matches(find).count();
        let length =
            (text.len() - found * find.len()).saturating_add(found.saturating_mul(by.len()));
        if length > max {
            let what = "Length of string".to_string();
            return Err(Box::new(EvalAltResult::ErrorDataTooLarge(what, Position::NONE)));
        }
        *text = text.replace(find, by).into();
        Ok(())
    };
    engine.register_fn("replace", replace);
    engine.register_fn("replace", move |text: &mut ImmutableString, find: &str, by: char| {
        replace(text, find, by.encode_utf8(&mut [0; 4]))
    });
    engine.register_fn("replace", move |text: &mut ImmutableString, find: char, by: &str| {
        replace(text, find.encode_utf8(&mut [0; 4]), by)
    });
    engine.register_fn("replace", move |text: &mut ImmutableString, find: char, by: char| {
        replace(text, find.encode_utf8(&mut [0; 4]), by.encode_utf8(&mut [0; 4]))
    });
}

/// A closure's name is a hash with a key that each process draws anew: no plan may depend on it.
fn function_names(engine: &mut Engine) {
    fn name(f: &FnPtr) -> ImmutableString {
        if f.is_anonymous() { "closure".into() } else { f.fn_name().into() }
    }
    engine.register_get("name", |f: &mut FnPtr| name(f));
    engine.register_fn("name", |f: &mut FnPtr| name(f));
    for print in ["print", "debug", "to_string", "to_debug"] {
        engine
            .register_fn(print, |f: &mut FnPtr| ImmutableString::from(format!("Fn({})", name(f))));
    }
    engine.register_fn("get_fn_metadata_list", Array::new);
    engine.register_fn("get_fn_metadata_list", |_: &str| Array::new());
    engine.register_fn("get_fn_metadata_list", |_: &str, _: i64| Array::new());
}
