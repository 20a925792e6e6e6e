//! The audit where there is no finite model: trajectories, and arbitrary pairs of states.

use super::finite::settings;
use super::learned::Learned;
use super::named::Naming;
use super::{Audit, AuditVerdict, Effort};
use crate::audit::{Pathwise, pathwise};
use crate::mdp::Env;
use crate::script::{Host, Variant};
use crate::shaping::Fault;

/// What was found out about a shaping without a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Continuous {
    /// The learner's γ.
    pub gamma: f64,
    /// Ways from the same states compared.
    pub pathwise: Option<Pathwise>,
    /// What states and actions are called.
    pub naming: Naming,
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
        naming: Naming::new(env),
    }));
    Ok(audit)
}
