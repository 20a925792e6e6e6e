//! Adam (Kingma & Ba 2015).

use super::kernels::{AdamStep, Kernels};
use super::{Buffer, Gradient, Mlp, Real};

/// β₁ and β₂: how slowly the moments of the gradient fade. PyTorch's.
const BETA: [f64; 2] = [0.9, 0.999];

/// What keeps the denominator from 0.
const EPSILON: f64 = 1e-8;

/// The optimiser's state.
///
/// ```text
/// m ← β₁ m + (1 − β₁) g          v ← β₂ v + (1 − β₂) g²
/// w ← w − α/(1 − β₁ᵗ) · m / (√v / √(1 − β₂ᵗ) + ε)
/// ```
#[derive(Debug, Clone)]
pub struct Adam<T: Real> {
    /// The moments, as the parameters lie in memory.
    m: Buffer<T>,
    v: Buffer<T>,
    /// β₁ᵗ and β₂ᵗ.
    powers: [f64; 2],
}

impl<T: Real> Adam<T> {
    /// Before its first step on `mlp`.
    pub fn new(mlp: &Mlp<T>) -> Self {
        let zeros = || Buffer::zeros(mlp.params.len());
        Self { m: zeros(), v: zeros(), powers: [1.0; 2] }
    }

    /// A step down `gradient`, of the size `learning_rate`.
    pub fn step(
        &mut self,
        kernels: Kernels,
        learning_rate: f64,
        gradient: &Gradient<T>,
        mlp: &mut Mlp<T>,
    ) {
        for (power, beta) in self.powers.iter_mut().zip(BETA) {
            *power *= beta;
        }
        let [power_1, power_2] = self.powers;
        let step = AdamStep {
            rest_1: T::of(1.0 - BETA[0]),
            beta_2: T::of(BETA[1]),
            rest_2: T::of(1.0 - BETA[1]),
            size: T::of(learning_rate / (1.0 - power_1)),
            scale: T::of(1.0 / (1.0 - power_2).sqrt()),
            epsilon: T::of(EPSILON),
        };
        kernels.adam(&step, gradient.values(), (&mut self.m, &mut self.v), &mut mlp.params);
    }

    /// Its state: the moments m and v, and β₁ᵗ and β₂ᵗ.
    pub fn state(&self) -> (&[T], &[T], [f64; 2]) {
        (&self.m, &self.v, self.powers)
    }

    /// As it was in [`Self::state`].
    ///
    /// # Panics
    /// If the moments are those of another network.
    pub fn restore(&mut self, m: &[T], v: &[T], powers: [f64; 2]) {
        self.m.copy_from_slice(m);
        self.v.copy_from_slice(v);
        self.powers = powers;
    }
}
