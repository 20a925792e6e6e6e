//! Statements as Cranelift's blocks.

use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::{
    AbiParam, Block, InstBuilder, MemFlagsData, SigRef, Signature, StackSlot, StackSlotData,
    StackSlotKind, Value, types,
};
use cranelift_codegen::isa::TargetFrontendConfig;
use cranelift_frontend::{FunctionBuilder, Variable};

use super::range::Ranges;
use crate::jit::ir::{Expr, Label, Program, Stmt, Type, Unary};

/// Operations that two branches may have together to be evaluated both. A mispredicted branch costs
/// some 15 cycles.
const SELECTED: u32 = 8;

/// Memory of the frame.
pub(super) const FRAME: MemFlagsData = MemFlagsData::trusted();

/// A function under construction.
pub(super) struct Build<'a> {
    pub(super) program: &'a Program,
    pub(super) b: FunctionBuilder<'a>,
    pub(super) locals: Vec<Variable>,
    pub(super) arrays: Vec<StackSlot>,
    /// The addresses of the tables.
    pub(super) tables: Vec<i64>,
    /// The address of the inputs.
    pub(super) inputs: Value,
    /// Operations left.
    fuel: Variable,
    /// Where traps go.
    pub(super) trap: Block,
    /// Where [`Stmt::Exit`] and [`Stmt::Again`] go.
    labels: Vec<(Label, Block)>,
    /// The signatures of functions of one float, and of two.
    pub(super) calls: [SigRef; 2],
    /// What is known of values.
    pub(super) ranges: Ranges,
}

/// The body of the function of a checked program, whose tables begin at the address `constants`.
pub(super) fn function(
    program: &Program,
    constants: i64,
    mut b: FunctionBuilder<'_>,
    target: TargetFrontendConfig,
) {
    let entry = b.create_block();
    b.append_block_params_for_function_params(entry);
    b.switch_to_block(entry);
    b.seal_block(entry);
    let inputs = b.block_params(entry)[0];
    let trap = b.create_block();
    b.set_cold_block(trap);
    let locals = program.locals.iter().map(|ty| b.declare_var(machine_type(*ty))).collect();
    let fuel = b.declare_var(types::I64);
    let full = b.ins().iconst(types::I64, program.fuel);
    b.def_var(fuel, full);
    let mut arrays = Vec::with_capacity(program.arrays.len());
    for (_, len) in &program.arrays {
        let slot = StackSlotData::new(StackSlotKind::ExplicitSlot, 8 * *len as u32, 3);
        arrays.push(b.create_sized_stack_slot(slot));
    }
    let mut tables = Vec::with_capacity(program.tables.len());
    let mut at = constants;
    for table in &program.tables {
        tables.push(at);
        at = at.wrapping_add(8 * table.len() as i64);
    }
    let calls = [1, 2].map(|n| {
        let mut signature = Signature::new(target.default_call_conv);
        signature.params.extend((0..n).map(|_| AbiParam::new(types::F64)));
        signature.returns.push(AbiParam::new(types::F64));
        b.import_signature(signature)
    });
    let (labels, ranges) = (Vec::new(), Ranges::new());
    let mut build =
        Build { program, b, locals, arrays, tables, inputs, fuel, trap, labels, calls, ranges };
    if build.list(&program.body) {
        build.b.ins().jump(trap, &[]);
    }
    build.b.switch_to_block(trap);
    build.b.seal_block(trap);
    let sign = match program.result {
        Type::Float => build.b.ins().f64const(f64::NAN),
        Type::Int | Type::Bool => build.b.ins().iconst(types::I64, i64::MIN),
    };
    build.b.ins().return_(&[sign]);
    build.b.finalize(target);
}

/// How a value of a type is held.
pub(super) fn machine_type(ty: Type) -> types::Type {
    match ty {
        Type::Float => types::F64,
        Type::Int => types::I64,
        Type::Bool => types::I8,
    }
}

