//! The mathematical functions of scripts, as machine code calls them: [`crate::mdp::math`] and Rust's
//! own where those are exact.

use super::ir::Math1;
use crate::mdp::math;

/// Functions of one float by their names in scripts.
pub const UNARY: &[(&str, Math1)] = &[
    ("sin", sin),
    ("cos", cos),
    ("tan", tan),
    ("asin", asin),
    ("acos", acos),
    ("atan", atan),
    ("sinh", sinh),
    ("cosh", cosh),
    ("tanh", tanh),
    ("asinh", asinh),
    ("acosh", acosh),
    ("atanh", atanh),
    ("exp", exp),
    ("ln", ln),
    ("log", log10),
    ("sqrt", sqrt),
    ("to_radians", to_radians),
    ("to_degrees", to_degrees),
];

macro_rules! unary {
    ($($name:ident = $f:expr;)*) => {$(
        extern "C" fn $name(x: f64) -> f64 {
            $f(x)
        }
    )*};
}

unary! {
    sin = math::sin;
    cos = math::cos;
    tan = math::tan;
    asin = math::asin;
    acos = math::acos;
    atan = math::atan;
    sinh = math::sinh;
    cosh = math::cosh;
    tanh = math::tanh;
    asinh = math::asinh;
    acosh = math::acosh;
    atanh = math::atanh;
    exp = math::exp;
    ln = math::ln;
    log10 = math::log10;
    sqrt = f64::sqrt;
    to_radians = f64::to_radians;
    to_degrees = f64::to_degrees;
}

/// The nearest whole number, halves away from zero.
pub extern "C" fn round(x: f64) -> f64 {
    x.round()
}

/// What is behind the point, with the sign of `x`.
pub extern "C" fn fraction(x: f64) -> f64 {
    x.fract()
}

/// The angle of the point (`x`, `y`), given `y` first.
pub extern "C" fn atan2(y: f64, x: f64) -> f64 {
    math::atan2(y, x)
}

/// The logarithm of `x` to the base `base`.
pub extern "C" fn log(x: f64, base: f64) -> f64 {
    math::log(x, base)
}

/// √(x² + y²).
pub extern "C" fn hypot(x: f64, y: f64) -> f64 {
    math::hypot(x, y)
}

/// `x` to the power of `y`.
pub extern "C" fn pow(x: f64, y: f64) -> f64 {
    math::pow(x, y)
}

/// The remainder of the division towards zero, with the sign of `x`; NaN by zero.
pub extern "C" fn remainder(x: f64, y: f64) -> f64 {
    x % y
}
