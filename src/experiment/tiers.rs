//! How a variant's callbacks are run, in words.

use crate::script::{Diagnostic, DiscretiserSpec, Host, PhiOn, Tier, Variant};

/// How one callback is run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CallbackTier {
    /// Its key in the experiment: `potential`, `terms.fuel`.
    pub key: String,
    /// Whether it is machine code.
    pub is_native: bool,
    /// Whether it is interpreted, and called at every step.
    pub is_slow: bool,
    /// `native`, or why it is interpreted, where, and what that costs.
    pub how: String,
}

/// The callbacks of `variant`, each with how it is run.
///
/// # Errors
/// If the variant's environment cannot be built.
pub fn tiers(host: &Host, variant: &Variant) -> Result<Vec<CallbackTier>, Diagnostic> {
    let env = variant.environment().map_err(|e| Diagnostic::error(e.message).maybe_hint(e.hint))?;
    let is_finite = env.finite().is_some();
    let tiers = host.callbacks().tiers(variant, &env.schema());
    let described = tiers.into_iter().map(|tiered| {
        let is_often = is_called_at_every_step(variant, &tiered.key, is_finite);
        let how = match &tiered.tier {
            Tier::Number(kernel, _) if kernel.is_machine() => "native".to_string(),
            Tier::Integer(kernel) if kernel.is_machine() => "native".to_string(),
            Tier::Number(..) | Tier::Integer(_) => {
                "evaluated: there is no machine code in this build".to_string()
            }
            Tier::Interpreted(reason) => {
                let place = reason
                    .place
                    .as_ref()
                    .map_or(String::new(), |place| format!("line {}: ", place.line));
                let cost = if is_often {
                    "interpreted at every step, each call some 200 times slower"
                } else {
                    "interpreted, not at every step"
                };
                format!("{place}{}; {cost}", reason.what)
            }
        };
        let is_slow = is_often && matches!(tiered.tier, Tier::Interpreted(_));
        CallbackTier { is_native: how == "native", is_slow, key: tiered.key, how }
    });
    Ok(described.collect())
}

/// Whether the callback under `key` is called at every step; otherwise once for a state, a cell or a
/// transition, and remembered.
fn is_called_at_every_step(variant: &Variant, key: &str, is_finite: bool) -> bool {
    match key {
        "discretiser" => true,
        "potential" => {
            variant.potential_on == PhiOn::Raw
                && !matches!(variant.discretiser, DiscretiserSpec::StateIndex)
        }
        "allowed" => !is_finite,
        "reward" => !is_finite || variant.frame_skip > 1,
        _ if key.starts_with("terms.") => !is_finite || variant.frame_skip > 1,
        _ => false,
    }
}
