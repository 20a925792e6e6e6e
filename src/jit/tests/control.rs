//! Blocks, loops, fuel, and what is not evaluated.

use super::*;

const OUT: Label = Label(0);
const ROUND: Label = Label(1);
const BODY: Label = Label(2);

fn set(i: usize, value: Expr) -> Stmt {
    Stmt::Set(i, value)
}

fn plus(x: Expr, y: i64) -> Expr {
    binary(Binary::AddInt, x, Expr::Int(y))
}

fn less(x: Expr, y: Expr) -> Expr {
    binary(Binary::Int(Compare::Lt), x, y)
}

/// `for i in 0..n { if i == skip { continue } if i == stop { break } sum += i }`, a round costing 3.
fn sum(fuel: i64) -> Program {
    let [n, skip, stop] = [0, 1, 2].map(|i| Expr::Input(i, Type::Int));
    let is = |x| binary(Binary::Int(Compare::Eq), Expr::Local(0), x);
    let body = vec![
        set(0, Expr::Int(0)),
        set(1, Expr::Int(0)),
        Stmt::Block(
            OUT,
            vec![Stmt::Loop(
                ROUND,
                vec![
                    Stmt::Block(
                        BODY,
                        vec![
                            Stmt::If(less(Expr::Local(0), n), vec![], vec![Stmt::Exit(OUT)]),
                            Stmt::If(is(skip), vec![Stmt::Exit(BODY)], vec![]),
                            Stmt::If(is(stop), vec![Stmt::Exit(OUT)], vec![]),
                            set(1, binary(Binary::AddInt, Expr::Local(1), Expr::Local(0))),
                        ],
                    ),
                    set(0, plus(Expr::Local(0), 1)),
                    Stmt::Again(ROUND, 3),
                ],
            )],
        ),
        Stmt::Return(Expr::Local(1)),
    ];
    Program { locals: vec![Type::Int; 2], fuel, ..program(3, Type::Int, body) }
}

#[test]
fn loops_are_left_and_begun_again() {
    let code = Tiers::new(&sum(1_000_000));
    for n in 0..8 {
        for skip in -1..8 {
            for stop in -1..8 {
                let mut right = 0;
                for i in (0..n).take_while(|i| *i != stop || *i == skip) {
                    right += if i == skip { 0 } else { i };
                }
                let inputs = [n, skip, stop].map(|x| x as f64);
                expect(&code, &inputs, Some(Value::Int(right)));
            }
        }
    }
}

#[test]
fn fuel_ends_exactly() {
    for fuel in 0..20 {
        let code = Tiers::new(&sum(fuel));
        for n in 0..8_i64 {
            let right = (3 * n <= fuel).then(|| Value::Int(n * (n - 1) / 2));
            expect(&code, &[n as f64, -1.0, -1.0], right);
        }
    }
    // A loop without an end ends.
    let forever = vec![Stmt::Loop(ROUND, vec![Stmt::Again(ROUND, 1)])];
    expect(&Tiers::new(&program(0, Type::Float, forever)), &[], None);
}

#[test]
fn nested_loops_share_their_fuel() {
    // for i in 0..n { for j in 0..i { sum += j } }
    let (inner, after) = (Label(3), Label(4));
    let body = vec![
        set(0, Expr::Int(0)),
        set(2, Expr::Int(0)),
        Stmt::Block(
            OUT,
            vec![Stmt::Loop(
                ROUND,
                vec![
                    Stmt::If(
                        less(Expr::Local(0), Expr::Input(0, Type::Int)),
                        vec![],
                        vec![Stmt::Exit(OUT)],
                    ),
                    set(1, Expr::Int(0)),
                    Stmt::Block(
                        after,
                        vec![Stmt::Loop(
                            inner,
                            vec![
                                Stmt::If(
                                    less(Expr::Local(1), Expr::Local(0)),
                                    vec![],
                                    vec![Stmt::Exit(after)],
                                ),
                                set(2, binary(Binary::AddInt, Expr::Local(2), Expr::Local(1))),
                                set(1, plus(Expr::Local(1), 1)),
                                Stmt::Again(inner, 1),
                            ],
                        )],
                    ),
                    set(0, plus(Expr::Local(0), 1)),
                    Stmt::Again(ROUND, 1),
                ],
            )],
        ),
        Stmt::Return(Expr::Local(2)),
    ];
    let base = Program { locals: vec![Type::Int; 3], ..program(1, Type::Int, body) };
    let n = 7;
    let right = (0..n).map(|i| (0..i).sum::<i64>()).sum();
    // n rounds outside, and n (n - 1) / 2 inside.
    for (fuel, enough) in [(n + 21, true), (n + 20, false)] {
        let code = Tiers::new(&Program { fuel, ..base.clone() });
        expect(&code, &[n as f64], enough.then_some(Value::Int(right)));
    }
}

