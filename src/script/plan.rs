//! What a script's top level builds: plain data, which can be hashed, sent to threads, resumed.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::{Map, Value as Json};

use super::diagnostic::{Diagnostic, Place};
use super::source::SourceSet;
use super::value::Value;
use crate::env::EnvSpec;
use crate::learn::AgentConfig;
use crate::shaping::Dim;

/// A script function that the host calls while training.
#[derive(Debug, Clone)]
pub struct Callback {
    /// The function's name in its script; for closures one that Rhai made up.
    pub(super) function: String,
    /// Values captured by a closure: its leading arguments.
    pub(super) captures: Vec<Value>,
    /// How it is called in messages: `height`, or `closure`.
    pub label: String,
    /// Where the script hands it over.
    pub place: Option<Place>,
    /// SHA-256 of everything that can change its results: the tokens of its source (without
    /// comments and formatting) and of the functions it can reach, captured values, constants,
    /// imports.
    pub digest: String,
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
}

/// The seeds of a variant.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SeedList(pub Vec<u64>);

/// One experiment, fully resolved.
#[derive(Debug, Clone)]
pub struct Variant {
    /// Its name, unique in the study.
    pub name: String,
    /// Where the script defines it.
    pub place: Option<Place>,
    /// The environment.
    pub env: &'static EnvSpec,
    /// Its constructor's arguments, defaults filled in.
    pub kwargs: Map<String, Json>,
    /// The agent.
    pub agent: AgentConfig,
    /// State → cell.
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
    /// Φ(s).
    pub potential: Option<Callback>,
    /// On what Φ is evaluated.
    pub potential_on: PhiOn,
    /// Replaces the learned reward.
    pub reward: Option<Callback>,
    /// Extra reward terms by name.
    pub terms: BTreeMap<String, Callback>,
    /// The rationale, for manifest and report.
    pub notes: Option<String>,
}

impl Variant {
    /// Everything that can change a result of this variant, except the seed.
    pub fn identity(&self) -> Json {
        let digest = |c: &Callback| Json::from(c.digest.as_str());
        let discretiser = match &self.discretiser {
            DiscretiserSpec::StateIndex => Json::from("state_index"),
            DiscretiserSpec::Bins(dims) => serde_json::json!({
                "bins": dims.iter().map(|d| serde_json::json!([d.field, d.lo, d.hi, d.n]))
                    .collect::<Vec<_>>()
            }),
            DiscretiserSpec::Cells { shape, cell } => {
                serde_json::json!({ "cells": shape, "callback": digest(cell) })
            }
        };
        let params: Map<String, Json> =
            self.agent.params.iter().map(|(k, v)| ((*k).into(), serde_json::json!(v))).collect();
        let terms: Map<String, Json> =
            self.terms.iter().map(|(k, c)| (k.clone(), digest(c))).collect();
        serde_json::json!({
            "env": self.env.id,
            "kwargs": self.kwargs,
            "agent": self.agent.spec.name,
            "params": params,
            "discretiser": discretiser,
            "episodes": self.episodes,
            "max_steps": self.max_steps,
            "potential": self.potential.as_ref().map(digest),
            "potential_on": self.potential.is_some().then_some(self.potential_on),
            "reward": self.reward.as_ref().map(digest),
            "terms": terms,
        })
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
