//! What a script's top level builds: plain data, which can be hashed, sent to threads, resumed.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::Serialize;
use serde_json::{Map, Value as Json};

use super::diagnostic::{Diagnostic, Place};
use super::native::TierCell;
use super::shaping::Shaping;
use super::source::SourceSet;
use super::value::Value;
use crate::env::{AnyEnv, EnvConfig, EnvError, EnvSpec};
use crate::learn::AgentConfig;
use crate::nn::Mlp;
use crate::shaping::{Dim, FeatureKind, FeatureSpec, Scale};

/// A script function that the host calls while training.
#[derive(Debug, Clone)]
pub struct Callback {
    /// The function's name in its script; for closures one that Rhai made up.
    pub(super) function: String,
    /// Values captured by a closure: its leading arguments.
    pub(super) captures: Vec<Value>,
    /// How many arguments it takes after those.
    pub arity: usize,
    /// How it is called in messages: `height`, or `closure`.
    pub label: String,
    /// Where the script hands it over.
    pub place: Option<Place>,
    /// SHA-256 of everything that can change its results: the tokens of its source (without
    /// comments and formatting) and of the functions it can reach, captured values, constants,
    /// imports.
    pub digest: String,
    /// How it is run.
    pub(super) tier: TierCell,
}

impl Callback {
    /// How it is called inside a message.
    pub(super) fn described(&self) -> String {
        if self.label == "closure" { "(a closure)".into() } else { format!("`{}`", self.label) }
    }
}

/// On what a potential is evaluated when states are discretised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PhiOn {
    /// On the representative of the state's cell: keeps the learner's guarantee.
    Cell,
    /// On the raw state.
    Raw,
}

/// How states become table indices.
#[derive(Debug, Clone)]
pub enum DiscretiserSpec {
    /// The environment's own state index.
    StateIndex,
    /// Uniform bins.
    Bins(Vec<Dim>),
    /// Scripted cells; `shape` is `[n]` or one size per index returned.
    Cells {
        /// Sizes.
        shape: Vec<usize>,
        /// The function.
        cell: Callback,
    },
    /// No cells: features, in which values are linear.
    Features(FeatureSpec),
    /// No cells: a network sees the numbers of the state.
    Raw,
}

impl DiscretiserSpec {
    /// The range of a field that is cut into bins or has features, and into how many.
    pub fn dim(&self, field: usize) -> Option<&Dim> {
        let dims = match self {
            Self::Bins(dims) => dims,
            Self::Features(features) => &features.dims,
            Self::StateIndex | Self::Cells { .. } | Self::Raw => return None,
        };
        dims.iter().find(|d| d.field == field)
    }
}

/// The seeds of a variant.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SeedList(pub Vec<u64>);

/// A stored network that training starts from. No script names one: it is given with the command.
#[derive(Debug, Clone)]
pub struct StartModel {
    /// SHA-256 of its file, in hexadecimal.
    pub digest: String,
    /// The file; `None` in a plan that was read back from results, which needs its digest alone.
    pub file: Option<Arc<StartFile>>,
}

/// The file of a network.
#[derive(Debug)]
pub struct StartFile {
    /// What it holds.
    pub bytes: Vec<u8>,
    /// The network.
    pub net: Mlp<f32>,
}

/// One experiment, fully resolved.
#[derive(Debug, Clone)]
pub struct Variant {
    /// Its name, unique in the study.
    pub name: String,
    /// Where the script defines it.
    pub place: Option<Place>,
    /// The environment.
    pub env: &'static EnvSpec,
    /// How it is set up: its constructor's arguments (defaults filled in), attributes, reset
    /// options and real-valued actions.
    pub config: EnvConfig,
    /// How many steps of the environment an action is repeated.
    pub frame_skip: u32,
    /// The range to which the learned reward is clipped, before the potential's part is added.
    pub clip_reward: Option<[f64; 2]>,
    /// Ranges that scripted cells see as [-1, 1] (the edges of bins are in physical units already).
    pub normalise: Vec<Scale>,
    /// The agent.
    pub agent: AgentConfig,
    /// What its network starts from; `None` for a random one, and for other agents.
    pub start: Option<StartModel>,
    /// Functions among its parameters, by their keys.
    pub agent_functions: BTreeMap<&'static str, Callback>,
    /// State → cell, or → features.
    pub discretiser: DiscretiserSpec,
    /// Episodes per seed.
    pub episodes: u32,
    /// The seeds.
    pub seeds: SeedList,
    /// The time limit; `None` for none.
    pub max_steps: Option<u32>,
    /// The native return that counts as solved, for the rolling mean.
    pub threshold: Option<f64>,
    /// Window of the rolling mean, in episodes.
    pub window: u32,
    /// Whether training of a seed ends as soon as the rolling mean reaches the threshold, which
    /// there is then.
    pub stop_when_solved: bool,
    /// Φ(s), or Φ(s, episode) if it takes two arguments.
    pub potential: Option<Callback>,
    /// On what Φ is evaluated.
    pub potential_on: PhiOn,
    /// What else shapes the reward.
    pub shaping: Shaping,
    /// Replaces the learned reward.
    pub reward: Option<Callback>,
    /// Extra reward terms by name.
    pub terms: BTreeMap<String, Callback>,
    /// The shield: which actions may be taken.
    pub allowed: Option<Callback>,
    /// The rationale, for manifest and report.
    pub notes: Option<String>,
}

impl Variant {
    /// A new instance of its environment.
    ///
    /// # Errors
    /// Never for a resolved variant: its configuration has been built once.
    pub fn environment(&self) -> Result<AnyEnv, EnvError> {
        self.env.build(&self.config)
    }

