//! The evaluator: runs a program as it stands. It works everywhere, and machine code is tested
//! against it; the two share nothing but the form.
//!
//! A cell of a local or of an array's element is 64 bits, of the type that the program says.

use std::cell::Cell;

use super::ir::{Binary, Compare, Expr, Label, Program, Stmt, Table, Type, Unary};

/// What a program returns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    /// A float.
    Float(f64),
    /// An integer.
    Int(i64),
    /// A truth value.
    Bool(bool),
}

/// The program ended without a result.
struct Trap;

/// How a statement ended.
enum Flow {
    Next,
    Exit(Label),
    Again(Label),
    Return(Value),
}

/// A run of a program.
struct Run<'a> {
    program: &'a Program,
    inputs: &'a [f64],
    /// The locals, then the elements of the arrays.
    cells: &'a mut [u64],
    fuel: i64,
}

thread_local! {
    /// Cells of the last run, so that a run need not allocate.
    static CELLS: Cell<Vec<u64>> = const { Cell::new(Vec::new()) };
}

impl Program {
    /// Runs the program. `None` if it traps.
    ///
    /// # Panics
    /// If there are fewer than `n_inputs` inputs, or [`Program::check`] refuses the program.
    pub fn evaluate(&self, inputs: &[f64]) -> Option<Value> {
        let mut cells = CELLS.take();
        cells.clear();
        cells.resize(self.locals.len() + self.arrays.iter().map(|a| a.1).sum::<usize>(), 0);
        let mut run = Run { program: self, inputs, cells: &mut cells, fuel: self.fuel };
        let flow = run.list(&self.body);
        CELLS.set(cells);
        match flow {
            Ok(Flow::Return(value)) => Some(value),
            _ => None,
        }
    }
}

