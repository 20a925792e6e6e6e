//! Random programs over the numeric subset, and a little beyond it.

mod expressions;

use rand::{Rng, RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// The types that generated expressions have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ty {
    Float,
    Int,
    Bool,
}

const TYPES: [Ty; 3] = [Ty::Float, Ty::Int, Ty::Bool];

/// Constants that every generated script defines.
pub(super) const CONSTANTS: &str = "const MAXI = 9223372036854775807;\n\
    const MINI = -9223372036854775807 - 1;\n\
    const HALF = 0.5;\n\
    const FLOATS = [0.5, -1.5, 1e300, -0.0];\n\
    const INTS = [3, -1, 0, 9223372036854775807, 2];\n\
    const GRID = [[1.0, 2.0, 3.0], [-4.0, 5.0, -6.0]];\n\
    const GOALS = [#{ x: 1.5, n: 2 }, #{ x: -0.5, n: -3 }];\n";

/// A writer of programs.
pub(super) struct Generator {
    rng: Xoshiro256PlusPlus,
    /// Variables in scope: name, type, whether they may be assigned to.
    scope: Vec<(String, Ty, bool)>,
    /// Functions that may be called: name, parameters, result.
    helpers: Vec<(String, Vec<Ty>, Ty)>,
    names: usize,
    /// Nodes that may still be written.
    budget: i32,
    in_loop: bool,
    result: Ty,
    /// Whether `t` can be seen.
    step: bool,
}

impl Generator {
    pub(super) fn new(seed: u64) -> Self {
        Self {
            rng: Xoshiro256PlusPlus::seed_from_u64(seed),
            scope: Vec::new(),
            helpers: Vec::new(),
            names: 0,
            budget: 0,
            in_loop: false,
            result: Ty::Float,
            step: false,
        }
    }

    fn below(&mut self, n: usize) -> usize {
        self.rng.random_range(0..n)
    }

    fn chance(&mut self, one_in: usize) -> bool {
        self.below(one_in) == 0
    }

    fn pick<T: Copy>(&mut self, list: &[T]) -> T {
        list[self.below(list.len())]
    }

    fn name(&mut self) -> String {
        // Few names, so that they shadow one another.
        self.names += 1;
        if self.chance(3) { format!("v{}", self.below(4)) } else { format!("w{}", self.names) }
    }

    /// A script of `n` programs called `p0`, `p1`, …, functions of a step, with the types of their
    /// results.
    pub(super) fn script(&mut self, n: usize) -> (String, Vec<Ty>) {
        let mut text = CONSTANTS.to_string();
        let mut results = Vec::new();
        for i in 0..n {
            self.helpers.clear();
            for h in 0..self.below(3) {
                let params: Vec<Ty> = (0..self.below(4)).map(|_| self.pick(&TYPES)).collect();
                let result = self.pick(&TYPES);
                let name = format!("h{i}_{h}");
                text += &self.function(&name, &params, result, 12);
                self.helpers.push((name, params, result));
            }
            let result = self.pick(&TYPES);
            let body = {
                self.scope.clear();
                self.step = true;
                self.budget = 10 + self.below(60) as i32;
                self.result = result;
                self.body(result)
            };
            text.extend(["fn p", &i.to_string(), "(t) { ", &body, " }\n"]);
            results.push(result);
        }
        (text, results)
    }

    fn function(&mut self, name: &str, params: &[Ty], result: Ty, budget: i32) -> String {
        self.scope.clear();
        self.step = false;
        self.budget = budget;
        self.result = result;
        let mut list = Vec::new();
        for (i, &ty) in params.iter().enumerate() {
            let param = format!("a{i}");
            self.scope.push((param.clone(), ty, true));
            list.push(param);
        }
        let body = self.body(result);
        format!("fn {name}({}) {{ {body} }}\n", list.join(", "))
    }

