//! Numbers in scripts. Three deviations from stock Rhai, all deliberate:
//!
//! 1. Comparisons of floats are IEEE 754's. Stock Rhai compares with an epsilon, so that
//!    `1e-17 > 0.0` is false and `NaN == 0.0` is true.
//! 2. Transcendental functions and `**` are [`crate::mdp::math`]'s, correctly rounded, the same on
//!    every platform.
//! 3. Conveniences: `clamp`, `pow`, `sign`, `ceil`; mathematical functions accept integers; the
//!    constants `PI`, `E`, `INF`.

use rhai::{Engine, EvalAltResult, Position};

use crate::jit::math::UNARY;
use crate::mdp::math;

type Fallible<T> = Result<T, Box<EvalAltResult>>;

fn arithmetic<T>(message: &str) -> Fallible<T> {
    Err(Box::new(EvalAltResult::ErrorArithmetic(message.into(), Position::NONE)))
}

/// Registers operators and functions on numbers.
pub(super) fn register(engine: &mut Engine) {
    // Fast operators would bypass what is registered here.
    engine.set_fast_operators(false);
    comparisons(engine);
    mathematics(engine);
    conveniences(engine);
}

fn comparisons(engine: &mut Engine) {
    macro_rules! compare {
        ($($op:tt),*) => {$(
            engine.register_fn(stringify!($op), |a: f64, b: f64| a $op b);
            engine.register_fn(stringify!($op), |a: i64, b: f64| (a as f64) $op b);
            engine.register_fn(stringify!($op), |a: f64, b: i64| a $op (b as f64));
        )*};
    }
    compare!(==, !=, <, <=, >, >=);
}

fn mathematics(engine: &mut Engine) {
    for &(name, f) in UNARY {
        engine.register_fn(name, move |x: f64| f(x));
        engine.register_fn(name, move |x: i64| f(x as f64));
    }
    engine.register_fn("atan", math::atan2);
    engine.register_fn("log", math::log);
    engine.register_fn("hypot", math::hypot);
    macro_rules! power {
        ($name:literal) => {
            engine.register_fn($name, math::pow);
            engine.register_fn($name, |x: f64, n: i64| math::pow_int(x, n));
            engine.register_fn($name, |x: i64, y: f64| math::pow(x as f64, y));
            engine.register_fn($name, |x: i64, n: i64| -> Fallible<i64> {
                match u32::try_from(n) {
                    Err(_) if n < 0 => arithmetic(&format!(
                        "Integer raised to a negative power: {x} ** {n} (write {x}.0)"
                    )),
                    Err(_) => arithmetic(&format!("Exponential overflow: {x} ** {n}")),
                    Ok(power) => x.checked_pow(power).map_or_else(
                        || arithmetic(&format!("Exponential overflow: {x} ** {n}")),
                        Ok,
                    ),
                }
            });
        };
    }
    power!("**");
    power!("pow");
    engine.register_fn("**=", |x: &mut f64, y: f64| *x = math::pow(*x, y));
    engine.register_fn("**=", |x: &mut f64, n: i64| *x = math::pow_int(*x, n));
}

/// The smaller of two; the first if they compare equal or either is NaN. (`f64::min` leaves the
/// sign of `min(0.0, -0.0)` to the platform.)
fn least(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}

/// The larger of two; the first if they compare equal or either is NaN.
fn greatest(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

fn clamp(x: f64, lo: f64, hi: f64) -> f64 {
    least(greatest(x, lo), hi)
}

fn conveniences(engine: &mut Engine) {
    engine.register_fn("clamp", clamp);
    engine.register_fn("clamp", |x: i64, lo: i64, hi: i64| x.max(lo).min(hi));
    engine.register_fn("clamp", |x: f64, lo: i64, hi: i64| clamp(x, lo as f64, hi as f64));
    engine.register_fn("clamp", |x: i64, lo: f64, hi: f64| clamp(x as f64, lo, hi));
    engine.register_fn("sign", |x: f64| {
        if x > 0.0 {
            1.0
        } else if x < 0.0 {
            -1.0
        } else {
            x
        }
    });
    engine.register_fn("sign", |x: i64| x.signum());
    engine.register_fn("ceil", f64::ceil);
    engine.register_fn("ceil", |x: i64| x);
    engine.register_fn("floor", |x: i64| x);
    engine.register_fn("round", |x: i64| x);
    for (name, f) in [("min", least as fn(f64, f64) -> f64), ("max", greatest)] {
        engine.register_fn(name, f);
        engine.register_fn(name, move |a: i64, b: f64| f(a as f64, b));
        engine.register_fn(name, move |a: f64, b: i64| f(a, b as f64));
    }
    engine.register_fn("is_nan", f64::is_nan);
    engine.register_fn("is_finite", f64::is_finite);
    engine.register_fn("is_infinite", f64::is_infinite);
    engine.register_fn("is_nan", |_: i64| false);
    engine.register_fn("is_finite", |_: i64| true);
    engine.register_fn("is_infinite", |_: i64| false);
}