impl Run<'_> {
    fn list(&mut self, list: &[Stmt]) -> Result<Flow, Trap> {
        for stmt in list {
            match self.stmt(stmt)? {
                Flow::Next => {}
                flow => return Ok(flow),
            }
        }
        Ok(Flow::Next)
    }

    fn stmt(&mut self, stmt: &Stmt) -> Result<Flow, Trap> {
        match stmt {
            Stmt::Set(i, value) => self.cells[*i] = self.bits(value)?,
            Stmt::SetElement(i, at, value) => {
                let cell = self.first_cell(*i) + at;
                self.cells[cell] = self.bits(value)?;
            }
            Stmt::Check(value) => drop(self.bits(value)?),
            Stmt::If(condition, yes, no) => {
                return self.list(if self.bool(condition)? { yes } else { no });
            }
            Stmt::Block(label, list) => {
                return Ok(match self.list(list)? {
                    Flow::Exit(to) if to == *label => Flow::Next,
                    flow => flow,
                });
            }
            Stmt::Loop(label, list) => loop {
                match self.list(list)? {
                    Flow::Again(to) if to == *label => {}
                    flow => return Ok(flow),
                }
            },
            Stmt::Exit(label) => return Ok(Flow::Exit(*label)),
            Stmt::Again(label, operations) => {
                self.fuel -= i64::from(*operations);
                return if self.fuel < 0 { Err(Trap) } else { Ok(Flow::Again(*label)) };
            }
            Stmt::Return(value) => {
                return Ok(Flow::Return(match self.program.result {
                    Type::Float => Value::Float(self.float(value)?),
                    Type::Int => Value::Int(self.int(value)?),
                    Type::Bool => Value::Bool(self.bool(value)?),
                }));
            }
            Stmt::Trap => return Err(Trap),
        }
        Ok(Flow::Next)
    }

    fn bits(&self, expr: &Expr) -> Result<u64, Trap> {
        Ok(match self.program.type_of(expr) {
            Type::Float => self.float(expr)?.to_bits(),
            Type::Int => self.int(expr)? as u64,
            Type::Bool => u64::from(self.bool(expr)?),
        })
    }

    /// Where the elements of array `i` begin.
    fn first_cell(&self, i: usize) -> usize {
        let before = self.program.arrays[..i].iter().map(|a| a.1).sum::<usize>();
        self.program.locals.len() + before
    }

    /// The cell of an element of array `i`.
    fn element(&self, i: usize, index: &Expr) -> Result<u64, Trap> {
        let at = place(self.int(index)?, self.program.arrays[i].1)?;
        Ok(self.cells[self.first_cell(i) + at])
    }

    fn float(&self, expr: &Expr) -> Result<f64, Trap> {
        Ok(match expr {
            Expr::Float(x) => *x,
            Expr::Input(i, _) => self.inputs[*i],
            Expr::Local(i) => f64::from_bits(self.cells[*i]),
            Expr::Unary(op, x) => match op {
                Unary::NegFloat => -self.float(x)?,
                Unary::AbsFloat => self.float(x)?.abs(),
                Unary::IntToFloat => self.int(x)? as f64,
                Unary::Floor => self.float(x)?.floor(),
                Unary::Ceil => self.float(x)?.ceil(),
                Unary::Trunc => self.float(x)?.trunc(),
                Unary::Sqrt => self.float(x)?.sqrt(),
                _ => unreachable!("not a float: {op:?}"),
            },
            Expr::Binary(op, x, y) => {
                let (x, y) = (self.float(x)?, self.float(y)?);
                match op {
                    Binary::AddFloat => x + y,
                    Binary::SubFloat => x - y,
                    Binary::MulFloat => x * y,
                    Binary::DivFloat => x / y,
                    Binary::Least if y < x => y,
                    Binary::Greatest if y > x => y,
                    Binary::Least | Binary::Greatest => x,
                    _ => unreachable!("not a float: {op:?}"),
                }
            }
            Expr::Call1(f, x) => f(self.float(x)?),
            Expr::Call2(f, x, y) => f(self.float(x)?, self.float(y)?),
            Expr::Table(i, index) => match &self.program.tables[*i] {
                Table::Float(list) => list[place(self.int(index)?, list.len())?],
                Table::Int(_) => unreachable!("not a table of floats"),
            },
            Expr::Element(i, index) => f64::from_bits(self.element(*i, index)?),
            _ => unreachable!("not a float: {expr:?}"),
        })
    }

    fn int(&self, expr: &Expr) -> Result<i64, Trap> {
        Ok(match expr {
            Expr::Int(x) => *x,
            Expr::Input(i, _) => self.inputs[*i] as i64,
            Expr::Local(i) => self.cells[*i] as i64,
            Expr::Unary(op, x) => match op {
                Unary::NegInt => self.int(x)?.checked_neg().ok_or(Trap)?,
                Unary::AbsInt => self.int(x)?.checked_abs().ok_or(Trap)?,
                Unary::FloatToInt => self.float(x)? as i64,
                _ => unreachable!("not an integer: {op:?}"),
            },
            Expr::Binary(op, x, y) => {
                let (x, y) = (self.int(x)?, self.int(y)?);
                match op {
                    Binary::AddInt => x.checked_add(y).ok_or(Trap)?,
                    Binary::SubInt => x.checked_sub(y).ok_or(Trap)?,
                    Binary::MulInt => x.checked_mul(y).ok_or(Trap)?,
                    Binary::DivInt => x.checked_div(y).ok_or(Trap)?,
                    Binary::RemInt => x.checked_rem(y).ok_or(Trap)?,
                    Binary::MinInt => x.min(y),
                    Binary::MaxInt => x.max(y),
                    Binary::AndInt => x & y,
                    Binary::OrInt => x | y,
                    Binary::XorInt => x ^ y,
                    _ => unreachable!("not an integer: {op:?}"),
                }
            }
            Expr::Table(i, index) => match &self.program.tables[*i] {
                Table::Int(list) => list[place(self.int(index)?, list.len())?],
                Table::Float(_) => unreachable!("not a table of integers"),
            },
            Expr::Element(i, index) => self.element(*i, index)? as i64,
            _ => unreachable!("not an integer: {expr:?}"),
        })
    }

    fn bool(&self, expr: &Expr) -> Result<bool, Trap> {
        Ok(match expr {
            Expr::Bool(x) => *x,
            Expr::Input(i, _) => self.inputs[*i] != 0.0,
            Expr::Local(i) => self.cells[*i] != 0,
            Expr::Unary(op, x) => match op {
                Unary::Not => !self.bool(x)?,
                Unary::IsNan => self.float(x)?.is_nan(),
                Unary::IsFinite => self.float(x)?.is_finite(),
                Unary::IsInfinite => self.float(x)?.is_infinite(),
                _ => unreachable!("not a truth value: {op:?}"),
            },
            Expr::Binary(op, x, y) => match op {
                Binary::AndBool => self.bool(x)? & self.bool(y)?,
                Binary::OrBool => self.bool(x)? | self.bool(y)?,
                Binary::XorBool => self.bool(x)? ^ self.bool(y)?,
                Binary::Float(how) => compare(*how, &self.float(x)?, &self.float(y)?),
                Binary::Int(how) => compare(*how, &self.int(x)?, &self.int(y)?),
                Binary::Bool(how) => compare(*how, &self.bool(x)?, &self.bool(y)?),
                _ => unreachable!("not a truth value: {op:?}"),
            },
            Expr::And(x, y) => self.bool(x)? && self.bool(y)?,
            Expr::Or(x, y) => self.bool(x)? || self.bool(y)?,
            Expr::Element(i, index) => self.element(*i, index)? != 0,
            _ => unreachable!("not a truth value: {expr:?}"),
        })
    }
}

/// The place of an index among `len` elements.
fn place(index: i64, len: usize) -> Result<usize, Trap> {
    let at = if index < 0 { index.checked_add_unsigned(len as u64) } else { Some(index) };
    match at.and_then(|at| usize::try_from(at).ok()) {
        Some(at) if at < len => Ok(at),
        _ => Err(Trap),
    }
}

fn compare<T: PartialOrd>(how: Compare, x: &T, y: &T) -> bool {
    match how {
        Compare::Eq => x == y,
        Compare::Ne => x != y,
        Compare::Lt => x < y,
        Compare::Le => x <= y,
        Compare::Gt => x > y,
        Compare::Ge => x >= y,
    }
}
