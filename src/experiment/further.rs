//! Further training: networks that start from a stored one, in place of random ones.
//!
//! Only the weights go on. The optimiser, the replay buffer, the step size and exploration start
//! anew, and so does the random generator of every seed.

use std::path::Path;
use std::sync::Arc;

use sha2::{Digest, Sha256};

use super::assemble::inputs;
use super::hex;
use super::play::session;
use super::store::{Model, StoreError};
use crate::env::Session;
use crate::learn::AgentConfig;
use crate::nn::Shape;
use crate::script::{Diagnostic, Plan, StartFile, StartModel, Variant};
use crate::shaping::{Inputs, Scale};

/// Lets every variant of `plan` that learns a network start from the one in the file `path`.
///
/// # Errors
/// If the file cannot be read or holds no network, if no variant learns one, and if a variant that
/// does sees or plays something else or asks for another network: how they differ is said.
pub fn start_from(plan: &mut Plan, path: &Path) -> Result<(), Diagnostic> {
    let wrong = |what: &str| Diagnostic::error(format!("{}: {what}", path.display()));
    let bytes = std::fs::read(path)
        .map_err(|e| Diagnostic::error(StoreError::io(path, "cannot be read", &e).to_string()))?;
    let model = Model::decode(&bytes).map_err(|what| {
        wrong(&what).hint("a unit that has learned a network leaves a `model.safetensors`")
    })?;
    if !plan.variants.iter().any(|v| v.agent.is_network()) {
        return Err(wrong("there is nothing to start from it: no variant learns a network")
            .hint("`dqn` and `double_dqn` do"));
    }
    let learners = || plan.variants.iter().filter(|v| v.agent.is_network());
    for variant in learners() {
        let about = |d: Diagnostic| {
            d.at(variant.place.clone()).note(format!("in variant `{}`", variant.name))
        };
        let session =
            session(variant).map_err(|e| Diagnostic::error(e.message).maybe_hint(e.hint))?;
        model.fits(&session).map_err(|what| about(wrong(&what)))?;
        if let Some(what) = seen_otherwise(&model, variant, &session) {
            return Err(about(wrong(&what).hint("`normalise` says how numbers are shown")));
        }
        let (there, here) = (model.net.shape(), asked_for(&variant.agent, model.net.shape()));
        if *there != here {
            return Err(about(
                wrong(&format!(
                    "holds a network {}, here it is {}",
                    described(there),
                    described(&here)
                ))
                .hint(format!(
                    "give the agent `net_arch: {:?}, dueling: {}`",
                    there.hidden, there.dueling
                )),
            ));
        }
    }
    let digest = hex(&Sha256::digest(&bytes));
    let start = StartModel { digest, file: Some(Arc::new(StartFile { bytes, net: model.net })) };
    for variant in plan.variants.iter_mut().filter(|v| v.agent.is_network()) {
        variant.start = Some(start.clone());
    }
    Ok(())
}

/// How what the network sees of a state differs from what the variant shows, if it does. Their
/// fields are the same.
fn seen_otherwise(model: &Model, variant: &Variant, session: &Session) -> Option<String> {
    let here = inputs(variant, session.n_states(), session.schema());
    let (Inputs::Fields(there), Inputs::Fields(here)) = (&model.inputs, &here) else { return None };
    let mut pairs = model.fields.iter().zip(there.iter().zip(here));
    let (name, (there, here)) = pairs.find(|(_, (there, here))| there != here)?;
    let shown = |scale: &Option<Scale>| match scale {
        None => "in physical units".to_string(),
        Some(scale) => format!("with [{:?}, {:?}] as [-1, 1]", scale.low, scale.high),
    };
    Some(format!("sees `{name}` {}, here it is shown {}", shown(there), shown(here)))
}

/// The shape of the network that `agent` learns, of as many inputs and actions as `like` has.
fn asked_for(agent: &AgentConfig, like: &Shape) -> Shape {
    Shape { hidden: agent.widths("net_arch"), dueling: agent.is_on("dueling"), ..like.clone() }
}

/// `4 → 24 → 24 → 2, dueling`.
fn described(shape: &Shape) -> String {
    let layers = [shape.n_inputs].into_iter().chain(shape.hidden.iter().copied());
    let layers: Vec<String> = layers.chain([shape.n_actions]).map(|n| n.to_string()).collect();
    format!("{}{}", layers.join(" → "), if shape.dueling { ", dueling" } else { "" })
}
