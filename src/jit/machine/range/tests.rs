//! Ranges hold what they say, of values at their edges.

use super::*;

const INTS: [i64; 13] =
    [i64::MIN, i64::MIN + 1, -(1 << 32), -7, -2, -1, 0, 1, 2, 7, 1 << 32, i64::MAX - 1, i64::MAX];

const FLOATS: [f64; 11] =
    [f64::NEG_INFINITY, -1e300, -3.5, -1.0, -0.0, 0.0, 0.5, 2.0, 7.9, 1e300, f64::INFINITY];

const ORDERS: [Compare; 6] =
    [Compare::Eq, Compare::Ne, Compare::Lt, Compare::Le, Compare::Gt, Compare::Ge];

/// What a function of two integers is, without a value if it traps.
type OfTwo = fn(i64, i64) -> Option<i64>;

/// All ranges between edges, with the edges in them.
fn ranges<T: Copy + PartialOrd>(edges: &[T]) -> Vec<Vec<T>> {
    let mut all = Vec::new();
    for lo in 0..edges.len() {
        for hi in lo..edges.len() {
            all.push(edges[lo..=hi].to_vec());
        }
    }
    all
}

fn int_range(list: &[i64]) -> Range {
    Range::Int(list[0], list[list.len() - 1])
}

fn holds_int(range: Range, x: i64) {
    let (lo, hi) = range.int();
    assert!(lo <= x && x <= hi, "{x} in {range:?}");
}

fn holds_float(range: Range, x: f64) {
    let (lo, hi, nan) = range.float();
    assert!(if x.is_nan() { nan } else { lo <= x && x <= hi }, "{x} in {range:?}");
}

#[test]
fn of_operations_on_two_integers() {
    let operations: [(Binary, OfTwo); 6] = [
        (Binary::AddInt, i64::checked_add),
        (Binary::SubInt, i64::checked_sub),
        (Binary::MulInt, i64::checked_mul),
        (Binary::RemInt, i64::checked_rem),
        (Binary::MinInt, |x, y| Some(x.min(y))),
        (Binary::MaxInt, |x, y| Some(x.max(y))),
    ];
    for a in ranges(&INTS) {
        for b in ranges(&INTS) {
            for (op, of) in operations {
                let (range, exact) = int_range(&a).binary(op, int_range(&b));
                let results: Vec<_> =
                    a.iter().flat_map(|x| b.iter().map(move |y| of(*x, *y))).collect();
                assert!(!exact || results.iter().all(Option::is_some), "{op:?} {a:?} {b:?}");
                results.into_iter().flatten().for_each(|x| holds_int(range, x));
            }
            for how in ORDERS {
                let decided = int_range(&a).decides(how, int_range(&b));
                for (x, y) in a.iter().flat_map(|x| b.iter().map(move |y| (x, y))) {
                    let right = match how {
                        Compare::Eq => x == y,
                        Compare::Ne => x != y,
                        Compare::Lt => x < y,
                        Compare::Le => x <= y,
                        Compare::Gt => x > y,
                        Compare::Ge => x >= y,
                    };
                    assert!(decided.is_none_or(|d| d == right), "{how:?} {a:?} {b:?}");
                }
            }
        }
    }
}

#[test]
fn of_operations_on_one_value() {
    for list in ranges(&INTS) {
        let range = int_range(&list);
        for x in &list {
            x.checked_neg().into_iter().for_each(|y| holds_int(range.unary(Unary::NegInt), y));
            x.checked_abs().into_iter().for_each(|y| holds_int(range.unary(Unary::AbsInt), y));
            holds_float(range.unary(Unary::IntToFloat), *x as f64);
        }
    }
    for list in ranges(&FLOATS) {
        for nan in [false, true] {
            let range = Range::Float(list[0], list[list.len() - 1], nan);
            let mut all = list.clone();
            all.extend(nan.then_some(f64::NAN));
            for x in all {
                holds_int(range.unary(Unary::FloatToInt), x as i64);
                holds_float(range.unary(Unary::Floor), x.floor());
                holds_float(range.unary(Unary::Ceil), x.ceil());
                holds_float(range.unary(Unary::Trunc), x.trunc());
            }
        }
    }
}

#[test]
fn of_the_lesser_and_the_greater() {
    for a in ranges(&FLOATS) {
        for b in ranges(&FLOATS) {
            for (nan, other_nan) in [(false, false), (false, true), (true, false), (true, true)] {
                let range = |list: &[f64], nan| Range::Float(list[0], list[list.len() - 1], nan);
                let (first, second) = (range(&a, nan), range(&b, other_nan));
                let least = first.binary(Binary::Least, second).0;
                let greatest = first.binary(Binary::Greatest, second).0;
                for &x in a.iter().chain(nan.then_some(&f64::NAN)) {
                    for &y in b.iter().chain(other_nan.then_some(&f64::NAN)) {
                        holds_float(least, if y < x { y } else { x });
                        holds_float(greatest, if y > x { y } else { x });
                    }
                }
            }
        }
    }
}

#[test]
fn of_tables_and_constants() {
    assert_eq!(Range::of(&Table::Int(vec![3, -4, 9])), Range::Int(-4, 9));
    assert_eq!(Range::of(&Table::Float(vec![3.0])), Range::Any);
    assert_eq!(Range::constant(2.5), Range::Float(2.5, 2.5, false));
    assert_eq!(Range::constant(f64::NAN), Range::Any);
}
