//! What a unit leaves behind.

use crate::learn::QTable;
use crate::mdp::Ending;

/// One episode.
#[derive(Debug, Clone, PartialEq)]
pub struct EpisodeRow {
    /// Number of steps.
    pub steps: u32,
    /// Native return: the undiscounted sum of what the environment paid.
    pub native: f64,
    /// Learned return: the undiscounted sum of what the agent learned from.
    pub learned: f64,
    /// The part of the learned return that potentials and advice make up.
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
    /// A planner's largest change per sweep; empty for learners.
    pub sweeps: Vec<f64>,
}

/// Action values read back from a store.
#[derive(Debug, Clone, PartialEq)]
pub struct Learned {
    /// The values; the agent's initial one where nothing was learned.
    pub q: QTable,
    /// Whether anything was learned in a state, one flag each.
    pub experienced: Vec<bool>,
}

impl UnitRecord {
    /// Steps over all episodes.
    pub fn steps(&self) -> u64 {
        self.rows.iter().map(|r| u64::from(r.steps)).sum()
    }
}
