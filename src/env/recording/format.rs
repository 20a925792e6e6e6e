//! The lines of a recording.

use serde::Deserialize;
use serde_json::{Map, Value};

use super::RecordingError;
use crate::env::{Observation, PlayedAction, Session};
use crate::mdp::numpy::Seed;

/// Line 1. Fields that a replay does not need are ignored.
#[derive(Deserialize)]
pub(super) struct Header {
    r#type: String,
    #[serde(default)]
    pub(super) config: String,
    pub(super) env_id: String,
    #[serde(default)]
    kwargs: Map<String, Value>,
    #[serde(default)]
    make_kwargs: Map<String, Value>,
    #[serde(default)]
    attrs: Map<String, Value>,
}

impl Header {
    /// Parses line 1.
    pub(super) fn parse(text: &str) -> Result<Self, RecordingError> {
        let error = |message: String| RecordingError::new(1, message);
        let header: Self =
            serde_json::from_str(text).map_err(|e| error(format!("not a header: {e}")))?;
        if header.r#type != "header" {
            return Err(error(format!(
                "a recording starts with a line of type `header`, not `{}`",
                header.r#type
            )));
        }
        Ok(header)
    }

    /// Makes a new instance of the environment.
    pub(super) fn session(&self) -> Result<Session, RecordingError> {
        let error = |message: &dyn std::fmt::Display| RecordingError::new(1, message);
        let mut kwargs = self.kwargs.clone();
        let mut limit = None;
        for (key, value) in &self.make_kwargs {
            if key == "max_episode_steps" {
                limit = Some(value.as_i64().ok_or_else(|| {
                    error(&format!("`max_episode_steps` must be an integer, not {value}"))
                })?);
            } else {
                kwargs.insert(key.clone(), value.clone());
            }
        }
        let mut session = Session::new(&self.env_id, &kwargs).map_err(|e| error(&e))?;
        if let Some(limit) = limit {
            session = session.with_max_episode_steps(limit).map_err(|e| error(&e))?;
        }
        for (name, value) in &self.attrs {
            session.set_attribute(name, value).map_err(|e| error(&e))?;
        }
        Ok(session)
    }
}

/// A line after the first.
#[derive(Deserialize)]
pub(super) struct Episode {
    r#type: String,
    pub(super) seed: u64,
    #[serde(rename = "episode")]
    pub(super) number: u64,
    reset_seed: Option<RecordedSeed>,
    pub(super) reset_options: Option<Map<String, Value>>,
    pub(super) reset_obs: RecordedObs,
    #[serde(default)]
    pub(super) reset_info: ResetInfo,
    pub(super) steps: Vec<RecordedStep>,
}

impl Episode {
    /// Parses line `line`.
    pub(super) fn parse(line: usize, text: &str) -> Result<Self, RecordingError> {
        let episode: Self = serde_json::from_str(text)
            .map_err(|e| RecordingError::new(line, format!("not an episode: {e}")))?;
        if episode.r#type != "episode" {
            let message =
                format!("after the header come lines of type `episode`, not `{}`", episode.r#type);
            return Err(RecordingError::new(line, message));
        }
        Ok(episode)
    }

    /// The seed of its reset; `None` if that continued the stream.
    pub(super) fn reset_seed(&self, line: usize) -> Result<Option<Seed>, RecordingError> {
        match &self.reset_seed {
            None => Ok(None),
            Some(RecordedSeed::Number(seed)) => Ok(Some(Seed::from(*seed))),
            Some(RecordedSeed::Text(seed)) => {
                seed.parse().map(Some).map_err(|e| RecordingError::new(line, e))
            }
        }
    }
}

/// What is compared of a reset's `info`.
#[derive(Default, Deserialize)]
pub(super) struct ResetInfo {
    /// One character per action, `1` for those that can do anything.
    pub(super) action_mask: Option<String>,
}

/// A seed: a number, or text if it is 2^64 or more.
#[derive(Deserialize)]
#[serde(untagged, expecting = "a seed must be an integer of 0 or more, or its digits as text")]
enum RecordedSeed {
    Number(u64),
    Text(String),
}

/// One step, as recorded.
#[derive(Deserialize)]
pub(super) struct RecordedStep {
    pub(super) action: PlayedAction,
    pub(super) obs: RecordedObs,
    pub(super) reward: f64,
    pub(super) terminated: bool,
    pub(super) truncated: bool,
    /// `info["prob"]`, on finite environments.
    pub(super) prob: Option<f64>,
    /// `info["action_mask"]`, one character per action, where there is one.
    pub(super) mask: Option<String>,
}

/// An observation, as recorded.
#[derive(Deserialize)]
#[serde(untagged, expecting = "an observation must be an integer or a list of numbers")]
pub(super) enum RecordedObs {
    Index(i64),
    Box(Vec<f64>),
}

impl RecordedObs {
    /// Its numbers.
    pub(super) fn numbers(&self) -> Vec<f64> {
        match self {
            Self::Index(index) => vec![*index as f64],
            // Parsed as float64 and rounded to float32, which is what was written. The integers of
            // a tuple are small enough to stay what they are.
            Self::Box(list) => list.iter().map(|&x| f64::from(x as f32)).collect(),
        }
    }

    /// Whether it is of the same kind and length as `obs`.
    pub(super) fn fits(&self, obs: &Observation) -> bool {
        match (self, obs) {
            (Self::Index(_), Observation::Index(_)) => true,
            (Self::Box(recorded), Observation::Box(obs)) => recorded.len() == obs.len(),
            (Self::Box(recorded), Observation::Tuple(obs)) => recorded.len() == obs.len(),
            _ => false,
        }
    }
}
