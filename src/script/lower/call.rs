//! Calls: a script's functions are inlined, everything else is an operator or a mathematical
//! function.

use rhai::{Expr, FnCallExpr, Position, Stmt as Syntax};

use super::function::Function;
use super::value::{Binding, Slot, Val};
use super::{Frame, Lowered, Lowering, MAX_DEPTH, Return, is_stable, outside};
use crate::jit::ir::{self, Stmt};

/// What a function returns whose `return`s do not agree.
const MIXED: &str = "a function that returns a value on one path only, or one type here and another \
                     there";

impl Lowering<'_> {
    /// The value of a call.
    pub(super) fn call(&mut self, call: &FnCallExpr, position: Position) -> Lowered<Val> {
        if call.capture_parent_scope {
            return outside("a function that sees its caller's variables", position);
        }
        let name = call.name.as_str();
        let args = self.args(call)?;
        for arg in &args {
            if let Val::Mixed(what) = arg {
                return outside(*what, position);
            }
        }
        if call.is_qualified() {
            let file = self.module(call, position)?;
            return self.inline(file, name, args, position);
        }
        if call.op_token.is_none() && self.file().contains(name, Some(args.len())) {
            return self.inline(self.file, name, args, position);
        }
        if call.op_token.is_none() && self.file().contains(name, None) {
            return outside(format!("`{name}` with another number of arguments"), position);
        }
        self.builtin(name, &args, position)
    }

    /// The file of a function called as `alias::name(…)`.
    fn module(&self, call: &FnCallExpr, position: Position) -> Lowered<usize> {
        let alias = match call.namespace.path.as_slice() {
            [alias] => alias.as_str(),
            _ => return outside("a module's module", position),
        };
        match self.file().aliases.get(alias) {
            Some(&file) if self.library.file(file).is_public(&call.name, call.args.len()) => {
                Ok(file)
            }
            _ => outside(format!("the module `{alias}`"), position),
        }
    }

    /// The arguments of a call. A variable in the first place is read after the others are evaluated:
    /// Rhai hands it over as a reference.
    fn args(&mut self, call: &FnCallExpr) -> Lowered<Vec<Val>> {
        match call.args.split_first() {
            Some((first @ Expr::Variable(..), rest)) => {
                let mut args = self.in_order(rest.iter().chain(std::iter::once(first)))?;
                args.rotate_right(1);
                Ok(args)
            }
            _ => self.in_order(call.args.iter()),
        }
    }

    /// Binds the parameters of `function`, which is begun.
    pub(super) fn enter(
        &mut self,
        name: &str,
        function: &Function,
        args: Vec<Val>,
        returns: Option<Return>,
        position: Position,
    ) -> Lowered<()> {
        let file = self.file;
        let is_same = |f: &Frame| f.file == file && f.name == name && f.n_params == args.len();
        if self.frames.iter().any(is_same) {
            return outside("a function that calls itself", position);
        }
        if self.frames.len() == MAX_DEPTH {
            return outside("calls that are nested too deeply", position);
        }
        let mut bindings = Vec::with_capacity(args.len());
        for (param, arg) in function.params.iter().zip(args) {
            let slot = self.slot(function.assigned.contains(param), arg, position)?;
            bindings.push(Binding { name: param.clone(), slot });
        }
        self.scope = bindings;
        self.frames.push(Frame {
            file,
            name: name.to_string(),
            n_params: function.params.len(),
            assigned: function.assigned.clone(),
            returns,
        });
        Ok(())
    }

    /// Where a variable that starts as `val` is kept.
    pub(super) fn slot(
        &mut self,
        is_assigned: bool,
        val: Val,
        position: Position,
    ) -> Lowered<Slot> {
        Ok(match val {
            Val::Num(e) if is_assigned || !is_stable(&e) => {
                let local = self.local(self.program.type_of(&e), position)?;
                self.code.push(Stmt::Set(local, e));
                Slot::Local(local)
            }
            Val::Mixed(what) => return outside(what, position),
            Val::Unit if is_assigned => {
                return outside("a variable that gets its value later", position);
            }
            val if is_assigned && !matches!(val, Val::Never) => {
                return outside(
                    format!("{} in a variable that changes", val.described()),
                    position,
                );
            }
            mut val => {
                self.freeze(&mut val, position)?;
                Slot::Fixed(val)
            }
        })
    }

    /// The value of the function `name` of `file` for `args`.
    pub(super) fn inline(
        &mut self,
        file: usize,
        name: &str,
        args: Vec<Val>,
        position: Position,
    ) -> Lowered<Val> {
        if args.iter().any(|v| matches!(v, Val::Never)) {
            return Ok(Val::Never);
        }
        let Some(function) = self.library.file(file).get(name, args.len()) else {
            return outside(format!("`{name}` with another number of arguments"), position);
        };
        self.count(position)?;
        let outer_file = std::mem::replace(&mut self.file, file);
        let outer_scope = std::mem::take(&mut self.scope);
        let outer_loops = std::mem::take(&mut self.loops);
        let label = self.label();
        let returns = Some(Return::Inlined { label, value: None, count: 0 });
        self.enter(name, &function, args, returns, position)?;
        let one = match function.body.as_slice() {
            [Syntax::Expr(expr)] if !matches!(**expr, Expr::Stmt(_)) => Some(expr),
            _ => None,
        };
        let result = if let Some(expr) = one {
            // Most helpers are one expression: no need to leave anything.
            let (code, val) = self.nested(|l| l.expr(expr))?;
            let frame = self.frames.pop().expect("just entered");
            if let Some(Return::Inlined { count: 0, .. }) = frame.returns {
                self.code.extend(code);
                val
            } else {
                return outside("a `return` inside an expression", position);
            }
        } else {
            let (code, ()) = self.nested(|l| l.tail_block(&function.body))?;
            let frame = self.frames.pop().expect("just entered");
            self.code.push(Stmt::Block(label, code));
            match frame.returns {
                Some(Return::Inlined { value: Some(value), .. }) => value,
                _ => Val::Never,
            }
        };
        self.scope = outer_scope;
        self.loops = outer_loops;
        self.file = outer_file;
        Ok(result)
    }

    /// A call in the last place of a function: what it returns, its caller returns.
    pub(super) fn tail_call(&mut self, call: &FnCallExpr, position: Position) -> Lowered<()> {
        let name = call.name.as_str();
        let file = if call.is_qualified() { self.module(call, position)? } else { self.file };
        let is_function = call.op_token.is_none()
            && !call.capture_parent_scope
            && self.library.file(file).contains(name, Some(call.args.len()));
        if !is_function {
            let val = self.call(call, position)?;
            return self.emit_return(val, position);
        }
        let args = self.args(call)?;
        if args.iter().any(|v| matches!(v, Val::Never)) {
            return Ok(());
        }
        let Some(function) = self.library.file(file).get(name, args.len()) else {
            return outside(format!("`{name}` called as a function"), position);
        };
        let outer_file = std::mem::replace(&mut self.file, file);
        let outer_scope = std::mem::take(&mut self.scope);
        let outer_loops = std::mem::take(&mut self.loops);
        self.enter(name, &function, args, None, position)?;
        self.tail_block(&function.body)?;
        self.frames.pop();
        self.scope = outer_scope;
        self.loops = outer_loops;
        self.file = outer_file;
        Ok(())
    }

    /// Leaves the inlined function of `frame` with `val`.
    pub(super) fn leave(&mut self, frame: usize, val: Val, position: Position) -> Lowered<()> {
        let Some(Return::Inlined { label, value, count }) = self.frames[frame].returns.take()
        else {
            unreachable!("the root returns to the host");
        };
        let value = match (value, val) {
            (None, Val::Num(e)) => {
                let local = self.local(self.program.type_of(&e), position)?;
                self.code.push(Stmt::Set(local, e));
                Val::Num(ir::Expr::Local(local))
            }
            (Some(Val::Num(ir::Expr::Local(local))), Val::Num(e))
                if self.program.locals[local] == self.program.type_of(&e) =>
            {
                self.code.push(Stmt::Set(local, e));
                Val::Num(ir::Expr::Local(local))
            }
            (None | Some(Val::Unit), Val::Unit) => Val::Unit,
            (None, mut val) => {
                self.freeze(&mut val, position)?;
                val
            }
            (Some(_), val) => {
                self.discard(val);
                Val::Mixed(MIXED)
            }
        };
        self.code.push(Stmt::Exit(label));
        self.frames[frame].returns =
            Some(Return::Inlined { label, value: Some(value), count: count + 1 });
        Ok(())
    }
}
