//! Whether a program is well formed: every type as it must be, every number of something that exists.
//!
//! What runs a program relies on it. What it does not see: that locals and the elements of arrays are
//! set before they are read.

use std::fmt;

use super::ir::{Binary, Compare, Expr, Label, Program, Stmt, Type, Unary};
use super::kernel::Output;

/// What is wrong with a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Invalid(&'static str);

impl fmt::Display for Invalid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "an ill-formed program: {}", self.0)
    }
}

impl std::error::Error for Invalid {}

fn ensure(holds: bool, or: &'static str) -> Result<(), Invalid> {
    if holds { Ok(()) } else { Err(Invalid(or)) }
}

impl Program {
    /// Checks that the program is well formed.
    ///
    /// # Errors
    /// With the first thing that is wrong.
    pub fn check(&self) -> Result<(), Invalid> {
        ensure(self.fuel >= 0, "less than no fuel")?;
        ensure(self.tables.iter().all(|t| t.len() > 0), "an empty table")?;
        ensure(self.arrays.iter().all(|a| a.1 > 0), "an empty array")?;
        Check { program: self, around: Vec::new() }.list(&self.body)
    }

    /// Checks that the program's result is an `R`.
    pub(super) fn returns<R: Output>(&self) -> Result<(), Invalid> {
        ensure(R::holds(self.result), "a result of another type")
    }
}

/// A walk through a program.
struct Check<'a> {
    program: &'a Program,
    /// The labels around, with whether they are of loops.
    around: Vec<(Label, bool)>,
}

impl Check<'_> {
    fn list(&mut self, list: &[Stmt]) -> Result<(), Invalid> {
        list.iter().try_for_each(|stmt| self.stmt(stmt))
    }

    fn within(&mut self, label: Label, is_loop: bool, list: &[Stmt]) -> Result<(), Invalid> {
        ensure(!self.around.iter().any(|(l, _)| *l == label), "a label within itself")?;
        self.around.push((label, is_loop));
        self.list(list)?;
        self.around.pop();
        Ok(())
    }

    fn stmt(&mut self, stmt: &Stmt) -> Result<(), Invalid> {
        match stmt {
            Stmt::Set(i, value) => match self.program.locals.get(*i) {
                Some(ty) => self.expr(value, *ty),
                None => Err(Invalid("no such local")),
            },
            Stmt::SetElement(i, at, value) => match self.program.arrays.get(*i) {
                Some((ty, len)) if at < len => self.expr(value, *ty),
                Some(_) => Err(Invalid("no such element")),
                None => Err(Invalid("no such array")),
            },
            Stmt::Check(value) => self.any(value).map(drop),
            Stmt::If(condition, yes, no) => {
                self.expr(condition, Type::Bool)?;
                self.list(yes)?;
                self.list(no)
            }
            Stmt::Block(label, list) => self.within(*label, false, list),
            Stmt::Loop(label, list) => self.within(*label, true, list),
            Stmt::Exit(label) => {
                ensure(self.around.contains(&(*label, false)), "leaves a block it is not in")
            }
            Stmt::Again(label, _) => {
                ensure(self.around.contains(&(*label, true)), "repeats a loop it is not in")
            }
            Stmt::Return(value) => self.expr(value, self.program.result),
            Stmt::Trap => Ok(()),
        }
    }

    fn expr(&self, expr: &Expr, ty: Type) -> Result<(), Invalid> {
        ensure(self.any(expr)? == ty, "a value of another type")
    }

    /// The type of a well-formed expression.
    fn any(&self, expr: &Expr) -> Result<Type, Invalid> {
        match expr {
            Expr::Float(_) | Expr::Int(_) | Expr::Bool(_) => {}
            Expr::Input(i, _) => ensure(*i < self.program.n_inputs, "no such input")?,
            Expr::Local(i) => ensure(*i < self.program.locals.len(), "no such local")?,
            Expr::Unary(op, x) => self.expr(x, op.operand())?,
            Expr::Binary(op, x, y) => {
                self.expr(x, op.operand())?;
                self.expr(y, op.operand())?;
                let ordered = matches!(
                    op,
                    Binary::Bool(Compare::Lt | Compare::Le | Compare::Gt | Compare::Ge)
                );
                ensure(!ordered, "an order of truth values")?;
            }
            Expr::And(x, y) | Expr::Or(x, y) => {
                self.expr(x, Type::Bool)?;
                self.expr(y, Type::Bool)?;
            }
            Expr::Call1(_, x) => self.expr(x, Type::Float)?,
            Expr::Call2(_, x, y) => {
                self.expr(x, Type::Float)?;
                self.expr(y, Type::Float)?;
            }
            Expr::Table(i, index) => {
                ensure(*i < self.program.tables.len(), "no such table")?;
                self.expr(index, Type::Int)?;
            }
            Expr::Element(i, index) => {
                ensure(*i < self.program.arrays.len(), "no such array")?;
                self.expr(index, Type::Int)?;
            }
        }
        Ok(self.program.type_of(expr))
    }
}

impl Unary {
    /// The type of its operand.
    fn operand(self) -> Type {
        match self {
            Self::NegFloat
            | Self::AbsFloat
            | Self::FloatToInt
            | Self::Floor
            | Self::Ceil
            | Self::Trunc
            | Self::Sqrt
            | Self::IsNan
            | Self::IsFinite
            | Self::IsInfinite => Type::Float,
            Self::NegInt | Self::AbsInt | Self::IntToFloat => Type::Int,
            Self::Not => Type::Bool,
        }
    }
}

impl Binary {
    /// The type of its operands.
    fn operand(self) -> Type {
        match self {
            Self::Float(_) => Type::Float,
            Self::Int(_) => Type::Int,
            other => other.result(),
        }
    }
}
