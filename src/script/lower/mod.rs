//! From a callback's syntax to the typed intermediate form of [`crate::jit`]: the numeric subset of
//! the language, everything that a reward, a potential or a discretiser is usually written with.
//!
//! Functions are inlined, captured values and the script's constants become constants, the state's
//! fields become inputs. Every variable has one type, found here; where it cannot be found, or where
//! something else lies outside the subset (strings, arrays that grow, maps, recursion), the whole
//! callback stays with the interpreter, and [`Outside`] says why. Nothing is guessed: what can be
//! lowered gives the bits that the interpreter gives, and traps where the interpreter reports an
//! error or runs out of its operations.
//!
//! With `syntax`, this is the only place that reads Rhai's syntax tree.

mod builtin;
mod call;
mod chain;
mod expr;
mod function;
mod loops;
mod stmt;
mod switch;
#[cfg(test)]
mod tests;
mod value;

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;
use std::sync::Arc;

use rhai::Position;

use function::File;
pub(super) use function::Library;
use value::{Binding, Val};

use super::engine::CALLBACK_OPERATIONS;
use super::value::Value;
use crate::jit::Program;
use crate::jit::ir::{self, Binary, Compare, Label, Stmt, Type, Unary};
use crate::mdp::Schema;

/// Why a callback is not lowered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Outside {
    /// What lies outside the subset: `a string`.
    pub(super) what: String,
    /// Where.
    pub(super) position: Position,
    /// In which file.
    pub(super) file: Option<Arc<str>>,
}

type Lowered<T> = Result<T, Outside>;

fn outside<T>(what: impl Into<String>, position: Position) -> Lowered<T> {
    Err(Outside { what: what.into(), position, file: None })
}

/// What the host hands to a callback after its captured values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Param {
    /// A state, whose fields are the inputs from this one on.
    State(usize),
    /// A step: its parts are the inputs of [`crate::shaping::StepLayout`].
    Step,
    /// An integer input.
    Int(usize),
}

/// What a callback must return.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Want {
    /// A number; integers count as floats.
    Number,
    /// An integer.
    Integer,
    /// The index of a cell in a table of this shape, or one index per dimension.
    Cell(Vec<usize>),
    /// A truth value.
    Flag,
}

impl Want {
    fn result(&self) -> Type {
        match self {
            Self::Number => Type::Float,
            Self::Integer | Self::Cell(_) => Type::Int,
            Self::Flag => Type::Bool,
        }
    }
}

/// A callback as the lowering needs to know it.
pub(super) struct Subject<'a> {
    /// The function's name.
    pub(super) function: &'a str,
    /// Its captured values.
    pub(super) captures: &'a [Value],
    /// What it gets after those.
    pub(super) params: &'a [Param],
    /// How many inputs there are.
    pub(super) n_inputs: usize,
    /// What it must return.
    pub(super) want: Want,
}

/// Lowers `subject`, a callback on states with this `schema`, in a script with these functions and
/// `constants`.
///
/// # Errors
/// If it lies outside the subset.
pub(super) fn lower(
    subject: &Subject<'_>,
    library: &Library,
    constants: &BTreeMap<String, Value>,
    schema: &Schema,
) -> Lowered<Program> {
    let mut lowering = Lowering {
        library,
        file: 0,
        constants,
        schema,
        want: subject.want.clone(),
        program: Program {
            n_inputs: subject.n_inputs,
            locals: Vec::new(),
            arrays: Vec::new(),
            tables: Vec::new(),
            fuel: 0,
            result: subject.want.result(),
            body: Vec::new(),
        },
        n_labels: 0,
        code: Vec::new(),
        scope: Vec::new(),
        frames: Vec::new(),
        loops: Vec::new(),
        cost: 0,
    };
    lowering.root(subject).map_err(|outside| Outside {
        file: Some(library.file(lowering.file).name.clone()),
        ..outside
    })
}

/// Where an inlined function's `return` goes.
enum Return {
    /// To the host.
    Root,
    /// After the block `label`, with the value in `value`.
    Inlined { label: Label, value: Option<Val>, count: usize },
}

/// A function being inlined.
struct Frame {
    file: usize,
    name: String,
    n_params: usize,
    assigned: Rc<BTreeSet<String>>,
    /// How it returns; `None` as the one below does, for calls in the last place.
    returns: Option<Return>,
}

/// A loop being lowered.
struct Loop {
    /// The block around it.
    exit: Label,
    /// The block around its body.
    next: Label,
    /// Whether something in it leaves it.
    breaks: bool,
}

