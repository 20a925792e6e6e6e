//! Losses of an error.

use super::Real;

/// What is minimised: the mean over a batch of a function of the error `δ = Q(s, a) − y`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Loss {
    /// δ².
    SquaredError,
    /// ½δ² up to |δ| = 1, |δ| − ½ beyond (Huber 1964): PyTorch's smooth L1 loss.
    Huber,
}

impl Loss {
    /// The loss of an error, and its derivative.
    #[inline]
    pub fn of<T: Real>(self, error: T) -> (T, T) {
        let (one, half) = (T::of(1.0), T::of(0.5));
        match self {
            Self::SquaredError => (error * error, error + error),
            Self::Huber if error > one => (error - half, one),
            Self::Huber if error < -one => (-error - half, -one),
            Self::Huber => (half * error * error, error),
        }
    }
}