impl Build<'_> {
    /// A new block, begun, that only the current one leads to.
    pub(super) fn begin(&mut self, block: Block) {
        self.b.switch_to_block(block);
        self.b.seal_block(block);
    }

    /// Statements in the current block. Whether it goes on after them.
    fn list(&mut self, list: &[Stmt]) -> bool {
        list.iter().all(|stmt| self.stmt(stmt))
    }

    fn stmt(&mut self, stmt: &Stmt) -> bool {
        match stmt {
            Stmt::Set(i, value) => {
                let value = self.value(value);
                self.b.def_var(self.locals[*i], value);
            }
            Stmt::SetElement(i, at, value) => {
                let value = self.value(value);
                let address = self.b.ins().stack_addr(types::I64, self.arrays[*i], 0);
                self.b.ins().store(FRAME, value, address, 8 * *at as i32);
            }
            Stmt::Check(value) => {
                self.value(value);
            }
            Stmt::If(condition, yes, no) => return self.choice(condition, yes, no),
            Stmt::Block(label, list) => {
                let end = self.b.create_block();
                self.labels.push((*label, end));
                if self.list(list) {
                    self.b.ins().jump(end, &[]);
                }
                self.labels.pop();
                self.begin(end);
            }
            Stmt::Loop(label, list) => {
                let head = self.b.create_block();
                self.b.ins().jump(head, &[]);
                self.b.switch_to_block(head);
                self.labels.push((*label, head));
                let goes_on = self.list(list);
                self.labels.pop();
                self.b.seal_block(head);
                return goes_on;
            }
            Stmt::Exit(label) => {
                let end = self.block(*label);
                self.b.ins().jump(end, &[]);
                return false;
            }
            Stmt::Again(label, operations) => {
                let fuel = self.b.use_var(self.fuel);
                let left = self.b.ins().iadd_imm_s(fuel, -i64::from(*operations));
                self.b.def_var(self.fuel, left);
                let empty = self.b.ins().icmp_imm_s(IntCC::SignedLessThan, left, 0);
                let head = self.block(*label);
                self.b.ins().brif(empty, self.trap, &[], head, &[]);
                return false;
            }
            Stmt::Return(value) => {
                let value = self.returned(value);
                self.b.ins().return_(&[value]);
                return false;
            }
            Stmt::Trap => {
                self.b.ins().jump(self.trap, &[]);
                return false;
            }
        }
        true
    }

    /// The block of a label around.
    fn block(&self, label: Label) -> Block {
        let found = self.labels.iter().rfind(|(l, _)| *l == label);
        found.expect("checked: the label is around").1
    }

    /// A value as the function returns it.
    fn returned(&mut self, value: &Expr) -> Value {
        let value = self.value(value);
        match self.program.result {
            Type::Bool => self.b.ins().uextend(types::I64, value),
            Type::Float | Type::Int => value,
        }
    }

    fn choice(&mut self, condition: &Expr, yes: &[Stmt], no: &[Stmt]) -> bool {
        if self.selects(condition, yes, no) {
            return true;
        }
        let trap = self.trap;
        let [start, other, end] = [yes, no, &[]].map(|list| match list {
            [Stmt::Trap, ..] => trap,
            _ => self.b.create_block(),
        });
        // Without an arm of its own, a condition that fails leads to what follows.
        let fails = if no.is_empty() { end } else { other };
        self.branch(condition, start, fails);
        let mut goes_on = no.is_empty();
        for (block, list) in [(start, yes), (other, no)] {
            if block == trap || (list.is_empty() && block == other) {
                continue;
            }
            self.begin(block);
            if self.list(list) {
                self.b.ins().jump(end, &[]);
                goes_on = true;
            }
        }
        if goes_on {
            self.begin(end);
        }
        goes_on
    }

    /// Goes on at `yes` if the condition holds, else at `no`.
    fn branch(&mut self, condition: &Expr, yes: Block, no: Block) {
        match condition {
            Expr::Bool(holds) => {
                self.b.ins().jump(if *holds { yes } else { no }, &[]);
            }
            Expr::Unary(Unary::Not, x) => self.branch(x, no, yes),
            Expr::And(x, y) if !self.is_cheap(y) => {
                let next = self.b.create_block();
                self.branch(x, next, no);
                self.begin(next);
                self.branch(y, yes, no);
            }
            Expr::Or(x, y) if !self.is_cheap(y) => {
                let next = self.b.create_block();
                self.branch(x, yes, next);
                self.begin(next);
                self.branch(y, yes, no);
            }
            _ => {
                let holds = self.value(condition);
                self.b.ins().brif(holds, yes, &[], no, &[]);
            }
        }
    }

    /// Both arms of a choice without a branch, if they only set locals to what is cheap and cannot
    /// trap.
    fn selects(&mut self, condition: &Expr, yes: &[Stmt], no: &[Stmt]) -> bool {
        let mut cost = 0;
        let mut set = Vec::new();
        for stmt in yes.iter().chain(no) {
            match stmt {
                Stmt::Set(i, value) if let Some(more) = super::value::cost(value) => {
                    cost += 1 + more;
                    if !set.contains(i) {
                        set.push(*i);
                    }
                }
                _ => return false,
            }
        }
        if cost > SELECTED {
            return false;
        }
        let condition = self.value(condition);
        let before: Vec<_> = set.iter().map(|i| self.b.use_var(self.locals[*i])).collect();
        self.list(yes);
        let one: Vec<_> = set.iter().map(|i| self.b.use_var(self.locals[*i])).collect();
        for (i, value) in set.iter().zip(before) {
            self.b.def_var(self.locals[*i], value);
        }
        self.list(no);
        for (i, one) in set.iter().zip(one) {
            let other = self.b.use_var(self.locals[*i]);
            let value = self.select(condition, one, other);
            self.b.def_var(self.locals[*i], value);
        }
        true
    }
}