    /// What was changed in the environment's setting beyond its constructor's arguments, one line
    /// each.
    pub fn setting(&self) -> Vec<String> {
        let mut lines = Vec::new();
        let entries = [
            ("attributes", &self.config.attributes),
            ("reset_options", &self.config.reset_options),
        ];
        for (name, map) in entries {
            if !map.is_empty() {
                let list: Vec<_> = map.iter().map(|(k, v)| format!("{k}: {v}")).collect();
                lines.push(format!("{name} {}", list.join(", ")));
            }
        }
        if let Some(actions) = &self.config.actions {
            lines.push(format!("actions {actions:?}"));
        }
        if self.frame_skip > 1 {
            lines.push(format!("frame_skip {}", self.frame_skip));
        }
        if let Some(range) = self.clip_reward {
            lines.push(format!("clip_reward {range:?}"));
        }
        for scale in &self.normalise {
            // The variant's environment has been built before.
            let Ok(env) = self.environment() else { continue };
            let name = env.schema().fields[scale.field].name;
            lines.push(format!("normalise {name} from [{:?}, {:?}]", scale.low, scale.high));
        }
        lines
    }

    /// Whether a potential or advice shapes the reward.
    pub fn is_shaped(&self) -> bool {
        self.potential.is_some() || self.shaping.is_active()
    }

    /// Whether Φ changes from episode to episode.
    pub fn is_dynamic(&self) -> bool {
        self.potential.as_ref().is_some_and(|phi| phi.arity == 2)
    }

    /// Whether the agent learns from anything but the native reward, a potential and advice.
    pub fn changes_reward(&self) -> bool {
        self.reward.is_some() || !self.terms.is_empty() || self.clip_reward.is_some()
    }

    /// The rolling mean of the native return, over a full window, at which training of a seed ends;
    /// `None` if all episodes are played.
    pub fn stops_at(&self) -> Option<f64> {
        self.threshold.filter(|_| self.stop_when_solved)
    }

    /// Everything that can change a result of this variant, except the seed.
    pub fn identity(&self) -> Json {
        let digest = |c: &Callback| Json::from(c.digest.as_str());
        let list = |dims: &[Dim]| -> Vec<Json> {
            dims.iter().map(|d| serde_json::json!([d.field, d.lo, d.hi, d.n])).collect()
        };
        let discretiser = match &self.discretiser {
            DiscretiserSpec::StateIndex => Json::from("state_index"),
            DiscretiserSpec::Raw => Json::from("raw"),
            DiscretiserSpec::Bins(dims) => serde_json::json!({ "bins": list(dims) }),
            DiscretiserSpec::Features(FeatureSpec { kind: FeatureKind::Tiles(n), dims }) => {
                serde_json::json!({ "tiles": list(dims), "tilings": n })
            }
            DiscretiserSpec::Features(FeatureSpec { kind: FeatureKind::Fourier, dims }) => {
                serde_json::json!({ "fourier": list(dims) })
            }
            DiscretiserSpec::Cells { shape, cell } => {
                serde_json::json!({ "cells": shape, "callback": digest(cell) })
            }
        };
        let params: Map<String, Json> =
            self.agent.in_effect().map(|(k, v)| (k.into(), serde_json::json!(v))).collect();
        let functions: Map<String, Json> =
            self.agent_functions.iter().map(|(k, c)| ((*k).into(), digest(c))).collect();
        let terms: Map<String, Json> =
            self.terms.iter().map(|(k, c)| (k.clone(), digest(c))).collect();
        let mut identity = serde_json::json!({
            "env": self.env.id,
            "kwargs": self.config.kwargs,
            "attributes": self.config.attributes,
            "reset_options": self.config.reset_options,
            "actions": self.config.actions,
            "frame_skip": self.frame_skip,
            "clip_reward": self.clip_reward,
            "normalise": self.normalise,
            "agent": self.agent.spec.name,
            "params": params,
            "discretiser": discretiser,
            "episodes": self.episodes,
            "max_steps": self.max_steps,
            "potential": self.potential.as_ref().map(digest),
            "potential_on": self.potential.is_some().then_some(self.potential_on),
            "shaping": self.shaping.identity(),
            "reward": self.reward.as_ref().map(digest),
            "terms": terms,
            "agent_functions": functions,
            "allowed": self.allowed.as_ref().map(digest),
        });
        if let Some(start) = &self.start {
            identity["start"] = serde_json::json!({ "sha256": start.digest });
        }
        // Elsewhere threshold and window only measure.
        if let Some(threshold) = self.stops_at() {
            identity["stop_when_solved"] =
                serde_json::json!({ "threshold": threshold, "window": self.window });
        }
        identity
    }
}

/// A claim that is checked after the run.
#[derive(Debug, Clone)]
pub struct Expectation {
    /// What it says.
    pub text: String,
    /// The function of the results.
    pub check: Callback,
}

/// What a golden run plays at most.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct GoldenBudget {
    /// Episodes per seed.
    pub episodes: Option<u32>,
    /// Seeds per variant.
    pub seeds: Option<u32>,
}

/// A study: what a script is.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Its name; the results folder is called so.
    pub name: String,
    /// What is compared.
    pub variants: Vec<Variant>,
    /// Claims.
    pub expectations: Vec<Expectation>,
    /// The variant that others are compared with.
    pub baseline: Option<String>,
    /// The rationale, for manifest and report.
    pub notes: Option<String>,
    /// How much of it a golden file covers.
    pub golden: GoldenBudget,
    /// The script's text and imports.
    pub sources: SourceSet,
    /// The script's constants, which its functions see.
    pub(super) constants: BTreeMap<String, Value>,
    /// What the author should know, though it runs.
    pub warnings: Vec<Diagnostic>,
    /// What the script printed while it built the plan.
    pub printed: Vec<String>,
}
