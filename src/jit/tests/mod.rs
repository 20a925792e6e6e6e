//! Programs built by hand and at random, evaluated and as machine code, against Rust.

mod control;
mod indices;
#[cfg(all(feature = "jit", target_arch = "x86_64"))]
mod listing;
mod memory;
mod operations;
mod programs;
mod random;

use super::ir::{Binary, Compare, Expr, Label, Math1, Math2, Program, Stmt, Table, Type, Unary};
use super::{Kernel, Value};

/// A program without locals, arrays and tables.
fn program(n_inputs: usize, result: Type, body: Vec<Stmt>) -> Program {
    Program {
        n_inputs,
        locals: Vec::new(),
        arrays: Vec::new(),
        tables: Vec::new(),
        fuel: 1_000_000,
        result,
        body,
    }
}

fn unary(op: Unary, x: Expr) -> Expr {
    Expr::Unary(op, Box::new(x))
}

fn binary(op: Binary, x: Expr, y: Expr) -> Expr {
    Expr::Binary(op, Box::new(x), Box::new(y))
}

fn input(i: usize) -> Expr {
    Expr::Input(i, Type::Float)
}

/// The bits of a result; all NaNs are the same.
fn bits(value: Option<Value>) -> Option<u64> {
    value.map(|value| match value {
        Value::Float(x) if x.is_nan() => f64::NAN.to_bits(),
        Value::Float(x) => x.to_bits(),
        Value::Int(x) => x as u64,
        Value::Bool(x) => x.into(),
    })
}

/// A program on both tiers.
enum Tiers {
    Float([Kernel<f64>; 2]),
    Int([Kernel<i64>; 2]),
}

impl Tiers {
    fn new(program: &Program) -> Self {
        let machine = cfg!(feature = "jit");
        if program.result == Type::Float {
            let tiers = [Kernel::new(program.clone()), Kernel::evaluated(program.clone())];
            let tiers = tiers.map(Result::unwrap);
            assert_eq!(tiers[0].is_machine(), machine);
            Self::Float(tiers)
        } else {
            let tiers = [Kernel::new(program.clone()), Kernel::evaluated(program.clone())];
            let tiers = tiers.map(Result::unwrap);
            assert_eq!(tiers[0].is_machine(), machine);
            Self::Int(tiers)
        }
    }

    /// What both return, as bits: that of a trap is that of [`super::Output::TRAP`].
    fn call(&self, inputs: &[f64]) -> [u64; 2] {
        match self {
            Self::Float(tiers) => {
                tiers.each_ref().map(|k| bits(Some(Value::Float(k.call(inputs)))).unwrap())
            }
            Self::Int(tiers) => tiers.each_ref().map(|k| k.call(inputs) as u64),
        }
    }
}

/// Runs a program on both tiers and compares with what is right, `None` being a trap.
fn expect(tiers: &Tiers, inputs: &[f64], right: Option<Value>) {
    let trap = match tiers {
        Tiers::Float(_) => f64::NAN.to_bits(),
        Tiers::Int(_) => i64::MIN as u64,
    };
    let right = bits(right).unwrap_or(trap);
    let [machine, evaluated] = tiers.call(inputs);
    assert_eq!(evaluated, right, "evaluated, of {inputs:?}");
    assert_eq!(machine, right, "machine code, of {inputs:?}");
}

/// Floats at the edges of everything.
const FLOATS: [f64; 32] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    -0.5,
    1.5,
    -1.5,
    2.5,
    0.499_999_999_999_999_94,
    std::f64::consts::PI,
    -1e-17,
    f64::MIN_POSITIVE,
    -f64::MIN_POSITIVE,
    5e-324,
    -5e-324,
    2.225_073_858_507_201e-308,
    f64::MAX,
    f64::MIN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::NAN,
    9_007_199_254_740_991.0,
    9_007_199_254_740_992.0,
    -9_007_199_254_740_992.0,
    4_503_599_627_370_495.5,
    9_223_372_036_854_774_784.0,
    9_223_372_036_854_775_808.0,
    -9_223_372_036_854_775_808.0,
    -9_223_372_036_854_777_856.0,
    1e300,
    7.0,
];

/// Integers at the edges of everything.
const INTS: [i64; 20] = [
    0,
    1,
    -1,
    2,
    -2,
    3,
    7,
    -7,
    63,
    i64::MAX,
    i64::MAX - 1,
    i64::MIN,
    i64::MIN + 1,
    1 << 53,
    (1 << 53) + 1,
    -(1 << 53) - 1,
    1 << 32,
    3_037_000_500,
    -3_037_000_500,
    1 << 62,
];
