//! Callbacks as they are written, in the form.

use super::*;
use crate::jit::math;

fn neg(x: Expr) -> Expr {
    unary(Unary::NegFloat, x)
}

fn square(x: Expr) -> Expr {
    binary(Binary::MulFloat, x.clone(), x)
}

/// -|θ|.
pub(super) fn one_line() -> Program {
    program(4, Type::Float, vec![Stmt::Return(neg(unary(Unary::AbsFloat, input(2))))])
}

/// -(θ/0.2095)² - 0.1 (x/2.4)².
pub(super) fn quadratic() -> Program {
    let part = |i, scale| square(binary(Binary::DivFloat, input(i), Expr::Float(scale)));
    let far = binary(Binary::MulFloat, Expr::Float(0.1), part(0, 2.4));
    let value = binary(Binary::SubFloat, neg(part(2, 0.2095)), far);
    program(4, Type::Float, vec![Stmt::Return(value)])
}

/// A reward with ifs: -1 for a fallen pole, else 1, less 0.5 far from the middle.
pub(super) fn reward() -> Program {
    let outside = |i, limit: f64| {
        binary(Binary::Float(Compare::Gt), unary(Unary::AbsFloat, input(i)), Expr::Float(limit))
    };
    let fallen = Expr::Or(Box::new(outside(0, 2.4)), Box::new(outside(2, 0.2095)));
    let body = vec![
        Stmt::If(fallen, vec![Stmt::Return(Expr::Float(-1.0))], vec![]),
        Stmt::Set(0, Expr::Float(1.0)),
        Stmt::If(
            outside(0, 1.2),
            vec![Stmt::Set(0, binary(Binary::SubFloat, Expr::Local(0), Expr::Float(0.5)))],
            vec![],
        ),
        Stmt::Return(Expr::Local(0)),
    ];
    Program { locals: vec![Type::Float], ..program(4, Type::Float, body) }
}

/// The height sin(3x) 0.45 + 0.55.
pub(super) fn height() -> Program {
    let sine = math::UNARY.iter().find(|(name, _)| *name == "sin").unwrap().1;
    let sine = Expr::Call1(sine, Box::new(binary(Binary::MulFloat, Expr::Float(3.0), input(0))));
    let value = binary(
        Binary::AddFloat,
        binary(Binary::MulFloat, sine, Expr::Float(0.45)),
        Expr::Float(0.55),
    );
    program(2, Type::Float, vec![Stmt::Return(value)])
}

/// The number of the cell among 12 x 12 x 24 x 24.
pub(super) fn cells() -> Program {
    let mut index = Expr::Int(0);
    for (i, (n, hi)) in [(12, 2.4), (12, 3.0), (24, 0.5), (24, 2.0)].into_iter().enumerate() {
        let width = 2.0 * hi / f64::from(n);
        let place = binary(
            Binary::DivFloat,
            binary(Binary::AddFloat, input(i), Expr::Float(hi)),
            Expr::Float(width),
        );
        let most = Expr::Float(f64::from(n - 1));
        let place = binary(
            Binary::Least,
            binary(Binary::Greatest, unary(Unary::Floor, place), Expr::Float(0.0)),
            most,
        );
        let place = unary(Unary::FloatToInt, place);
        index =
            binary(Binary::AddInt, binary(Binary::MulInt, index, Expr::Int(i64::from(n))), place);
    }
    program(4, Type::Int, vec![Stmt::Return(index)])
}

fn states() -> Vec<[f64; 4]> {
    let some = [0.0, -0.0, 0.1, -0.21, 0.2095, 1.3, 2.4, -2.5, 1e300, f64::INFINITY, f64::NAN];
    let mut states = Vec::new();
    for x in some {
        for theta in some {
            states.push([x, theta * 0.5, theta, x + theta]);
        }
    }
    states
}

#[test]
fn are_what_they_are_in_rust() {
    let [line, quadratic, reward, height, cells] =
        [one_line(), quadratic(), reward(), height(), cells()].map(|p| Tiers::new(&p));
    for s in states() {
        expect(&line, &s, Some(Value::Float(-s[2].abs())));
        let (a, b) = (s[2] / 0.2095, s[0] / 2.4);
        expect(&quadratic, &s, Some(Value::Float(-(a * a) - 0.1 * (b * b))));
        let right = if s[0].abs() > 2.4 || s[2].abs() > 0.2095 {
            -1.0
        } else if s[0].abs() > 1.2 {
            0.5
        } else {
            1.0
        };
        expect(&reward, &s, Some(Value::Float(right)));
        let right = crate::mdp::math::sin(3.0 * s[0]) * 0.45 + 0.55;
        expect(&height, &s, Some(Value::Float(right)));
        let mut cell = 0;
        for (i, (n, hi)) in [(12, 2.4), (12, 3.0), (24, 0.5), (24, 2.0)].into_iter().enumerate() {
            let place: f64 = ((s[i] + hi) / (2.0 * hi / f64::from(n))).floor();
            let place = if 0.0 > place { 0.0 } else { place };
            let most = f64::from(n - 1);
            let place = if most < place { most } else { place };
            cell = cell * i64::from(n) + place as i64;
        }
        expect(&cells, &s, Some(Value::Int(cell)));
    }
}
