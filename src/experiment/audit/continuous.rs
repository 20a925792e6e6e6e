//! The audit where there is no finite model: trajectories, and arbitrary pairs of states.

use serde::Serialize;

use super::finite::{TrueReturn, settings};
use super::learned::Learned;
use super::named::Naming;
use super::{Audit, AuditVerdict, Thorough};
use crate::audit::{
    Pair, Pathwise, Query, QuerySettings, Sampled, SampledSettings, cell_ranges, pathwise, query,
    sampled,
};
use crate::experiment::assemble::middle;
use crate::mdp::{Env, Schema};
use crate::script::{DiscretiserSpec, Host, Variant};
use crate::shaping::Fault;

/// What was found out about a shaping without a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Continuous {
    /// The learner's γ.
    pub gamma: f64,
    /// Ways from the same states compared.
    pub pathwise: Option<Pathwise>,
    /// Arbitrary states compared, reachable or not.
    pub query: Option<Query>,
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
    /// What is lost in native return.
    pub true_return: Option<TrueReturn>,
    /// Why nothing was compared.
    pub unsolved: Option<String>,
}

/// Transitions that are sampled at most.
const TRANSITIONS: usize = 3_000_000;
/// States that are sampled in a cell at most, for each action.
const SAMPLES: usize = 25;
/// Quadruples of states that are compared.
const QUADRUPLES: usize = 1_000;
/// Episodes whose first states are looked at.
const STARTS: usize = 10_000;

/// The range of each field: that of the observation space, or its middle alone where that is
/// unbounded.
fn ranges(schema: &Schema) -> Vec<[f64; 2]> {
    let fields = schema.fields.iter().zip(middle(schema));
    let bounded = |low: f64, high: f64| low.is_finite() && high.is_finite();
    fields
        .map(|(f, middle)| if bounded(f.low, f.high) { [f.low, f.high] } else { [middle; 2] })
        .collect()
}

/// The model of a discretised environment, with the states sampled per cell, if there are bins and a
/// way to put the environment into a state.
pub(in crate::experiment) fn sample<E: Env + Clone + 'static>(
    variant: &Variant,
    env: &E,
    thorough: Thorough<'_>,
) -> Result<Option<(Sampled, usize)>, Fault> {
    let DiscretiserSpec::Bins(dims) = &variant.discretiser else { return Ok(None) };
    let cells: usize = dims.iter().map(|d| d.n).product();
    let samples = (TRANSITIONS / (cells * env.n_actions()).max(1)).min(SAMPLES);
    if samples == 0 {
        return Ok(None);
    }
    let ranges = ranges(&env.schema());
    let settings = SampledSettings {
        n_cells: cells,
        samples,
        starts: STARTS,
        gamma: variant.agent.float("gamma"),
        frame_skip: variant.frame_skip,
        seed: 0,
        threads: thorough.threads,
    };
    let asked = || {
        let host = Host::open(thorough.plan).expect("it has been opened before");
        Learned::new(&host, variant, env).expect("it has been made before").into_asked()
    };
    let found = sampled(env, &settings, &cell_ranges(dims, &ranges), &asked, thorough.progress)?;
    Ok(found.map(|found| (found, samples)))
}

/// Samples and solves the discretised environment.
pub(super) fn model<E: Env + Clone + 'static>(
    variant: &Variant,
    env: &E,
    thorough: Thorough<'_>,
    audit: &mut Audit,
) -> Result<(), Fault> {
    let Some((found, samples)) = sample(variant, env, thorough)? else { return Ok(()) };
    let gamma = variant.agent.float("gamma");
    let pair = Pair::new(&found.mdp, &found.shaping, gamma);
    let compared = pair.as_ref().ok().map(|pair| pair.preservation(&found.phi));
    let change = pair.as_ref().ok().and_then(|pair| pair.policy_change().ok());
    let model = SampledModel {
        cells: found.excluded.len(),
        excluded: found.n_excluded(),
        samples,
        transitions: found.transitions,
        states: found.mdp.reachable().iter().filter(|r| **r).count(),
        policy_preserved: compared.as_ref().and_then(|p| p.verdict.preserved()),
        states_changed: compared.as_ref().map(|p| p.states_changed.len()),
        true_return: change.map(|c| TrueReturn { optimal: c.optimal, shaped: c.worst }),
        unsolved: pair.err().map(|e| e.to_string()),
    };
    let continuous = audit.continuous.get_or_insert_with(|| {
        Box::new(Continuous {
            gamma,
            pathwise: None,
            query: None,
            model: None,
            naming: Naming::new(env),
        })
    });
    continuous.model = Some(model);
    Ok(())
}

/// What trajectories say. `cut`: whether some reward depends on the time limit, which trajectories
/// without one do not show. `why` is the reason for trying them where there would be something better.
pub(super) fn verdict(found: &Pathwise, cut: bool, why: Option<&str>) -> (AuditVerdict, String) {
    let why = why.map_or(String::new(), |why| format!("{why}; "));
    match (&found.violation, found.bound()) {
        (Some(_), _) => (
            AuditVerdict::NotPotentialBased,
            format!("{why}two ways from one state are paid differently"),
        ),
        (None, _) if cut => (
            AuditVerdict::Inconclusive,
            "the reward depends on `t.truncated`, which ways without a time limit do not show"
                .into(),
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
    let (verdict, basis) = verdict(&found, learned.depends_on_the_cut, None);
    let gamma = variant.agent.float("gamma");
    let mut asked = ranges(&env.schema());
    if let DiscretiserSpec::Bins(dims) = &variant.discretiser {
        for d in dims {
            asked[d.field] = [d.lo, d.hi];
        }
    }
    let settings =
        QuerySettings { gamma, quadruples: QUADRUPLES, ranges: asked, terminates: true, seed: 0 };
    // With a proof at hand, what states that may never be reached say is of no interest.
    let query = match found.violation {
        Some(_) => None,
        None => query(env, &settings, |env, t| learned.added(env, t))?,
    };
    let mut audit = Audit::new(verdict, None, basis);
    audit.continuous = Some(Box::new(Continuous {
        gamma,
        pathwise: Some(found),
        query,
        model: None,
        naming: Naming::new(env),
    }));
    Ok(audit)
}
