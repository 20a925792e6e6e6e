//! Observation normalisation: what the agent's discretiser sees instead of physical units.

use serde::Serialize;

/// The range of one field that is shown as [-1, 1]. It is stated beforehand, not estimated while
/// training, so that an observation means the same in every episode of every run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Scale {
    /// Which field of the state: an index into `Schema::fields`.
    pub field: usize,
    /// What is shown as -1.
    pub low: f64,
    /// What is shown as 1. Values outside the range lie outside [-1, 1].
    pub high: f64,
}

impl Scale {
    /// `x` in physical units, as it is shown.
    #[inline]
    pub fn shown(&self, x: f64) -> f64 {
        2.0 * ((x - self.low) / (self.high - self.low)) - 1.0
    }

    /// The physical value that is shown as `x`.
    pub fn physical(&self, x: f64) -> f64 {
        // Exact at either end.
        let share = f64::midpoint(x, 1.0);
        self.low * (1.0 - share) + self.high * share
    }

    /// Replaces the fields that `scales` speak of by what is shown.
    #[inline]
    pub fn show_all(scales: &[Self], fields: &mut [f64]) {
        for scale in scales {
            fields[scale.field] = scale.shown(fields[scale.field]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_of_the_range_are_minus_one_and_one() {
        let scale = Scale { field: 1, low: -0.5, high: 1.5 };
        assert_eq!([-0.5, 0.5, 1.5, 2.5].map(|x| scale.shown(x)), [-1.0, 0.0, 1.0, 2.0]);
        assert_eq!([-1.0, 0.0, 1.0, 2.0].map(|x| scale.physical(x)), [-0.5, 0.5, 1.5, 2.5]);
        let mut fields = [7.0, 1.0];
        Scale::show_all(&[scale], &mut fields);
        assert_eq!(fields, [7.0, 0.5]);
    }
}
