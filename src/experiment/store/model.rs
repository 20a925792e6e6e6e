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

    pub(super) fn decode(bytes: &[u8]) -> Result<Self, String> {
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
mod tests {
    use super::*;
    use crate::experiment::units;
    use crate::mdp::streams::Stream;
    use crate::nn::Shape;
    use crate::script::{Plan, load};

    const CAR: &str = r#"experiment(#{
        name: "car", env: "MountainCar-v0", agent: dqn(), episodes: 3, seeds: [7], frame_skip: 2,
        normalise: #{ position: [-1.2, 0.6] }, potential: |s| s.position,
    })"#;
    const LAKE: &str = r#"experiment(#{
        name: "lake", env: "FrozenLake-v1", agent: dqn(), episodes: 3, seeds: 1,
    })"#;

    fn plan(script: &str) -> Plan {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("script.rhai");
        std::fs::write(&path, script).unwrap();
        load(&path).unwrap_or_else(|d| panic!("{}", d.render(false)))
    }

    fn net(n_inputs: usize, n_actions: usize, dueling: bool) -> Mlp<f32> {
        let shape = Shape { n_inputs, hidden: vec![3, 2], n_actions, dueling };
        Mlp::new(shape, &mut Stream::new(1, "network"))
    }

    fn file(script: &str, net: &Mlp<f32>) -> Vec<u8> {
        let plan = plan(script);
        let network = TrainedNetwork { which: Checkpoint::Best, episode: 2, net: net.clone() };
        model((&units(&plan)[0], &plan.variants[0]), &network)
    }

    fn session(id: &str) -> Session {
        Session::new(id, &serde_json::Map::new()).unwrap()
    }

    #[test]
    fn a_model_comes_back_with_what_it_belongs_to() {
        let net = net(2, 3, true);
        let bytes = file(CAR, &net);
        assert_eq!(bytes, file(CAR, &net));
        let read = Model::decode(&bytes).unwrap();
        assert_eq!(read.net.shape(), net.shape());
        assert_eq!(read.net.params(), net.params());
        let position = Scale { field: 0, low: -1.2, high: 0.6 };
        assert_eq!(read.inputs, Inputs::Fields(vec![Some(position), None]));
        assert_eq!(read.fields, ["position", "velocity"]);
        assert_eq!(read.frame_skip, 2);
        let says = |name: &str| read.manifest[name].as_str();
        let plan = plan(CAR);
        let unit = &units(&plan)[0];
        assert_eq!([says("env"), says("seed"), says("episode")], ["MountainCar-v0", "7", "2"]);
        assert_eq!([says("unit"), says("checkpoint")], [unit.hash.as_str(), "best"]);
        assert_eq!(says("config"), plan.variants[0].identity().to_string());
        assert!(says("config").contains(&plan.variants[0].potential.as_ref().unwrap().digest));
        assert_eq!(
            says("inputs"),
            r#"{"fields":[{"name":"position","shown":[-1.2,0.6]},{"name":"velocity"}]}"#
        );
        read.fits(&session("MountainCar-v0")).unwrap();

        let lake = Model::decode(&file(LAKE, &self::net(16, 4, false))).unwrap();
        assert_eq!(lake.inputs, Inputs::OneHot(16));
        lake.fits(&session("FrozenLake-v1")).unwrap();
    }

    #[test]
    fn models_of_other_environments_do_not_play() {
        let car = Model::decode(&file(CAR, &net(2, 3, false))).unwrap();
        let lake = Model::decode(&file(LAKE, &net(16, 4, false))).unwrap();
        let refused = |model: &Model, id: &str, message: &str| {
            assert_eq!(model.fits(&session(id)).unwrap_err(), message);
        };
        refused(
            &car,
            "CartPole-v1",
            "is about the actions left, none, right of MountainCar-v0, here they are left, right",
        );
        refused(
            &lake,
            "FrozenLake8x8-v1",
            "is about the 16 states of FrozenLake-v1, here there are 64",
        );
        let mut other = car;
        other.fields = vec!["x".into(), "v".into()];
        refused(
            &other,
            "MountainCar-v0",
            "sees x, v of MountainCar-v0, here a state is position, velocity",
        );
    }

    /// What is wrong with the file after `change`.
    fn refusal(change: impl FnOnce(&mut Texts)) -> String {
        let (tensors, mut manifest) = decode(&file(CAR, &net(2, 3, false))).unwrap();
        change(&mut manifest);
        Model::decode(&encode(&tensors, &manifest)).unwrap_err()
    }

    #[test]
    fn manifests_that_do_not_fit_are_refused() {
        let put = |name: &'static str, text: &'static str| {
            refusal(move |manifest| drop(manifest.insert(name.into(), text.into())))
        };
        assert_eq!(
            put("runner-model", "2"),
            "is a model of version 2, this program knows version 1"
        );
        assert_eq!(refusal(Texts::clear), "holds tensors, but was not written by runner");
        let missing = refusal(|manifest| drop(manifest.remove("inputs")));
        assert_eq!(missing, "does not say what its `inputs` are");
        assert!(put("actions", "left").starts_with("`actions` cannot be read (expected value"));
        assert_eq!(
            put("inputs", r#"{"one_hot":16}"#),
            "has weights of 2 inputs and 3 actions, but speaks of 16 and 3"
        );
        assert_eq!(put("frame_skip", "0"), "`frame_skip` is 0: no step would be played");
        let upside_down = r#"{"fields":[{"name":"position","shown":[0.6,-1.2]},{"name":"v"}]}"#;
        assert_eq!(put("inputs", upside_down), "`inputs`: [0.6, -1.2] is no range of `position`");
    }

    #[test]
    fn damaged_files_are_refused_and_none_brings_it_down() {
        let bytes = file(CAR, &net(2, 3, true));
        for end in 0..bytes.len() {
            Model::decode(&bytes[..end]).unwrap_err();
        }
        let mut damaged = bytes.clone();
        for i in 0..bytes.len() {
            for flip in [1, 4, 32, 128, 255] {
                damaged[i] ^= flip;
                let _ = Model::decode(&damaged);
                damaged[i] = bytes[i];
            }
        }
        // Layers that do not fit together, whose weights would fill any memory.
        let (mut tensors, manifest) = decode(&bytes).unwrap();
        for tensor in &mut tensors {
            tensor.values = vec![0.0; 50_000];
            tensor.shape = vec![50_000];
            if tensor.name.ends_with("weight") {
                tensor.shape.push(1);
            }
        }
        tensors.retain(|tensor| tensor.name.starts_with("q_net"));
        let error = Model::decode(&encode(&tensors, &manifest)).unwrap_err();
        assert_eq!(error, "layer 1 takes 1 numbers, the layer before it gives 50000");
    }
}
