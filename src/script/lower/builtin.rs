//! Operators and mathematical functions, with the meaning that [`super::super::numeric`] and Rhai's
//! standard library give them.

use rhai::Position;

use super::value::Val;
use super::{Lowered, Lowering, outside};
use crate::jit::ir::{Binary, Compare, Expr, Math1, Math2, Stmt, Type, Unary};
use crate::jit::math;
use crate::script::value::Value;

use Type::{Bool, Float, Int};

type Number = (Expr, Type);

fn unary(op: Unary, x: Expr) -> Expr {
    match (op, &x) {
        (Unary::NegFloat, Expr::Float(x)) => Expr::Float(-x),
        (Unary::IntToFloat, Expr::Int(x)) => Expr::Float(*x as f64),
        (Unary::Not, Expr::Bool(x)) => Expr::Bool(!x),
        _ => Expr::Unary(op, x.into()),
    }
}

fn binary(op: Binary, a: Expr, b: Expr) -> Expr {
    let folded = match (op, &a, &b) {
        (Binary::AddFloat, Expr::Float(a), Expr::Float(b)) => Some(Expr::Float(a + b)),
        (Binary::SubFloat, Expr::Float(a), Expr::Float(b)) => Some(Expr::Float(a - b)),
        (Binary::MulFloat, Expr::Float(a), Expr::Float(b)) => Some(Expr::Float(a * b)),
        (Binary::DivFloat, Expr::Float(a), Expr::Float(b)) => Some(Expr::Float(a / b)),
        (Binary::AddInt, Expr::Int(a), Expr::Int(b)) => a.checked_add(*b).map(Expr::Int),
        (Binary::SubInt, Expr::Int(a), Expr::Int(b)) => a.checked_sub(*b).map(Expr::Int),
        (Binary::MulInt, Expr::Int(a), Expr::Int(b)) => a.checked_mul(*b).map(Expr::Int),
        (Binary::Int(how), Expr::Int(a), Expr::Int(b)) => Some(Expr::Bool(holds(how, a, b))),
        (Binary::Float(how), Expr::Float(a), Expr::Float(b)) => Some(Expr::Bool(holds(how, a, b))),
        _ => None,
    };
    folded.unwrap_or_else(|| Expr::Binary(op, a.into(), b.into()))
}

fn holds<T: PartialOrd>(how: Compare, a: &T, b: &T) -> bool {
    match how {
        Compare::Eq => a == b,
        Compare::Ne => a != b,
        Compare::Lt => a < b,
        Compare::Le => a <= b,
        Compare::Gt => a > b,
        Compare::Ge => a >= b,
    }
}

fn float(number: &Number) -> Expr {
    match number {
        (x, Int) => unary(Unary::IntToFloat, x.clone()),
        (x, _) => x.clone(),
    }
}

fn comparison(name: &str) -> Option<Compare> {
    Some(match name {
        "==" => Compare::Eq,
        "!=" => Compare::Ne,
        "<" => Compare::Lt,
        "<=" => Compare::Le,
        ">" => Compare::Gt,
        ">=" => Compare::Ge,
        _ => return None,
    })
}