/// The work in progress.
struct Lowering<'a> {
    library: &'a Library,
    /// The file of the innermost function.
    file: usize,
    constants: &'a BTreeMap<String, Value>,
    schema: &'a Schema,
    want: Want,
    program: Program,
    n_labels: usize,
    /// The statements of the innermost block so far.
    code: Vec<Stmt>,
    /// The variables of the innermost function.
    scope: Vec<Binding>,
    frames: Vec<Frame>,
    /// The loops of the innermost function.
    loops: Vec<Loop>,
    /// A bound on the operations that the interpreter counts for what is lowered so far, every loop's
    /// body once.
    cost: u64,
}

/// Operations that the interpreter counts at most for a node of the syntax tree.
const NODE_COST: u64 = 4;
/// Nodes that a callback may have with everything it calls: beyond, machine code would be long in
/// the making.
const MAX_NODES: u64 = 20_000;
/// How deep calls may be nested: the interpreter's own limit is 48, for the functions of a script
/// that the host calls.
const MAX_DEPTH: usize = 32;
/// Locals at most: the interpreter allows 512 variables at a time.
const MAX_LOCALS: usize = 400;

impl Lowering<'_> {
    fn root(&mut self, subject: &Subject<'_>) -> Lowered<Program> {
        let arity = subject.captures.len() + subject.params.len();
        let Some(function) = self.file().get(subject.function, arity) else {
            return outside("a function that is not the script's", Position::NONE);
        };
        let mut args: Vec<Val> = subject.captures.iter().map(Val::of).collect();
        args.extend(subject.params.iter().map(|param| match param {
            Param::State(offset) => Val::State(*offset),
            Param::Step => Val::Step,
            Param::Int(input) => Val::Num(ir::Expr::Input(*input, Type::Int)),
        }));
        // The host's own part of a call.
        self.cost = 16 + NODE_COST * arity as u64;
        self.enter(subject.function, &function, args, Some(Return::Root), Position::NONE)?;
        self.tail_block(&function.body)?;
        let operations = CALLBACK_OPERATIONS as i64;
        self.program.fuel = operations - self.cost as i64;
        self.program.body = std::mem::take(&mut self.code);
        Ok(self.program.clone())
    }

    /// The file of the innermost function.
    fn file(&self) -> Rc<File> {
        self.library.file(self.file).clone()
    }

    /// Counts a node.
    fn count(&mut self, position: Position) -> Lowered<()> {
        self.cost += NODE_COST;
        if self.cost > NODE_COST * MAX_NODES {
            return outside("a function that is too long, with all that it calls", position);
        }
        Ok(())
    }

    fn label(&mut self) -> Label {
        self.n_labels += 1;
        Label(self.n_labels - 1)
    }

    fn local(&mut self, ty: Type, position: Position) -> Lowered<usize> {
        if self.program.locals.len() == MAX_LOCALS {
            return outside(
                "too many variables, those of all functions that are called included",
                position,
            );
        }
        self.program.locals.push(ty);
        Ok(self.program.locals.len() - 1)
    }

    /// `expr` in a local of its own, so that it is evaluated here and now.
    fn hold(&mut self, expr: ir::Expr, position: Position) -> Lowered<ir::Expr> {
        let local = self.local(self.program.type_of(&expr), position)?;
        self.code.push(Stmt::Set(local, expr));
        Ok(ir::Expr::Local(local))
    }

    /// As [`Self::hold`], unless evaluating it again costs nothing and gives the same.
    fn held(&mut self, expr: ir::Expr, position: Position) -> Lowered<ir::Expr> {
        if is_stable(&expr) { Ok(expr) } else { self.hold(expr, position) }
    }

    /// What `lower` emits, apart.
    fn nested<T>(
        &mut self,
        lower: impl FnOnce(&mut Self) -> Lowered<T>,
    ) -> Lowered<(Vec<Stmt>, T)> {
        let outer = std::mem::take(&mut self.code);
        let n_bindings = self.scope.len();
        let result = lower(self);
        self.scope.truncate(n_bindings);
        let code = std::mem::replace(&mut self.code, outer);
        Ok((code, result?))
    }

    /// Traps unless `0 <= index < n`; gives the index in a local.
    fn in_range(&mut self, index: ir::Expr, n: usize, position: Position) -> Lowered<ir::Expr> {
        let index = self.held(index, position)?;
        let compare = |op, with| {
            ir::Expr::Binary(Binary::Int(op), index.clone().into(), ir::Expr::Int(with).into())
        };
        let beyond =
            ir::Expr::Or(compare(Compare::Lt, 0).into(), compare(Compare::Ge, n as i64).into());
        self.code.push(Stmt::If(beyond, vec![Stmt::Trap], Vec::new()));
        Ok(index)
    }

    /// Returns `val` from the innermost function.
    fn emit_return(&mut self, val: Val, position: Position) -> Lowered<()> {
        if matches!(val, Val::Never) {
            return Ok(());
        }
        let frame = self.frames.iter().rposition(|f| f.returns.is_some()).expect("the root's");
        let is_root = matches!(self.frames[frame].returns, Some(Return::Root));
        if is_root { self.return_to_host(val, position) } else { self.leave(frame, val, position) }
    }

    fn return_to_host(&mut self, val: Val, position: Position) -> Lowered<()> {
        let want = self.want.clone();
        let stmt = match (want, val) {
            (_, Val::Mixed(what)) => return outside(what, position),
            (Want::Number, Val::Num(e)) => match self.program.type_of(&e) {
                Type::Float => Stmt::Return(e),
                Type::Int => Stmt::Return(ir::Expr::Unary(Unary::IntToFloat, e.into())),
                Type::Bool => Stmt::Trap,
            },
            (Want::Integer, Val::Num(e)) if self.program.type_of(&e) == Type::Int => {
                Stmt::Return(e)
            }
            (Want::Flag, Val::Num(e)) if self.program.type_of(&e) == Type::Bool => Stmt::Return(e),
            (Want::Cell(shape), Val::Num(e)) if shape.len() == 1 => {
                return self.return_cell(&shape, vec![e], position);
            }
            (Want::Cell(shape), val) => {
                if let Some(indices) = self.elements(&val) {
                    return self.return_cell(&shape, indices, position);
                }
                Stmt::Trap
            }
            // The interpreter says what is wrong with it.
            _ => Stmt::Trap,
        };
        self.code.push(stmt);
        Ok(())
    }

    /// Returns the row-major index of the cell that `indices` name.
    fn return_cell(
        &mut self,
        shape: &[usize],
        indices: Vec<ir::Expr>,
        position: Position,
    ) -> Lowered<()> {
        let all_ints = indices.iter().all(|e| self.program.type_of(e) == Type::Int);
        if indices.len() != shape.len() || !all_ints {
            self.code.push(Stmt::Trap);
            return Ok(());
        }
        let mut cell: Option<ir::Expr> = None;
        for (index, &n) in indices.into_iter().zip(shape) {
            let index = self.in_range(index, n, position)?;
            cell = Some(match cell {
                None => index,
                Some(cell) => {
                    let n = ir::Expr::Int(n as i64).into();
                    let row = ir::Expr::Binary(Binary::MulInt, cell.into(), n);
                    ir::Expr::Binary(Binary::AddInt, row.into(), index.into())
                }
            });
        }
        self.code.push(cell.map_or(Stmt::Trap, Stmt::Return));
        Ok(())
    }
}

