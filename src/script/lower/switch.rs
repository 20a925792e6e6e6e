//! `switch` on integers and truth values.

use std::collections::{BTreeMap, BTreeSet};

use rhai::{
    ASTNode, Engine, Expr, OptimizationLevel, Position, RangeCase, Stmt as Syntax,
    SwitchCasesCollection,
};

use super::value::Val;
use super::{Lowered, Lowering, outside};
use crate::jit::ir::{self, Binary, Compare, Stmt, Type};
use crate::script::source::tokens;

/// A constant that a case stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::script) enum Case {
    Int(i64),
    Bool(bool),
}

/// Numbers of one file that are considered.
const MAX_NUMBERS: usize = 4096;
/// Cases of a `switch`: they become nested conditions.
const MAX_CASES: usize = 128;

/// The syntax tree keeps only the hashes of the values of cases. What they stand for is found by
/// parsing a `switch` over all integers that occur in `text`, whose order is known.
pub(super) fn cases(text: &str) -> BTreeMap<u64, Case> {
    let tokens = tokens(text);
    if !tokens.iter().any(|t| t.text == "switch") {
        return BTreeMap::new();
    }
    let numbers: BTreeSet<i64> = tokens.iter().filter_map(|t| integer(t.text)).collect();
    let mut all: Vec<i64> = numbers.into_iter().take(MAX_NUMBERS).collect();
    all.extend(all.clone().into_iter().filter_map(i64::checked_neg).collect::<Vec<_>>());
    let known: BTreeSet<i64> = all.into_iter().collect();
    let mut cases: Vec<Case> = known.into_iter().map(Case::Int).collect();
    cases.extend([Case::Bool(true), Case::Bool(false)]);
    let arms = cases.iter().map(|case| match case {
        Case::Int(x) => format!("{x} => 0"),
        Case::Bool(x) => format!("{x} => 0"),
    });
    let arms: Vec<String> = arms.collect();
    let mut engine = Engine::new_raw();
    engine.set_optimization_level(OptimizationLevel::None);
    let Ok(ast) = engine.compile(format!("switch 0 {{ {} }}", arms.join(", "))) else {
        return BTreeMap::new();
    };
    let mut found = BTreeMap::new();
    ast.walk(&mut |path: &[ASTNode<'_>]| {
        if let Some(ASTNode::Stmt(Syntax::Switch(x, _))) = path.last() {
            found.extend(x.1.cases.iter().map(|(hash, list)| (*hash, cases[list.blocks[0]])));
        }
        true
    });
    found
}

/// The integer that a token is.
fn integer(token: &str) -> Option<i64> {
    let digits = token.replace('_', "").to_lowercase();
    for (prefix, radix) in [("0x", 16), ("0o", 8), ("0b", 2)] {
        if let Some(digits) = digits.strip_prefix(prefix) {
            return i64::from_str_radix(digits, radix).ok();
        }
    }
    digits.parse().ok()
}

/// A condition and what is done if it holds.
type Arm<'e> = (ir::Expr, &'e Expr);

