//! What a unit leaves behind.

use super::store::Checkpoint;
use crate::learn::dqn::LogRow;
use crate::learn::planning::Sweep;
use crate::learn::{LinearQ, QTable};
use crate::mdp::Ending;
use crate::nn::Mlp;
use crate::shaping::{ActionSet, Features};

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
    /// The error of the values of a predictor after it: root mean square over the states that its
    /// policy reaches. `None` for other agents, without a model, and in between where many episodes
    /// make it costly.
    pub value_error: Option<f64>,
    /// What a network believed at its start, and what it brought; `None` for other agents.
    pub start: Option<StartValue>,
}

/// The first state of an episode, as a network values it and as it turned out. What is believed
/// beyond what is brought is overestimation (van Hasselt, Guez & Silver 2016), as far as the agent
/// does not explore.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StartValue {
    /// The largest action value there, when the episode began.
    pub believed: f64,
    /// The discounted learned return of the episode; where the time limit cut it off, what might
    /// have followed is not in it.
    pub brought: f64,
}

/// Everything one unit produced.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct UnitRecord {
    /// Its episodes, in order.
    pub rows: Vec<EpisodeRow>,
    /// The action values learned, if the agent keeps any.
    pub q: Option<QTable>,
    /// The weights learned, shape `[n_features, n_actions]`, if the agent's values are linear in
    /// features.
    pub weights: Option<QTable>,
    /// The state values learned, if they are what the agent learns.
    pub values: Option<StateValues>,
    /// How a planner came to its solution; empty for learners.
    pub sweeps: Vec<Sweep>,
    /// The networks learned, if that is what the agent learns.
    pub networks: Vec<TrainedNetwork>,
    /// What was written down of their learning.
    pub log: Vec<LogRow>,
}

/// A network that is kept.
#[derive(Debug, Clone, PartialEq)]
pub struct TrainedNetwork {
    /// As what.
    pub which: Checkpoint,
    /// After how many episodes.
    pub episode: u32,
    /// The network.
    pub net: Mlp<f32>,
}

/// State values with what they should be.
#[derive(Debug, Clone, PartialEq)]
pub struct StateValues {
    /// Those learned, one per state.
    pub v: Vec<f64>,
    /// The exact ones, `None` in states that the policy does not reach; empty without a model.
    pub exact: Vec<Option<f64>>,
}

/// What an agent learns of states.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Action values.
    Q(QTable),
    /// State values of a policy that was given, one per state.
    V(Vec<f64>),
}

impl Values {
    /// The value of a state: of the best action, or of the policy.
    pub fn of(&self, s: usize) -> f64 {
        match self {
            Self::Q(q) => q.max(s),
            Self::V(v) => v[s],
        }
    }

    /// The action values, if that is what they are.
    pub fn q(&self) -> Option<&QTable> {
        match self {
            Self::Q(q) => Some(q),
            Self::V(_) => None,
        }
    }
}

/// What was learned, read back from a store: of states, or where values are linear in features, of
/// these: their weights then stand in for action values.
#[derive(Debug, Clone, PartialEq)]
pub struct Learned {
    /// The values; the agent's initial one where nothing was learned.
    pub values: Values,
    /// Whether anything was learned in a state (or of a feature), one flag each.
    pub experienced: Vec<bool>,
    /// In how many episodes.
    pub episodes: u32,
}

impl Learned {
    /// As a shield leaves it that allows `allowed`, one set per state: refused actions are worth −∞.
    #[must_use]
    pub fn behind(self, allowed: &[ActionSet]) -> Self {
        let Self { values: Values::Q(q), experienced, episodes } = self else { return self };
        let n_actions = q.n_actions();
        let behind = q.values().iter().enumerate().map(|(i, &value)| {
            let refused = !allowed[i / n_actions].contains(i % n_actions);
            if refused { f64::NEG_INFINITY } else { value }
        });
        let q = QTable::from_values(n_actions, behind.collect());
        Self { values: Values::Q(q), experienced, episodes }
    }

    /// Of weights of `features`: the values at `states`, a row each. Something was learned where it
    /// was of one of the state's features.
    #[must_use]
    pub fn at(self, features: &Features, states: &[Vec<f64>]) -> Self {
        let Self { values: Values::Q(weights), experienced, episodes } = self else { return self };
        let mut active = features.active();
        let mut known = |state: &Vec<f64>| {
            features.see(state, &mut active);
            active.index.iter().any(|&i| experienced[i as usize])
        };
        let experienced = states.iter().map(&mut known).collect();
        let q = LinearQ::from_weights(features.clone(), weights).table(states);
        Self { values: Values::Q(q), experienced, episodes }
    }
}

impl UnitRecord {
    /// Steps over all episodes.
    pub fn steps(&self) -> u64 {
        self.rows.iter().map(|r| u64::from(r.steps)).sum()
    }
}
