//! Expressions as Cranelift's values.

use cranelift_codegen::ir::condcodes::{FloatCC, IntCC};
use cranelift_codegen::ir::{InstBuilder, InstructionData, MemFlagsData, Value, types};

use super::build::{Build, FRAME, machine_type};
use super::range::Range;
use crate::jit::ir::{Binary, Compare, Expr, Type, Unary};

/// Operations that the second operand of a logical one may have to be evaluated always.
const CHEAP: u32 = 6;

/// Inputs: they are there whichever way is taken, and nothing writes to them.
const INPUT: MemFlagsData = MemFlagsData::trusted().with_readonly().with_can_move();

/// Elements of tables: reading one must stay behind the check of its index.
const ELEMENT: MemFlagsData = MemFlagsData::trusted();

/// About how many operations an expression is; `None` if it may trap, or calls.
pub(super) fn cost(expr: &Expr) -> Option<u32> {
    match expr {
        Expr::Float(_) | Expr::Int(_) | Expr::Bool(_) | Expr::Local(_) => Some(0),
        Expr::Input(_, ty) => Some(if *ty == Type::Float { 0 } else { 2 }),
        Expr::Unary(op, x) => {
            let own = match op {
                Unary::NegInt | Unary::AbsInt => return None,
                Unary::Sqrt | Unary::FloatToInt => 5,
                _ => 1,
            };
            Some(own + cost(x)?)
        }
        Expr::Binary(op, x, y) => {
            let own = match op {
                Binary::AddInt
                | Binary::SubInt
                | Binary::MulInt
                | Binary::DivInt
                | Binary::RemInt => return None,
                Binary::DivFloat => 4,
                _ => 1,
            };
            Some(own + cost(x)? + cost(y)?)
        }
        Expr::And(x, y) | Expr::Or(x, y) => Some(1 + cost(x)? + cost(y)?),
        Expr::Call1(..) | Expr::Call2(..) | Expr::Table(..) | Expr::Element(..) => None,
    }
}

fn ordered(how: Compare) -> FloatCC {
    match how {
        Compare::Eq => FloatCC::Equal,
        Compare::Ne => FloatCC::NotEqual,
        Compare::Lt => FloatCC::LessThan,
        Compare::Le => FloatCC::LessThanOrEqual,
        Compare::Gt => FloatCC::GreaterThan,
        Compare::Ge => FloatCC::GreaterThanOrEqual,
    }
}

fn signed(how: Compare) -> IntCC {
    match how {
        Compare::Eq => IntCC::Equal,
        Compare::Ne => IntCC::NotEqual,
        Compare::Lt => IntCC::SignedLessThan,
        Compare::Le => IntCC::SignedLessThanOrEqual,
        Compare::Gt => IntCC::SignedGreaterThan,
        Compare::Ge => IntCC::SignedGreaterThanOrEqual,
    }
}

