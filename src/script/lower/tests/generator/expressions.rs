//! Random expressions.

use super::{Generator, Ty};

impl Generator {
    fn variable(&mut self, ty: Ty) -> Option<String> {
        let mut seen = Vec::new();
        let mut fitting = Vec::new();
        for (name, of, _) in self.scope.iter().rev() {
            if !seen.contains(name) {
                seen.push(name.clone());
                if *of == ty {
                    fitting.push(name.clone());
                }
            }
        }
        if fitting.is_empty() { None } else { Some(fitting[self.below(fitting.len())].clone()) }
    }

    fn leaf(&mut self, ty: Ty) -> String {
        if self.chance(2)
            && let Some(name) = self.variable(ty)
        {
            return name;
        }
        let step = self.step && self.chance(2);
        match ty {
            Ty::Float if step => self
                .pick(&[
                    "t.state.x",
                    "t.state.y",
                    "t.next_state.x",
                    "t.reward",
                    "t.state[0]",
                    "t[\"reward\"]",
                    "t.next_state[1]",
                ])
                .to_string(),
            Ty::Int if step => self
                .pick(&[
                    "t.action",
                    "t.step",
                    "t.state.n",
                    "t.next_state.n",
                    "t.state[2]",
                    "t.state[-1]",
                ])
                .to_string(),
            Ty::Bool if step => self.pick(&["t.terminated", "t.truncated"]).to_string(),
            Ty::Float => self
                .pick(&[
                    "0.0",
                    "-0.0",
                    "1.0",
                    "-1.0",
                    "0.5",
                    "2.0",
                    "1e308",
                    "5e-324",
                    "PI",
                    "E",
                    "INF",
                    "-INF",
                    "(0.0 / 0.0)",
                    "HALF",
                    "9007199254740993.0",
                    "1e-17",
                    "3.7",
                    "FLOATS[1]",
                    "GRID[1][-1]",
                    "GOALS[0].x",
                    "9.3e18",
                ])
                .to_string(),
            Ty::Int => self
                .pick(&[
                    "0",
                    "1",
                    "-1",
                    "2",
                    "3",
                    "7",
                    "-5",
                    "MAXI",
                    "MINI",
                    "INTS[0]",
                    "GOALS[1].n",
                    "63",
                    "4294967296",
                    "FLOATS.len()",
                    "0x1f",
                ])
                .to_string(),
            Ty::Bool => self.pick(&["true", "false"]).to_string(),
        }
    }

    /// A number of either type, with its type.
    fn number(&mut self, depth: usize) -> (String, Ty) {
        let ty = if self.chance(3) { Ty::Int } else { Ty::Float };
        (self.expr(ty, depth), ty)
    }

    pub(in super::super) fn expr(&mut self, ty: Ty, depth: usize) -> String {
        self.budget -= 1;
        if depth == 0 || self.budget < 0 {
            return self.leaf(ty);
        }
        let d = depth - 1;
        if self.chance(10) {
            return self.compound(ty, d);
        }
        match ty {
            Ty::Float => self.float(d),
            Ty::Int => self.int(d),
            Ty::Bool => self.boolean(d),
        }
    }

    /// Expressions that hold statements.
    fn compound(&mut self, ty: Ty, d: usize) -> String {
        match self.below(4) {
            0 => {
                let scope = self.scope.len();
                let statements = self.statement(2);
                let value = self.expr(ty, d);
                self.scope.truncate(scope);
                format!("{{ {statements} {value} }}")
            }
            1 => {
                let on = self.expr(Ty::Int, d);
                let (a, b, c) = (self.expr(ty, d), self.expr(ty, d), self.expr(ty, d));
                format!("switch {on} {{ 1 => {a}, 2..=6 => {b}, _ => {c} }}")
            }
            2 if !self.helpers.is_empty() => {
                let which = self.below(self.helpers.len());
                let helper = self.helpers[which].clone();
                if helper.2 != ty {
                    return self.expr(ty, d);
                }
                let args: Vec<String> = helper.1.iter().map(|&ty| self.expr(ty, d)).collect();
                format!("{}({})", helper.0, args.join(", "))
            }
            _ => {
                let c = self.condition(d);
                let (a, b) = (self.expr(ty, d), self.expr(ty, d));
                format!("if {c} {{ {a} }} else {{ {b} }}")
            }
        }
    }

