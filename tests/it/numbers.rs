//! Numbers in scripts: comparisons, arithmetic and mathematics, at plan time and in callbacks.

use std::fmt::Write as _;

use runner::mdp::math;
use runner::script::Host;

use crate::language::{LAKE, holds, plan_of, potential, value};

type Unary = fn(f64) -> f64;

#[test]
fn comparisons_are_ieee() {
    for yes in [
        "1e-17 > 0.0",
        "INF == INF",
        "INF > 1.0",
        "1 == 1.0",
        "1.0 == 1",
        "2 > 1.5",
        "0.1 + 0.2 != 0.3",
        "0.0 == -0.0",
        "!(INF < INF)",
        "1e308 * 10.0 == INF",
        "9007199254740993 == 9007199254740992.0",
    ] {
        assert!(holds(yes), "{yes}");
    }
    for op in ["==", "<", "<=", ">", ">="] {
        assert!(!holds(&format!("(0.0 / 0.0) {op} 0.0")), "NaN {op} 0");
        assert!(!holds(&format!("1 {op} (0.0 / 0.0)")), "1 {op} NaN");
    }
    assert!(holds("(0.0 / 0.0) != (0.0 / 0.0)"));
    // Arrays compare element by element with the same `==`; `in` and `contains` do so too.
    assert!(holds("[1e-17] != [0.0]"));
    assert!(!holds("0.0 in [1e-17]"));
    assert!(!holds("[1e-17].contains(0.0)"));
    assert!(holds("[1e-17, 0.0].index_of(0.0) == 1"));
}

#[test]
fn switch_matches_bits_and_types() {
    assert_eq!(value("", "switch 2 { 1 => 10, 2 => 20, _ => 30 }"), 20.0);
    assert_eq!(value("", "switch 1.0 { 1 => 10, _ => 30 }"), 30.0, "an integer case is no float");
    assert_eq!(value("", "switch 7 { 0..5 => 1, 5..=7 => 2, _ => 3 }"), 2.0);
}

#[test]
fn arithmetic_follows_the_rules() {
    let cases: &[(&str, f64)] = &[
        ("1 + 2.0", 3.0),
        ("7 / 2", 3.0),
        ("-7 / 2", -3.0),
        ("-7 % 3", -1.0),
        ("7.5 % 2", 1.5),
        ("7 % 2.5", 2.0),
        ("7 / 2.0", 3.5),
        ("7.0 / 2", 3.5),
        ("-2 ** 2", 4.0),
        ("2 ** 3 ** 2", 512.0),
        ("2.0 ** -1", 0.5),
        ("2 ** 0.5", 2.0_f64.sqrt()),
        ("let x = 1; x += 0.5; x", 1.5),
        ("let x = 3.0; x -= 1; x", 2.0),
        ("let x = 3; x *= 1.5; x", 4.5),
        ("let x = 7.0; x /= 2; x", 3.5),
        ("let x = 7.5; x %= 2; x", 1.5),
        ("let x = 2; x **= 3; x", 8.0),
        ("let x = 2.0; x **= 0.5; x", 2.0_f64.sqrt()),
        ("let x = 2; x **= 0.5; x", 2.0_f64.sqrt()),
        ("1 << 3", 8.0),
        ("1 << 64", 0.0),
        ("6 & 3", 2.0),
        ("6 ^ 3", 5.0),
        ("min(1, 2.5)", 1.0),
        ("max(1, 2.5)", 2.5),
        ("min(3, 2)", 2.0),
        ("clamp(5, 0, 3)", 3.0),
        ("clamp(0.5, 1, 2)", 1.0),
        ("clamp(-1, 0.0, 2.0)", 0.0),
        ("sign(-2.5)", -1.0),
        ("sign(0)", 0.0),
        ("floor(-1.5)", -2.0),
        ("ceil(1.2)", 2.0),
        ("round(2.5)", 3.0),
        ("round(-2.5)", -3.0),
        ("to_int(-1.9)", -1.0),
        ("to_float(3) / 2", 1.5),
        ("abs(-3)", 3.0),
        ("abs(-3.5)", 3.5),
        ("-5.abs()", 5.0),
        ("floor(3)", 3.0),
        ("parse_float(\"0.1\")", 0.1),
        ("parse_int(\"-12\")", -12.0),
        ("[1, 2, 3].len()", 3.0),
        ("[1, 2, 3].reduce(|a, x| a + x, 0)", 6.0),
    ];
    for (body, expected) in cases {
        assert_eq!(value("", body), *expected, "{body}");
    }
    assert!(holds("1.0 / 0.0 == INF && is_nan(0.0 / 0.0) && is_finite(1) && !is_nan(1)"));
}

