//! What can be said exactly about a variant's shaping.

use serde::Serialize;

use super::assemble::{NotAModelError, diagnostic_of, learned_model};
use super::shielded::playable;
use crate::audit::{Preservation, Verdict, preservation};
use crate::env::EnvVisitor;
use crate::mdp::Env;
use crate::script::{Diagnostic, DiscretiserSpec, Host, PhiOn, Variant};
use crate::shaping::Fault;

/// The verdict on a variant's shaping.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Audit {
    /// `unshaped`, `potential-based`, `policy preserved`, `policy changed`, `inconclusive` or
    /// `not checked`.
    pub verdict: &'static str,
    /// Whether the optimal policy survives; `None` if that was not decided.
    pub policy_preserved: Option<bool>,
    /// Reachable states whose optimal actions change, where the model is known.
    pub states_changed: Option<usize>,
    /// Whether `Q_F + Φ = Q` was found to hold, where the model is known.
    pub identity_holds: Option<bool>,
    /// On what the verdict rests, in one line.
    pub basis: String,
    /// The comparison itself, where the model is known.
    #[serde(skip)]
    pub exact: Option<Preservation>,
}

impl Audit {
    fn new(verdict: &'static str, policy_preserved: Option<bool>, basis: &str) -> Self {
        Self {
            verdict,
            policy_preserved,
            states_changed: None,
            identity_holds: None,
            basis: basis.to_string(),
            exact: None,
        }
    }

    /// A verdict with every field filled in, for rehearsing what reads it.
    pub fn made_up() -> Self {
        Self {
            states_changed: Some(0),
            identity_holds: Some(true),
            ..Self::new("potential-based", Some(true), "made up")
        }
    }

    /// The verdict with the number of changed states, for tables.
    pub fn label(&self) -> String {
        match self.states_changed {
            Some(n) if n > 0 => format!("{} ({n})", self.verdict),
            _ => self.verdict.to_string(),
        }
    }
}

/// Judges the shaping of `variant`.
///
/// On a finite environment both models are solved and compared. Elsewhere a potential evaluated on
/// cells, or on the states themselves where values are linear in features, is potential-based by
/// construction, and other rewards are not judged.
///
/// # Errors
/// If a callback fails.
pub fn audit_variant(host: &Host, variant: &Variant) -> Result<Audit, Diagnostic> {
    if variant.potential.is_none() && !variant.changes_reward() {
        return Ok(Audit::new("unshaped", Some(true), "the agent learns from the native reward"));
    }
    let env = variant.environment().map_err(|e| Diagnostic::error(e.message).maybe_hint(e.hint))?;
    env.visit(Judge { host, variant })
}

struct Judge<'a> {
    host: &'a Host,
    variant: &'a Variant,
}

impl EnvVisitor for Judge<'_> {
    type Out = Result<Audit, Diagnostic>;

    fn visit<E: Env + Clone + 'static>(self, env: E) -> Self::Out {
        let (host, variant) = (self.host, self.variant);
        let potential_only = !variant.changes_reward();
        // Features know nothing of cells either: what is said is said of the states themselves.
        let on_cells =
            matches!(variant.discretiser, DiscretiserSpec::Bins(_) | DiscretiserSpec::Cells { .. });
        if on_cells {
            return Ok(match (potential_only, variant.potential_on) {
                (true, PhiOn::Cell) => Audit::new(
                    "potential-based",
                    Some(true),
                    "by construction, for the discretised problem: Φ is constant on each cell",
                ),
                (true, PhiOn::Raw) => {
                    Audit::new("not checked", None, "Φ of the raw state is not constant on cells")
                }
                (false, _) => {
                    Audit::new("not checked", None, "a changed reward without a finite model")
                }
            });
        }
        let Some(plain) = env.finite().filter(|_| variant.frame_skip == 1) else {
            return Ok(match (potential_only, variant.frame_skip) {
                (true, _) => Audit::new(
                    "potential-based",
                    Some(true),
                    "by construction: Φ is a function of the state",
                ),
                (false, 1) => {
                    Audit::new("not checked", None, "a changed reward without a finite model")
                }
                (false, _) => {
                    Audit::new("not checked", None, "a changed reward, summed over skipped frames")
                }
            });
        };
        let model = match learned_model(host, variant, &env) {
            Ok(model) => model,
            // A reward without a model is an answer, not a mistake.
            Err(fault) => match fault.0.downcast::<NotAModelError>() {
                Ok(e) => return Ok(Audit::new("not checked", None, &e.what.to_string())),
                Err(other) => {
                    let d = diagnostic_of(Fault(other));
                    return Err(d.note(format!("in variant `{}`", variant.name)));
                }
            },
        };
        let plain = playable(host, variant, &env, (**plain).clone()).map_err(diagnostic_of)?;
        let gamma = variant.agent.float("gamma");
        let Ok(result) = preservation(&plain, &model.shaped, gamma, &model.phi) else {
            return Ok(Audit::new(
                "inconclusive",
                None,
                if gamma < 1.0 {
                    "some value is not finite: are the rewards too large?"
                } else {
                    "with gamma = 1 some policy never ends and has no value: use gamma < 1"
                },
            ));
        };
        let (verdict, preserved, basis) = match result.verdict {
            Verdict::Inconclusive => {
                ("inconclusive", None, "two actions are too close for the numbers to decide")
            }
            Verdict::Preserved if potential_only && result.identity_holds() => {
                ("potential-based", Some(true), "exact: Q_F + Φ = Q and the greedy sets are equal")
            }
            Verdict::Preserved => {
                ("policy preserved", Some(true), "exact: the greedy sets are equal")
            }
            Verdict::Changed => ("policy changed", Some(false), "exact: the greedy sets differ"),
        };
        Ok(Audit {
            states_changed: Some(result.states_changed.len()),
            identity_holds: potential_only.then(|| result.identity_holds()),
            exact: Some(result),
            ..Audit::new(verdict, preserved, basis)
        })
    }
}
