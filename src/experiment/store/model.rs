//! `model.safetensors`, `best.safetensors`: a network, with what it belongs to.
//!
//! The weights are called as a state dictionary of PyTorch calls them. What they belong to stands in
//! the header's map, each entry a text or JSON as a text:
//!
//! | entry | what it says |
//! |---|---|
//! | `runner-model` | the version of this list |
//! | `runner` | the version of the program that has written it |
//! | `env`, `kwargs` | the environment and its arguments |
//! | `config` | everything that can change what was learned, the digests of the script's functions included |
//! | `unit`, `seed` | the unit that has learned it: the hash of `config` and the seed |
//! | `checkpoint`, `episode` | `last` or `best`, and after how many episodes |
//! | `inputs` | what the network sees of a state: see [`Seen`] |
//! | `actions` | what its outputs stand for, in their order |
//! | `frame_skip` | for how many steps an action is played |

use std::path::Path;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::json;

use super::StoreError;
use super::tensors::{Texts, decode, encode};
use crate::env::Session;
use crate::experiment::Unit;
use crate::experiment::assemble::inputs;
use crate::experiment::record::TrainedNetwork;
use crate::mdp::{Field, Schema};
use crate::nn::Mlp;
use crate::script::Variant;
use crate::shaping::{Inputs, Scale};

/// Version of the list above, under this name.
const VERSION: (&str, &str) = ("runner-model", "1");

/// Which of a unit's networks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Checkpoint {
    /// That of the end of training.
    Last,
    /// That of the best returns.
    Best,
}

impl Checkpoint {
    /// Its name in manifests and on the command line.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Last => "last",
            Self::Best => "best",
        }
    }

    /// Its file in a unit's folder.
    pub fn file_name(self) -> &'static str {
        match self {
            Self::Last => "model.safetensors",
            Self::Best => "best.safetensors",
        }
    }
}

/// What a network sees of a state: `{"one_hot":16}`, of which one is 1, or
/// `{"fields":[{"name":"position","shown":[-1.2,0.6]},{"name":"velocity"}]}`, numbers in physical
/// units, or if they are `shown` as [-1, 1], with the range that is shown so.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Seen {
    OneHot(usize),
    Fields(Vec<SeenField>),
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct SeenField {
    name: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    shown: Option<[f64; 2]>,
}

impl Seen {
    fn new(inputs: &Inputs, schema: &Schema) -> Self {
        match inputs {
            Inputs::OneHot(n_states) => Self::OneHot(*n_states),
            Inputs::Fields(scales) => {
                let field = |(field, scale): (&Field, &Option<Scale>)| SeenField {
                    name: field.name.to_string(),
                    shown: scale.map(|scale| [scale.low, scale.high]),
                };
                Self::Fields(schema.fields.iter().zip(scales).map(field).collect())
            }
        }
    }

    fn inputs(&self) -> Result<Inputs, String> {
        let fields = match self {
            Self::OneHot(n_states) => return Ok(Inputs::OneHot(*n_states)),
            Self::Fields(fields) => fields,
        };
        let scale = |(field, seen): (usize, &SeenField)| match seen.shown {
            None => Ok(None),
            Some([low, high]) if low < high && (high - low).is_finite() => {
                Ok(Some(Scale { field, low, high }))
            }
            Some(range) => Err(format!("`inputs`: {range:?} is no range of `{}`", seen.name)),
        };
        Ok(Inputs::Fields(fields.iter().enumerate().map(scale).collect::<Result<_, _>>()?))
    }
}

/// A network from a file.
#[derive(Debug, Clone)]
pub struct Model {
    /// The network.
    pub net: Mlp<f32>,
    /// What it sees of a state.
    pub inputs: Inputs,
    /// The names of what it sees, where these are fields.
    pub fields: Vec<String>,
    /// What its outputs stand for.
    pub actions: Vec<String>,
    /// For how many steps an action is played.
    pub frame_skip: u32,
    /// Everything that the file says, by name.
    pub manifest: Texts,
}

/// The file of a network that `unit` of `variant` has learned.
pub(super) fn model((unit, variant): (&Unit, &Variant), network: &TrainedNetwork) -> Vec<u8> {
    let env = variant.environment().expect("it has been made before");
    let schema = env.schema();
    let inputs = inputs(variant, env.n_states(), &schema);
    let config = variant.identity();
    let entries = [
        (VERSION.0, VERSION.1.to_string()),
        ("runner", env!("CARGO_PKG_VERSION").to_string()),
        ("env", variant.env.id.to_string()),
        ("kwargs", config["kwargs"].to_string()),
        ("config", config.to_string()),
        ("unit", unit.hash.clone()),
        ("seed", unit.seed.to_string()),
        ("checkpoint", network.which.as_str().to_string()),
        ("episode", network.episode.to_string()),
        ("inputs", json!(Seen::new(&inputs, &schema)).to_string()),
        ("actions", json!(schema.actions).to_string()),
        ("frame_skip", variant.frame_skip.to_string()),
    ];
    let manifest = entries.map(|(name, text)| (name.to_string(), text)).into();
    encode(&network.net.tensors(), &manifest)
}

