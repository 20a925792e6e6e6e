//! Functions of numbers: the crate's own, and Rhai's where there is nothing to add. Transcendental
//! ones are correctly rounded.

use super::{Call, Known, Parameter, arg, call, function};

const NUMBER: &str = "int | float";
const X: Parameter = arg("x", NUMBER);
const Y: Parameter = arg("y", NUMBER);

/// Of a number, a float.
const REAL: Call = call(&[X], "float", "");
const TO_FLOAT: &[Call] = &[REAL];
/// Of a number, one of its own type.
const SAME: &[Call] =
    &[call(&[arg("x", "int")], "int", ""), call(&[arg("x", "float")], "float", "")];
/// Of a float alone.
const OF_FLOAT: &[Call] = &[call(&[arg("x", "float")], "float", "")];
const TEST: &[Call] = &[call(&[X], "bool", "")];
const TEST_INT: &[Call] = &[call(&[arg("x", "int")], "bool", "")];
const TWO: &[Call] = &[call(&[X, Y], NUMBER, "")];

/// A call of `clamp` whose limits are of one type.
const CLAMP_INTS: [Parameter; 2] = [arg("lo", "int"), arg("hi", "int")];
const CLAMP_FLOATS: [Parameter; 2] = [arg("lo", "float"), arg("hi", "float")];
const CLAMP: &[Call] = &[
    call(&[X, CLAMP_FLOATS[0], CLAMP_FLOATS[1]], "float", ""),
    call(&[X, CLAMP_INTS[0], CLAMP_INTS[1]], NUMBER, ""),
];

pub(super) const MATHEMATICS: &[Known] = &[
    function("sin", TO_FLOAT, "the sine of x, in radians"),
    function("cos", TO_FLOAT, "the cosine of x, in radians"),
    function("tan", TO_FLOAT, "the tangent of x, in radians"),
    function("asin", TO_FLOAT, "the angle whose sine is x, in radians"),
    function("acos", TO_FLOAT, "the angle whose cosine is x, in radians"),
    function(
        "atan",
        &[REAL, call(&[arg("y", "float"), arg("x", "float")], "float", "")],
        "the angle whose tangent is x; or of the point (x, y), from -π to π",
    ),
    function("sinh", TO_FLOAT, "the hyperbolic sine"),
    function("cosh", TO_FLOAT, "the hyperbolic cosine"),
    function("tanh", TO_FLOAT, "the hyperbolic tangent"),
    function("asinh", TO_FLOAT, "the inverse hyperbolic sine"),
    function("acosh", TO_FLOAT, "the inverse hyperbolic cosine"),
    function("atanh", TO_FLOAT, "the inverse hyperbolic tangent"),
    function("to_radians", TO_FLOAT, "x degrees in radians"),
    function("to_degrees", TO_FLOAT, "x radians in degrees"),
    function("exp", TO_FLOAT, "e to the power of x"),
    function("ln", TO_FLOAT, "the natural logarithm"),
    function(
        "log",
        &[REAL, call(&[arg("x", "float"), arg("base", "float")], "float", "")],
        "the logarithm to base 10, or to another one",
    ),
    function("sqrt", TO_FLOAT, "the square root"),
    function("pow", TWO, "x to the power of y, as x ** y; of two integers an integer"),
    function(
        "hypot",
        &[call(&[arg("x", "float"), arg("y", "float")], "float", "")],
        "√(x² + y²) without overflow",
    ),
    function("abs", SAME, "without its sign"),
    function("sign", SAME, "1, 0 or -1 as x is above, at or below 0"),
    function("min", TWO, "the smaller one; the first if either is NaN"),
    function("max", TWO, "the larger one; the first if either is NaN"),
    function("clamp", CLAMP, "x, but at least lo and at most hi"),
    function("floor", SAME, "the largest whole number that is at most x"),
    function("ceil", SAME, "the smallest whole number that is at least x"),
    function("round", SAME, "the nearest whole number, halves away from 0"),
    function("int", OF_FLOAT, "x without its fraction, as a float"),
    function("fraction", OF_FLOAT, "what comes after the point"),
    function("to_int", &[call(&[X], "int", "")], "as an integer, without its fraction"),
    function("to_float", TO_FLOAT, "as a float"),
    function("is_nan", TEST, "whether x is not a number"),
    function("is_finite", TEST, "whether x is neither infinite nor NaN"),
    function("is_infinite", TEST, "whether x is infinite"),
    function("is_zero", TEST, "whether x is 0"),
    function("is_even", TEST_INT, "whether x is even"),
    function("is_odd", TEST_INT, "whether x is odd"),
];
