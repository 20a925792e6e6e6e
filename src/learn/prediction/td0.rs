//! TD(0) (Sutton 1988; Sutton & Barto 2018, section 6.1).
//!
//! `V(S) ← V(S) + α [R + γ V(S′) − V(S)]`

use super::{Estimate, Rule};
use crate::learn::Last;

/// One-step temporal-difference prediction.
#[derive(Debug, Clone, Default)]
pub struct Td0 {
    s: usize,
}

impl Rule for Td0 {
    const BOOTSTRAPS: bool = true;

    fn begin(&mut self, _estimate: &mut Estimate, s: usize) {
        self.s = s;
    }

    #[inline]
    fn step(&mut self, estimate: &mut Estimate, reward: f64, next: usize) {
        estimate.learn(self.s, reward + estimate.gamma * estimate.v[next]);
        self.s = next;
    }

    fn end(&mut self, estimate: &mut Estimate, reward: f64, last: Last) {
        estimate.learn(self.s, reward + estimate.gamma * estimate.after(last));
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{HALF, MEAN, after};
    use super::*;
    use crate::learn::AlphaSource;

    fn play(alpha: AlphaSource, last: Last) -> Vec<f64> {
        after(Td0::default(), &[1.0, 4.0, 9.0], alpha, &[0, 1, 0], &[2.0, 4.0, 8.0], last)
    }

    #[test]
    fn an_episode_by_hand() {
        // 1 + (2 + 2 - 1) / 2 = 2.5; 4 + (4 + 1.25 - 4) / 2 = 4.625; 2.5 + (8 - 2.5) / 2.
        assert_eq!(play(HALF, Last::Terminated), [5.25, 4.625, 9.0]);
        // In the end 8 + 9 / 2 instead of 8.
        assert_eq!(play(HALF, Last::Truncated(2)), [7.5, 4.625, 9.0]);
        // 1/1 and 1/2 for state 0: 4, then 4 + (8 - 4) / 2; state 1: 4 + 4 / 2.
        assert_eq!(play(MEAN, Last::Terminated), [6.0, 6.0, 9.0]);
    }
}
