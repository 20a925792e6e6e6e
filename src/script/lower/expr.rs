//! Expressions.

use std::rc::Rc;

use rhai::{ASTFlags, Expr, Position};

use super::value::{Slot, Val};
use super::{Lowered, Lowering, is_stable, may_trap, outside};
use crate::jit::ir::{self, Stmt, Type};
use crate::script::value::Value;

impl Lowering<'_> {
    /// The value of `expr`.
    pub(super) fn expr(&mut self, expr: &Expr) -> Lowered<Val> {
        let position = expr.start_position();
        self.count(position)?;
        Ok(match expr {
            Expr::FloatConstant(x, _) => Val::Num(ir::Expr::Float(**x)),
            Expr::IntegerConstant(x, _) => Val::Num(ir::Expr::Int(*x)),
            Expr::BoolConstant(x, _) => Val::Num(ir::Expr::Bool(*x)),
            Expr::StringConstant(x, _) => Val::Data(Rc::new(Value::Str(x.to_string()))),
            Expr::CharConstant(x, _) => Val::Data(Rc::new(Value::Char(*x))),
            Expr::Unit(_) => Val::Unit,
            Expr::Variable(x, _, _) if x.2.is_empty() => self.variable(&x.1, position)?,
            Expr::Variable(..) => return outside("a module's constant", position),
            Expr::Stmt(block) => self.block_value(block.statements())?,
            Expr::FnCall(call, pos) => self.call(call, *pos)?,
            Expr::Dot(..) | Expr::Index(..) => self.chain(expr)?,
            Expr::And(list, _) => self.logic(list, true)?,
            Expr::Or(list, _) => self.logic(list, false)?,
            Expr::Array(items, _) => self.array(items, position)?,
            Expr::InterpolatedString(..) => {
                return outside("a string that is put together", position);
            }
            Expr::Map(..) => return outside("a map", position),
            Expr::ThisPtr(_) => return outside("`this`", position),
            Expr::Coalesce(..) => return outside("`??`", position),
            Expr::DynamicConstant(..) => return outside("a function as a value", position),
            _ => return outside("an expression of this kind", position),
        })
    }

    fn variable(&mut self, name: &str, position: Position) -> Lowered<Val> {
        if let Some(binding) = self.scope.iter().rev().find(|b| b.name == name) {
            return Ok(match &binding.slot {
                Slot::Local(local) => Val::Num(ir::Expr::Local(*local)),
                Slot::Fixed(val) => val.clone(),
            });
        }
        if self.file == 0 {
            if let Some(value) = self.constants.get(name) {
                return Ok(Val::of(value));
            }
        } else if let Some(expr) = self.file().constant(name) {
            return self.module_constant(&expr, position);
        }
        let built_in = match name {
            "PI" => std::f64::consts::PI,
            "E" => std::f64::consts::E,
            "INF" => f64::INFINITY,
            _ if self.file == 0 && self.file().contains(name, None) => {
                let function = Value::Fn { name: name.to_string(), captures: Vec::new() };
                return Ok(Val::Data(Rc::new(function)));
            }
            _ => return outside(format!("the variable `{name}`"), position),
        };
        Ok(Val::Num(ir::Expr::Float(built_in)))
    }

    /// A constant of a module, if it is one that can be worked out here.
    fn module_constant(&mut self, expr: &Expr, position: Position) -> Lowered<Val> {
        let outer = std::mem::take(&mut self.scope);
        let (code, val) = self.nested(|l| l.expr(expr))?;
        self.scope = outer;
        let is_known = match &val {
            Val::Num(e) => matches!(e, ir::Expr::Float(_) | ir::Expr::Int(_) | ir::Expr::Bool(_)),
            Val::Data(_) => true,
            _ => false,
        };
        if is_known && code.is_empty() { Ok(val) } else { outside("a module's constant", position) }
    }

    /// The number that `expr` is.
    pub(super) fn numeric(&mut self, expr: &Expr) -> Lowered<(ir::Expr, Type)> {
        let position = expr.start_position();
        let val = self.expr(expr)?;
        match self.number(&val) {
            Some(number) => Ok(number),
            None => outside(val.described(), position),
        }
    }

    /// The truth value that `expr` is.
    pub(super) fn condition(&mut self, expr: &Expr) -> Lowered<ir::Expr> {
        match self.numeric(expr)? {
            (e, Type::Bool) => Ok(e),
            _ => outside("a number as a condition", expr.start_position()),
        }
    }

    /// The values of `exprs`, each as it is when its turn comes: what a later one does to a variable
    /// is not seen by the earlier ones.
    pub(super) fn in_order<'e>(
        &mut self,
        exprs: impl Iterator<Item = &'e Expr>,
    ) -> Lowered<Vec<Val>> {
        let mut vals: Vec<Val> = Vec::new();
        for expr in exprs {
            let before = self.code.len();
            let val = self.expr(expr)?;
            if self.code.len() > before {
                let emitted = self.code.split_off(before);
                for earlier in &mut vals {
                    self.freeze(earlier, expr.start_position())?;
                }
                self.code.extend(emitted);
            }
            vals.push(val);
        }
        Ok(vals)
    }

    /// Evaluates `val` here and now.
    pub(super) fn freeze(&mut self, val: &mut Val, position: Position) -> Lowered<()> {
        if let Val::Num(e) | Val::Slice { offset: e, .. } = val
            && !is_stable(e)
        {
            *e = self.hold(e.clone(), position)?;
        }
        Ok(())
    }

    /// `a && b && …` or `a || b || …`.
    fn logic(&mut self, list: &[Expr], and: bool) -> Lowered<Val> {
        let join = |a: ir::Expr, b: ir::Expr| {
            if and { ir::Expr::And(a.into(), b.into()) } else { ir::Expr::Or(a.into(), b.into()) }
        };
        let Some((first, rest)) = list.split_first() else { return Ok(Val::Unit) };
        let mut so_far = self.condition(first)?;
        for expr in rest {
            if let ir::Expr::Bool(known) = so_far {
                if known != and {
                    return Ok(Val::Num(so_far));
                }
                so_far = self.condition(expr)?;
                continue;
            }
            let (code, next) = self.nested(|l| l.condition(expr))?;
            if code.is_empty() {
                so_far = join(so_far, next);
                continue;
            }
            // What the right side does must not be done if the left one decides.
            let result = self.local(Type::Bool, expr.start_position())?;
            self.code.push(Stmt::Set(result, so_far));
            let mut code = code;
            code.push(Stmt::Set(result, next));
            let decided = ir::Expr::Local(result);
            self.code.push(if and {
                Stmt::If(decided, code, Vec::new())
            } else {
                Stmt::If(decided, Vec::new(), code)
            });
            so_far = ir::Expr::Local(result);
        }
        Ok(Val::Num(so_far))
    }

    /// `[a, b, …]`.
    fn array(&mut self, items: &[Expr], position: Position) -> Lowered<Val> {
        let vals = self.in_order(items.iter())?;
        if let Some(value) = constant_array(&vals) {
            return Ok(Val::Data(Rc::new(value)));
        }
        let numbers: Option<Vec<_>> = vals.iter().map(|v| self.number(v)).collect();
        let Some(numbers) = numbers else {
            return outside("an array of other things than numbers", position);
        };
        let ty = numbers[0].1;
        if numbers.iter().any(|(_, other)| *other != ty) {
            return outside(
                "an array of numbers of several types (write 1.0 for 1 among floats)",
                position,
            );
        }
        if self.program.arrays.iter().map(|a| a.1).sum::<usize>() + numbers.len() > 1024 {
            return outside("arrays that are too long", position);
        }
        self.program.arrays.push((ty, numbers.len()));
        let id = self.program.arrays.len() - 1;
        for (i, (e, _)) in numbers.into_iter().enumerate() {
            self.code.push(Stmt::SetElement(id, i, e));
        }
        Ok(Val::Array(id))
    }

    /// Evaluates `val` for what it may do, which is to trap.
    pub(super) fn discard(&mut self, val: Val) {
        if let Val::Num(e) = val
            && may_trap(&e)
        {
            self.code.push(Stmt::Check(e));
        }
    }
}

/// The array of `vals`, if they are all constants.
fn constant_array(vals: &[Val]) -> Option<Value> {
    let constant = |val: &Val| match val {
        Val::Num(ir::Expr::Float(x)) => Some(Value::Float(*x)),
        Val::Num(ir::Expr::Int(x)) => Some(Value::Int(*x)),
        Val::Num(ir::Expr::Bool(x)) => Some(Value::Bool(*x)),
        Val::Data(value) => Some((**value).clone()),
        _ => None,
    };
    vals.iter().map(constant).collect::<Option<_>>().map(Value::Array)
}

/// Whether a chain is cut off where there is nothing (`?.`).
pub(super) fn is_optional(flags: ASTFlags) -> bool {
    flags.intersects(ASTFlags::NEGATED)
}
