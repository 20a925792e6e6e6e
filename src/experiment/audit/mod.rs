//! What can be said about a variant's shaping: exactly on a finite model, by construction where the
//! host builds the potential's term itself, and from samples elsewhere.

mod continuous;
mod finite;
mod learned;
mod named;
mod replacement;

use serde::Serialize;

use super::assemble::{diagnostic_of, of_action};
use crate::audit::{Critical, Pathwise, Preservation};
use crate::env::EnvVisitor;
use crate::mdp::Env;
use crate::script::{AdviceOn, Diagnostic, DiscretiserSpec, Host, PhiOn, Plan, Variant};
use crate::shaping::Fault;

pub(super) use continuous::sample;
pub use continuous::{Continuous, SampledModel};
pub use finite::{Exact, TrueReturn};
pub use named::Naming;

/// What a shaping is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum AuditVerdict {
    /// The agent learns from the native reward.
    Unshaped,
    /// A potential alone.
    PotentialBased,
    /// Something that no potential explains: proved by a certificate, or by the model.
    NotPotentialBased,
    /// Samples show no violation: it may be potential-based.
    NoViolationFound,
    /// Nothing was found out, or nothing that is certain.
    Inconclusive,
}

impl AuditVerdict {
    /// Its name in files.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Unshaped => "unshaped",
            Self::PotentialBased => "potential-based",
            Self::NotPotentialBased => "not-potential-based",
            Self::NoViolationFound => "no-violation-found",
            Self::Inconclusive => "inconclusive",
        }
    }
}

/// The verdict on a variant's shaping.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Audit {
    /// What the shaping is.
    pub verdict: AuditVerdict,
    /// Whether the optimal policy survives; `None` if that was not decided.
    pub policy_preserved: Option<bool>,
    /// Reachable states whose optimal actions change, where the model is known.
    pub states_changed: Option<usize>,
    /// Whether `Q_F + Φ = Q` was found to hold, where the model is known.
    pub identity_holds: Option<bool>,
    /// What the best policy earns, and what the policy that is best for the shaped reward earns, in
    /// the environment's own reward, where the model is known.
    pub true_return: Option<TrueReturn>,
    /// How far the added reward could be scaled before the optimal actions change, where the model is
    /// known and the reward is no potential's.
    pub critical: Option<Critical>,
    /// Whether there is a loop that pays better than the task, where the model is known.
    pub exploitable: Option<bool>,
    /// On what the verdict rests, in one line.
    pub basis: String,
    /// What a potential could do in its place, if it is none.
    pub instead: Option<String>,
    /// What of the native reward is shaping already, if there is something of the kind.
    pub remark: Option<&'static str>,
    /// Everything found on the finite model.
    #[serde(skip)]
    pub exact: Option<Box<Exact>>,
    /// Everything found without one.
    #[serde(skip)]
    pub continuous: Option<Box<Continuous>>,
}

impl Audit {
    fn new(
        verdict: AuditVerdict,
        policy_preserved: Option<bool>,
        basis: impl Into<String>,
    ) -> Self {
        Self {
            verdict,
            policy_preserved,
            states_changed: None,
            identity_holds: None,
            true_return: None,
            critical: None,
            exploitable: None,
            basis: basis.into(),
            instead: None,
            remark: None,
            exact: None,
            continuous: None,
        }
    }

    /// A verdict with every field filled in, for rehearsing what reads it.
    pub fn made_up() -> Self {
        Self {
            states_changed: Some(0),
            identity_holds: Some(true),
            true_return: Some(TrueReturn::made_up()),
            critical: Some(Critical { k: None, breaks_ties: false }),
            exploitable: Some(false),
            ..Self::new(AuditVerdict::PotentialBased, Some(true), "made up")
        }
    }

    /// The verdict in a few words, for tables: what matters most to whoever trains with it.
    pub fn label(&self) -> String {
        match (self.verdict, self.policy_preserved, self.states_changed) {
            (AuditVerdict::NotPotentialBased, Some(true), _) => "policy preserved".into(),
            (AuditVerdict::NotPotentialBased, Some(false), Some(n)) if n > 0 => {
                format!("policy changed ({n})")
            }
            (AuditVerdict::NotPotentialBased, Some(false), _) => "policy changed".into(),
            (AuditVerdict::NotPotentialBased, None, _) => "not potential-based".into(),
            (AuditVerdict::NoViolationFound, ..) => "no violation found".into(),
            (verdict, ..) => verdict.as_str().into(),
        }
    }

    /// The comparison of the two models, where there are any.
    pub fn preservation(&self) -> Option<&Preservation> {
        self.exact.as_ref().and_then(|exact| exact.preservation.as_ref())
    }

    /// The comparison of ways, where it was made.
    pub fn pathwise(&self) -> Option<&Pathwise> {
        let finite = self.exact.as_ref().and_then(|exact| exact.pathwise.as_ref());
        finite.or_else(|| self.continuous.as_ref().and_then(|c| c.pathwise.as_ref()))
    }
}

/// How much is looked into: whether a discretised environment is sampled and solved, which takes
/// seconds.
#[derive(Clone, Copy)]
pub struct Thorough<'a> {
    /// Where the script's functions are found, once more for each thread.
    pub plan: &'a Plan,
    /// Threads.
    pub threads: usize,
    /// Hears how much of it is done, of how much.
    pub progress: &'a (dyn Fn(usize, usize) + Sync),
}

