//! What Rhai's limits leave open: functions that block, allocate before their result is measured,
//! or show names that differ from one process to the next.

use std::rc::Rc;

use rhai::{Array, Dynamic, Engine, EvalAltResult, FnPtr, ImmutableString, Map, Position};

use super::diagnostic::Diagnostic;
use super::engine::Context;
use super::watch::Stop;

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

/// With fewer operations than this nothing is built that is nested deeply enough to overflow a
/// stack.
const HARMLESS: u64 = 2_000;

/// Counts operations across the calls that native functions make back into the script, and stops it
/// if it takes too long or too much memory. What [`stopped`] then finds in the error is which.
fn operations(engine: &mut Engine, context: &Rc<Context>) {
    let context = context.clone();
    engine.on_progress(move |_| {
        let n = context.operations.get() + 1;
        context.operations.set(n);
        if n > context.max_operations.get() {
            return Some(Dynamic::UNIT);
        }
        if n == HARMLESS {
            context.watched.announce();
        }
        context.watched.stop().map(Dynamic::from)
    });
}

/// Why `operations` has stopped a script that ended with this token; `None` if it did too much.
pub(super) fn stopped(token: &Dynamic) -> Option<Stop> {
    token.clone().try_cast()
}

/// Closures in closures that a variable may hold, and values one may have captured by `curry`.
const MAX_NESTING: usize = 32;
/// Closures, arrays and maps that one value may be made of, if there are closures among them: Rhai
/// counts the elements of arrays and maps, but not what closures hold.
const MAX_PARTS: usize = 20_000;

/// Whether a variable holds a closure around closures around …: they are dropped by recursion,
/// and 100,000 of them overflow the stack, which nothing can catch. A closure can hold arrays and
/// maps of closures, and is itself made by capturing a variable, which is shared from then on.
pub(super) fn too_deep(value: &Dynamic) -> bool {
    (value.is_shared() || value.is_fnptr()) && deep(value, 0, &mut { MAX_PARTS })
}

fn deep(value: &Dynamic, depth: usize, left: &mut usize) -> bool {
    let is_fnptr = value.is_fnptr();
    if !is_fnptr && !value.is_array() && !value.is_map() {
        return false;
    }
    if depth > MAX_NESTING || *left == 0 {
        return true;
    }
    *left -= 1;
    if is_fnptr {
        return value.read_lock::<FnPtr>().is_some_and(|f| {
            f.iter_curry().count() > MAX_NESTING || f.iter_curry().any(|v| deep(v, depth + 1, left))
        });
    }
    if let Some(array) = value.read_lock::<Array>() {
        return array.iter().any(|v| deep(v, depth + 1, left));
    }
    value.read_lock::<Map>().is_some_and(|map| map.values().any(|v| deep(v, depth + 1, left)))
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
