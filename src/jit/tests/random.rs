//! Programs at random: both tiers, bit for bit.

use super::*;
use crate::jit::math;

/// `SplitMix64` (Steele, Lea & Flood 2014).
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    fn one<T: Copy>(&mut self, list: &[T]) -> T {
        list[self.below(list.len())]
    }

    fn float(&mut self) -> f64 {
        match self.below(4) {
            0 => self.below(9) as f64 - 4.0,
            1 => f64::from_bits(self.bits()),
            _ => self.one(&FLOATS),
        }
    }

    fn int(&mut self) -> i64 {
        if self.below(3) == 0 { self.one(&INTS) } else { self.below(9) as i64 - 4 }
    }
}

const INPUTS: usize = 4;
const TYPES: [Type; 3] = [Type::Float, Type::Int, Type::Bool];
const ORDERS: [Compare; 6] =
    [Compare::Eq, Compare::Ne, Compare::Lt, Compare::Le, Compare::Gt, Compare::Ge];

/// A program being written.
struct Writer {
    random: Random,
    locals: Vec<Type>,
    arrays: Vec<(Type, usize)>,
    tables: Vec<Table>,
    result: Type,
    labels: usize,
    /// The labels around, with whether they are of loops.
    around: Vec<(Label, bool)>,
}

impl Writer {
    fn new(seed: u64) -> Self {
        let mut random = Random(seed);
        let locals = (0..random.below(6)).map(|_| random.one(&TYPES)).collect();
        let arrays =
            (0..random.below(3)).map(|_| (random.one(&TYPES), 1 + random.below(4))).collect();
        let tables = (0..random.below(3)).map(|i| {
            let len = 1 + random.below(4);
            if i == 0 {
                Table::Float((0..len).map(|_| random.float()).collect())
            } else {
                Table::Int((0..len).map(|_| random.int()).collect())
            }
        });
        let tables = tables.collect();
        let result = random.one(&TYPES);
        Self { random, locals, arrays, tables, result, labels: 0, around: Vec::new() }
    }

    fn program(mut self) -> Program {
        let mut body = Vec::new();
        for (i, ty) in self.locals.clone().into_iter().enumerate() {
            body.push(Stmt::Set(i, self.leaf(ty, false)));
        }
        for (i, (ty, len)) in self.arrays.clone().into_iter().enumerate() {
            for at in 0..len {
                body.push(Stmt::SetElement(i, at, self.leaf(ty, false)));
            }
        }
        body.extend(self.list(4));
        body.push(Stmt::Return(self.expr(self.result, 4)));
        Program {
            n_inputs: INPUTS,
            locals: self.locals,
            arrays: self.arrays,
            tables: self.tables,
            fuel: self.random.below(60) as i64,
            result: self.result,
            body,
        }
    }

    fn list(&mut self, depth: usize) -> Vec<Stmt> {
        (0..self.random.below(4)).map(|_| self.stmt(depth)).collect()
    }

    fn within(&mut self, is_loop: bool, depth: usize) -> (Label, Vec<Stmt>) {
        let label = Label(self.labels);
        self.labels += 1;
        self.around.push((label, is_loop));
        let list = self.list(depth);
        self.around.pop();
        (label, list)
    }

    fn stmt(&mut self, depth: usize) -> Stmt {
        match self.random.below(14) {
            0..4 if !self.locals.is_empty() => {
                let i = self.random.below(self.locals.len());
                Stmt::Set(i, self.expr(self.locals[i], 3))
            }
            4 if !self.arrays.is_empty() => {
                let i = self.random.below(self.arrays.len());
                let (ty, len) = self.arrays[i];
                Stmt::SetElement(i, self.random.below(len), self.expr(ty, 3))
            }
            5..8 if depth > 0 => {
                let condition = self.expr(Type::Bool, 3);
                Stmt::If(condition, self.list(depth - 1), self.list(depth - 1))
            }
            8 if depth > 0 => {
                let (label, list) = self.within(false, depth - 1);
                Stmt::Block(label, list)
            }
            9 if depth > 0 => {
                let (label, mut list) = self.within(true, depth - 1);
                // Most loops go round.
                let again = Stmt::Again(label, self.random.below(9) as u32);
                let again = match again {
                    // Without using fuel they might never end.
                    Stmt::Again(label, 0) => Stmt::Again(label, 1),
                    again => again,
                };
                list.push(Stmt::If(self.expr(Type::Bool, 2), vec![again], vec![]));
                Stmt::Loop(label, list)
            }
            10 if !self.around.is_empty() => match self.random.one(&self.around.clone()) {
                (label, true) => Stmt::Again(label, 1 + self.random.below(4) as u32),
                (label, false) => Stmt::Exit(label),
            },
            11 if self.random.below(4) == 0 => Stmt::Trap,
            12 if self.random.below(3) == 0 => Stmt::Return(self.expr(self.result, 3)),
            _ => {
                let ty = self.random.one(&TYPES);
                Stmt::Check(self.expr(ty, 2))
            }
        }
    }

    /// A constant, an input, or a local if those are set.
    fn leaf(&mut self, ty: Type, locals: bool) -> Expr {
        let same: Vec<usize> = (0..self.locals.len()).filter(|i| self.locals[*i] == ty).collect();
        match self.random.below(3) {
            0 => Expr::Input(self.random.below(INPUTS), ty),
            1 if locals && !same.is_empty() => Expr::Local(self.random.one(&same)),
            _ => match ty {
                Type::Float => Expr::Float(self.random.float()),
                Type::Int => Expr::Int(self.random.int()),
                Type::Bool => Expr::Bool(self.random.below(2) == 0),
            },
        }
    }