/// Whether an expression costs nothing and is the same wherever it is evaluated.
fn is_stable(expr: &ir::Expr) -> bool {
    use ir::Expr::{Bool, Float, Input, Int};
    matches!(expr, Float(_) | Int(_) | Bool(_) | Input(..))
}

/// Whether evaluating an expression may trap.
fn may_trap(expr: &ir::Expr) -> bool {
    match expr {
        ir::Expr::Float(_)
        | ir::Expr::Int(_)
        | ir::Expr::Bool(_)
        | ir::Expr::Input(..)
        | ir::Expr::Local(_) => false,
        ir::Expr::Table(..) | ir::Expr::Element(..) => true,
        ir::Expr::Unary(op, x) => matches!(op, Unary::NegInt | Unary::AbsInt) || may_trap(x),
        ir::Expr::Binary(op, a, b) => {
            let traps = matches!(
                op,
                Binary::AddInt | Binary::SubInt | Binary::MulInt | Binary::DivInt | Binary::RemInt
            );
            traps || may_trap(a) || may_trap(b)
        }
        ir::Expr::And(a, b) | ir::Expr::Or(a, b) | ir::Expr::Call2(_, a, b) => {
            may_trap(a) || may_trap(b)
        }
        ir::Expr::Call1(_, x) => may_trap(x),
    }
}
