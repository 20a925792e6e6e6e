//! What a callback costs: as machine code, evaluated, and the same function written in Rust.
//!
//! A figure is for [`CALLS`] calls, one for each of as many states; the throughput is that of calls.
//! The call itself, which nothing can do without, is `floor`.

#![allow(missing_docs)]

use std::hint::black_box;

use divan::Bencher;
use divan::counter::ItemsCount;
use runner::jit::ir::{Binary, Compare, Expr, Program, Stmt, Type, Unary};
use runner::jit::{Kernel, Output, math};

fn main() {
    divan::main();
}

/// States of which each is visited once in a round.
const CALLS: usize = 4096;

/// States all over the bounds of CartPole, in no order (Weyl sequences).
fn states() -> Vec<[f64; 4]> {
    let roots = [2.0f64, 3.0, 5.0, 7.0].map(f64::sqrt);
    let scale = [2.6, 3.2, 0.25, 2.2];
    (0..CALLS)
        .map(|i| std::array::from_fn(|k| ((i as f64 * roots[k]).fract() * 2.0 - 1.0) * scale[k]))
        .collect()
}

fn run<R>(bencher: Bencher, f: impl Fn(&[f64; 4]) -> R) {
    let states = states();
    bencher.counter(ItemsCount::new(CALLS)).bench_local(|| {
        for state in &states {
            black_box(f(black_box(state)));
        }
    });
}

fn machine<R: Output>(bencher: Bencher, program: Program) {
    let kernel = Kernel::<R>::new(program).expect("a well-formed program");
    assert!(kernel.is_machine(), "this build or host has no machine code");
    run(bencher, |s| kernel.call(s));
}

fn evaluated<R: Output>(bencher: Bencher, program: Program) {
    let kernel = Kernel::<R>::evaluated(program).expect("a well-formed program");
    run(bencher, |s| kernel.call(s));
}

fn compile<R: Output>(bencher: Bencher, program: &Program) {
    bencher.bench_local(|| Kernel::<R>::new(program.clone()));
}

/// A function in Rust, called as a callback is: through a pointer that the compiler does not know.
fn rust<R>(bencher: Bencher, f: fn(&[f64; 4]) -> R) {
    let f = black_box(f);
    run(bencher, f);
}

fn program(result: Type, locals: Vec<Type>, body: Vec<Stmt>) -> Program {
    let (arrays, tables) = (Vec::new(), Vec::new());
    Program { n_inputs: 4, locals, arrays, tables, fuel: 1_000_000, result, body }
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

macro_rules! callback {
    ($name:ident, $result:ty, $program:expr, $rust:expr) => {
        mod $name {
            use super::*;

            #[divan::bench]
            fn compile(bencher: Bencher) {
                super::compile::<$result>(bencher, &$program);
            }

            #[divan::bench]
            fn evaluated(bencher: Bencher) {
                super::evaluated::<$result>(bencher, $program);
            }

            #[divan::bench]
            fn machine(bencher: Bencher) {
                super::machine::<$result>(bencher, $program);
            }

            #[divan::bench]
            fn rust(bencher: Bencher) {
                super::rust::<$result>(bencher, $rust);
            }
        }
    };
}

callback!(a_floor, f64, program(Type::Float, vec![], vec![Stmt::Return(input(2))]), |s| s[2]);

/// -|θ|.
fn potential() -> Program {
    let value = unary(Unary::NegFloat, unary(Unary::AbsFloat, input(2)));
    program(Type::Float, vec![], vec![Stmt::Return(value)])
}

callback!(b_potential, f64, potential(), |s| -s[2].abs());

/// -(θ/0.2095)² - 0.1 (x/2.4)².
fn quadratic() -> Program {
    let square = |i, scale| {
        let part = binary(Binary::DivFloat, input(i), Expr::Float(scale));
        binary(Binary::MulFloat, part.clone(), part)
    };
    let far = binary(Binary::MulFloat, Expr::Float(0.1), square(0, 2.4));
    let value = binary(Binary::SubFloat, unary(Unary::NegFloat, square(2, 0.2095)), far);
    program(Type::Float, vec![], vec![Stmt::Return(value)])
}

callback!(c_quadratic, f64, quadratic(), |s| {
    let (theta, x) = (s[2] / 0.2095, s[0] / 2.4);
    -(theta * theta) - 0.1 * (x * x)
});

fn outside(i: usize, limit: f64) -> Expr {
    binary(Binary::Float(Compare::Gt), unary(Unary::AbsFloat, input(i)), Expr::Float(limit))
}

/// -1 if fallen; else 1, less 0.5 far from the middle.
fn reward() -> Program {
    let fallen = Expr::Or(Box::new(outside(0, 2.4)), Box::new(outside(2, 0.2095)));
    let less = binary(Binary::SubFloat, Expr::Local(0), Expr::Float(0.5));
    let body = vec![
        Stmt::If(fallen, vec![Stmt::Return(Expr::Float(-1.0))], vec![]),
        Stmt::Set(0, Expr::Float(1.0)),
        Stmt::If(outside(0, 1.2), vec![Stmt::Set(0, less)], vec![]),
        Stmt::Return(Expr::Local(0)),
    ];
    program(Type::Float, vec![Type::Float], body)
}

callback!(d_reward, f64, reward(), |s| {
    if s[0].abs() > 2.4 || s[2].abs() > 0.2095 {
        return -1.0;
    }
    let mut reward = 1.0;
    if s[0].abs() > 1.2 {
        reward -= 0.5;
    }
    reward
});

/// The height of MountainCar, sin(3x) 0.45 + 0.55.
fn height() -> Program {
    let (_, sine) = math::UNARY.iter().find(|(name, _)| *name == "sin").expect("sin is there");
    let sine = Expr::Call1(*sine, Box::new(binary(Binary::MulFloat, Expr::Float(3.0), input(0))));
    let scaled = binary(Binary::MulFloat, sine, Expr::Float(0.45));
    let value = binary(Binary::AddFloat, scaled, Expr::Float(0.55));
    program(Type::Float, vec![], vec![Stmt::Return(value)])
}

callback!(e_height, f64, height(), |s| runner::mdp::math::sin(3.0 * s[0]) * 0.45 + 0.55);

/// Bins of the four fields: how many, and where they end.
const BINS: [(i64, f64); 4] = [(12, 2.4), (12, 3.0), (24, 0.5), (24, 2.0)];

/// The number of the cell among 12 x 12 x 24 x 24.
fn cells() -> Program {
    let mut index = Expr::Int(0);
    for (i, (n, hi)) in BINS.into_iter().enumerate() {
        let from_start = binary(Binary::AddFloat, input(i), Expr::Float(hi));
        let width = Expr::Float(2.0 * hi / n as f64);
        let bin = unary(Unary::Floor, binary(Binary::DivFloat, from_start, width));
        let bin = binary(Binary::Greatest, bin, Expr::Float(0.0));
        let bin = binary(Binary::Least, bin, Expr::Float((n - 1) as f64));
        index = binary(
            Binary::AddInt,
            binary(Binary::MulInt, index, Expr::Int(n)),
            unary(Unary::FloatToInt, bin),
        );
    }
    program(Type::Int, vec![], vec![Stmt::Return(index)])
}

callback!(f_cells, i64, cells(), |s| {
    let mut cell = 0;
    for (x, (n, hi)) in s.iter().zip(BINS) {
        let bin = ((x + hi) / (2.0 * hi / n as f64)).floor().clamp(0.0, (n - 1) as f64);
        cell = cell * n + bin as i64;
    }
    cell
});
