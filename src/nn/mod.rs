//! Small networks, trained on one core.
//!
//! - [`Mlp`], [`Shape`]: a multilayer perceptron; [`Tensor`]: its weights by name
//! - [`Activations`], [`Gradient`]: forwards and backwards, without allocation
//! - [`Adam`], [`Loss`], [`blend`]: what moves the weights
//! - [`Kernels`]: the loops, for each instruction set; all give the same bits
//! - [`Real`], [`Buffer`]: numbers and where they lie
//!
//! Weights have the same bits after training on any x86-64 or arm64 machine: the order of every sum
//! is fixed, products that are added are rounded once, and nothing else is left to a library.

mod adam;
mod buffer;
mod gradient;
mod kernels;
mod loss;
mod mlp;
mod real;
#[cfg(test)]
mod tests;

pub use adam::Adam;
pub use buffer::Buffer;
pub use gradient::Gradient;
pub use kernels::Kernels;
pub use loss::Loss;
pub use mlp::{Activations, Mlp, Shape, Tensor};
pub use real::Real;

/// Moves the parameters of `to` towards those of `from`, by the part `rate` of the way: Polyak
/// averaging of a target network. A rate of 1 copies.
pub fn blend<T: Real>(kernels: Kernels, rate: f64, from: &Mlp<T>, to: &mut Mlp<T>) {
    if rate == 1.0 {
        to.params.copy_from_slice(&from.params);
    } else {
        kernels.blend(T::of(rate), &from.params, &mut to.params);
    }
}