    /// Statements and a value.
    fn body(&mut self, ty: Ty) -> String {
        let depth = self.scope.len();
        let mut text = String::new();
        for _ in 0..self.below(5) {
            text += &self.statement(2);
        }
        let tail = self.expr(ty, 4);
        self.scope.truncate(depth);
        match self.below(12) {
            0 => format!("{text}return {tail};"),
            1 => {
                let (a, b) = (self.condition(2), self.expr(self.result, 3));
                format!("{text}if {a} {{ {b} }} else {{ {tail} }}")
            }
            // A number of either type is as good to the host.
            2 if ty == Ty::Float => {
                let (a, b) = (self.condition(2), self.expr(Ty::Int, 2));
                format!("{text}if {a} {{ {b} }} else {{ {tail} }}")
            }
            _ => format!("{text}{tail}"),
        }
    }

    fn block(&mut self, depth: usize) -> String {
        let scope = self.scope.len();
        let mut text = String::new();
        for _ in 0..=self.below(2) {
            text += &self.statement(depth);
        }
        self.scope.truncate(scope);
        text
    }

    fn statement(&mut self, depth: usize) -> String {
        self.budget -= 1;
        if depth == 0 || self.budget < 0 {
            return String::new();
        }
        match self.below(14) {
            0..=3 => {
                let ty = self.pick(&TYPES);
                let value = self.expr(ty, 3);
                let name = self.name();
                let constant = self.chance(6);
                self.scope.push((name.clone(), ty, !constant));
                format!("{} {name} = {value};\n", if constant { "const" } else { "let" })
            }
            4..=6 => self.assignment(),
            7 | 8 => {
                let (condition, yes) = (self.condition(3), self.block(depth - 1));
                if self.chance(2) {
                    let no = self.block(depth - 1);
                    format!("if {condition} {{ {yes} }} else {{ {no} }}\n")
                } else {
                    format!("if {condition} {{ {yes} }}\n")
                }
            }
            9 => self.range_loop(depth),
            10 => self.counted_loop(depth),
            11 if self.in_loop => {
                let condition = self.condition(2);
                let word = if self.chance(2) { "break" } else { "continue" };
                format!("if {condition} {{ {word}; }}\n")
            }
            12 if self.chance(2) => {
                let condition = self.condition(2);
                let value = self.expr(self.result, 2);
                format!("if {condition} {{ return {value}; }}\n")
            }
            13 => {
                let ty = self.pick(&TYPES);
                format!("{};\n", self.expr(ty, 2))
            }
            _ => self.switch(depth),
        }
    }

    fn assignment(&mut self) -> String {
        let places: Vec<_> = self.scope.iter().filter(|v| v.2).cloned().collect();
        // A variable that is shadowed by one of another type cannot be meant.
        let visible = |name: &str| self.scope.iter().rev().find(|v| v.0 == name).cloned();
        let places: Vec<_> =
            places.into_iter().filter(|p| visible(&p.0).as_ref() == Some(p)).collect();
        if places.is_empty() {
            return String::new();
        }
        let (name, ty, _) = places[self.below(places.len())].clone();
        let value = self.expr(ty, 3);
        let op = match ty {
            _ if self.chance(2) => "=",
            Ty::Float => self.pick(&["+=", "-=", "*=", "/=", "%=", "**="]),
            Ty::Int => self.pick(&["+=", "-=", "*=", "/=", "%=", "&=", "|=", "^="]),
            Ty::Bool => self.pick(&["&=", "|=", "^="]),
        };
        // Now and then a type that does not stay what it was.
        if ty == Ty::Int && self.chance(25) {
            return format!("{name} {op} {};\n", self.expr(Ty::Float, 1));
        }
        format!("{name} {op} {value};\n")
    }