/// Judges the shaping of `variant`.
///
/// On a finite environment both models are solved and compared. Elsewhere a potential that the host
/// evaluates is potential-based by construction, and other rewards are tried on trajectories; if
/// `thorough`, a discretised environment is sampled and solved besides. That never changes the
/// verdict, for it is about the sampled model only.
///
/// # Errors
/// If a callback fails.
pub fn audit_variant(
    host: &Host,
    variant: &Variant,
    thorough: Option<Thorough<'_>>,
) -> Result<Audit, Diagnostic> {
    let env = variant.environment().map_err(|e| Diagnostic::error(e.message).maybe_hint(e.hint))?;
    env.visit(Judge { host, variant, thorough }).map_err(|fault| {
        host.annotate(diagnostic_of(fault).note(format!("in variant `{}`", variant.name)))
    })
}

struct Judge<'a> {
    host: &'a Host,
    variant: &'a Variant,
    thorough: Option<Thorough<'a>>,
}

impl EnvVisitor for Judge<'_> {
    type Out = Result<Audit, Fault>;

    fn visit<E: Env + Clone + 'static>(self, env: E) -> Self::Out {
        let remark = env.own_shaping();
        Ok(Audit { remark, ..self.judge(&env)? })
    }
}

impl Judge<'_> {
    fn judge<E: Env + Clone + 'static>(self, env: &E) -> Result<Audit, Fault> {
        let Self { host, variant, thorough } = self;
        if !variant.is_shaped() && !variant.changes_reward() {
            let basis = "the agent learns from the native reward";
            return Ok(Audit::new(AuditVerdict::Unshaped, Some(true), basis));
        }
        if variant.shaping.advice.is_some() && variant.shaping.advice_on == AdviceOn::LookBack {
            return Ok(look_back(variant));
        }
        // Features and networks have no cells: what is said is said of the states themselves.
        let on_states = matches!(
            variant.discretiser,
            DiscretiserSpec::StateIndex | DiscretiserSpec::Features(_) | DiscretiserSpec::Raw
        );
        if let Some(advice) = &variant.shaping.advice {
            // A value that is no number is a mistake here as well.
            let n_cells = env.n_states().unwrap_or(0);
            if n_cells > 0 && on_states {
                of_action(host, variant, env, n_cells, advice, "the advice")?;
            }
        }
        // What the agent adds itself is in no model of the reward.
        if beyond_states(variant).is_some() && !variant.changes_reward() && !variant.is_dynamic() {
            return Ok(by_construction(variant));
        }
        if on_states && variant.frame_skip == 1 && env.finite().is_some() {
            return finite::judge(host, variant, env);
        }
        let mut audit = if variant.changes_reward() {
            continuous::try_out(host, variant, env)?
        } else {
            by_construction(variant)
        };
        if let Some(thorough) = thorough {
            continuous::model(variant, env, thorough, &mut audit)?;
        }
        Ok(audit)
    }
}

/// What a learner knows of advice on the step before is gone when it bootstraps.
fn look_back(variant: &Variant) -> Audit {
    if variant.agent.spec.learns_from_returns() && !variant.changes_reward() {
        let basis = "by construction: a return takes back the advice on the step before it, and \
                     no more";
        return Audit::new(AuditVerdict::PotentialBased, Some(true), basis);
    }
    let basis = "look-back advice: a learner that bootstraps does not take all of it back";
    Audit::new(AuditVerdict::Inconclusive, None, basis)
}

/// Why the optimal policy survives a shaping that is no function of the state alone.
fn beyond_states(variant: &Variant) -> Option<&'static str> {
    if variant.shaping.advice.is_some() {
        Some("by construction: actions are chosen by Q_F + Φ(s, a)")
    } else if variant.shaping.learned.is_some() {
        Some("by construction: Q_F = Q − η / (1 + η) V where it settles")
    } else if variant.is_dynamic() {
        Some("by construction: Φ of an arrival is what is taken back when leaving")
    } else {
        None
    }
}

/// Where the host itself adds γΦ(s′) − Φ(s), and nothing else is added.
fn by_construction(variant: &Variant) -> Audit {
    let raw = variant.potential.is_some() && variant.potential_on == PhiOn::Raw;
    let (preserved, basis) = match (&variant.discretiser, raw, beyond_states(variant)) {
        (
            DiscretiserSpec::StateIndex | DiscretiserSpec::Features(_) | DiscretiserSpec::Raw,
            _,
            Some(why),
        )
        | (_, false, Some(why)) => (Some(true), why),
        (
            DiscretiserSpec::StateIndex | DiscretiserSpec::Features(_) | DiscretiserSpec::Raw,
            _,
            None,
        ) => (Some(true), "by construction: Φ is a function of the state"),
        (_, false, None) => {
            (Some(true), "by construction, for the discretised problem: Φ is constant on each cell")
        }
        (_, true, _) => (
            None,
            "by construction, for the true states; on cells, where Φ is not constant, the greedy \
             policy may change",
        ),
    };
    Audit::new(AuditVerdict::PotentialBased, preserved, basis)
}
