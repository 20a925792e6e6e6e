//! The exact audit, where there is a finite model.

use serde::Serialize;

use super::learned::Learned;
use super::named::Naming;
use super::replacement::replacement;
use super::{Audit, AuditVerdict, beyond_states};
use crate::audit::{
    Advantages, BrokenTask, Critical, Cycle, Expected, Finding, Hacking, NotSsp, Pair, Pathwise,
    PathwiseSettings, Pattern, PolicyChange, Preservation, Scaling, SspCheck, Strict, Unsolved,
    Verdict, broken_task, pathwise, pattern, strict,
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
    /// What is lost in native return.
    pub change: Option<PolicyChange>,
    /// How far the added reward could be scaled before the optimal actions change; not asked of
    /// potentials, for which there is no limit.
    pub critical: Option<Critical>,
    /// The loop that pays better than the task.
    pub hacking: Option<Hacking>,
    /// With γ = 1, a loop that pays for ever: there is no optimal policy for the learned reward.
    pub endless: Option<Cycle>,
    /// A task on the same dynamics that the added reward would break.
    pub broken_task: Option<BrokenTask>,
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
        change: None,
        critical: None,
        hacking: None,
        endless: None,
        broken_task: None,
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
    let pair = Pair::new(mdp, &f, gamma);
    let compared = pair.as_ref().ok().map(|pair| pair.preservation(&model.phi));
    let preserved = match (&compared, &pair) {
        (Some(compared), _) => compared.verdict.preserved(),
        // Whoever goes round for ever earns without limit: no policy of the task's is optimal.
        (None, Err(Unsolved::Learned(SspCheck::NotSsp { why: NotSsp::PayingLoop { .. }, .. }))) => {
            Some(false)
        }
        _ => None,
    };
    // Where rounding hides whether actions are tied it may hide what is no potential's, too.
    let nothing = exact.pattern == Pattern::Nothing && beyond_states(variant).is_none();
    let hidden = compared.as_ref().is_some_and(|c| c.verdict == Verdict::Inconclusive);
    let verdict = match checked.finding {
        Finding::Holds if nothing => AuditVerdict::Unshaped,
        Finding::Holds if hidden => AuditVerdict::Inconclusive,
        Finding::Holds => AuditVerdict::PotentialBased,
        Finding::Fails => AuditVerdict::NotPotentialBased,
        Finding::Inconclusive => AuditVerdict::Inconclusive,
    };
    let basis = basis(variant, verdict, preserved, pair.as_ref().err());
    let mut audit = Audit::new(verdict, preserved, basis);
    if verdict == AuditVerdict::NotPotentialBased {
        audit.instead = Some(replacement(variant, exact.pattern, &checked, exact.scaling.as_ref()));
        exact.broken_task = broken_task(mdp, &dynamics, &f, gamma).ok().flatten();
    }
    if let Err(Unsolved::Learned(SspCheck::NotSsp {
        why: NotSsp::PayingLoop { cycle, .. }, ..
    })) = &pair
    {
        exact.endless.clone_from(cycle);
    }
    if let Ok(pair) = &pair {
        exact.change = pair.policy_change().ok();
        if verdict == AuditVerdict::NotPotentialBased {
            exact.critical = pair.critical().ok();
            exact.hacking = exact.change.as_ref().and_then(|c| pair.hacking(c).ok()?);
        }
    }
    audit.true_return =
        exact.change.as_ref().map(|c| TrueReturn { optimal: c.optimal, shaped: c.worst });
    audit.critical = exact.critical;
    audit.exploitable = Some(exact.hacking.is_some() || exact.endless.is_some());
    exact.strict = Some(checked);
    if let Some(compared) = compared {
        audit.states_changed = Some(compared.states_changed.len());
        audit.identity_holds = potential_only.then(|| compared.identity_holds());
        exact.preservation = Some(compared);
    }
    audit.exact = Some(Box::new(exact));
    Ok(audit)
}

/// On what the verdict on two models rests.
fn basis(
    variant: &Variant,
    verdict: AuditVerdict,
    preserved: Option<bool>,
    unsolved: Option<&Unsolved>,
) -> String {
    let text = match (unsolved, preserved, verdict) {
        (Some(unsolved), ..) => return unsolved.to_string(),
        (.., AuditVerdict::Unshaped) if !variant.is_shaped() => {
            "exact: what is added to the reward is 0 everywhere"
        }
        (.., AuditVerdict::Unshaped) => "exact: the potential is 0 everywhere",
        (_, None, _) => "two actions are too close for the numbers to decide",
        (_, Some(false), _) => "exact: the greedy sets differ",
        (_, Some(true), AuditVerdict::PotentialBased) if variant.changes_reward() => {
            "exact: every transition agrees with one potential"
        }
        (_, Some(true), AuditVerdict::PotentialBased) => {
            beyond_states(variant).unwrap_or("exact: Q_F + Φ = Q and the greedy sets are equal")
        }
        (_, Some(true), _) => "exact: the greedy sets are equal",
    };
    text.into()
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
    let (verdict, basis) =
        super::continuous::verdict(&found, learned.depends_on_the_cut, Some(why));
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
