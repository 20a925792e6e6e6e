//! The audit where there is no finite model: trajectories, and arbitrary pairs of states.

use serde::Serialize;

use super::finite::settings;
use super::learned::Learned;
use super::named::Naming;
use super::{Audit, AuditVerdict, Thorough};
use crate::audit::{Pathwise, SampledSettings, cell_ranges, pathwise, preservation, sampled};
use crate::experiment::assemble::middle;
use crate::mdp::Env;
use crate::script::{DiscretiserSpec, Host, Variant};
use crate::shaping::Fault;

/// What was found out about a shaping without a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Continuous {
    /// The learner's γ.
    pub gamma: f64,
    /// Ways from the same states compared.
    pub pathwise: Option<Pathwise>,
    /// The discretised environment, sampled and solved.
    pub model: Option<SampledModel>,
    /// What states and actions are called.
    pub naming: Naming,
}

/// What was found about the sampled model of a discretised environment: true of that model, and of
/// nothing else.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SampledModel {
    /// Number of cells.
    pub cells: usize,
    /// How many of them have no state from which an episode could go on.
    pub excluded: usize,
    /// States sampled in each of the others, for each action.
    pub samples: usize,
    /// Number of transitions sampled.
    pub transitions: usize,
    /// Cells that an episode can come to and act in.
    pub states: usize,
    /// Whether the model's optimal policy survives the shaping; `None` if the numbers cannot tell.
    pub policy_preserved: Option<bool>,
    /// Cells whose greedy actions change.
    pub states_changed: Option<usize>,
    /// Why nothing was compared.
    pub unsolved: Option<String>,
}

/// Transitions that are sampled at most.
const TRANSITIONS: usize = 3_000_000;
/// States that are sampled in a cell at most, for each action.
const SAMPLES: usize = 25;
/// Episodes whose first states are looked at.
const STARTS: usize = 10_000;

/// Samples and solves the discretised environment, if there is a way to put it into a state.
pub(super) fn model<E: Env + Clone + 'static>(
    variant: &Variant,
    env: &E,
    thorough: Thorough<'_>,
    audit: &mut Audit,
) -> Result<(), Fault> {
    let DiscretiserSpec::Bins(dims) = &variant.discretiser else { return Ok(()) };
    let cells: usize = dims.iter().map(|d| d.n).product();
    let samples = (TRANSITIONS / (cells * env.n_actions()).max(1)).min(SAMPLES);
    if samples == 0 {
        return Ok(());
    }
    let schema = env.schema();
    let middle = middle(&schema);
    let ranges: Vec<[f64; 2]> =
        schema
            .fields
            .iter()
            .zip(middle)
            .map(|(f, middle)| {
                if f.low.is_finite() && f.high.is_finite() { [f.low, f.high] } else { [middle; 2] }
            })
            .collect();
    let gamma = variant.agent.float("gamma");
    let settings = SampledSettings {
        n_cells: cells,
        samples,
        starts: STARTS,
        gamma,
        frame_skip: variant.frame_skip,
        seed: 0,
        threads: thorough.threads,
    };
    let asked = || {
        let host = Host::open(thorough.plan).expect("it has been opened before");
        Learned::new(&host, variant, env).expect("it has been made before").into_asked()
    };
    let found = sampled(env, &settings, &cell_ranges(dims, &ranges), &asked, thorough.progress)?;
    let Some(found) = found else { return Ok(()) };
    let compared = preservation(&found.mdp, &found.shaped(), gamma, &found.phi);
    let model = SampledModel {
        cells,
        excluded: found.n_excluded(),
        samples,
        transitions: found.transitions,
        states: found.mdp.reachable().iter().filter(|r| **r).count(),
        policy_preserved: compared.as_ref().ok().and_then(|p| p.verdict.preserved()),
        states_changed: compared.as_ref().ok().map(|p| p.states_changed.len()),
        unsolved: compared.err().map(|e| e.to_string()),
    };
    let continuous = audit.continuous.get_or_insert_with(|| {
        Box::new(Continuous { gamma, pathwise: None, model: None, naming: Naming::new(env) })
    });
    continuous.model = Some(model);
    Ok(())
}

/// What trajectories say; `why` is the reason for trying them where there would be something better.
pub(super) fn verdict(found: &Pathwise, why: Option<&str>) -> (AuditVerdict, String) {
    let why = why.map_or(String::new(), |why| format!("{why}; "));
    match (&found.violation, found.bound()) {
        (Some(_), _) => (
            AuditVerdict::NotPotentialBased,
            format!("{why}two ways from one state are paid differently"),
        ),
        (None, Some(bound)) if found.comparisons > 0 => (
            AuditVerdict::NoViolationFound,
            format!(
                "{why}none in {} ways compared: at most {:.1} % of such ways violate it (95 %)",
                found.comparisons,
                100.0 * bound
            ),
        ),
        _ => (
            AuditVerdict::Inconclusive,
            format!("{why}no two ways from one state ended, so nothing could be compared"),
        ),
    }
}

/// Judges a changed reward by trajectories.
pub(super) fn try_out<E: Env + Clone + 'static>(
    host: &Host,
    variant: &Variant,
    env: &E,
) -> Result<Audit, Fault> {
    let mut learned = Learned::new(host, variant, env)?;
    let found = pathwise(env, &settings(variant), |env, t| learned.added(env, t))?;
    let (verdict, basis) = verdict(&found, None);
    let mut audit = Audit::new(verdict, None, basis);
    audit.continuous = Some(Box::new(Continuous {
        gamma: variant.agent.float("gamma"),
        pathwise: Some(found),
        model: None,
        naming: Naming::new(env),
    }));
    Ok(audit)
}
