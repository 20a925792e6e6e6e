//! Statements and blocks.

use rhai::{ASTFlags, Expr, FlowControl, Position, Stmt as Syntax};

use super::value::{Binding, Slot, Val};
use super::{Lowered, Lowering, Return, Want, outside};
use crate::jit::ir::{self, Stmt};

/// Types of the two arms of an `if` that differ.
const ARMS: &str = "a number of one type on one path and of another on the other (write 0.0 for 0)";

impl Lowering<'_> {
    /// The value of a block of its own, which is that of its last statement.
    pub(super) fn block_value(&mut self, stmts: &[Syntax]) -> Lowered<Val> {
        let n_bindings = self.scope.len();
        let val = self.statements(stmts);
        self.scope.truncate(n_bindings);
        val
    }

    fn statements(&mut self, stmts: &[Syntax]) -> Lowered<Val> {
        let Some((last, others)) = stmts.split_last() else { return Ok(Val::Unit) };
        for stmt in others {
            let val = self.stmt(stmt)?;
            if matches!(val, Val::Never) {
                return Ok(Val::Never);
            }
            self.discard(val);
        }
        self.stmt(last)
    }

    /// The value of a statement.
    pub(super) fn stmt(&mut self, stmt: &Syntax) -> Lowered<Val> {
        let position = stmt.position();
        self.count(position)?;
        match stmt {
            Syntax::Noop(_) => Ok(Val::Unit),
            Syntax::Expr(expr) => self.expr(expr),
            Syntax::FnCall(call, pos) => self.call(call, *pos),
            Syntax::Block(block) => self.block_value(block.statements()),
            Syntax::Var(x, _, pos) => self.define(x.0.name.as_str(), &x.1, *pos),
            Syntax::Assignment(x) => {
                let op = x.0.get_op_assignment_info().map(|info| info.5);
                self.assign(&x.1.lhs, op, &x.1.rhs, x.0.position())
            }
            Syntax::If(x, _) => self.if_value(x),
            Syntax::Switch(x, pos) => self.switch_value(&x.0, &x.1, *pos),
            Syntax::While(x, pos) => self.while_loop(x, *pos),
            Syntax::Do(x, flags, pos) => self.do_loop(x, flags.intersects(ASTFlags::NEGATED), *pos),
            Syntax::For(x, pos) => self.for_loop(&x.0, x.1.as_ref(), &x.2, *pos),
            Syntax::BreakLoop(expr, flags, pos) => {
                self.break_loop(expr.is_some(), flags.intersects(ASTFlags::BREAK), *pos)
            }
            Syntax::Return(expr, flags, pos) => {
                // What is thrown is for the interpreter to say.
                if flags.intersects(ASTFlags::BREAK) {
                    return Ok(self.trap());
                }
                let val = expr.as_ref().map_or(Ok(Val::Unit), |e| self.expr(e))?;
                self.emit_return(val, *pos)?;
                Ok(Val::Never)
            }
            Syntax::TryCatch(_, pos) => outside("`try`", *pos),
            Syntax::Share(_) => outside("a closure", position),
            _ => outside("a statement of this kind", position),
        }
    }

    /// `let name = expr`.
    fn define(&mut self, name: &str, expr: &Expr, position: Position) -> Lowered<Val> {
        let val = self.expr(expr)?;
        if matches!(val, Val::Never) {
            return Ok(Val::Never);
        }
        let is_assigned = self.frames.last().is_some_and(|frame| frame.assigned.contains(name));
        let slot = self.slot(is_assigned, val, position)?;
        self.scope.push(Binding { name: name.to_string(), slot });
        Ok(Val::Unit)
    }

    /// `lhs = rhs`, or `lhs op= rhs`.
    fn assign(
        &mut self,
        lhs: &Expr,
        op: Option<&str>,
        rhs: &Expr,
        position: Position,
    ) -> Lowered<Val> {
        let Expr::Variable(x, ..) = lhs else {
            return outside("an array, a map or a state that is changed", position);
        };
        let name = x.1.as_str();
        let val = self.expr(rhs)?;
        if matches!(val, Val::Never) {
            return Ok(Val::Never);
        }
        self.count(position)?;
        let binding = self.scope.iter().rev().find(|b| b.name == name);
        let Some(Slot::Local(local)) = binding.map(|b| &b.slot) else {
            return outside(format!("an assignment to `{name}`"), position);
        };
        let local = *local;
        let val = match op {
            Some(op) => self.builtin(op, &[Val::Num(ir::Expr::Local(local)), val], position)?,
            None => val,
        };
        match self.number(&val) {
            Some((e, ty)) if ty == self.program.locals[local] => {
                self.code.push(Stmt::Set(local, e));
                Ok(Val::Unit)
            }
            Some((_, ty)) => {
                let (was, is) = (type_name(self.program.locals[local]), type_name(ty));
                let hint = match ty {
                    ir::Type::Float => " (let it start as 0.0, not 0)",
                    _ => "",
                };
                let what = format!("`{name}`, which holds {was} first and {is} later{hint}");
                outside(what, position)
            }
            None => outside(format!("{} in a variable that changes", val.described()), position),
        }
    }

    fn if_value(&mut self, x: &FlowControl) -> Lowered<Val> {
        let condition = self.condition(&x.expr)?;
        if let ir::Expr::Bool(known) = condition {
            let block = if known { &x.body } else { &x.branch };
            return self.block_value(block.statements());
        }
        let position = x.expr.start_position();
        let yes = self.nested(|l| l.statements(x.body.statements()))?;
        let no = self.nested(|l| l.statements(x.branch.statements()))?;
        self.join(condition, yes, no, position)
    }

    /// One of two arms, each a piece of code with its value.
    pub(super) fn join(
        &mut self,
        condition: ir::Expr,
        (mut yes, yes_val): (Vec<Stmt>, Val),
        (mut no, no_val): (Vec<Stmt>, Val),
        position: Position,
    ) -> Lowered<Val> {
        let val = match (yes_val, no_val) {
            (Val::Never, val) | (val, Val::Never) => val,
            (Val::Num(a), Val::Num(b)) => {
                let ty = self.program.type_of(&a);
                if ty == self.program.type_of(&b) {
                    let result = self.local(ty, position)?;
                    yes.push(Stmt::Set(result, a));
                    no.push(Stmt::Set(result, b));
                    Val::Num(ir::Expr::Local(result))
                } else {
                    yes.push(Stmt::Check(a));
                    no.push(Stmt::Check(b));
                    Val::Mixed(ARMS)
                }
            }
            (Val::Unit, Val::Unit) => Val::Unit,
            (a, b) => {
                for (code, val) in [(&mut yes, a), (&mut no, b)] {
                    if let Val::Num(e) = val {
                        code.push(Stmt::Check(e));
                    }
                }
                Val::Mixed("a value on one path only")
            }
        };
        self.code.push(Stmt::If(condition, yes, no));
        Ok(val)
    }

    /// A function's body, or a part of it after which the function returns: the value of its last
    /// statement is returned.
    pub(super) fn tail_block(&mut self, stmts: &[Syntax]) -> Lowered<()> {
        let n_bindings = self.scope.len();
        let result = self.tail_statements(stmts);
        self.scope.truncate(n_bindings);
        result
    }

    fn tail_statements(&mut self, stmts: &[Syntax]) -> Lowered<()> {
        let Some((last, others)) = stmts.split_last() else {
            return self.emit_return(Val::Unit, Position::NONE);
        };
        for stmt in others {
            let val = self.stmt(stmt)?;
            if matches!(val, Val::Never) {
                return Ok(());
            }
            self.discard(val);
        }
        self.tail_stmt(last)
    }

    fn tail_stmt(&mut self, stmt: &Syntax) -> Lowered<()> {
        let position = stmt.position();
        match stmt {
            Syntax::If(x, _) => {
                self.count(position)?;
                let condition = self.condition(&x.expr)?;
                if let ir::Expr::Bool(known) = condition {
                    let block = if known { &x.body } else { &x.branch };
                    return self.tail_block(block.statements());
                }
                let (yes, ()) = self.nested(|l| l.tail_statements(x.body.statements()))?;
                let (no, ()) = self.nested(|l| l.tail_statements(x.branch.statements()))?;
                self.code.push(Stmt::If(condition, yes, no));
                Ok(())
            }
            Syntax::Block(block) => {
                self.count(position)?;
                self.tail_block(block.statements())
            }
            Syntax::Switch(x, pos) => {
                self.count(position)?;
                self.tail_switch(&x.0, &x.1, *pos)
            }
            Syntax::Expr(expr) => {
                self.count(position)?;
                self.tail_expr(expr)
            }
            Syntax::FnCall(call, pos) => {
                self.count(position)?;
                self.tail_call(call, *pos)
            }
            other => {
                let val = self.stmt(other)?;
                self.emit_return(val, position)
            }
        }
    }

    fn returns_cells(&self) -> bool {
        let frame = self.frames.iter().rev().find_map(|f| f.returns.as_ref());
        matches!((frame, &self.want), (Some(Return::Root), Want::Cell(_)))
    }

    pub(super) fn tail_expr(&mut self, expr: &Expr) -> Lowered<()> {
        let position = expr.start_position();
        match expr {
            Expr::Stmt(block) => {
                self.count(position)?;
                self.tail_block(block.statements())
            }
            Expr::FnCall(call, pos) => {
                self.count(position)?;
                self.tail_call(call, *pos)
            }
            Expr::Array(items, _) if self.returns_cells() => {
                self.count(position)?;
                let vals = self.in_order(items.iter())?;
                let numbers = vals.iter().map(|v| self.number(v).map(|(e, _)| e));
                if let (Some(numbers), Want::Cell(shape)) =
                    (numbers.collect::<Option<Vec<_>>>(), self.want.clone())
                {
                    return self.return_cell(&shape, numbers, position);
                }
                self.trap();
                Ok(())
            }
            other => {
                let val = self.expr(other)?;
                self.emit_return(val, position)
            }
        }
    }
}

fn type_name(ty: ir::Type) -> &'static str {
    match ty {
        ir::Type::Float => "a float",
        ir::Type::Int => "an integer",
        ir::Type::Bool => "a truth value",
    }
}