impl Model {
    /// Reads a file.
    ///
    /// # Errors
    /// If it cannot be read, is damaged or something else: what it misses is named.
    pub fn read(path: &Path) -> Result<Self, StoreError> {
        let bytes = std::fs::read(path).map_err(|e| StoreError::io(path, "cannot be read", &e))?;
        Self::decode(&bytes).map_err(|what| StoreError::new(path, what))
    }

    pub(in crate::experiment) fn decode(bytes: &[u8]) -> Result<Self, String> {
        let (tensors, manifest) = decode(bytes)?;
        match manifest.get(VERSION.0) {
            Some(version) if version == VERSION.1 => {}
            Some(version) => {
                return Err(format!(
                    "is a model of version {version}, this program knows version {}",
                    VERSION.1
                ));
            }
            None => return Err("holds tensors, but was not written by runner".into()),
        }
        let net = Mlp::from_tensors(&tensors)?;
        let seen: Seen = entry(&manifest, "inputs")?;
        let (inputs, actions) = (seen.inputs()?, entry::<Vec<String>>(&manifest, "actions")?);
        let fields = match seen {
            Seen::OneHot(_) => Vec::new(),
            Seen::Fields(fields) => fields.into_iter().map(|field| field.name).collect(),
        };
        let frame_skip = entry(&manifest, "frame_skip")?;
        let shape = net.shape();
        let (sees, gives) = (inputs.n_inputs(), actions.len());
        if (shape.n_inputs, shape.n_actions) != (sees, gives) {
            return Err(format!(
                "has weights of {} inputs and {} actions, but speaks of {sees} and {gives}",
                shape.n_inputs, shape.n_actions
            ));
        }
        if frame_skip == 0 {
            return Err("`frame_skip` is 0: no step would be played".into());
        }
        Ok(Self { net, inputs, fields, actions, frame_skip, manifest })
    }

    /// Whether it can play in `session`.
    ///
    /// # Errors
    /// If not: how its environment differs.
    pub fn fits(&self, session: &Session) -> Result<(), String> {
        let schema = session.schema();
        let env = self.manifest.get("env").map_or("another environment", String::as_str);
        if self.actions != schema.actions {
            return Err(format!(
                "is about the actions {} of {env}, here they are {}",
                self.actions.join(", "),
                schema.actions.join(", ")
            ));
        }
        let here: Vec<&str> = schema.fields.iter().map(|field| field.name).collect();
        match (&self.inputs, session.n_states()) {
            (Inputs::OneHot(n), Some(n_states)) if *n == n_states => Ok(()),
            (Inputs::OneHot(n), Some(n_states)) => {
                Err(format!("is about the {n} states of {env}, here there are {n_states}"))
            }
            (Inputs::OneHot(n), None) => Err(format!(
                "is about the {n} states of {env}, here a state is {}",
                here.join(", ")
            )),
            (Inputs::Fields(_), _) if self.fields == here => Ok(()),
            (Inputs::Fields(_), _) => Err(format!(
                "sees {} of {env}, here a state is {}",
                self.fields.join(", "),
                here.join(", ")
            )),
        }
    }
}

/// An entry of a manifest that is JSON.
fn entry<T: DeserializeOwned>(manifest: &Texts, name: &str) -> Result<T, String> {
    let text = manifest.get(name).ok_or_else(|| format!("does not say what its `{name}` are"))?;
    serde_json::from_str(text).map_err(|e| format!("`{name}` cannot be read ({e}): {text}"))
}

/// Whether a file is a model: by its name, or because it begins as one does.
pub fn holds_model(path: &Path) -> bool {
    path.extension().is_some_and(|x| x == "safetensors")
        || std::fs::read(path).is_ok_and(|bytes| bytes.get(8) == Some(&b'{'))
}

/// Reads a model that is to play in `session`.
///
/// # Errors
/// As [`Model::read`], and if it belongs to an environment with other states or actions.
pub fn read_model(path: &Path, session: &Session) -> Result<Model, StoreError> {
    let model = Model::read(path)?;
    model.fits(session).map_err(|what| StoreError::new(path, what))?;
    Ok(model)
}

#[cfg(test)]
mod tests;
