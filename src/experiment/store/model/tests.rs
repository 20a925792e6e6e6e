//! What comes back, and what is refused.

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
    assert_eq!(put("runner-model", "2"), "is a model of version 2, this program knows version 1");
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