impl Lowering<'_> {
    /// What the operator or function `name` gives for `args`.
    pub(super) fn builtin(&mut self, name: &str, args: &[Val], position: Position) -> Lowered<Val> {
        // What the operators `in` and `..` are called inside Rhai.
        if matches!(name, "contains" | "..") {
            return outside(if name == ".." { "a range" } else { "`in`" }, position);
        }
        if args.iter().any(|v| matches!(v, Val::Never)) {
            return Ok(Val::Never);
        }
        if let (Some(how), [a, b]) = (comparison(name), args)
            && let Some(result) = text_comparison(how, a, b)
        {
            return Ok(Val::Num(result));
        }
        let numbers: Option<Vec<Number>> = args.iter().map(|v| self.number(v)).collect();
        let Some(numbers) = numbers else {
            let stranger = args.iter().find(|v| self.number(v).is_none()).expect("one at least");
            let text = matches!(stranger.described(), "a string" | "a character");
            return match (comparison(name), text) {
                (Some(_), true) => outside("a comparison of strings", position),
                _ if is_operator(name) => {
                    outside(format!("`{name}` of {}", stranger.described()), position)
                }
                _ => outside(format!("`{name}` of {}", stranger.described()), position),
            };
        };
        let result = match numbers.as_slice() {
            [x] => self.of_one(name, x, position)?,
            [a, b] => self.of_two(name, a, b, position)?,
            [x, lo, hi] if name == "clamp" => clamp(x, lo, hi),
            _ => None,
        };
        match result {
            Some(result) => Ok(Val::Num(result)),
            None if known(name) => outside(format!("`{name}` of these arguments"), position),
            None => outside(format!("`{name}`"), position),
        }
    }

    /// A property of a number: `x.floor`, `n.is_odd`.
    pub(super) fn getter(&mut self, val: &Val, name: &str, position: Position) -> Lowered<Val> {
        const FLOAT: [&str; 8] =
            ["floor", "ceiling", "round", "int", "fraction", "is_nan", "is_finite", "is_infinite"];
        const INT: [&str; 3] = ["is_zero", "is_odd", "is_even"];
        let ty = self.number(val).map(|(_, ty)| ty);
        let exists = match ty {
            Some(Float) => FLOAT.contains(&name),
            Some(Int) => INT.contains(&name),
            _ => false,
        };
        if !exists {
            return outside(format!("the property `{name}` of a number"), position);
        }
        self.builtin(name, std::slice::from_ref(val), position)
    }

    fn of_one(&mut self, name: &str, x: &Number, position: Position) -> Lowered<Option<Expr>> {
        let (e, ty) = (x.0.clone(), x.1);
        let simple = match (name, ty) {
            ("-", Float) => unary(Unary::NegFloat, e),
            ("-", Int) => unary(Unary::NegInt, e),
            ("+", Float | Int)
            | ("to_float", Float)
            | ("to_int" | "floor" | "ceil" | "round", Int) => e,
            ("!", Bool) => unary(Unary::Not, e),
            ("abs", Float) => unary(Unary::AbsFloat, e),
            ("abs", Int) => unary(Unary::AbsInt, e),
            ("sqrt", Float | Int) => unary(Unary::Sqrt, float(x)),
            ("floor", Float) => unary(Unary::Floor, e),
            ("ceil" | "ceiling", Float) => unary(Unary::Ceil, e),
            ("int", Float) => unary(Unary::Trunc, e),
            ("round", Float) => Expr::Call1(math::round, e.into()),
            ("fraction", Float) => Expr::Call1(math::fraction, e.into()),
            ("to_float", Int) => float(x),
            ("is_nan", Float) => unary(Unary::IsNan, e),
            ("is_finite", Float) => unary(Unary::IsFinite, e),
            ("is_infinite", Float) => unary(Unary::IsInfinite, e),
            ("is_zero", Float) => binary(Binary::Float(Compare::Eq), e, Expr::Float(0.0)),
            ("is_zero", Int) => binary(Binary::Int(Compare::Eq), e, Expr::Int(0)),
            ("is_even" | "is_odd", Int) => {
                let bit = binary(Binary::AndInt, e, Expr::Int(1));
                let odd = Expr::Int(i64::from(name == "is_odd"));
                binary(Binary::Int(Compare::Eq), bit, odd)
            }
            ("to_int", Float) => self.integer_of(e, position)?,
            ("sign", Float | Int) => self.sign(e, ty, position)?,
            (_, Float | Int) => {
                let found = math::UNARY.iter().find(|(n, _)| *n == name);
                return Ok(found.map(|(_, f)| Expr::Call1(*f as Math1, float(x).into())));
            }
            _ => return Ok(None),
        };
        Ok(Some(simple))
    }

    /// Rhai refuses what does not fit; what is not a number is 0.
    fn integer_of(&mut self, x: Expr, position: Position) -> Lowered<Expr> {
        let x = self.held(x, position)?;
        let beyond =
            |how, limit: i64| binary(Binary::Float(how), x.clone(), Expr::Float(limit as f64));
        let outside =
            Expr::Or(beyond(Compare::Gt, i64::MAX).into(), beyond(Compare::Lt, i64::MIN).into());
        self.code.push(Stmt::If(outside, vec![Stmt::Trap], Vec::new()));
        Ok(unary(Unary::FloatToInt, x))
    }

    /// 1, -1 or 0; of a float that is neither positive nor negative, itself.
    fn sign(&mut self, x: Expr, ty: Type, position: Position) -> Lowered<Expr> {
        let (compare, zero, one, minus): (fn(Compare) -> Binary, _, _, _) = match ty {
            Int => (Binary::Int, Expr::Int(0), Expr::Int(1), Expr::Int(-1)),
            _ => (Binary::Float, Expr::Float(0.0), Expr::Float(1.0), Expr::Float(-1.0)),
        };
        let x = self.hold(x, position)?;
        let sign = self.local(ty, position)?;
        self.code.push(Stmt::Set(sign, x.clone()));
        let set = |how, to: Expr| {
            let holds = binary(compare(how), x.clone(), zero.clone());
            Stmt::If(holds, vec![Stmt::Set(sign, to)], Vec::new())
        };
        let (positive, negative) = (set(Compare::Gt, one), set(Compare::Lt, minus));
        self.code.extend([positive, negative]);
        Ok(Expr::Local(sign))
    }

    fn of_two(
        &mut self,
        name: &str,
        a: &Number,
        b: &Number,
        position: Position,
    ) -> Lowered<Option<Expr>> {
        if let Some(how) = comparison(name) {
            let op = match (a.1, b.1) {
                (Bool, Bool) if matches!(how, Compare::Eq | Compare::Ne) => Binary::Bool(how),
                (Bool, _) | (_, Bool) => return Ok(None),
                (Int, Int) => Binary::Int(how),
                _ => {
                    return Ok(Some(binary(Binary::Float(how), float(a), float(b))));
                }
            };
            return Ok(Some(binary(op, a.0.clone(), b.0.clone())));
        }
        let both = (a.1, b.1);
        let ints = both == (Int, Int);
        let call = |f: Math2| Expr::Call2(f, float(a).into(), float(b).into());
        let by_type = |of_ints: Binary, of_floats: Binary| {
            if ints {
                binary(of_ints, a.0.clone(), b.0.clone())
            } else {
                binary(of_floats, float(a), float(b))
            }
        };
        if matches!(both, (Bool, _) | (_, Bool)) {
            let op = match (both, name) {
                ((Bool, Bool), "&") => Binary::AndBool,
                ((Bool, Bool), "|") => Binary::OrBool,
                ((Bool, Bool), "^") => Binary::XorBool,
                _ => return Ok(None),
            };
            return Ok(Some(binary(op, a.0.clone(), b.0.clone())));
        }
        Ok(Some(match name {
            "+" => by_type(Binary::AddInt, Binary::AddFloat),
            "-" => by_type(Binary::SubInt, Binary::SubFloat),
            "*" => by_type(Binary::MulInt, Binary::MulFloat),
            "/" => by_type(Binary::DivInt, Binary::DivFloat),
            "%" if ints => binary(Binary::RemInt, a.0.clone(), b.0.clone()),
            "%" => call(math::remainder),
            "min" => by_type(Binary::MinInt, Binary::Least),
            "max" => by_type(Binary::MaxInt, Binary::Greatest),
            "&" if ints => binary(Binary::AndInt, a.0.clone(), b.0.clone()),
            "|" if ints => binary(Binary::OrInt, a.0.clone(), b.0.clone()),
            "^" if ints => binary(Binary::XorInt, a.0.clone(), b.0.clone()),
            "**" | "pow" => return self.power(a, b, position),
            "atan" if both == (Float, Float) => call(math::atan2),
            "log" if both == (Float, Float) => call(math::log),
            "hypot" if both == (Float, Float) => call(math::hypot),
            _ => return Ok(None),
        }))
    }

    /// `a ** b`. A square is correctly rounded as a product, as the pinned power is; of integers a
    /// chain of products overflows where the power does.
    fn power(&mut self, a: &Number, b: &Number, position: Position) -> Lowered<Option<Expr>> {
        let of_ints = (a.1, b.1) == (Int, Int);
        if of_ints {
            let Expr::Int(n @ 0..=64) = b.0 else {
                return outside("an integer to the power of a variable", position);
            };
            let x = self.held(a.0.clone(), position)?;
            let mut product = Expr::Int(1);
            for _ in 0..n {
                product = binary(Binary::MulInt, product, x.clone());
            }
            return Ok(Some(product));
        }
        let exponent = float(b);
        if let Expr::Float(n) = exponent
            && n == 2.0
        {
            let x = self.held(float(a), position)?;
            return Ok(Some(binary(Binary::MulFloat, x.clone(), x)));
        }
        Ok(Some(Expr::Call2(math::pow, float(a).into(), exponent.into())))
    }
}

