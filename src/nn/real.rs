//! The numbers that networks are made of.

use fearless_simd::{Simd, SimdBase, SimdFloat, f32x16, f64x8};

/// A floating-point number: float32, in which networks are trained, or float64, in which the
/// equations are checked.
pub trait Real:
    nalgebra::Scalar
    + Copy
    + Default
    + PartialOrd
    + std::ops::Add<Output = Self>
    + std::ops::Sub<Output = Self>
    + std::ops::Mul<Output = Self>
    + std::ops::Div<Output = Self>
    + std::ops::Neg<Output = Self>
    + std::ops::AddAssign
    + std::ops::SubAssign
    + fearless_simd::SimdFloatElement
    + 'static
{
    /// Numbers in a vector, on every machine: rows of weights are padded to a multiple of it.
    const LANES: usize;

    /// A vector of [`Self::LANES`] numbers. Where registers are shorter it takes several.
    type Vector<S: Simd>: SimdFloat<S> + SimdBase<S, Element = Self>;

    /// The nearest number to `x`.
    fn of(x: f64) -> Self;

    /// As a float64, exactly.
    fn to_f64(self) -> f64;

    /// `self · a + b`, rounded once.
    #[must_use]
    fn mul_add(self, a: Self, b: Self) -> Self;

    /// √`self`, correctly rounded.
    #[must_use]
    fn sqrt(self) -> Self;
}

impl Real for f32 {
    const LANES: usize = 16;

    type Vector<S: Simd> = f32x16<S>;

    fn of(x: f64) -> Self {
        x as f32
    }

    fn to_f64(self) -> f64 {
        f64::from(self)
    }

    fn mul_add(self, a: Self, b: Self) -> Self {
        self.mul_add(a, b)
    }

    fn sqrt(self) -> Self {
        self.sqrt()
    }
}

impl Real for f64 {
    const LANES: usize = 8;

    type Vector<S: Simd> = f64x8<S>;

    fn of(x: f64) -> Self {
        x
    }

    fn to_f64(self) -> f64 {
        self
    }

    #[allow(clippy::disallowed_methods, reason = "networks are to be rounded once")]
    fn mul_add(self, a: Self, b: Self) -> Self {
        self.mul_add(a, b)
    }

    fn sqrt(self) -> Self {
        self.sqrt()
    }
}
