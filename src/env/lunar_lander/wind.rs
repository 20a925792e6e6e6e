//! The wind: a force and a torque that change smoothly and never repeat.

use crate::mdp::math;
use crate::mdp::numpy::NumpyRng;

/// Where in their patterns force and torque are.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Wind {
    force_index: i64,
    torque_index: i64,
}

impl Wind {
    /// Two places anywhere in the patterns.
    pub(super) fn draw(rng: &mut NumpyRng) -> Self {
        let force_index = rng.integers(-9999, 9999);
        Self { force_index, torque_index: rng.integers(-9999, 9999) }
    }

    /// The next force and torque, each in (-1, 1).
    pub(super) fn next(&mut self) -> [f64; 2] {
        let gusts = [self.force_index, self.torque_index].map(gust);
        self.force_index += 1;
        self.torque_index += 1;
        gusts
    }
}

fn gust(index: i64) -> f64 {
    let k = index as f64;
    math::tanh(math::sin(0.02 * k) + math::sin(std::f64::consts::PI * 0.01 * k))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gusts_are_gymnasiums() {
        // tanh(sin 0.5 + sin(π/4)) and tanh(sin(-0.5) + sin(-π/4)).
        assert!((gust(25) - 0.829_500_304_419_141_5).abs() < 1e-15, "{}", gust(25));
        assert_eq!(gust(-25), -gust(25));
        assert_eq!(gust(0), 0.0);
        let mut wind = Wind { force_index: 25, torque_index: -1 };
        assert_eq!(wind.next(), [gust(25), gust(-1)]);
        assert_eq!(wind.next(), [gust(26), gust(0)]);
    }
}
