//! Every operation at its edges, against Rust.

use super::*;

/// What is right, of one or two operands; without a value it traps.
type OfFloat = fn(f64) -> Value;
type OfFloats = fn(f64, f64) -> Value;
type OfInt = fn(i64) -> Option<Value>;
type OfInts = fn(i64, i64) -> Option<Value>;
type OfFlags = fn(bool, bool) -> bool;

/// Whether the operands are inputs or constants, which are compiled differently.
#[derive(Clone, Copy)]
enum From {
    Input,
    Constant,
}

const FROM: [From; 2] = [From::Input, From::Constant];

/// An integer that need not be a float: from the two inputs `at` and `at + 1`, its halves.
fn int(from: From, at: usize, x: i64) -> (Expr, [f64; 2]) {
    let halves = [(x >> 32) as f64, f64::from(x as u32)];
    let expr = match from {
        From::Constant => Expr::Int(x),
        // Only multiplying by 2^32 in two steps keeps clear of overflow at the least integer.
        From::Input => binary(
            Binary::OrInt,
            binary(Binary::MulInt, Expr::Input(at, Type::Int), Expr::Int(1 << 32)),
            Expr::Input(at + 1, Type::Int),
        ),
    };
    (expr, halves)
}

fn float(from: From, at: usize, x: f64) -> Expr {
    match from {
        From::Constant => Expr::Float(x),
        From::Input => input(at),
    }
}

fn returned(n_inputs: usize, value: Expr) -> Tiers {
    let mut program = program(n_inputs, Type::Float, Vec::new());
    program.result = program.type_of(&value);
    program.body = vec![Stmt::Return(value)];
    Tiers::new(&program)
}

#[test]
fn of_one_float() {
    let operations: [(Unary, OfFloat); 10] = [
        (Unary::NegFloat, |x| Value::Float(-x)),
        (Unary::AbsFloat, |x| Value::Float(x.abs())),
        (Unary::FloatToInt, |x| Value::Int(x as i64)),
        (Unary::Floor, |x| Value::Float(x.floor())),
        (Unary::Ceil, |x| Value::Float(x.ceil())),
        (Unary::Trunc, |x| Value::Float(x.trunc())),
        (Unary::Sqrt, |x| Value::Float(x.sqrt())),
        (Unary::IsNan, |x| Value::Bool(x.is_nan())),
        (Unary::IsFinite, |x| Value::Bool(x.is_finite())),
        (Unary::IsInfinite, |x| Value::Bool(x.is_infinite())),
    ];
    for (op, right) in operations {
        let code = returned(1, unary(op, input(0)));
        for x in FLOATS {
            expect(&code, &[x], Some(right(x)));
            expect(&returned(0, unary(op, Expr::Float(x))), &[], Some(right(x)));
        }
    }
}

#[test]
fn of_two_floats() {
    let operations: [(Binary, OfFloats); 12] = [
        (Binary::AddFloat, |x, y| Value::Float(x + y)),
        (Binary::SubFloat, |x, y| Value::Float(x - y)),
        (Binary::MulFloat, |x, y| Value::Float(x * y)),
        (Binary::DivFloat, |x, y| Value::Float(x / y)),
        (Binary::Least, |x, y| Value::Float(if y < x { y } else { x })),
        (Binary::Greatest, |x, y| Value::Float(if y > x { y } else { x })),
        (Binary::Float(Compare::Eq), |x, y| Value::Bool(x == y)),
        (Binary::Float(Compare::Ne), |x, y| Value::Bool(x != y)),
        (Binary::Float(Compare::Lt), |x, y| Value::Bool(x < y)),
        (Binary::Float(Compare::Le), |x, y| Value::Bool(x <= y)),
        (Binary::Float(Compare::Gt), |x, y| Value::Bool(x > y)),
        (Binary::Float(Compare::Ge), |x, y| Value::Bool(x >= y)),
    ];
    for (op, right) in operations {
        let code = returned(2, binary(op, input(0), input(1)));
        for y in FLOATS {
            let by_constant = returned(1, binary(op, input(0), Expr::Float(y)));
            for x in FLOATS {
                expect(&code, &[x, y], Some(right(x, y)));
                expect(&by_constant, &[x], Some(right(x, y)));
            }
        }
    }
}

/// As documented: NaN on either side gives the first, and so do zeros of either sign.
#[test]
fn the_least_and_the_greatest_prefer_the_first() {
    for op in [Binary::Least, Binary::Greatest] {
        let code = returned(2, binary(op, input(0), input(1)));
        for (x, y) in [(0.0, -0.0), (-0.0, 0.0), (1.0, f64::NAN), (f64::NAN, 1.0)] {
            expect(&code, &[x, y], Some(Value::Float(x)));
        }
    }
}

#[test]
fn of_one_integer() {
    let operations: [(Unary, OfInt); 3] = [
        (Unary::NegInt, |x| x.checked_neg().map(Value::Int)),
        (Unary::AbsInt, |x| x.checked_abs().map(Value::Int)),
        (Unary::IntToFloat, |x| Some(Value::Float(x as f64))),
    ];
    for (op, right) in operations {
        for x in INTS {
            for from in FROM {
                let (expr, halves) = int(from, 0, x);
                expect(&returned(2, unary(op, expr)), &halves, right(x));
            }
        }
    }
}

