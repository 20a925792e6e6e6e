//! The typed intermediate form of a callback: what is between a script's syntax and machine code.
//!
//! A [`Program`] is a pure function of a slice of floats. Every expression has one type, control
//! flow is structured as in WebAssembly (blocks that are left, loops that are begun again), all calls
//! are inlined, and nothing allocates. What a script would report as an error (an overflow, a division
//! by zero, an index outside an array, a missing value, too many operations) is a *trap*: it ends the
//! program without a result. Whoever runs it asks the script's interpreter then, which says what is
//! wrong, and where.

/// What an expression or a local holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Type {
    /// An IEEE 754 double.
    Float,
    /// A 64-bit integer.
    Int,
    /// A truth value.
    Bool,
}

/// A function of one float that machine code can call.
pub type Math1 = extern "C" fn(f64) -> f64;
/// A function of two floats that machine code can call.
pub type Math2 = extern "C" fn(f64, f64) -> f64;

/// Operations on one value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unary {
    /// -x of a float: flips the sign, of NaN and zeros too.
    NegFloat,
    /// -x of an integer; traps on the least one.
    NegInt,
    /// |x| of a float.
    AbsFloat,
    /// |x| of an integer; traps on the least one.
    AbsInt,
    /// Logical negation.
    Not,
    /// The float nearest to an integer.
    IntToFloat,
    /// The integer of a float: truncated, saturating, 0 for NaN (Rust's `as`).
    FloatToInt,
    /// The largest whole number that is not greater.
    Floor,
    /// The smallest whole number that is not less.
    Ceil,
    /// The whole number towards zero.
    Trunc,
    /// √x, correctly rounded.
    Sqrt,
    /// Whether a float is NaN.
    IsNan,
    /// Whether a float is neither infinite nor NaN.
    IsFinite,
    /// Whether a float is infinite.
    IsInfinite,
}

/// How two values of a type are compared. Of floats as IEEE 754 has it: with NaN only [`Self::Ne`]
/// holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Compare {
    /// ==
    Eq,
    /// !=
    Ne,
    /// <
    Lt,
    /// <=
    Le,
    /// \>
    Gt,
    /// \>=
    Ge,
}

/// Operations on two values. Both are always evaluated, the left one first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Binary {
    /// Of floats.
    AddFloat,
    /// Of floats.
    SubFloat,
    /// Of floats.
    MulFloat,
    /// Of floats; by zero it is infinite or NaN.
    DivFloat,
    /// The second float if it is less than the first, else the first: NaN on either side gives the
    /// first.
    Least,
    /// The second float if it is greater than the first, else the first.
    Greatest,
    /// Of integers; traps on overflow.
    AddInt,
    /// Of integers; traps on overflow.
    SubInt,
    /// Of integers; traps on overflow.
    MulInt,
    /// Of integers, towards zero; traps on division by zero and on the least one by -1.
    DivInt,
    /// Of integers, with the sign of the dividend; traps as [`Self::DivInt`] does.
    RemInt,
    /// The lesser integer.
    MinInt,
    /// The greater integer.
    MaxInt,
    /// Bitwise, of integers.
    AndInt,
    /// Bitwise, of integers.
    OrInt,
    /// Bitwise, of integers.
    XorInt,
    /// Of truth values.
    AndBool,
    /// Of truth values.
    OrBool,
    /// Of truth values.
    XorBool,
    /// Of floats.
    Float(Compare),
    /// Of integers.
    Int(Compare),
    /// Of truth values: [`Compare::Eq`] and [`Compare::Ne`] only.
    Bool(Compare),
}

/// A value.
#[derive(Debug, Clone)]
pub enum Expr {
    /// A constant.
    Float(f64),
    /// A constant.
    Int(i64),
    /// A constant.
    Bool(bool),
    /// An input: a float as it is, an integer that the float holds exactly, or whether it is not 0.
    Input(usize, Type),
    /// What a local holds.
    Local(usize),
    /// An operation.
    Unary(Unary, Box<Expr>),
    /// An operation.
    Binary(Binary, Box<Expr>, Box<Expr>),
    /// Whether both hold; the second is evaluated only if the first does.
    And(Box<Expr>, Box<Expr>),
    /// Whether one holds; the second is evaluated only if the first does not.
    Or(Box<Expr>, Box<Expr>),
    /// A function of one float.
    Call1(Math1, Box<Expr>),
    /// A function of two floats.
    Call2(Math2, Box<Expr>, Box<Expr>),
    /// An element of a table of constants. The index counts from 0, negative ones from the end
    /// (-1 is the last); traps outside.
    Table(usize, Box<Expr>),
    /// An element of a local array, likewise.
    Element(usize, Box<Expr>),
}

/// What is done.
#[derive(Debug, Clone)]
pub enum Stmt {
    /// Sets a local to a value of its type.
    Set(usize, Expr),
    /// Sets element `1` of local array `0` to a value of its type.
    SetElement(usize, usize, Expr),
    /// Evaluates a value, which may trap, and forgets it.
    Check(Expr),
    /// One or the other.
    If(Expr, Vec<Stmt>, Vec<Stmt>),
    /// Statements that [`Stmt::Exit`] of the same label leaves.
    Block(Label, Vec<Stmt>),
    /// Statements that [`Stmt::Again`] of the same label begins again. At their end the loop ends.
    Loop(Label, Vec<Stmt>),
    /// Goes on after the enclosing block of that label.
    Exit(Label),
    /// Goes on at the start of the enclosing loop of that label. Uses up that many operations of
    /// [`Program::fuel`]; traps if there are not so many left.
    Again(Label, u32),
    /// Ends the program with a value of the type [`Program::result`].
    Return(Expr),
    /// Ends the program without a result.
    Trap,
}