#[test]
fn integers_are_checked() {
    for body in [
        "9223372036854775807 + 1",
        "9223372036854775807 * 2",
        "-9223372036854775807 - 2",
        "1 / 0",
        "1 % 0",
        "2 ** 64",
        "2 ** -1",
        "abs(-9223372036854775807 - 1)",
        "-(-9223372036854775807 - 1)",
        "let x = 9223372036854775807; x += 1; x",
        "(-9223372036854775807 - 1) / -1",
        "to_int(1e30)",
        "(-9223372036854775807 - 1) % -1",
    ] {
        let plan = plan_of(&format!("fn f(s) {{ {body} }} {LAKE}"), &[]);
        let variant = &plan.variants[0];
        let host = Host::open(&plan).unwrap();
        let schema = variant.environment().unwrap().schema();
        let mut phi = host.callbacks().potential(potential(variant), &schema);
        assert!(phi.at(&[0.0; 4], 1).is_err(), "{body}");
    }
}

#[test]
fn mathematics_is_pinned_bit_for_bit() {
    let xs = [0.1, 0.7, 1.3, 2.9, -0.4, 1e-9, 12.34, 355.0 / 113.0];
    let unary: &[(&str, Unary)] = &[
        ("sin", math::sin),
        ("cos", math::cos),
        ("tan", math::tan),
        ("asin", math::asin),
        ("acos", math::acos),
        ("atan", math::atan),
        ("sinh", math::sinh),
        ("cosh", math::cosh),
        ("tanh", math::tanh),
        ("asinh", math::asinh),
        ("acosh", math::acosh),
        ("atanh", math::atanh),
        ("exp", math::exp),
        ("ln", math::ln),
        ("log", math::log10),
        ("sqrt", f64::sqrt),
        ("to_radians", f64::to_radians),
        ("to_degrees", f64::to_degrees),
    ];
    let mut body = String::new();
    let mut expected = Vec::new();
    for (name, f) in unary {
        for x in xs.iter().copied().filter(|x| f(*x).is_finite()) {
            write!(body, "print({name}({x:?})); print(({x:?}).{name}());").unwrap();
            expected.extend([f(x), f(x)]);
        }
    }
    for (x, y) in [(1.1, 2.3), (0.3, 0.7), (7.7, 1.5), (2.0, 0.5)] {
        write!(body,
            "print({x:?} ** {y:?}); print(pow({x:?}, {y:?})); print(atan({x:?}, {y:?})); print(hypot({x:?}, {y:?})); print(log({x:?}, {y:?}));\
             let z = {x:?}; z **= {y:?}; print(z); print({x:?} ** 3); print(pow({x:?}, 3));"
        ).unwrap();
        let cube = math::pow_int(x, 3);
        let power = math::pow(x, y);
        expected.extend([
            power,
            power,
            math::atan2(x, y),
            math::hypot(x, y),
            math::log(x, y),
            power,
            cube,
            cube,
        ]);
    }
    for (x, f) in [(2, math::sin as fn(f64) -> f64), (3, math::sin)] {
        write!(body, "print(sin({x}));").unwrap();
        expected.push(f(f64::from(x)));
    }
    let plan = plan_of(&format!("fn f(s) {{ 1 }} {body} {LAKE}"), &[]);
    assert_eq!(plan.printed.len(), expected.len());
    for (text, x) in plan.printed.iter().zip(&expected) {
        assert_eq!(text.parse::<f64>().unwrap().to_bits(), x.to_bits(), "{text} {x:?}");
    }
}