#[test]
fn of_two_integers() {
    let operations: [(Binary, OfInts); 16] = [
        (Binary::AddInt, |x, y| x.checked_add(y).map(Value::Int)),
        (Binary::SubInt, |x, y| x.checked_sub(y).map(Value::Int)),
        (Binary::MulInt, |x, y| x.checked_mul(y).map(Value::Int)),
        (Binary::DivInt, |x, y| x.checked_div(y).map(Value::Int)),
        (Binary::RemInt, |x, y| x.checked_rem(y).map(Value::Int)),
        (Binary::MinInt, |x, y| Some(Value::Int(x.min(y)))),
        (Binary::MaxInt, |x, y| Some(Value::Int(x.max(y)))),
        (Binary::AndInt, |x, y| Some(Value::Int(x & y))),
        (Binary::OrInt, |x, y| Some(Value::Int(x | y))),
        (Binary::XorInt, |x, y| Some(Value::Int(x ^ y))),
        (Binary::Int(Compare::Eq), |x, y| Some(Value::Bool(x == y))),
        (Binary::Int(Compare::Ne), |x, y| Some(Value::Bool(x != y))),
        (Binary::Int(Compare::Lt), |x, y| Some(Value::Bool(x < y))),
        (Binary::Int(Compare::Le), |x, y| Some(Value::Bool(x <= y))),
        (Binary::Int(Compare::Gt), |x, y| Some(Value::Bool(x > y))),
        (Binary::Int(Compare::Ge), |x, y| Some(Value::Bool(x >= y))),
    ];
    for (op, right) in operations {
        let general = returned(4, binary(op, int(From::Input, 0, 0).0, int(From::Input, 2, 0).0));
        for y in INTS {
            let by_constant = returned(2, binary(op, int(From::Input, 0, 0).0, Expr::Int(y)));
            let lower = int(From::Input, 2, y).1;
            for x in INTS {
                let upper = int(From::Input, 0, x).1;
                expect(&general, &[upper[0], upper[1], lower[0], lower[1]], right(x, y));
                expect(&by_constant, &upper, right(x, y));
            }
            let constants = returned(0, binary(op, Expr::Int(7), Expr::Int(y)));
            expect(&constants, &[], right(7, y));
        }
    }
}

#[test]
fn of_truth_values() {
    let operations: [(Binary, OfFlags); 5] = [
        (Binary::AndBool, |x, y| x & y),
        (Binary::OrBool, |x, y| x | y),
        (Binary::XorBool, |x, y| x ^ y),
        (Binary::Bool(Compare::Eq), |x, y| x == y),
        (Binary::Bool(Compare::Ne), |x, y| x != y),
    ];
    let of = |x: f64| x != 0.0;
    let at = |i| Expr::Input(i, Type::Bool);
    for x in FLOATS {
        expect(&returned(1, at(0)), &[x], Some(Value::Bool(of(x))));
        expect(&returned(1, unary(Unary::Not, at(0))), &[x], Some(Value::Bool(!of(x))));
    }
    for (op, right) in operations {
        let code = returned(2, binary(op, at(0), at(1)));
        for (x, y) in [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0), (f64::NAN, -0.0)] {
            expect(&code, &[x, y], Some(Value::Bool(right(of(x), of(y)))));
        }
    }
}

#[test]
fn inputs_and_constants() {
    for x in FLOATS {
        expect(&returned(1, input(0)), &[x], Some(Value::Float(x)));
        expect(&returned(1, Expr::Input(0, Type::Int)), &[x], Some(Value::Int(x as i64)));
        expect(&returned(0, Expr::Float(x)), &[], Some(Value::Float(x)));
    }
    for x in INTS {
        expect(&returned(0, Expr::Int(x)), &[], Some(Value::Int(x)));
    }
    // More inputs than it reads are fine; it reads the right one.
    expect(&returned(3, input(2)), &[1.0, 2.0, 3.0, 4.0], Some(Value::Float(3.0)));
}

#[test]
#[should_panic(expected = "fewer inputs than the program reads")]
fn too_few_inputs_are_refused() {
    let program = program(2, Type::Float, vec![Stmt::Return(input(1))]);
    if cfg!(feature = "jit") {
        Kernel::<f64>::new(program).unwrap().call(&[1.0]);
    } else {
        panic!("fewer inputs than the program reads");
    }
}

#[test]
fn functions_are_called() {
    let all: Vec<(Math1, f64)> =
        crate::jit::math::UNARY.iter().flat_map(|(_, f)| FLOATS.map(|x| (*f, x))).collect();
    for (f, x) in all {
        let code = returned(1, Expr::Call1(f, Box::new(input(0))));
        expect(&code, &[x], Some(Value::Float(f(x))));
    }
    let two: [Math2; 4] = [
        crate::jit::math::atan2,
        crate::jit::math::pow,
        crate::jit::math::remainder,
        crate::jit::math::hypot,
    ];
    for f in two {
        let code = returned(2, Expr::Call2(f, Box::new(input(0)), Box::new(input(1))));
        for (x, y) in [(3.0, 4.0), (-0.5, 2.0), (f64::NAN, 0.0), (1e300, -1e300), (7.5, 2.0)] {
            expect(&code, &[x, y], Some(Value::Float(f(x, y))));
        }
    }
    // What is needed after a call survives it.
    let sin = |x| Expr::Call1(crate::jit::math::UNARY[0].1, Box::new(x));
    let sum =
        binary(Binary::AddFloat, sin(input(0)), binary(Binary::MulFloat, sin(input(1)), input(0)));
    let right = crate::mdp::math::sin(0.3) + crate::mdp::math::sin(1.1) * 0.3;
    expect(&returned(2, sum), &[0.3, 1.1], Some(Value::Float(right)));
}

#[test]
fn expressions_of_constants_alone() {
    for x in FLOATS {
        for y in FLOATS {
            let [a, b] = [float(From::Constant, 0, x), float(From::Constant, 1, y)];
            let code = returned(0, binary(Binary::DivFloat, a, b));
            expect(&code, &[], Some(Value::Float(x / y)));
        }
    }
}
