//! What is known of a value while lowering.

use std::rc::Rc;

use super::Lowering;
use crate::jit::ir::{Expr, Table, Type};
use crate::script::value::Value;

/// A value: a number to be computed, or something that is known already.
#[derive(Debug, Clone)]
pub(super) enum Val {
    /// A float, an integer or a truth value.
    Num(Expr),
    /// A one-letter string whose Unicode scalar value is an input.
    Letter(usize),
    /// A state; its fields are the inputs from this one on.
    State(usize),
    /// A step.
    Step,
    /// A string, an array, a map or a function.
    Data(Rc<Value>),
    /// The elements of a table of constants from `offset` on, of shape `dims`.
    Slice { table: usize, dims: Rc<[usize]>, offset: Expr },
    /// A local array.
    Array(usize),
    /// `()`.
    Unit,
    /// Control does not come here.
    Never,
    /// One thing on one path, another on another, as it says.
    Mixed(&'static str),
}

/// A variable.
#[derive(Debug, Clone)]
pub(super) struct Binding {
    pub(super) name: String,
    pub(super) slot: Slot,
}

/// Where a variable is.
#[derive(Debug, Clone)]
pub(super) enum Slot {
    /// In a local, to which can be assigned.
    Local(usize),
    /// Nowhere: it never changes.
    Fixed(Val),
}

impl Val {
    /// A constant.
    pub(super) fn of(value: &Value) -> Self {
        match value {
            Value::Unit => Self::Unit,
            Value::Bool(x) => Self::Num(Expr::Bool(*x)),
            Value::Int(x) => Self::Num(Expr::Int(*x)),
            Value::Float(x) => Self::Num(Expr::Float(*x)),
            other => Self::Data(Rc::new(other.clone())),
        }
    }

    /// What to call it in messages, with its article.
    pub(super) fn described(&self) -> &'static str {
        match self {
            Self::Num(_) => "a number",
            Self::Letter(_) => "a string",
            Self::State(_) => "a state",
            Self::Step => "a step",
            Self::Data(value) => match &**value {
                Value::Str(_) => "a string",
                Value::Char(_) => "a character",
                Value::Array(_) => "an array",
                Value::Map(_) => "a map",
                Value::Fn { .. } => "a function as a value",
                _ => "a constant",
            },
            Self::Slice { .. } | Self::Array(_) => "an array",
            Self::Unit => "a missing value",
            Self::Never => "nothing",
            Self::Mixed(what) => what,
        }
    }
}

/// The numbers in nested arrays of one shape, row by row.
fn flatten(value: &Value, into: &mut Vec<Value>) -> Option<Vec<usize>> {
    let Value::Array(items) = value else {
        return match value {
            Value::Int(_) | Value::Float(_) => {
                into.push(value.clone());
                Some(Vec::new())
            }
            _ => None,
        };
    };
    let mut shape: Option<Vec<usize>> = None;
    for item in items {
        let inner = flatten(item, into)?;
        if *shape.get_or_insert_with(|| inner.clone()) != inner {
            return None;
        }
    }
    let mut dims = vec![items.len()];
    dims.extend(shape?);
    Some(dims)
}

impl Lowering<'_> {
    /// The elements of an array of numbers.
    pub(super) fn elements(&self, val: &Val) -> Option<Vec<Expr>> {
        match val {
            Val::Array(id) => {
                let at = |i: usize| Expr::Element(*id, Expr::Int(i as i64).into());
                Some((0..self.program.arrays[*id].1).map(at).collect())
            }
            Val::Slice { table, dims, offset } if dims.len() == 1 => {
                let Expr::Int(offset) = offset else { return None };
                let at = |i: usize| Expr::Table(*table, Expr::Int(offset + i as i64).into());
                Some((0..dims[0]).map(at).collect())
            }
            Val::Data(value) => match &**value {
                Value::Array(items) => {
                    let number = |item: &Value| match Val::of(item) {
                        Val::Num(e) => Some(e),
                        _ => None,
                    };
                    items.iter().map(number).collect()
                }
                _ => None,
            },
            _ => None,
        }
    }

    /// An array of constants as a table, if it is one of numbers of one type, nested evenly or not at
    /// all.
    pub(super) fn table(&mut self, value: &Value) -> Option<Val> {
        let mut items = Vec::new();
        let dims = flatten(value, &mut items)?;
        let int = |v: &Value| if let Value::Int(x) = v { Some(*x) } else { None };
        let float = |v: &Value| if let Value::Float(x) = v { Some(*x) } else { None };
        let table = if let Value::Int(_) = items.first()? {
            Table::Int(items.iter().map(int).collect::<Option<_>>()?)
        } else {
            Table::Float(items.iter().map(float).collect::<Option<_>>()?)
        };
        let same = |known: &Table| match (known, &table) {
            (Table::Int(a), Table::Int(b)) => a == b,
            (Table::Float(a), Table::Float(b)) => {
                a.iter().map(|x| x.to_bits()).eq(b.iter().map(|x| x.to_bits()))
            }
            _ => false,
        };
        let id = self.program.tables.iter().position(same).unwrap_or_else(|| {
            self.program.tables.push(table.clone());
            self.program.tables.len() - 1
        });
        Some(Val::Slice { table: id, dims: dims.into(), offset: Expr::Int(0) })
    }

    /// The number that `val` is.
    pub(super) fn number(&self, val: &Val) -> Option<(Expr, Type)> {
        match val {
            Val::Num(e) => Some((e.clone(), self.program.type_of(e))),
            _ => None,
        }
    }
}
