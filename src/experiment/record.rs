//! What a unit leaves behind.

use crate::learn::{LinearQ, QTable};
use crate::mdp::Ending;
use crate::shaping::Features;

/// One episode.
#[derive(Debug, Clone, PartialEq)]
pub struct EpisodeRow {
    /// Number of steps.
    pub steps: u32,
    /// Native return: the undiscounted sum of what the environment paid.
    pub native: f64,
    /// Learned return: the undiscounted sum of what the agent learned from.
    pub learned: f64,
    /// The potential's part of the learned return.
    pub shaping: f64,
    /// Each extra term's part of the learned return, in the order of their names.
    pub terms: Vec<f64>,
    /// Exploration rate at the start of the episode.
    pub epsilon: f64,
    /// How it ended.
    pub ending: Ending,
}

/// Everything one unit produced.
#[derive(Debug, Clone, PartialEq)]
pub struct UnitRecord {
    /// Its episodes, in order.
    pub rows: Vec<EpisodeRow>,
    /// The action values learned, if the agent keeps any.
    pub q: Option<QTable>,
    /// The weights learned, shape `[n_features, n_actions]`, if the agent's values are linear in
    /// features.
    pub weights: Option<QTable>,
    /// A planner's largest change per sweep; empty for learners.
    pub sweeps: Vec<f64>,
}

/// Action values read back from a store: a row per state, or where values are linear in features a
/// row of weights per feature.
#[derive(Debug, Clone, PartialEq)]
pub struct Learned {
    /// The rows; the agent's initial ones where nothing was learned.
    pub q: QTable,
    /// Whether anything was learned, one flag per row.
    pub experienced: Vec<bool>,
}

impl Learned {
    /// Of weights of `features`: the values at `states`, a row each. Something was learned where it
    /// was of one of the state's features.
    #[must_use]
    pub fn at(self, features: &Features, states: &[Vec<f64>]) -> Self {
        let mut active = features.active();
        let mut known = |state: &Vec<f64>| {
            features.see(state, &mut active);
            active.index.iter().any(|&i| self.experienced[i as usize])
        };
        let experienced = states.iter().map(&mut known).collect();
        let q = LinearQ::from_weights(features.clone(), self.q).table(states);
        Self { q, experienced }
    }
}

impl UnitRecord {
    /// Steps over all episodes.
    pub fn steps(&self) -> u64 {
        self.rows.iter().map(|r| u64::from(r.steps)).sum()
    }
}
