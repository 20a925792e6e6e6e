//! The exact audit, where there is a finite model.

use serde::Serialize;

use super::learned::Learned;
use super::named::Naming;
use super::replacement::replacement;
use super::{Audit, AuditVerdict, beyond_states};
use crate::audit::{
    Advantages, Expected, Finding, Pathwise, PathwiseSettings, Pattern, Preservation, Scaling,
    Strict, pathwise, pattern, preservation, strict,
};
use crate::experiment::assemble::{NotAModelError, learned_model};
use crate::experiment::shielded::playable;
use crate::learn::planning::{Dynamics, Over};
use crate::mdp::Env;
use crate::script::{Host, Variant};
use crate::shaping::Fault;

/// Expected discounted returns in the environment's own reward, over the initial states.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TrueReturn {
    /// Of an optimal policy.
    pub optimal: f64,
    /// Of a policy that is optimal for the shaped reward; of several, the worst.
    pub shaped: f64,
}

impl TrueReturn {
    pub(super) fn made_up() -> Self {
        Self { optimal: 0.0, shaped: 0.0 }
    }
}

/// What was found out about a shaping on a finite model.
#[derive(Debug, Clone, PartialEq)]
pub struct Exact {
    /// The learner's γ.
    pub gamma: f64,
    /// Number of states in which an episode can be and act.
    pub states: usize,
    /// Transition by transition; `None` if the reward is no function of the transition.
    pub strict: Option<Strict>,
    /// In expectation over the outcomes of each action; `None` without a value of the uniform policy.
    pub expected: Option<Expected>,
    /// The learned reward as a multiple of the native one, up to a potential.
    pub scaling: Option<Scaling>,
    /// The STARC distance of the learned from the native reward.
    pub starc: Option<f64>,
    /// The kind of term that is added.
    pub pattern: Pattern,
    /// Both models solved and compared; `None` if they cannot be.
    pub preservation: Option<Preservation>,
    /// Episodes compared, where there is no model of the reward.
    pub pathwise: Option<Pathwise>,
    /// What states and actions are called.
    pub naming: Naming,
}

/// Judges the shaping of a variant on a finite environment.
pub(super) fn judge<E: Env + Clone + 'static>(
    host: &Host,
    variant: &Variant,
    env: &E,
) -> Result<Audit, Fault> {
    let mdp = env.finite().expect("only asked of finite environments");
    let mdp = &playable(host, variant, env, (**mdp).clone())?;
    let gamma = variant.agent.float("gamma");
    let mut exact = Exact {
        gamma,
        states: 0,
        strict: None,
        expected: None,
        scaling: None,
        starc: None,
        pattern: Pattern::Other,
        preservation: None,
        pathwise: None,
        naming: Naming::new(env),
    };
    let model = match learned_model(host, variant, env) {
        Ok(model) => model,
        // A reward without a model is an answer, not a mistake.
        Err(fault) => {
            return match fault.0.downcast::<NotAModelError>() {
                Ok(e) => on_trajectories(host, variant, env, exact, &e.what.to_string()),
                Err(other) => Err(Fault(other)),
            };
        }
    };
    let reachable = mdp.reachable();
    exact.states = reachable.iter().filter(|r| **r).count();
    let added = model.shaped.outcomes().iter().zip(mdp.outcomes());
    let f: Vec<f64> = added.map(|(shaped, plain)| shaped.reward - plain.reward).collect();
    exact.pattern = pattern(mdp, &f, &reachable);
    let declares = variant.potential.is_some() || variant.shaping.shift != 0.0;
    let declared = declares.then_some(&*model.phi);
    let checked = strict(mdp, &f, gamma, &reachable, declared);
    let dynamics = Dynamics::new(mdp, Over::Reachable);
    if let Ok(advantages) = Advantages::new(mdp, &dynamics, &f, gamma) {
        exact.expected = Some(advantages.expected(declared));
        exact.scaling = Some(advantages.scaling());
        exact.starc = Some(advantages.starc());
    }
    let potential_only = !variant.changes_reward();
    let compared = preservation(mdp, &model.shaped, gamma, &model.phi);
    let preserved = compared.as_ref().ok().and_then(|p| p.verdict.preserved());
    let (verdict, basis) = match (checked.finding, preserved) {
        (Finding::Holds, Some(true)) if potential_only => (
            AuditVerdict::PotentialBased,
            beyond_states(variant)
                .unwrap_or("exact: Q_F + Φ = Q and the greedy sets are equal")
                .into(),
        ),
        (Finding::Holds, Some(true)) => (
            AuditVerdict::PotentialBased,
            "exact: every transition agrees with one potential".into(),
        ),
        (Finding::Fails, Some(true)) => {
            (AuditVerdict::NotPotentialBased, "exact: the greedy sets are equal".into())
        }
        (Finding::Fails, Some(false)) => {
            (AuditVerdict::NotPotentialBased, "exact: the greedy sets differ".into())
        }
        (finding, _) => {
            let verdict = match finding {
                Finding::Holds => AuditVerdict::PotentialBased,
                Finding::Fails => AuditVerdict::NotPotentialBased,
                Finding::Inconclusive => AuditVerdict::Inconclusive,
            };
            let why = match &compared {
                Ok(_) => "two actions are too close for the numbers to decide".to_string(),
                Err(e) => e.to_string(),
            };
            (verdict, why)
        }
    };
    let mut audit = Audit::new(verdict, preserved, basis);
    if verdict == AuditVerdict::NotPotentialBased {
        audit.instead = Some(replacement(variant, exact.pattern, Some(&checked)));
    }
    exact.strict = Some(checked);
    if let Ok(compared) = compared {
        audit.states_changed = Some(compared.states_changed.len());
        audit.identity_holds = potential_only.then(|| compared.identity_holds());
        exact.preservation = Some(compared);
    }
    audit.exact = Some(Box::new(exact));
    Ok(audit)
}

/// A reward that depends on more than the transition: episodes can still be compared.
fn on_trajectories<E: Env + Clone + 'static>(
    host: &Host,
    variant: &Variant,
    env: &E,
    mut exact: Exact,
    why: &str,
) -> Result<Audit, Fault> {
    let mut learned = Learned::new(host, variant, env)?;
    let settings = settings(variant);
    let found = pathwise(env, &settings, |env, t| learned.added(env, t))?;
    let (verdict, basis) = super::continuous::verdict(&found, Some(why));
    exact.pathwise = Some(found);
    let mut audit = Audit::new(verdict, None, basis);
    audit.exact = Some(Box::new(exact));
    Ok(audit)
}

/// How episodes are compared.
pub(super) fn settings(variant: &Variant) -> PathwiseSettings {
    PathwiseSettings {
        time_limit: variant.max_steps,
        frame_skip: variant.frame_skip,
        ..PathwiseSettings::new(variant.agent.float("gamma"))
    }
}
