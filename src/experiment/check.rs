//! Finds mistakes in callbacks before anything is run in earnest.

use std::sync::atomic::AtomicBool;

use super::tiers::{CallbackTier, tiers};
use super::unit::{UnitError, run_unit};
use crate::script::{Diagnostic, Host, Plan, Variant};

/// Episodes and steps that are sampled per variant.
const EPISODES: u32 = 5;
const STEPS: u32 = 200;

/// What trying the callbacks out has brought to light.
#[derive(Debug)]
pub struct Checked {
    /// What they printed.
    pub printed: Vec<String>,
    /// How they are run, variant by variant.
    pub tiers: Vec<Vec<CallbackTier>>,
}

/// Plays a few short episodes of every variant, so that every callback is called on states that
/// occur; on finite environments on all of them.
///
/// # Errors
/// The first mistake found.
pub fn check(plan: &Plan) -> Result<Checked, Diagnostic> {
    let host = Host::open(plan)?;
    for variant in &plan.variants {
        let scripted = variant.is_shaped()
            || variant.allowed.is_some()
            || !variant.agent_functions.is_empty()
            || variant.reward.is_some()
            || !variant.terms.is_empty()
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
    let tiers = plan.variants.iter().map(|variant| tiers(&host, variant));
    Ok(Checked { tiers: tiers.collect::<Result<_, _>>()?, printed: host.printed() })
}