/// `clamp(x, lo, hi)` where it is defined.
fn clamp(x: &Number, lo: &Number, hi: &Number) -> Option<Expr> {
    match (x.1, lo.1, hi.1) {
        (Int, Int, Int) => {
            let raised = binary(Binary::MaxInt, x.0.clone(), lo.0.clone());
            Some(binary(Binary::MinInt, raised, hi.0.clone()))
        }
        (Float | Int, Float, Float) | (Float, Int, Int) => {
            let raised = binary(Binary::Greatest, float(x), float(lo));
            Some(binary(Binary::Least, raised, float(hi)))
        }
        _ => None,
    }
}

/// Whether two strings are equal, where that is known or a question of one letter.
fn text_comparison(how: Compare, a: &Val, b: &Val) -> Option<Expr> {
    let equal = match how {
        Compare::Eq => true,
        Compare::Ne => false,
        _ => return None,
    };
    let string = |val: &Val| match val {
        Val::Data(value) => match &**value {
            Value::Str(text) => Some(text.clone()),
            _ => None,
        },
        _ => None,
    };
    let letter = |input: usize, text: &str| {
        let mut chars = text.chars();
        match (chars.next(), chars.next()) {
            (Some(c), None) => {
                let code = Expr::Float(f64::from(u32::from(c)));
                binary(Binary::Float(how), Expr::Input(input, Float), code)
            }
            _ => Expr::Bool(!equal),
        }
    };
    match (a, b) {
        (Val::Letter(i), Val::Letter(j)) => {
            Some(binary(Binary::Float(how), Expr::Input(*i, Float), Expr::Input(*j, Float)))
        }
        (Val::Letter(i), other) | (other, Val::Letter(i)) => Some(letter(*i, &string(other)?)),
        _ => Some(Expr::Bool((string(a)? == string(b)?) == equal)),
    }
}

fn is_operator(name: &str) -> bool {
    !name.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// Whether there is a mathematical function of that name.
fn known(name: &str) -> bool {
    is_operator(name) || crate::script::functions::is_mathematical(name)
}