impl Build<'_> {
    /// Whether an operand is evaluated always rather than branched around.
    #[allow(clippy::unused_self, reason = "reads as a property of the function")]
    pub(super) fn is_cheap(&self, expr: &Expr) -> bool {
        cost(expr).is_some_and(|cost| cost <= CHEAP)
    }

    /// `value`, of which that much is known.
    fn within(&mut self, value: Value, range: Range) -> Value {
        self.ranges[value] = range;
        value
    }

    /// The value of an expression in the current block.
    pub(super) fn value(&mut self, expr: &Expr) -> Value {
        match expr {
            Expr::Float(x) => {
                let value = self.b.ins().f64const(*x);
                self.within(value, Range::constant(*x))
            }
            Expr::Int(x) => self.int(*x),
            Expr::Bool(x) => self.b.ins().iconst(types::I8, i64::from(*x)),
            Expr::Input(i, ty) => {
                let offset = 8 * *i as i32;
                let x = self.b.ins().load(types::F64, INPUT, self.inputs, offset);
                match ty {
                    Type::Float => x,
                    Type::Int => self.b.ins().fcvt_to_sint_sat(types::I64, x),
                    Type::Bool => {
                        let zero = self.b.ins().f64const(0.0);
                        self.b.ins().fcmp(FloatCC::NotEqual, x, zero)
                    }
                }
            }
            Expr::Local(i) => self.b.use_var(self.locals[*i]),
            Expr::Unary(op, x) => {
                let x = self.value(x);
                self.unary(*op, x)
            }
            Expr::Binary(op, x, y) => {
                let (x, y) = (self.value(x), self.value(y));
                self.binary(*op, x, y)
            }
            Expr::And(x, y) => self.logical(x, y, true),
            Expr::Or(x, y) => self.logical(x, y, false),
            Expr::Call1(f, x) => {
                let x = self.value(x);
                self.call(0, (*f as *const ()).expose_provenance(), &[x])
            }
            Expr::Call2(f, x, y) => {
                let (x, y) = (self.value(x), self.value(y));
                self.call(1, (*f as *const ()).expose_provenance(), &[x, y])
            }
            Expr::Table(i, index) => {
                let table = &self.program.tables[*i];
                let ty = machine_type(table.element());
                let at = self.place(index, table.len());
                let base = self.b.ins().iconst(types::I64, self.tables[*i]);
                let address = self.b.ins().iadd(base, at);
                let value = self.b.ins().load(ty, ELEMENT, address, 0);
                self.within(value, Range::of(table))
            }
            Expr::Element(i, index) => {
                let (ty, len) = self.program.arrays[*i];
                let at = self.place(index, len);
                let base = self.b.ins().stack_addr(types::I64, self.arrays[*i], 0);
                let address = self.b.ins().iadd(base, at);
                self.b.ins().load(machine_type(ty), FRAME, address, 0)
            }
        }
    }

    fn int(&mut self, x: i64) -> Value {
        let value = self.b.ins().iconst(types::I64, x);
        self.within(value, Range::Int(x, x))
    }

    /// Traps if `fails` holds.
    fn trap_if(&mut self, fails: Value) {
        let next = self.b.create_block();
        self.b.ins().brif(fails, self.trap, &[], next, &[]);
        self.begin(next);
    }

    /// One of two values, without a branch.
    pub(super) fn select(&mut self, condition: Value, one: Value, other: Value) -> Value {
        // For a float, Cranelift jumps on x86-64; for an integer it moves conditionally.
        if cfg!(target_arch = "x86_64") && self.b.func.dfg.value_type(one) == types::F64 {
            let (one, other) = (self.bits(one), self.bits(other));
            let chosen = self.b.ins().select(condition, one, other);
            return self.b.ins().bitcast(types::F64, MemFlagsData::new(), chosen);
        }
        self.b.ins().select(condition, one, other)
    }

    /// The bits of a float.
    fn bits(&mut self, x: Value) -> Value {
        let dfg = &self.b.func.dfg;
        if let Some(inst) = dfg.value_def(x).inst()
            && let InstructionData::UnaryIeee64 { imm, .. } = dfg.insts[inst]
        {
            return self.b.ins().iconst(types::I64, imm.bits() as i64);
        }
        self.b.ins().bitcast(types::I64, MemFlagsData::new(), x)
    }

    fn unary(&mut self, op: Unary, x: Value) -> Value {
        let range = self.ranges[x];
        let value = match op {
            Unary::NegFloat => self.b.ins().fneg(x),
            Unary::AbsFloat => self.b.ins().fabs(x),
            Unary::NegInt | Unary::AbsInt => {
                if range.int().0 == i64::MIN {
                    let least = self.b.ins().icmp_imm_s(IntCC::Equal, x, i64::MIN);
                    self.trap_if(least);
                }
                if op == Unary::NegInt { self.b.ins().ineg(x) } else { self.b.ins().iabs(x) }
            }
            Unary::Not => self.b.ins().bxor_imm_u(x, 1),
            Unary::IntToFloat => self.b.ins().fcvt_from_sint(types::F64, x),
            Unary::FloatToInt => self.b.ins().fcvt_to_sint_sat(types::I64, x),
            Unary::Floor => self.b.ins().floor(x),
            Unary::Ceil => self.b.ins().ceil(x),
            Unary::Trunc => self.b.ins().trunc(x),
            Unary::Sqrt => self.b.ins().sqrt(x),
            Unary::IsNan => self.b.ins().fcmp(FloatCC::Unordered, x, x),
            Unary::IsFinite | Unary::IsInfinite => {
                let how = if op == Unary::IsFinite { FloatCC::LessThan } else { FloatCC::Equal };
                let size = self.b.ins().fabs(x);
                let infinity = self.b.ins().f64const(f64::INFINITY);
                self.b.ins().fcmp(how, size, infinity)
            }
        };
        self.within(value, range.unary(op))
    }

    fn binary(&mut self, op: Binary, x: Value, y: Value) -> Value {
        let (range, exact) = self.ranges[x].binary(op, self.ranges[y]);
        let value = match op {
            Binary::AddFloat => self.b.ins().fadd(x, y),
            Binary::SubFloat => self.b.ins().fsub(x, y),
            Binary::MulFloat => self.b.ins().fmul(x, y),
            Binary::DivFloat => self.b.ins().fdiv(x, y),
            // In this form they are one instruction on x86-64.
            Binary::Least => {
                let less = self.b.ins().fcmp(FloatCC::LessThan, y, x);
                self.b.ins().select(less, y, x)
            }
            Binary::Greatest => {
                let less = self.b.ins().fcmp(FloatCC::LessThan, x, y);
                self.b.ins().select(less, y, x)
            }
            Binary::AddInt if exact => self.b.ins().iadd(x, y),
            Binary::SubInt if exact => self.b.ins().isub(x, y),
            Binary::MulInt if exact => self.b.ins().imul(x, y),
            Binary::AddInt | Binary::SubInt | Binary::MulInt => {
                let (value, overflow) = match op {
                    Binary::AddInt => self.b.ins().sadd_overflow(x, y),
                    Binary::SubInt => self.b.ins().ssub_overflow(x, y),
                    _ => self.b.ins().smul_overflow(x, y),
                };
                self.trap_if(overflow);
                value
            }
            Binary::DivInt | Binary::RemInt => {
                let (least, (lo, hi)) = (self.ranges[x].int().0, self.ranges[y].int());
                if lo <= 0 && hi >= 0 {
                    let zero = self.b.ins().icmp_imm_s(IntCC::Equal, y, 0);
                    self.trap_if(zero);
                }
                if least == i64::MIN && lo <= -1 && hi >= -1 {
                    let least = self.b.ins().icmp_imm_s(IntCC::Equal, x, i64::MIN);
                    let minus_one = self.b.ins().icmp_imm_s(IntCC::Equal, y, -1);
                    let overflow = self.b.ins().band(least, minus_one);
                    self.trap_if(overflow);
                }
                if op == Binary::DivInt { self.b.ins().sdiv(x, y) } else { self.b.ins().srem(x, y) }
            }
            Binary::MinInt => self.b.ins().smin(x, y),
            Binary::MaxInt => self.b.ins().smax(x, y),
            Binary::AndInt | Binary::AndBool => self.b.ins().band(x, y),
            Binary::OrInt | Binary::OrBool => self.b.ins().bor(x, y),
            Binary::XorInt | Binary::XorBool => self.b.ins().bxor(x, y),
            Binary::Float(how) => self.b.ins().fcmp(ordered(how), x, y),
            Binary::Int(how) if let Some(holds) = self.ranges[x].decides(how, self.ranges[y]) => {
                self.b.ins().iconst(types::I8, i64::from(holds))
            }
            Binary::Int(how) | Binary::Bool(how) => self.b.ins().icmp(signed(how), x, y),
        };
        self.within(value, range)
    }

    /// Both hold (`and`), or one; the second is evaluated only if it decides, unless that is cheap.
    fn logical(&mut self, x: &Expr, y: &Expr, and: bool) -> Value {
        let first = self.value(x);
        if self.is_cheap(y) {
            let second = self.value(y);
            return if and {
                self.b.ins().band(first, second)
            } else {
                self.b.ins().bor(first, second)
            };
        }
        let (next, end) = (self.b.create_block(), self.b.create_block());
        let result = self.b.append_block_param(end, types::I8);
        if and {
            self.b.ins().brif(first, next, &[], end, &[first.into()]);
        } else {
            self.b.ins().brif(first, end, &[first.into()], next, &[]);
        }
        self.begin(next);
        let second = self.value(y);
        self.b.ins().jump(end, &[second.into()]);
        self.begin(end);
        result
    }

    fn call(&mut self, signature: usize, address: usize, arguments: &[Value]) -> Value {
        let callee = self.b.ins().iconst(types::I64, address as i64);
        let call = self.b.ins().call_indirect(self.calls[signature], callee, arguments);
        self.b.inst_results(call)[0]
    }

    /// The offset in bytes of an element among `len`; traps outside.
    fn place(&mut self, index: &Expr, len: usize) -> Value {
        let len = len as i64;
        let mut at = self.value(index);
        let (lo, hi) = self.ranges[at].int();
        if lo < 0 {
            // Wrapping cannot bring an index inside: only the negative ones from -len end there.
            let sign = self.b.ins().sshr_imm_u(at, 63);
            let from_end = self.b.ins().band_imm_s(sign, len);
            at = self.b.ins().iadd(at, from_end);
        }
        if lo < -len || hi >= len {
            let outside = self.b.ins().icmp_imm_s(IntCC::UnsignedGreaterThanOrEqual, at, len);
            self.trap_if(outside);
        }
        self.b.ins().ishl_imm_u(at, 3)
    }
}