    fn range_loop(&mut self, depth: usize) -> String {
        let scope = self.scope.len();
        let name = self.name();
        let (over, ty) = match self.below(7) {
            0 => (format!("{}..{}", self.small(), self.small()), Ty::Int),
            1 => (format!("{}..={}", self.small(), self.small()), Ty::Int),
            2 => ("range(0, 7, 3)".to_string(), Ty::Int),
            3 => (format!("range({}, {}, -2)", self.small(), self.small()), Ty::Int),
            4 => ("FLOATS".to_string(), Ty::Float),
            5 => ("INTS".to_string(), Ty::Int),
            _ => {
                let items: Vec<String> = (0..3).map(|_| self.expr(Ty::Float, 1)).collect();
                (format!("[{}]", items.join(", ")), Ty::Float)
            }
        };
        let outer = std::mem::replace(&mut self.in_loop, true);
        let pattern = if self.chance(4) {
            let counter = self.name();
            self.scope.push((counter.clone(), Ty::Int, false));
            self.scope.push((name.clone(), ty, true));
            format!("({name}, {counter})")
        } else {
            self.scope.push((name.clone(), ty, true));
            name.clone()
        };
        let distinct = !pattern.contains(&format!("({name}, {name})"));
        let body = self.block(depth - 1);
        self.in_loop = outer;
        self.scope.truncate(scope);
        if distinct { format!("for {pattern} in {over} {{ {body} }}\n") } else { String::new() }
    }

    /// A loop with a counter of its own, so that it ends.
    fn counted_loop(&mut self, depth: usize) -> String {
        self.names += 1;
        let counter = format!("c{}", self.names);
        let limit = 1 + self.below(6);
        let outer = std::mem::replace(&mut self.in_loop, true);
        let scope = self.scope.len();
        self.scope.push((counter.clone(), Ty::Int, false));
        let body = self.block(depth - 1);
        self.scope.truncate(scope);
        self.in_loop = outer;
        match self.below(4) {
            0 => format!(
                "let {counter} = 0; loop {{ {counter} += 1; if {counter} > {limit} {{ break; }} \
                 {body} }}\n"
            ),
            1 => format!(
                "let {counter} = 0; do {{ {counter} += 1; {body} }} while {counter} < {limit};\n"
            ),
            2 => format!(
                "let {counter} = 0; do {{ {counter} += 1; {body} }} until {counter} >= {limit};\n"
            ),
            _ => format!(
                "let {counter} = 0; while {counter} < {limit} {{ {counter} += 1; {body} }}\n"
            ),
        }
    }

    /// A condition: Rhai refuses blocks there.
    fn condition(&mut self, depth: usize) -> String {
        let condition = self.expr(Ty::Bool, depth);
        if condition.starts_with(['{', 'i', 's']) { format!("!({condition})") } else { condition }
    }

    fn switch(&mut self, depth: usize) -> String {
        let on = self.expr(Ty::Int, 2);
        let (a, b, c) = (self.block(depth - 1), self.block(depth - 1), self.block(depth - 1));
        let guard =
            if self.chance(3) { format!(" if {}", self.condition(1)) } else { String::new() };
        format!(
            "switch {on} {{ 0 | 2{guard} => {{ {a} }} -1 => {{ {c} }} 3..9 => {{ {b} }} 5..=12 => {{ \
             {a} }} _ => {{ {c} }} }}\n"
        )
    }

    fn small(&mut self) -> i64 {
        self.below(9) as i64 - 3
    }

    /// A value for an input.
    pub(super) fn float_input(&mut self) -> f64 {
        const EDGES: [f64; 18] = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            0.5,
            -0.5,
            2.0,
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            5e-324,
            1e308,
            -1e308,
            9_007_199_254_740_992.0,
            9.223_372_036_854_775e18,
            -9.3e18,
            1e-17,
            2.5,
        ];
        match self.below(4) {
            0 => self.rng.random_range(-4.0..4.0),
            1 => f64::from_bits(self.rng.next_u64()),
            _ => self.pick(&EDGES),
        }
    }

    /// A value for an integer input, which floats hold exactly.
    pub(super) fn int_input(&mut self) -> i64 {
        match self.below(3) {
            0 => self.pick(&[0, 1, -1, 2, 3, 7, 1 << 40, -(1 << 52)]),
            _ => self.below(16) as i64 - 4,
        }
    }
}