    fn float(&mut self, d: usize) -> String {
        match self.below(16) {
            0..=5 => {
                let op = self.pick(&["+", "-", "*", "/", "%"]);
                let (mut a, mut b) = (self.number(d), self.number(d));
                if (a.1, b.1) == (Ty::Int, Ty::Int) {
                    if self.chance(2) {
                        a.0 = self.expr(Ty::Float, d);
                    } else {
                        b.0 = self.leaf(Ty::Float);
                    }
                }
                a.1 = Ty::Float;
                b.1 = Ty::Float;
                format!("({} {op} {})", a.0, b.0)
            }
            6 => format!("-({})", self.expr(Ty::Float, d)),
            7 | 8 => {
                let f = self.pick(&[
                    "abs", "floor", "ceil", "ceiling", "round", "int", "fraction", "sign", "sqrt",
                    "to_float",
                ]);
                let x = self.expr(Ty::Float, d);
                if self.chance(2) { format!("({x}).{f}()") } else { format!("{f}({x})") }
            }
            9 => {
                let f = self.pick(&["sin", "cos", "exp", "ln", "tanh", "atan", "sqrt", "log"]);
                let x = self.number(d);
                format!("{f}({})", x.0)
            }
            10 => {
                let f = self.pick(&["min", "max"]);
                let (a, b) = (self.expr(Ty::Float, d), self.number(d));
                format!("{f}({a}, {})", b.0)
            }
            11 => {
                let [x, lo, hi] = [0, 1, 2].map(|_| self.expr(Ty::Float, d));
                format!("clamp({x}, {lo}, {hi})")
            }
            12 => {
                let x = self.expr(Ty::Float, d);
                let n = self.pick(&["2", "2.0", "3", "-1", "0.5", "0"]);
                format!("({x}) ** {n}")
            }
            13 => format!("to_float({})", self.expr(Ty::Int, d)),
            14 => {
                let index = self.expr(Ty::Int, d);
                let array = self.pick(&["FLOATS", "GRID[0]", "GRID[1]"]);
                format!("{array}[{index}]")
            }
            _ => {
                let items: Vec<String> = (0..3).map(|_| self.expr(Ty::Float, d.min(1))).collect();
                format!("[{}][({}) % 4]", items.join(", "), self.expr(Ty::Int, d))
            }
        }
    }

    fn int(&mut self, d: usize) -> String {
        match self.below(12) {
            0..=4 => {
                let op = self.pick(&["+", "-", "*", "/", "%", "&", "|", "^"]);
                format!("({} {op} {})", self.expr(Ty::Int, d), self.expr(Ty::Int, d))
            }
            5 => format!("-({})", self.expr(Ty::Int, d)),
            6 => {
                let f = self.pick(&["abs", "sign", "floor", "to_int", "round", "ceil"]);
                format!("{f}({})", self.expr(Ty::Int, d))
            }
            7 => {
                let f = self.pick(&["min", "max"]);
                format!("{f}({}, {})", self.expr(Ty::Int, d), self.expr(Ty::Int, d))
            }
            8 => format!("to_int({})", self.expr(Ty::Float, d)),
            9 => {
                let n = self.below(5);
                format!("({}) ** {n}", self.expr(Ty::Int, d))
            }
            10 => format!("INTS[{}]", self.expr(Ty::Int, d)),
            _ => {
                let [x, lo, hi] = [0, 1, 2].map(|_| self.expr(Ty::Int, d));
                format!("clamp({x}, {lo}, {hi})")
            }
        }
    }

    fn boolean(&mut self, d: usize) -> String {
        match self.below(9) {
            0..=3 => {
                let op = self.pick(&["==", "!=", "<", "<=", ">", ">="]);
                let (a, b) = (self.number(d), self.number(d));
                format!("({} {op} {})", a.0, b.0)
            }
            4 => {
                let op = self.pick(&["&&", "||", "&", "|", "^", "==", "!="]);
                format!("({} {op} {})", self.expr(Ty::Bool, d), self.expr(Ty::Bool, d))
            }
            5 => format!("!({})", self.expr(Ty::Bool, d)),
            6 => {
                let f = self.pick(&["is_nan", "is_finite", "is_infinite"]);
                let x = self.number(d);
                format!("{f}({})", x.0)
            }
            7 => {
                let f = self.pick(&["is_odd", "is_even", "is_zero"]);
                format!("({}).{f}()", self.expr(Ty::Int, d))
            }
            _ => {
                let (a, b, c) =
                    (self.expr(Ty::Bool, d), self.expr(Ty::Bool, d), self.expr(Ty::Bool, d));
                format!("({a} && {b} || {c})")
            }
        }
    }
}
