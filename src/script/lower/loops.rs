//! Loops.

use rhai::{Expr, FlowControl, Ident, Position, Token};

use super::chain::UNEVEN;
use super::value::{Binding, Slot, Val};
use super::{Loop, Lowered, Lowering, outside};
use crate::jit::ir::{self, Binary, Compare, Label, Stmt, Type};
use crate::script::value::Value;

/// Elements of an array of constants over which a loop is written out, if they are no table.
const MAX_UNROLLED: usize = 64;

fn compare(how: Compare, a: &ir::Expr, b: &ir::Expr) -> ir::Expr {
    ir::Expr::Binary(Binary::Int(how), a.clone().into(), b.clone().into())
}

fn plus(a: &ir::Expr, n: i64) -> ir::Expr {
    ir::Expr::Binary(Binary::AddInt, a.clone().into(), ir::Expr::Int(n).into())
}

/// What a loop goes over.
enum Over {
    /// Integers from `lo` on by `step`, to `hi` or one step short of it.
    Range { lo: ir::Expr, hi: ir::Expr, step: i64, inclusive: bool },
    /// The elements of an array, which are as many.
    Array(Val, usize),
    /// Constants.
    Written(Vec<Value>),
}

impl Lowering<'_> {
    /// The body of a loop, between `exit` and a block of its own. The flag says whether it breaks.
    fn body(&mut self, x: &FlowControl, exit: Label) -> Lowered<(Stmt, bool)> {
        let next = self.label();
        self.loops.push(Loop { exit, next, breaks: false });
        let (code, ()) = self.nested(|l| {
            let val = l.block_value(x.body.statements())?;
            l.discard(val);
            Ok(())
        })?;
        let breaks = self.loops.pop().expect("just pushed").breaks;
        Ok((Stmt::Block(next, code), breaks))
    }

    /// Operations of one round, after `before`.
    fn round(&self, before: u64) -> u32 {
        // A round of an empty loop is counted too.
        (self.cost - before + super::NODE_COST) as u32
    }

    pub(super) fn while_loop(&mut self, x: &FlowControl, position: Position) -> Lowered<Val> {
        let (exit, top) = (self.label(), self.label());
        let before = self.cost;
        self.count(position)?;
        let is_endless = matches!(x.expr, Expr::Unit(..) | Expr::BoolConstant(true, ..));
        let mut code = Vec::new();
        if !is_endless {
            let (condition_code, condition) = self.nested(|l| l.condition(&x.expr))?;
            code.extend(condition_code);
            code.push(Stmt::If(condition, Vec::new(), vec![Stmt::Exit(exit)]));
        }
        let (body, breaks) = self.body(x, exit)?;
        code.extend([body, Stmt::Again(top, self.round(before))]);
        self.code.push(Stmt::Block(exit, vec![Stmt::Loop(top, code)]));
        Ok(if is_endless && !breaks { Val::Never } else { Val::Unit })
    }

    /// `do { … } while condition`, or `until` it. What continues it skips the condition.
    pub(super) fn do_loop(
        &mut self,
        x: &FlowControl,
        until: bool,
        position: Position,
    ) -> Lowered<Val> {
        let (exit, top, next) = (self.label(), self.label(), self.label());
        let before = self.cost;
        self.count(position)?;
        self.loops.push(Loop { exit, next, breaks: false });
        let (mut code, ends) = self.nested(|l| {
            let val = l.block_value(x.body.statements())?;
            let ends = matches!(val, Val::Never);
            l.discard(val);
            Ok(ends)
        })?;
        self.loops.pop();
        if !ends {
            let (condition_code, condition) = self.nested(|l| l.condition(&x.expr))?;
            code.extend(condition_code);
            let leave = vec![Stmt::Exit(exit)];
            code.push(if until {
                Stmt::If(condition, leave, Vec::new())
            } else {
                Stmt::If(condition, Vec::new(), leave)
            });
        }
        let round = vec![Stmt::Block(next, code), Stmt::Again(top, self.round(before))];
        self.code.push(Stmt::Block(exit, vec![Stmt::Loop(top, round)]));
        Ok(Val::Unit)
    }

    pub(super) fn break_loop(
        &mut self,
        has_value: bool,
        is_break: bool,
        position: Position,
    ) -> Lowered<Val> {
        if has_value {
            return outside("`break` with a value", position);
        }
        let Some(innermost) = self.loops.last_mut() else {
            return outside("`break` outside a loop", position);
        };
        innermost.breaks |= is_break;
        let to = if is_break { innermost.exit } else { innermost.next };
        self.code.push(Stmt::Exit(to));
        Ok(Val::Never)
    }

    /// What comes after `in`.
    fn over(&mut self, expr: &Expr) -> Lowered<Over> {
        let position = expr.start_position();
        if let Expr::FnCall(call, _) = expr {
            let operator = match call.op_token {
                Some(Token::ExclusiveRange) => Some(false),
                Some(Token::InclusiveRange) => Some(true),
                _ => None,
            };
            let is_range = call.name == "range"
                && !call.is_qualified()
                && !self.file().contains("range", Some(call.args.len()));
            if operator.is_some() || is_range {
                self.count(position)?;
                let vals = self.in_order(call.args.iter())?;
                let ints: Option<Vec<ir::Expr>> = vals
                    .iter()
                    .map(|v| self.number(v).filter(|(_, ty)| *ty == Type::Int).map(|(e, _)| e))
                    .collect();
                let (lo, hi, step) = match ints.as_deref() {
                    Some([lo, hi]) => (lo.clone(), hi.clone(), 1),
                    Some([lo, hi, ir::Expr::Int(step)]) if *step != 0 => {
                        (lo.clone(), hi.clone(), *step)
                    }
                    _ => return outside("a range of other things than integers", position),
                };
                let (lo, hi) = (self.held(lo, position)?, self.held(hi, position)?);
                return Ok(Over::Range { lo, hi, step, inclusive: operator == Some(true) });
            }
        }
        let val = self.expr(expr)?;
        if let Val::Data(value) = &val
            && let Value::Array(items) = &**value
        {
            return match self.table(value) {
                Some(slice) => Ok(Over::Array(slice, items.len())),
                None if items.len() <= MAX_UNROLLED => Ok(Over::Written(items.clone())),
                None => outside(UNEVEN, position),
            };
        }
        match &val {
            Val::Array(id) => Ok(Over::Array(val.clone(), self.program.arrays[*id].1)),
            Val::Slice { dims, .. } => Ok(Over::Array(val.clone(), dims[0])),
            other => outside(format!("a loop over {}", other.described()), position),
        }
    }

    pub(super) fn for_loop(
        &mut self,
        name: &Ident,
        counter: Option<&Ident>,
        x: &FlowControl,
        position: Position,
    ) -> Lowered<Val> {
        let over = self.over(&x.expr)?;
        // The elements of an array that is a constant are constants themselves.
        let is_range = matches!(over, Over::Range { .. });
        if !is_range && self.frames.last().is_some_and(|f| f.assigned.contains(name.as_str())) {
            return outside(format!("an assignment to `{}`", name.as_str()), name.pos);
        }
        let exit = self.label();
        let n_bindings = self.scope.len();
        let (code, ()) = self.nested(|l| {
            let round = match counter {
                Some(counter) => {
                    let local = l.local(Type::Int, position)?;
                    l.code.push(Stmt::Set(local, ir::Expr::Int(-1)));
                    Some((counter, local))
                }
                None => None,
            };
            match over {
                Over::Range { lo, hi, step, inclusive } => {
                    l.over_range(name, round, x, exit, (lo, hi, step, inclusive))
                }
                Over::Array(array, n) => l.over_array(name, round, x, exit, &array, n),
                Over::Written(items) => {
                    for item in &items {
                        let body = l.over_item(name, round, x, exit, Val::of(item))?;
                        l.code.push(body);
                    }
                    Ok(())
                }
            }
        })?;
        self.scope.truncate(n_bindings);
        self.code.push(Stmt::Block(exit, code));
        Ok(Val::Unit)
    }

    /// The body for one element.
    fn over_item(
        &mut self,
        name: &Ident,
        counter: Option<(&Ident, usize)>,
        x: &FlowControl,
        exit: Label,
        item: Val,
    ) -> Lowered<Stmt> {
        let n_bindings = self.scope.len();
        self.count(name.pos)?;
        let assigned = |l: &Self, name: &str| {
            l.frames.last().is_some_and(|frame| frame.assigned.contains(name))
        };
        if let Some((counter, local)) = counter {
            let next = plus(&ir::Expr::Local(local), 1);
            self.code.push(Stmt::Set(local, next));
            let is_assigned = assigned(self, counter.as_str());
            let slot = if is_assigned {
                self.slot(true, Val::Num(ir::Expr::Local(local)), counter.pos)?
            } else {
                Slot::Local(local)
            };
            self.scope.push(Binding { name: counter.as_str().to_string(), slot });
        }
        let is_assigned = assigned(self, name.as_str());
        let slot = self.slot(is_assigned, item, name.pos)?;
        self.scope.push(Binding { name: name.as_str().to_string(), slot });
        let (body, _) = self.body(x, exit)?;
        self.scope.truncate(n_bindings);
        Ok(body)
    }

    fn over_range(
        &mut self,
        name: &Ident,
        counter: Option<(&Ident, usize)>,
        x: &FlowControl,
        exit: Label,
        (lo, hi, step, inclusive): (ir::Expr, ir::Expr, i64, bool),
    ) -> Lowered<()> {
        let before = self.cost;
        let top = self.label();
        let i = self.local(Type::Int, name.pos)?;
        let at = ir::Expr::Local(i);
        self.code.push(Stmt::Set(i, lo));
        let leave = |how: Compare, with: &ir::Expr| {
            Stmt::If(compare(how, &at, with), vec![Stmt::Exit(exit)], Vec::new())
        };
        if inclusive {
            self.code.push(leave(Compare::Gt, &hi));
        }
        let (mut code, body) =
            self.nested(|l| l.over_item(name, counter, x, exit, Val::Num(at.clone())))?;
        code.push(body);
        let mut round = Vec::new();
        if inclusive {
            // The last may be the largest integer there is.
            code.push(leave(Compare::Eq, &hi));
        } else {
            round.push(leave(if step > 0 { Compare::Ge } else { Compare::Le }, &hi));
        }
        if step.unsigned_abs() != 1 {
            // A step beyond the last integer ends the loop early: for the interpreter to say.
            round.push(Stmt::Check(plus(&at, step)));
        }
        round.extend(code);
        round.push(Stmt::Set(i, plus(&at, step)));
        round.push(Stmt::Again(top, self.round(before)));
        self.code.push(Stmt::Loop(top, round));
        Ok(())
    }

    fn over_array(
        &mut self,
        name: &Ident,
        counter: Option<(&Ident, usize)>,
        x: &FlowControl,
        exit: Label,
        array: &Val,
        n: usize,
    ) -> Lowered<()> {
        let before = self.cost;
        let top = self.label();
        let i = self.local(Type::Int, name.pos)?;
        let at = ir::Expr::Local(i);
        self.code.push(Stmt::Set(i, ir::Expr::Int(0)));
        let (code, body) = self.nested(|l| {
            let item = match array {
                Val::Array(id) => Val::Num(ir::Expr::Element(*id, at.clone().into())),
                slice => l.slice_index(slice, at.clone(), name.pos)?,
            };
            l.over_item(name, counter, x, exit, item)
        })?;
        let end = compare(Compare::Ge, &at, &ir::Expr::Int(n as i64));
        let mut round = vec![Stmt::If(end, vec![Stmt::Exit(exit)], Vec::new())];
        round.extend(code);
        round.extend([body, Stmt::Set(i, plus(&at, 1)), Stmt::Again(top, self.round(before))]);
        self.code.push(Stmt::Loop(top, round));
        Ok(())
    }
}
