//! Finds mistakes in callbacks before anything is run in earnest.

use std::sync::atomic::AtomicBool;

use super::unit::{UnitError, run_unit};
use crate::script::{Diagnostic, Host, Plan, Variant};

/// Episodes and steps that are sampled per variant.
const EPISODES: u32 = 5;
const STEPS: u32 = 200;

/// Plays a few short episodes of every variant, so that every callback is called on states that
/// occur; on finite environments on all of them. Returns what they printed.
///
/// # Errors
/// The first mistake found.
pub fn check(plan: &Plan) -> Result<Vec<String>, Diagnostic> {
    let host = Host::open(plan)?;
    for variant in &plan.variants {
        let scripted = variant.is_shaped()
            || variant.allowed.is_some()
            || !variant.agent_functions.is_empty()
            || variant.reward.is_some()
            || !variant.terms.is_empty()
            || variant.allowed.is_some()
            || !variant.agent_functions.is_empty()
            || matches!(variant.discretiser, crate::script::DiscretiserSpec::Cells { .. });
        if !scripted {
            continue;
        }
        let probe = Variant {
            episodes: variant.episodes.min(EPISODES),
            max_steps: Some(variant.max_steps.unwrap_or(STEPS).min(STEPS)),
            ..variant.clone()
        };
        let seed = probe.seeds.0[0];
        match run_unit(&host, &probe, seed, &AtomicBool::new(false), &mut |_| {}) {
            Ok(_) | Err(UnitError::Interrupted | UnitError::Store(_)) => {}
            Err(UnitError::Script(d) | UnitError::Diverged(d, _)) => return Err(*d),
        }
    }
    Ok(host.printed())
}
