//! Actions whose type is known at run time only.

/// An action as recordings and rollouts write it: an integer, or a list of numbers.
#[derive(Debug, Clone, PartialEq)]
pub enum PlayedAction {
    /// An index into `Discrete(n)`.
    Index(i64),
    /// One number per component of a `Box`, rounded to float32 when it is played.
    Box(Vec<f64>),
}

impl From<i64> for PlayedAction {
    fn from(index: i64) -> Self {
        Self::Index(index)
    }
}

/// Tmp.
#[derive(Debug, Clone)]
pub struct ActionTable;
impl ActionTable {
    /// Tmp.
    pub fn len(&self) -> usize {
        0
    }
    /// Tmp.
    pub fn scalar(&self, _i: usize) -> f32 {
        0.0
    }
}
