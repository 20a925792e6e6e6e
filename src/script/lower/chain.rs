//! Properties, indices and methods: `t.next_state.x`, `s[2]`, `GOALS[i][0]`, `x.abs()`.

use std::rc::Rc;

use rhai::{ASTFlags, BinaryExpr, Expr, FnCallExpr, Position};

use super::expr::is_optional;
use super::value::Val;
use super::{Lowered, Lowering, outside};
use crate::jit::ir::{self, Binary, Compare, Stmt, Type};
use crate::mdp::FieldKind;
use crate::script::value::Value;
use crate::shaping::StepLayout;

/// Why an array of constants is no table.
pub(super) const UNEVEN: &str =
    "an array of other things than numbers of one type (write 1.0 for 1 among floats)";

/// One link of a chain.
enum Link<'e> {
    Property(&'e str),
    Method(&'e FnCallExpr),
    Index(&'e Expr),
}

/// The links of a chain that `expr` is, after what they start from.
fn links(expr: &Expr) -> Lowered<(&Expr, Vec<(Link<'_>, Position)>)> {
    fn parts(expr: &Expr) -> Option<(&BinaryExpr, ASTFlags, bool)> {
        match expr {
            Expr::Dot(x, flags, _) => Some((x, *flags, true)),
            Expr::Index(x, flags, _) => Some((x, *flags, false)),
            _ => None,
        }
    }
    fn link(expr: &Expr, dot: bool) -> Lowered<(Link<'_>, Position)> {
        let position = expr.start_position();
        let link = match (expr, dot) {
            (Expr::Property(x, _), true) => Link::Property(&x.2),
            (Expr::MethodCall(call, _), true) => Link::Method(call),
            (_, true) => return outside("an expression of this kind", position),
            (index, false) => Link::Index(index),
        };
        Ok((link, position))
    }
    let (mut x, mut flags, mut dot) = parts(expr).expect("only asked of chains");
    let base = &x.lhs;
    let mut links = Vec::new();
    loop {
        if is_optional(flags) {
            return outside("`?.`", base.start_position());
        }
        let goes_on = if flags.intersects(ASTFlags::BREAK) { None } else { parts(&x.rhs) };
        let Some((rest, rest_flags, rest_dot)) = goes_on else {
            links.push(link(&x.rhs, dot)?);
            return Ok((base, links));
        };
        links.push(link(&rest.lhs, dot)?);
        (x, flags, dot) = (rest, rest_flags, rest_dot);
    }
}

impl Lowering<'_> {
    /// The value of a chain.
    pub(super) fn chain(&mut self, expr: &Expr) -> Lowered<Val> {
        let (base, links) = links(expr)?;
        // Indices and arguments come first, then what they are applied to.
        let given = links.iter().flat_map(|(link, _)| match link {
            Link::Property(_) => [].iter(),
            Link::Method(call) => call.args.iter(),
            Link::Index(index) => std::slice::from_ref(*index).iter(),
        });
        let mut given = self.in_order(given.chain(std::iter::once(base)))?;
        let mut val = given.pop().expect("the base at least");
        let mut given = given.into_iter();
        for (link, position) in links {
            self.count(position)?;
            val = match link {
                Link::Property(name) => self.property(&val, name, position)?,
                Link::Index(_) => {
                    let index = given.next().expect("one for each index");
                    self.index(&val, &index, position)?
                }
                Link::Method(call) => {
                    let args: Vec<Val> = given.by_ref().take(call.args.len()).collect();
                    self.method(val, call, args, position)?
                }
            };
        }
        Ok(val)
    }

    fn property(&mut self, val: &Val, name: &str, position: Position) -> Lowered<Val> {
        match val {
            Val::State(offset) => self.field(*offset, name, position),
            Val::Step => Self::step_field(name, position),
            Val::Data(value) => match &**value {
                Value::Map(entries) => Ok(entries.get(name).map_or(Val::Unit, Val::of)),
                _ => outside(val.described(), position),
            },
            Val::Num(_) => self.getter(val, name, position),
            other => outside(other.described(), position),
        }
    }

    /// The field or fact `name` of the state whose fields are the inputs from `offset` on.
    fn field(&mut self, offset: usize, name: &str, position: Position) -> Lowered<Val> {
        if let Some(i) = self.schema.fields.iter().position(|f| f.name == name) {
            return Ok(self.nth_field(offset, i));
        }
        let Some((_, kind, x)) = self.schema.facts.iter().find(|(n, ..)| *n == name) else {
            return outside(format!("the unknown field `{name}`"), position);
        };
        Ok(match kind {
            FieldKind::Float => Val::Num(ir::Expr::Float(*x)),
            FieldKind::Int => Val::Num(ir::Expr::Int(*x as i64)),
            FieldKind::Letter => return outside("a string", position),
        })
    }

    fn nth_field(&self, offset: usize, i: usize) -> Val {
        let input = offset + i;
        match self.schema.fields[i].kind {
            FieldKind::Float => Val::Num(ir::Expr::Input(input, Type::Float)),
            FieldKind::Int => Val::Num(ir::Expr::Input(input, Type::Int)),
            FieldKind::Letter => Val::Letter(input),
        }
    }

    fn step_field(name: &str, position: Position) -> Lowered<Val> {
        let input = |i, ty| Ok(Val::Num(ir::Expr::Input(i, ty)));
        match name {
            "state" => Ok(Val::State(StepLayout::STATE)),
            "next_state" => Ok(Val::State(StepLayout::NEXT_STATE)),
            "action" => input(StepLayout::ACTION, Type::Int),
            "reward" => input(StepLayout::REWARD, Type::Float),
            "terminated" => input(StepLayout::TERMINATED, Type::Bool),
            "truncated" => input(StepLayout::TRUNCATED, Type::Bool),
            "step" => input(StepLayout::STEP, Type::Int),
            _ => outside(format!("the unknown field `{name}`"), position),
        }
    }

    /// `val[index]`.
    fn index(&mut self, val: &Val, index: &Val, position: Position) -> Lowered<Val> {
        if let Val::Data(key) = index {
            return match (val, &**key) {
                (Val::State(_) | Val::Step, Value::Str(name)) => self.property(val, name, position),
                (Val::Data(value), Value::Str(name)) if matches!(**value, Value::Map(_)) => {
                    self.property(val, name, position)
                }
                _ => outside(index.described(), position),
            };
        }
        let Some((index, Type::Int)) = self.number(index) else {
            return outside(format!("{} as an index", index.described()), position);
        };
        match val {
            Val::State(offset) => self.state_index(*offset, index, position),
            Val::Array(id) => Ok(Val::Num(ir::Expr::Element(*id, index.into()))),
            Val::Data(value) => {
                let Value::Array(items) = &**value else {
                    return outside(val.described(), position);
                };
                if let ir::Expr::Int(i) = index {
                    return match wrapped(i, items.len()) {
                        Some(i) => Ok(Val::of(&items[i])),
                        None => Ok(self.trap()),
                    };
                }
                match self.table(value) {
                    Some(slice) => self.slice_index(&slice, index, position),
                    None => outside(UNEVEN, position),
                }
            }
            Val::Slice { .. } => self.slice_index(val, index, position),
            other => outside(format!("an index into {}", other.described()), position),
        }
    }

    /// Ends the program here.
    pub(super) fn trap(&mut self) -> Val {
        self.code.push(Stmt::Trap);
        Val::Never
    }

    fn state_index(&mut self, offset: usize, index: ir::Expr, position: Position) -> Lowered<Val> {
        let n = self.schema.fields.len();
        if let ir::Expr::Int(i) = index {
            return Ok(match wrapped(i, n) {
                Some(i) => self.nth_field(offset, i),
                None => self.trap(),
            });
        }
        let ty = match self.schema.fields[0].kind {
            FieldKind::Float => Type::Float,
            FieldKind::Int => Type::Int,
            FieldKind::Letter => return outside("a string", position),
        };
        if self.schema.fields.iter().any(|f| f.kind != self.schema.fields[0].kind) {
            return outside("an index into fields of several types", position);
        }
        self.program.arrays.push((ty, n));
        let id = self.program.arrays.len() - 1;
        for i in 0..n {
            self.code.push(Stmt::SetElement(id, i, ir::Expr::Input(offset + i, ty)));
        }
        Ok(Val::Num(ir::Expr::Element(id, index.into())))
    }

    /// An element or a row of a table.
    pub(super) fn slice_index(
        &mut self,
        val: &Val,
        index: ir::Expr,
        position: Position,
    ) -> Lowered<Val> {
        let Val::Slice { table, dims, offset } = val else {
            return outside(val.described(), position);
        };
        // The table itself wraps negative indices and traps outside.
        if dims.len() == 1
            && matches!(offset, ir::Expr::Int(0))
            && self.program.tables[*table].len() == dims[0]
        {
            return Ok(Val::Num(ir::Expr::Table(*table, index.into())));
        }
        let n = dims[0] as i64;
        let index = self.hold(index, position)?;
        let ir::Expr::Local(local) = index else { unreachable!("just put into a local") };
        let is_negative =
            ir::Expr::Binary(Binary::Int(Compare::Lt), index.clone().into(), int(0).into());
        // Cannot overflow: one is negative, the other is not.
        let from_the_end = ir::Expr::Binary(Binary::AddInt, index.clone().into(), int(n).into());
        self.code.push(Stmt::If(is_negative, vec![Stmt::Set(local, from_the_end)], Vec::new()));
        let index = self.in_range(index, dims[0], position)?;
        let row: usize = dims[1..].iter().product();
        let skipped = ir::Expr::Binary(Binary::MulInt, index.into(), int(row as i64).into());
        let offset = ir::Expr::Binary(Binary::AddInt, offset.clone().into(), skipped.into());
        if dims.len() == 1 {
            return Ok(Val::Num(ir::Expr::Table(*table, offset.into())));
        }
        let offset = self.hold(offset, position)?;
        Ok(Val::Slice { table: *table, dims: Rc::from(&dims[1..]), offset })
    }

    fn method(
        &mut self,
        val: Val,
        call: &FnCallExpr,
        args: Vec<Val>,
        position: Position,
    ) -> Lowered<Val> {
        let name = call.name.as_str();
        if self.file().contains(name, Some(args.len())) {
            return outside(format!("`{name}` called as a method"), position);
        }
        let length = match (&val, name, args.len()) {
            (Val::State(_), "len", 0) => Some(self.schema.fields.len()),
            (Val::Array(id), "len", 0) => Some(self.program.arrays[*id].1),
            (Val::Slice { dims, .. }, "len", 0) => Some(dims[0]),
            (Val::Data(value), "len", 0) => match &**value {
                Value::Array(items) => Some(items.len()),
                _ => None,
            },
            _ => None,
        };
        if let Some(length) = length {
            return Ok(Val::Num(int(length as i64)));
        }
        if let (Val::Data(value), "call") = (&val, name)
            && let Value::Fn { name, captures } = &**value
        {
            let mut all: Vec<Val> = captures.iter().map(Val::of).collect();
            all.extend(args);
            // A script's closures and functions: its modules' are called by their names.
            return self.inline(0, name, all, position);
        }
        let mut all = vec![val];
        all.extend(args);
        self.builtin(name, &all, position)
    }
}

fn int(x: i64) -> ir::Expr {
    ir::Expr::Int(x)
}

/// A constant index, counted from the end if it is negative.
fn wrapped(index: i64, n: usize) -> Option<usize> {
    let index = if index < 0 { index.checked_add(n as i64)? } else { index };
    usize::try_from(index).ok().filter(|i| *i < n)
}