    fn boxed(&mut self, ty: Type, depth: usize) -> Box<Expr> {
        Box::new(self.expr(ty, depth))
    }

    /// An element of a table or an array of that type, if there is one.
    fn element(&mut self, ty: Type, depth: usize) -> Option<Expr> {
        let index = self.boxed(Type::Int, depth);
        let tables: Vec<_> =
            (0..self.tables.len()).filter(|i| self.tables[*i].element() == ty).collect();
        let arrays: Vec<_> = (0..self.arrays.len()).filter(|i| self.arrays[*i].0 == ty).collect();
        if !tables.is_empty() && self.random.below(2) == 0 {
            return Some(Expr::Table(self.random.one(&tables), index));
        }
        (!arrays.is_empty()).then(|| Expr::Element(self.random.one(&arrays), index))
    }

    fn expr(&mut self, ty: Type, depth: usize) -> Expr {
        if depth == 0 || self.random.below(6) == 0 {
            return self.leaf(ty, true);
        }
        if self.random.below(6) == 0
            && let Some(element) = self.element(ty, depth - 1)
        {
            return element;
        }
        let depth = depth - 1;
        match ty {
            Type::Float => self.float(depth),
            Type::Int => self.int(depth),
            Type::Bool => self.bool(depth),
        }
    }

    fn float(&mut self, depth: usize) -> Expr {
        match self.random.below(6) {
            0 => {
                let op = self.random.one(&[
                    Unary::NegFloat,
                    Unary::AbsFloat,
                    Unary::Floor,
                    Unary::Ceil,
                    Unary::Trunc,
                    Unary::Sqrt,
                ]);
                Expr::Unary(op, self.boxed(Type::Float, depth))
            }
            1 => Expr::Unary(Unary::IntToFloat, self.boxed(Type::Int, depth)),
            2 if self.random.below(2) == 0 => {
                let f = self.random.one(math::UNARY).1;
                Expr::Call1(f, self.boxed(Type::Float, depth))
            }
            3 if self.random.below(3) == 0 => {
                let f = self.random.one(&[math::remainder as Math2, math::atan2]);
                Expr::Call2(f, self.boxed(Type::Float, depth), self.boxed(Type::Float, depth))
            }
            _ => {
                let op = self.random.one(&[
                    Binary::AddFloat,
                    Binary::SubFloat,
                    Binary::MulFloat,
                    Binary::DivFloat,
                    Binary::Least,
                    Binary::Greatest,
                ]);
                Expr::Binary(op, self.boxed(Type::Float, depth), self.boxed(Type::Float, depth))
            }
        }
    }

    fn int(&mut self, depth: usize) -> Expr {
        match self.random.below(5) {
            0 => {
                let op = self.random.one(&[Unary::NegInt, Unary::AbsInt]);
                Expr::Unary(op, self.boxed(Type::Int, depth))
            }
            1 => Expr::Unary(Unary::FloatToInt, self.boxed(Type::Float, depth)),
            _ => {
                let op = self.random.one(&[
                    Binary::AddInt,
                    Binary::SubInt,
                    Binary::MulInt,
                    Binary::DivInt,
                    Binary::RemInt,
                    Binary::MinInt,
                    Binary::MaxInt,
                    Binary::AndInt,
                    Binary::OrInt,
                    Binary::XorInt,
                ]);
                Expr::Binary(op, self.boxed(Type::Int, depth), self.boxed(Type::Int, depth))
            }
        }
    }

    fn bool(&mut self, depth: usize) -> Expr {
        let how = self.random.one(&ORDERS);
        let (op, ty) = match self.random.below(8) {
            0 => return Expr::Unary(Unary::Not, self.boxed(Type::Bool, depth)),
            1 => {
                let op = self.random.one(&[Unary::IsNan, Unary::IsFinite, Unary::IsInfinite]);
                return Expr::Unary(op, self.boxed(Type::Float, depth));
            }
            2 => return Expr::And(self.boxed(Type::Bool, depth), self.boxed(Type::Bool, depth)),
            3 => return Expr::Or(self.boxed(Type::Bool, depth), self.boxed(Type::Bool, depth)),
            4 => {
                let same = self.random.one(&[Compare::Eq, Compare::Ne]);
                let op = [Binary::AndBool, Binary::OrBool, Binary::XorBool, Binary::Bool(same)];
                (self.random.one(&op), Type::Bool)
            }
            5 => (Binary::Int(how), Type::Int),
            _ => (Binary::Float(how), Type::Float),
        };
        Expr::Binary(op, self.boxed(ty, depth), self.boxed(ty, depth))
    }
}

/// Both tiers agree on programs `seeds`. How many calls gave a result.
fn agree(seeds: std::ops::Range<u64>) -> usize {
    let mut results = 0;
    for seed in seeds {
        let program = Writer::new(seed).program();
        let code = Tiers::new(&program);
        let mut random = Random(!seed);
        for _ in 0..24 {
            let inputs: [f64; INPUTS] = std::array::from_fn(|_| random.float());
            let [machine, evaluated] = code.call(&inputs);
            assert_eq!(machine, evaluated, "program {seed} of {inputs:?}: {program:#?}");
            results += usize::from(program.evaluate(&inputs).is_some());
        }
    }
    results
}

#[test]
fn tiers_agree_on_random_programs() {
    let results = agree(0..600);
    // The others trap. A generator of nothing but traps would prove nothing.
    assert!(results > 600 * 24 / 3, "{results} results");
}

/// `cargo test --release --lib jit::tests::random -- --ignored`
#[test]
#[ignore = "takes minutes"]
fn tiers_agree_on_many_random_programs() {
    agree(1_000..201_000);
}