#[test]
fn ends_without_a_result() {
    expect(&Tiers::new(&program(0, Type::Float, vec![])), &[], None);
    expect(&Tiers::new(&program(0, Type::Int, vec![Stmt::Trap])), &[], None);
    let condition = Expr::Input(0, Type::Bool);
    let both = vec![Stmt::If(condition.clone(), vec![Stmt::Trap], vec![Stmt::Trap])];
    expect(&Tiers::new(&program(1, Type::Bool, both)), &[1.0], None);
    let back = |x| vec![Stmt::Return(Expr::Bool(x))];
    let arms = program(1, Type::Bool, vec![Stmt::If(condition.clone(), back(true), back(false))]);
    let code = Tiers::new(&arms);
    expect(&code, &[1.0], Some(Value::Bool(true)));
    expect(&code, &[0.0], Some(Value::Bool(false)));
    let one = vec![Stmt::If(condition, vec![Stmt::Trap], vec![]), Stmt::Return(Expr::Bool(true))];
    let code = Tiers::new(&program(1, Type::Bool, one));
    expect(&code, &[1.0], None);
    expect(&code, &[0.0], Some(Value::Bool(true)));
}

/// How two integers compare.
type Order = fn(i64, i64) -> bool;

/// Integers of which it is known how they compare, and of which it is nearly known.
#[test]
fn comparisons_of_bounded_integers() {
    let orders: [(Compare, Order); 6] = [
        (Compare::Eq, |x, y| x == y),
        (Compare::Ne, |x, y| x != y),
        (Compare::Lt, |x, y| x < y),
        (Compare::Le, |x, y| x <= y),
        (Compare::Gt, |x, y| x > y),
        (Compare::Ge, |x, y| x >= y),
    ];
    for (lo, hi) in [(0, 0), (-2, 3), (0, 3)] {
        let x = binary(Binary::MaxInt, Expr::Input(0, Type::Int), Expr::Int(lo));
        let x = binary(Binary::MinInt, x, Expr::Int(hi));
        for y in -3..5 {
            for (how, right) in orders {
                let value = binary(Binary::Int(how), x.clone(), Expr::Int(y));
                let code = Tiers::new(&program(1, Type::Bool, vec![Stmt::Return(value)]));
                for input in -4..5_i64 {
                    let right = right(input.clamp(lo, hi), y);
                    expect(&code, &[input as f64], Some(Value::Bool(right)));
                }
            }
        }
    }
}

#[test]
fn what_is_not_evaluated_does_not_trap() {
    let one = |x| binary(Binary::DivInt, Expr::Int(1), x);
    let traps = || binary(Binary::Int(Compare::Eq), one(Expr::Input(1, Type::Int)), Expr::Int(1));
    let first = || Box::new(Expr::Input(0, Type::Bool));
    for and in [true, false] {
        let logical = |x, y| if and { Expr::And(x, y) } else { Expr::Or(x, y) };
        let value = logical(first(), Box::new(traps()));
        let returned = Tiers::new(&program(2, Type::Bool, vec![Stmt::Return(value.clone())]));
        let back = |x| vec![Stmt::Return(Expr::Bool(x))];
        let chosen = Stmt::If(value.clone(), back(true), back(false));
        let chosen = Tiers::new(&program(2, Type::Bool, vec![chosen]));
        let not = Stmt::If(unary(Unary::Not, value), back(false), back(true));
        let not = Tiers::new(&program(2, Type::Bool, vec![not]));
        for x in [false, true] {
            for y in [0_i64, 1, 2] {
                let second = 1_i64.checked_div(y).map(|q| q == 1);
                let right = if x == and { second } else { Some(x) };
                for code in [&returned, &chosen, &not] {
                    expect(code, &[f64::from(u8::from(x)), y as f64], right.map(Value::Bool));
                }
            }
        }
        // Both operands of the others are evaluated always.
        let op = if and { Binary::AndBool } else { Binary::OrBool };
        let value = binary(op, *first(), traps());
        let code = Tiers::new(&program(2, Type::Bool, vec![Stmt::Return(value)]));
        expect(&code, &[f64::from(u8::from(!and)), 0.0], None);
    }
    let check = vec![Stmt::Check(traps()), Stmt::Return(Expr::Float(1.0))];
    let code = Tiers::new(&program(2, Type::Float, check));
    expect(&code, &[0.0, 0.0], None);
    expect(&code, &[0.0, 1.0], Some(Value::Float(1.0)));
}

