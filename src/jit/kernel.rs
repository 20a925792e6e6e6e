//! What the loops of training call: a program, as fast as this host can run it.

use super::check::Invalid;
use super::eval::Value;
use super::ir::{Program, Type};
#[cfg(feature = "jit")]
use super::machine::Code;

/// What a kernel returns: a float, or an integer (a truth value is 0 or 1).
pub trait Output: Copy + sealed::Sealed {
    /// What stands for a trap: NaN, or the least integer. A program that returns it by itself counts
    /// as trapped.
    const TRAP: Self;

    /// Whether this is [`Self::TRAP`].
    fn is_trap(self) -> bool;

    /// Whether programs with this type of result return it.
    fn holds(result: Type) -> bool;

    /// What a program returned.
    fn of(value: Value) -> Self;
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for f64 {}
    impl Sealed for i64 {}
}

impl Output for f64 {
    const TRAP: Self = Self::NAN;

    #[inline]
    fn is_trap(self) -> bool {
        self.is_nan()
    }

    fn holds(result: Type) -> bool {
        result == Type::Float
    }

    #[inline]
    fn of(value: Value) -> Self {
        match value {
            Value::Float(x) => x,
            Value::Int(_) | Value::Bool(_) => unreachable!("the result is a float"),
        }
    }
}

impl Output for i64 {
    const TRAP: Self = Self::MIN;

    #[inline]
    fn is_trap(self) -> bool {
        self == Self::MIN
    }

    fn holds(result: Type) -> bool {
        result != Type::Float
    }

    #[inline]
    fn of(value: Value) -> Self {
        match value {
            Value::Int(x) => x,
            Value::Bool(x) => x.into(),
            Value::Float(_) => unreachable!("the result is an integer"),
        }
    }
}

/// A program made ready to be called millions of times.
#[derive(Debug)]
pub struct Kernel<R: Output>(Tier<R>);

#[derive(Debug)]
enum Tier<R> {
    #[cfg(feature = "jit")]
    Machine(Code<R>),
    Evaluated(Program, std::marker::PhantomData<R>),
}

impl<R: Output> Kernel<R> {
    /// `program` as machine code, or evaluated if this build or this host has none, or it does not fit.
    ///
    /// # Errors
    /// If the program is ill formed, or its result is not an `R`.
    pub fn new(program: Program) -> Result<Self, Invalid> {
        #[cfg(feature = "jit")]
        match Code::new(&program) {
            Ok(code) => return Ok(Self(Tier::Machine(code))),
            Err(super::machine::Error::Invalid(invalid)) => return Err(invalid),
            Err(super::machine::Error::Refused(_)) => {}
        }
        Self::evaluated(program)
    }

    /// `program`, evaluated.
    ///
    /// # Errors
    /// If the program is ill formed, or its result is not an `R`.
    pub fn evaluated(program: Program) -> Result<Self, Invalid> {
        program.check()?;
        program.returns::<R>()?;
        Ok(Self(Tier::Evaluated(program, std::marker::PhantomData)))
    }

    /// What the program returns, or [`Output::TRAP`].
    ///
    /// # Panics
    /// If there are fewer inputs than the program reads.
    #[inline]
    pub fn call(&self, inputs: &[f64]) -> R {
        match &self.0 {
            #[cfg(feature = "jit")]
            Tier::Machine(code) => code.call(inputs),
            Tier::Evaluated(program, _) => program.evaluate(inputs).map_or(R::TRAP, R::of),
        }
    }

    /// Whether it is machine code.
    pub fn is_machine(&self) -> bool {
        !matches!(self.0, Tier::Evaluated(..))
    }
}