impl Lowering<'_> {
    /// The conditions of a `switch`, in the order in which they are tried, and its default.
    fn arms<'e>(
        &mut self,
        on: &Expr,
        cases: &'e SwitchCasesCollection,
        position: Position,
    ) -> Lowered<(Vec<Arm<'e>>, Option<&'e Expr>)> {
        let (value, ty) = self.numeric(on)?;
        if ty == Type::Float {
            return outside("a `switch` on a float", on.start_position());
        }
        let value = self.held(value, position)?;
        let is = |how, x: i64| {
            ir::Expr::Binary(Binary::Int(how), value.clone().into(), ir::Expr::Int(x).into())
        };
        // By value, so that the order is the same in every process.
        if cases.cases.len() > MAX_CASES {
            return outside("a `switch` with too many cases", position);
        }
        let file = self.file();
        let known = cases
            .cases
            .iter()
            .filter_map(|(hash, list)| file.cases.get(hash).map(|case| (*case, list)));
        let mut constants: Vec<_> = known.collect();
        let unknown = cases.cases.len() - constants.len();
        // The hashes of the ranges are among them.
        if unknown > cases.ranges.len() {
            return outside("a case that is not an integer", position);
        }
        constants.sort_by_key(|(case, _)| match case {
            Case::Int(x) => *x,
            Case::Bool(x) => i64::from(*x),
        });
        let mut arms: Vec<(ir::Expr, usize)> = Vec::new();
        for (case, list) in constants {
            let holds = match (case, ty) {
                (Case::Int(x), Type::Int) => is(Compare::Eq, x),
                (Case::Bool(true), Type::Bool) => value.clone(),
                (Case::Bool(false), Type::Bool) => {
                    ir::Expr::Unary(ir::Unary::Not, value.clone().into())
                }
                _ => continue,
            };
            arms.extend(list.blocks.iter().map(|&block| (holds.clone(), block)));
        }
        for range in cases.ranges.iter().filter(|_| ty == Type::Int) {
            let (low, high) = match range {
                RangeCase::ExclusiveInt(r, _) => (r.start, is(Compare::Lt, r.end)),
                RangeCase::InclusiveInt(r, _) => (*r.start(), is(Compare::Le, *r.end())),
            };
            let holds = ir::Expr::And(is(Compare::Ge, low).into(), high.into());
            arms.push((holds, range.index()));
        }
        if arms.len() > MAX_CASES {
            return outside("a `switch` with too many cases", position);
        }
        let mut guarded = Vec::with_capacity(arms.len());
        for (holds, block) in arms {
            let arm = &cases.expressions[block];
            let holds = if let Expr::BoolConstant(true, _) = arm.lhs {
                holds
            } else {
                let (code, guard) = self.nested(|l| l.condition(&arm.lhs))?;
                if !code.is_empty() {
                    return outside("a case with a long condition", arm.lhs.start_position());
                }
                ir::Expr::And(holds.into(), guard.into())
            };
            guarded.push((holds, &arm.rhs));
        }
        Ok((guarded, cases.def_case.map(|block| &cases.expressions[block].rhs)))
    }

    pub(super) fn switch_value(
        &mut self,
        on: &Expr,
        cases: &SwitchCasesCollection,
        position: Position,
    ) -> Lowered<Val> {
        let (arms, default) = self.arms(on, cases, position)?;
        self.arm_value(&arms, default, position)
    }

    fn arm_value(
        &mut self,
        arms: &[Arm<'_>],
        default: Option<&Expr>,
        position: Position,
    ) -> Lowered<Val> {
        let Some(((holds, arm), rest)) = arms.split_first() else {
            return default.map_or(Ok(Val::Unit), |arm| self.expr(arm));
        };
        let yes = self.nested(|l| l.expr(arm))?;
        let no = self.nested(|l| l.arm_value(rest, default, position))?;
        self.join(holds.clone(), yes, no, position)
    }

    pub(super) fn tail_switch(
        &mut self,
        on: &Expr,
        cases: &SwitchCasesCollection,
        position: Position,
    ) -> Lowered<()> {
        let (arms, default) = self.arms(on, cases, position)?;
        self.tail_arm(&arms, default, position)
    }

    fn tail_arm(
        &mut self,
        arms: &[Arm<'_>],
        default: Option<&Expr>,
        position: Position,
    ) -> Lowered<()> {
        let Some(((holds, arm), rest)) = arms.split_first() else {
            return match default {
                Some(arm) => self.tail_expr(arm),
                None => self.emit_return(Val::Unit, position),
            };
        };
        let (yes, ()) = self.nested(|l| l.tail_expr(arm))?;
        let (no, ()) = self.nested(|l| l.tail_arm(rest, default, position))?;
        self.code.push(Stmt::If(holds.clone(), yes, no));
        Ok(())
    }
}
