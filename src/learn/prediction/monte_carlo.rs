//! Monte Carlo prediction (Sutton & Barto 2018, section 5.1).
//!
//! `V(S) ← V(S) + α [G − V(S)]` at the end of each episode, from its last step to its first, for the
//! first visit of S in the episode or for every one.

use super::{Estimate, Rule};
use crate::learn::Last;
use crate::learn::episode::{Episode, Visits};

/// Monte Carlo prediction.
///
/// Deviation 1: an episode that the time limit cuts off counts with the rewards that it had.
#[derive(Debug, Clone)]
pub struct MonteCarloPrediction {
    visits: Visits,
    episode: Episode,
}

impl MonteCarloPrediction {
    /// Over `n_states`.
    pub fn new(visits: Visits, n_states: usize) -> Self {
        Self { visits, episode: Episode::new(n_states) }
    }
}

impl Rule for MonteCarloPrediction {
    const BOOTSTRAPS: bool = false;

    fn begin(&mut self, _estimate: &mut Estimate, s: usize) {
        self.episode.begin();
        self.episode.visit(s);
    }

    fn step(&mut self, _estimate: &mut Estimate, reward: f64, next: usize) {
        self.episode.reward(reward);
        self.episode.visit(next);
    }

    fn end(&mut self, estimate: &mut Estimate, reward: f64, _last: Last) {
        self.episode.reward(reward);
        let gamma = estimate.gamma;
        self.episode.returns(gamma, self.visits, |s, g| estimate.learn(s, g));
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{HALF, MEAN, after};
    use super::*;
    use crate::learn::AlphaSource;

    /// States 0, 1, 0 with rewards 2, 4, 8: returns 6, 8, 8.
    fn play(visits: Visits, alpha: AlphaSource, last: Last) -> Vec<f64> {
        let rule = MonteCarloPrediction::new(visits, 3);
        after(rule, &[1.0, 4.0, 9.0], alpha, &[0, 1, 0], &[2.0, 4.0, 8.0], last)
    }

    #[test]
    fn an_episode_by_hand() {
        assert_eq!(play(Visits::First, HALF, Last::Terminated), [3.5, 6.0, 9.0]);
        // 1 + (8 - 1) / 2 = 4.5, then 4.5 + (6 - 4.5) / 2.
        assert_eq!(play(Visits::Every, HALF, Last::Terminated), [5.25, 6.0, 9.0]);
        assert_eq!(play(Visits::Every, MEAN, Last::Terminated), [7.0, 8.0, 9.0]);
        assert_eq!(play(Visits::First, MEAN, Last::Truncated(2)), [6.0, 8.0, 9.0]);
    }
}
