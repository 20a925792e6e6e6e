//! Functions that scripts can call besides Rhai's own: one list for registration checks,
//! suggestions, `list functions` and the docs. Agents are added from their own registry.

use crate::learn::registry::AGENTS;

/// A function of the script language.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Function {
    /// Its name.
    pub name: &'static str,
    /// How it is called.
    pub signature: String,
    /// What it does.
    pub doc: &'static str,
}

const BUILDERS: &[(&str, &str, &str)] = &[
    ("experiment", "experiment(map)", "one variant; its keys are listed under `list keys`"),
    (
        "with",
        "experiment.with(map)",
        "a copy with some keys changed; maps inside (agent, env, terms) are merged",
    ),
    ("study", "study(name, [experiments])", "the plan: variants to compare"),
    (
        "expect",
        "study.expect(text, |r| bool)",
        "a claim about the results, r.<variant>.<statistic>; decides the exit code",
    ),
    ("baseline", "study.baseline(name)", "the variant that the others are compared with"),
    (
        "golden",
        "study.golden(#{ episodes: 200, seeds: 2 })",
        "how much of the study its golden file covers; these are the defaults",
    ),
    ("notes", "study.notes(text)", "the rationale, carried into the manifest"),
    ("env", "env(id, #{kwargs})", "an environment with Gymnasium's constructor arguments"),
    (
        "generate_random_map",
        "generate_random_map(size, p, seed)",
        "Gymnasium's random map for FrozenLake's `desc`: tiles are ice with probability p",
    ),
    (
        "bins",
        "bins(#{ field: [lo, hi, n], .. }) or bins([[lo, hi, n], ..])",
        "uniform bins: NumPy's linspace and digitize, clamped; fields left out are ignored",
    ),
    ("cells", "cells(n, |s| i) or cells([n1, n2], |s| [i, j])", "scripted cells, numbered from 0"),
    (
        "tiles",
        "tiles(#{ field: [lo, hi, n], .., tilings: 8 }) or tiles([[lo, hi, n], ..], 8)",
        "tile coding for linear values: offset tilings of n tiles per field, without hashing",
    ),
    (
        "fourier",
        "fourier(order) or fourier(#{ order: 3, field: [lo, hi], .. })",
        "the Fourier basis for linear values, over all fields or those that are named",
    ),
    (
        "learned",
        "learned(eta)",
        "a potential of eta times the learner's own state values, eta · max Q(s, a)",
    ),
    ("constant", "constant(value)", "a schedule that does not change"),
    (
        "linear",
        "linear(start, end, n [, #{ steps: true }])",
        "from start to end over n episodes (or steps)",
    ),
    (
        "exponential",
        "exponential(start, factor, min [, #{ steps: true }])",
        "start · factorⁿ per episode (or step), at least min",
    ),
    (
        "visit_count",
        "visit_count() or visit_count(omega)",
        "a step size: 1/N(s, a), or N(s, a)^-omega",
    ),
    ("softmax", "softmax(temperature)", "exploration: actions weigh exp(Q / temperature)"),
    (
        "ucb",
        "ucb(c)",
        "exploration: the largest Q + c √(ln N(s) / N(s, a)), actions never tried first",
    ),
];

const MATHEMATICS: &[(&str, &str, &str)] = &[
    ("sin", "sin, cos, tan, asin, acos, atan, sinh, cosh, tanh, asinh, acosh, atanh", "radians"),
    ("exp", "exp(x), ln(x), log(x), log(x, base), sqrt(x)", "log(x) is to base 10"),
    ("pow", "pow(x, y), x ** y, hypot(x, y), atan(y, x)", "correctly rounded, as all of these"),
    ("abs", "abs(x), sign(x), min(x, y), max(x, y), clamp(x, lo, hi)", "integers and floats"),
    ("floor", "floor(x), ceil(x), round(x), to_int(x), to_float(x)", "rounding"),
    ("is_nan", "is_nan(x), is_finite(x), is_infinite(x)", "tests"),
];

/// Names among [`MATHEMATICS`], for suggestions.
pub(super) const MATHEMATICAL: &[&str] = &[
    "sin",
    "cos",
    "tan",
    "asin",
    "acos",
    "atan",
    "sinh",
    "cosh",
    "tanh",
    "asinh",
    "acosh",
    "atanh",
    "exp",
    "ln",
    "log",
    "sqrt",
    "pow",
    "hypot",
    "abs",
    "sign",
    "min",
    "max",
    "clamp",
    "floor",
    "ceil",
    "round",
    "to_int",
    "to_float",
    "is_nan",
    "is_finite",
    "is_infinite",
];

/// Every function, builders first, then agents, then mathematics.
pub fn functions() -> Vec<Function> {
    let plain = |list: &'static [(&'static str, &'static str, &'static str)]| {
        list.iter().map(|&(name, signature, doc)| Function {
            name,
            signature: signature.to_string(),
            doc,
        })
    };
    let agents = AGENTS.iter().map(|spec| {
        let params: Vec<String> =
            spec.params.iter().map(|p| format!("{}: {}", p.name, p.default)).collect();
        let signature = format!("{}(#{{ {} }})", spec.name, params.join(", "));
        Function { name: spec.name, signature, doc: spec.doc }
    });
    plain(BUILDERS).chain(agents).chain(plain(MATHEMATICS)).collect()
}