/// Arms without a branch: one may read what it has set, and not what the other has.
#[test]
fn arms_do_not_see_each_other() {
    let local = Expr::Local;
    let add = |x, y| binary(Binary::AddFloat, x, Expr::Float(y));
    let body = vec![
        set(0, input(1)),
        set(1, Expr::Float(10.0)),
        Stmt::If(
            Expr::Input(0, Type::Bool),
            vec![set(0, add(local(0), 1.0)), set(1, add(local(0), 2.0))],
            vec![set(0, add(local(0), 4.0))],
        ),
        Stmt::Return(binary(Binary::MulFloat, local(0), local(1))),
    ];
    let program = Program { locals: vec![Type::Float; 2], ..program(2, Type::Float, body) };
    let code = Tiers::new(&program);
    for x in FLOATS {
        expect(&code, &[1.0, x], Some(Value::Float((x + 1.0) * (x + 1.0 + 2.0))));
        expect(&code, &[0.0, x], Some(Value::Float((x + 4.0) * 10.0)));
    }
}

/// `let x; if … { x = 1.0 } else { x = 2.0 }`, in a loop too, where it is not set anew.
#[test]
fn arms_set_what_was_not_set() {
    let choice = |condition| {
        let arms = [1.0, 2.0].map(|x| vec![set(0, Expr::Float(x))]);
        let [yes, no] = arms;
        Stmt::If(condition, yes, no)
    };
    let again = Stmt::If(Expr::Input(1, Type::Bool), vec![Stmt::Again(ROUND, 1)], vec![]);
    let body = vec![
        Stmt::Loop(ROUND, vec![choice(Expr::Input(0, Type::Bool)), again]),
        Stmt::Return(Expr::Local(0)),
    ];
    let program = Program { locals: vec![Type::Float], ..program(2, Type::Float, body) };
    let code = Tiers::new(&program);
    expect(&code, &[1.0, 0.0], Some(Value::Float(1.0)));
    expect(&code, &[0.0, 0.0], Some(Value::Float(2.0)));
    expect(&code, &[0.0, 1.0], None);
}

#[test]
fn ill_formed_programs_are_refused() {
    let wrong = |body: Vec<Stmt>| {
        let program = Program {
            locals: vec![Type::Int],
            arrays: vec![(Type::Int, 2)],
            ..program(1, Type::Float, body)
        };
        assert!(Kernel::<f64>::new(program.clone()).is_err(), "{:?}", program.body);
        assert!(Kernel::<f64>::evaluated(program).is_err());
    };
    wrong(vec![Stmt::Return(Expr::Int(1))]);
    wrong(vec![Stmt::Return(input(1))]);
    wrong(vec![set(0, Expr::Float(1.0))]);
    wrong(vec![set(1, Expr::Int(1))]);
    wrong(vec![Stmt::SetElement(0, 2, Expr::Int(1))]);
    wrong(vec![Stmt::SetElement(1, 0, Expr::Int(1))]);
    wrong(vec![Stmt::Check(Expr::Table(0, Box::new(Expr::Int(0))))]);
    wrong(vec![Stmt::Check(Expr::Element(0, Box::new(Expr::Float(0.0))))]);
    wrong(vec![Stmt::Check(binary(Binary::AddInt, Expr::Int(1), Expr::Float(1.0)))]);
    wrong(vec![Stmt::Check(binary(
        Binary::Bool(Compare::Lt),
        Expr::Bool(true),
        Expr::Bool(false),
    ))]);
    wrong(vec![Stmt::Exit(OUT)]);
    wrong(vec![Stmt::Loop(ROUND, vec![Stmt::Exit(ROUND)])]);
    wrong(vec![Stmt::Block(OUT, vec![Stmt::Again(OUT, 1)])]);
    wrong(vec![Stmt::Block(OUT, vec![Stmt::Block(OUT, vec![])])]);
    let int = program(0, Type::Int, vec![Stmt::Return(Expr::Int(1))]);
    assert!(Kernel::<f64>::new(int.clone()).is_err());
    assert!(Kernel::<i64>::new(int).is_ok());
}
