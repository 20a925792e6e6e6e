//! What a network sees of a state.

use super::{Fields, Scale};

/// From a state to the inputs of a network.
#[derive(Debug, Clone, PartialEq)]
pub enum Inputs {
    /// Of this many states, each has an input of its own, which is 1 in it and 0 elsewhere.
    OneHot(usize),
    /// The state's numbers in the order of the environment's schema, each in physical units or as
    /// its scale shows it.
    Fields(Vec<Option<Scale>>),
}

impl Inputs {
    /// The first `n` fields, some of them scaled.
    pub fn fields(n: usize, scales: &[Scale]) -> Self {
        let scale = |field| scales.iter().find(|s| s.field == field).copied();
        Self::Fields((0..n).map(scale).collect())
    }

    /// Number of inputs.
    pub fn n_inputs(&self) -> usize {
        match self {
            Self::OneHot(n) => *n,
            Self::Fields(scales) => scales.len(),
        }
    }

    /// Numbers that are kept of a state, from which its inputs can be made: the index, or the inputs
    /// themselves.
    pub fn n_kept(&self) -> usize {
        match self {
            Self::OneHot(_) => 1,
            Self::Fields(scales) => scales.len(),
        }
    }

    /// Writes what is kept of a state into `out`, shape `[n_kept]`.
    #[inline]
    pub fn keep(&self, s: &Fields, out: &mut [f32]) {
        match self {
            Self::OneHot(_) => out[0] = s.index as f32,
            Self::Fields(scales) => {
                for ((scale, &x), out) in scales.iter().zip(&s.values).zip(out) {
                    *out = scale.map_or(x, |scale| scale.shown(x)) as f32;
                }
            }
        }
    }

    /// Writes the inputs of a state into `out`, shape `[n_inputs]`, from what was kept of it.
    #[inline]
    pub fn expand(&self, kept: &[f32], out: &mut [f32]) {
        match self {
            Self::OneHot(_) => {
                out.fill(0.0);
                out[kept[0] as usize] = 1.0;
            }
            Self::Fields(_) => out.copy_from_slice(kept),
        }
    }
}
