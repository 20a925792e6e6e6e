//! Tables and local arrays, by any index.

use super::*;

const INDICES: [i64; 14] =
    [0, 1, 2, 3, -1, -2, -3, -4, i64::MAX, i64::MIN, i64::MIN + 3, 1 << 61, -(1 << 61), 1 << 32];

fn element<T: Copy>(list: &[T], index: i64) -> Option<T> {
    let at = if index < 0 { index.checked_add(list.len() as i64)? } else { index };
    list.get(usize::try_from(at).ok()?).copied()
}

/// An index of which nothing is known: input 0, or beyond 2^53 a choice of it by input 0.
fn unknown(index: i64) -> Expr {
    let zero = binary(Binary::SubInt, Expr::Input(0, Type::Int), Expr::Input(0, Type::Int));
    binary(Binary::XorInt, zero, Expr::Int(index))
}

#[test]
fn tables_are_read_by_any_index() {
    let floats = [1.5, -0.0, 2.5];
    let ints = [7, i64::MIN + 1, -3];
    for index in INDICES {
        for at in [Expr::Int(index), unknown(index)] {
            for table in 0..2 {
                let value = Expr::Table(table, Box::new(at.clone()));
                let result = if table == 0 { Type::Float } else { Type::Int };
                let program = Program {
                    tables: vec![Table::Float(floats.to_vec()), Table::Int(ints.to_vec())],
                    ..program(1, result, vec![Stmt::Return(value)])
                };
                let right = if table == 0 {
                    element(&floats, index).map(Value::Float)
                } else {
                    element(&ints, index).map(Value::Int)
                };
                expect(&Tiers::new(&program), &[1.0], right);
            }
        }
    }
}

#[test]
fn arrays_are_written_and_read_by_any_index() {
    let arrays = vec![(Type::Float, 3), (Type::Int, 2), (Type::Bool, 3)];
    let floats = [3.5, -1.0, 0.25];
    for index in INDICES {
        for at in [Expr::Int(index), unknown(index)] {
            for array in 0..3 {
                let mut body = vec![
                    Stmt::SetElement(1, 0, Expr::Int(-5)),
                    Stmt::SetElement(1, 1, Expr::Int(1 << 62)),
                ];
                for (i, x) in floats.iter().enumerate() {
                    body.push(Stmt::SetElement(0, i, Expr::Float(0.0)));
                    body.push(Stmt::SetElement(2, i, Expr::Bool(i == 1)));
                    body.push(Stmt::SetElement(0, i, Expr::Float(*x)));
                }
                body.push(Stmt::Return(Expr::Element(array, Box::new(at.clone()))));
                let program =
                    Program { arrays: arrays.clone(), ..program(1, arrays[array].0, body) };
                let right = match array {
                    0 => element(&floats, index).map(Value::Float),
                    1 => element(&[-5, 1 << 62], index).map(Value::Int),
                    _ => element(&[false, true, false], index).map(Value::Bool),
                };
                expect(&Tiers::new(&program), &[1.0], right);
            }
        }
    }
}

/// The check must not be overtaken: in a loop, an element whose index does not change may be read
/// before the loop only if the index has been checked before.
#[test]
fn an_element_is_not_read_before_its_index_is_checked() {
    let far = binary(Binary::AddInt, Expr::Input(0, Type::Int), Expr::Int(1 << 50));
    let value = Expr::Table(0, Box::new(far));
    let body = vec![
        Stmt::Set(0, Expr::Float(0.0)),
        Stmt::Loop(
            Label(0),
            vec![
                Stmt::If(
                    Expr::Input(1, Type::Bool),
                    vec![Stmt::Set(0, binary(Binary::AddFloat, Expr::Local(0), value))],
                    vec![],
                ),
                Stmt::If(Expr::Input(2, Type::Bool), vec![Stmt::Again(Label(0), 1)], vec![]),
            ],
        ),
        Stmt::Return(Expr::Local(0)),
    ];
    let program = Program {
        locals: vec![Type::Float],
        tables: vec![Table::Float(vec![1.0, 2.0])],
        ..program(3, Type::Float, body)
    };
    let code = Tiers::new(&program);
    expect(&code, &[0.0, 0.0, 0.0], Some(Value::Float(0.0)));
    expect(&code, &[0.0, 1.0, 0.0], None);
    expect(&code, &[1.0 - (1_i64 << 50) as f64, 1.0, 0.0], Some(Value::Float(2.0)));
}

#[test]
fn an_index_known_to_be_inside_is_inside() {
    // Clamped to -3..=2 and to -4..=3, of which the second may be outside.
    for (lo, hi) in [(-3, 2), (-4, 3), (0, 2), (0, 3), (-3, -1), (1, 1)] {
        let index = Expr::Input(0, Type::Int);
        let index =
            binary(Binary::MinInt, binary(Binary::MaxInt, index, Expr::Int(lo)), Expr::Int(hi));
        let value = Expr::Table(0, Box::new(index));
        let list = [10, 20, 30];
        let program = Program {
            tables: vec![Table::Int(list.to_vec())],
            ..program(1, Type::Int, vec![Stmt::Return(value)])
        };
        let code = Tiers::new(&program);
        for x in FLOATS {
            let index = (x as i64).clamp(lo, hi);
            expect(&code, &[x], element(&list, index).map(Value::Int));
        }
    }
}