/// Names a [`Stmt::Block`] or [`Stmt::Loop`]; unique in a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Label(pub usize);

/// Constants of one type.
#[derive(Debug, Clone, PartialEq)]
pub enum Table {
    /// Floats.
    Float(Vec<f64>),
    /// Integers.
    Int(Vec<i64>),
}

impl Table {
    /// The type of its elements.
    pub fn element(&self) -> Type {
        match self {
            Self::Float(_) => Type::Float,
            Self::Int(_) => Type::Int,
        }
    }

    /// How many there are, at least one.
    #[allow(clippy::len_without_is_empty, reason = "a table is never empty")]
    pub fn len(&self) -> usize {
        match self {
            Self::Float(list) => list.len(),
            Self::Int(list) => list.len(),
        }
    }
}

/// A pure function of floats.
#[derive(Debug, Clone)]
pub struct Program {
    /// How many inputs it reads at most: [`Expr::Input`] is below.
    pub n_inputs: usize,
    /// The types of its locals, by their numbers. All are set before they are read.
    pub locals: Vec<Type>,
    /// Type and length (at least 1) of its local arrays, by their numbers. All elements are set before
    /// one is read.
    pub arrays: Vec<(Type, usize)>,
    /// Its tables, by their numbers.
    pub tables: Vec<Table>,
    /// Operations that its loops may use up.
    pub fuel: i64,
    /// What it returns.
    pub result: Type,
    /// What it does. At the end without a [`Stmt::Return`] it traps.
    pub body: Vec<Stmt>,
}

impl Program {
    /// Whether input `index` can have a part in what it returns.
    pub fn reads(&self, index: usize) -> bool {
        fn expr(e: &Expr, index: usize) -> bool {
            match e {
                Expr::Input(i, _) => *i == index,
                Expr::Float(_) | Expr::Int(_) | Expr::Bool(_) | Expr::Local(_) => false,
                Expr::Unary(_, x) | Expr::Call1(_, x) | Expr::Table(_, x) | Expr::Element(_, x) => {
                    expr(x, index)
                }
                Expr::Binary(_, a, b) | Expr::And(a, b) | Expr::Or(a, b) | Expr::Call2(_, a, b) => {
                    expr(a, index) || expr(b, index)
                }
            }
        }
        fn stmts(list: &[Stmt], index: usize) -> bool {
            list.iter().any(|stmt| match stmt {
                Stmt::Set(_, e) | Stmt::SetElement(_, _, e) | Stmt::Check(e) | Stmt::Return(e) => {
                    expr(e, index)
                }
                Stmt::If(e, a, b) => expr(e, index) || stmts(a, index) || stmts(b, index),
                Stmt::Block(_, list) | Stmt::Loop(_, list) => stmts(list, index),
                Stmt::Exit(_) | Stmt::Again(..) | Stmt::Trap => false,
            })
        }
        stmts(&self.body, index)
    }

    /// The type of an expression in it.
    pub fn type_of(&self, expr: &Expr) -> Type {
        match expr {
            Expr::Float(_) | Expr::Call1(..) | Expr::Call2(..) => Type::Float,
            Expr::Int(_) => Type::Int,
            Expr::Bool(_) | Expr::And(..) | Expr::Or(..) => Type::Bool,
            Expr::Input(_, ty) => *ty,
            Expr::Local(i) => self.locals[*i],
            Expr::Unary(op, _) => op.result(),
            Expr::Binary(op, ..) => op.result(),
            Expr::Table(i, _) => self.tables[*i].element(),
            Expr::Element(i, _) => self.arrays[*i].0,
        }
    }
}

impl Unary {
    /// The type of its result.
    pub fn result(self) -> Type {
        match self {
            Self::NegFloat
            | Self::AbsFloat
            | Self::IntToFloat
            | Self::Floor
            | Self::Ceil
            | Self::Trunc
            | Self::Sqrt => Type::Float,
            Self::NegInt | Self::AbsInt | Self::FloatToInt => Type::Int,
            Self::Not | Self::IsNan | Self::IsFinite | Self::IsInfinite => Type::Bool,
        }
    }
}

impl Binary {
    /// The type of its result.
    pub fn result(self) -> Type {
        match self {
            Self::AddFloat
            | Self::SubFloat
            | Self::MulFloat
            | Self::DivFloat
            | Self::Least
            | Self::Greatest => Type::Float,
            Self::AddInt
            | Self::SubInt
            | Self::MulInt
            | Self::DivInt
            | Self::RemInt
            | Self::MinInt
            | Self::MaxInt
            | Self::AndInt
            | Self::OrInt
            | Self::XorInt => Type::Int,
            Self::AndBool
            | Self::OrBool
            | Self::XorBool
            | Self::Float(_)
            | Self::Int(_)
            | Self::Bool(_) => Type::Bool,
        }
    }
}
