//! What a potential could do in the place of a term that is none.

use crate::audit::{Finding, Pattern, Scaling, Strict};
use crate::script::Variant;

/// Advice on a shaping that is not potential-based.
pub(super) fn replacement(
    variant: &Variant,
    pattern: Pattern,
    strict: &Strict,
    scaling: Option<&Scaling>,
) -> String {
    if scaling.is_some_and(|s| s.finding == Finding::Holds) {
        return "nothing: a positive multiple of the native reward has the same optimal policies"
            .into();
    }
    // A term that only the endings have is part of the task, whatever potential would explain it; so
    // is one that is the same everywhere.
    let plain = matches!(pattern, Pattern::AtTheEnd | Pattern::Constant);
    let diagnosis = strict.diagnosis.as_ref().filter(|_| !plain);
    let gamma = variant.agent.float("gamma");
    if let Some(d) = diagnosis {
        let other_gamma = (d.gamma - gamma).abs() > 1e-12;
        if other_gamma {
            return format!(
                "it is a potential's difference with γ = {}, but the agent's is {gamma}: give the \
                 function as `potential`, and the host adds γΦ(s′) − Φ(s) with the agent's own γ",
                rounded(d.gamma)
            );
        }
        let values = match d.common() {
            Some(c) => rounded(c),
            None => "other values than 0".into(),
        };
        return format!(
            "it is a potential's difference with Φ = {values} in terminal states, where it must be \
             0: give the function as `potential`, and the host sees to that"
        );
    }
    match pattern {
        Pattern::Nothing => "it adds nothing".into(),
        Pattern::Constant => {
            "the same for every step: a cost (or wage) of living, which changes what it is worth \
             to end early; no potential does that. `potential_shift` makes untried actions look \
             better or worse without changing what is optimal"
                .into()
        }
        Pattern::AtTheEnd => {
            "paid at the end only: it changes what the endings are worth, so it is part of the \
             task. To say how promising a state is on the way, use `potential`"
                .into()
        }
        Pattern::OfNextState => {
            "a bonus for where the agent is: as `potential: |s| ..`, the same function of the \
             state, it is paid when it rises and taken back when it falls"
                .into()
        }
        Pattern::OneWay => {
            "it pays for going one way and takes nothing back for returning: pay for both, that \
             is, give what the progress is measured by as `potential`"
                .into()
        }
        Pattern::OfAction => {
            "it depends on the action, not only on where that leads: `advice: |s, a| ..` does the \
             same and keeps the optimal policy"
                .into()
        }
        Pattern::Other => {
            "what it measures, as a function of the state alone, makes a `potential`: the host \
             adds γΦ(s′) − Φ(s), which cannot be exploited"
                .into()
        }
    }
}

/// A number without the noise of its last bits.
fn rounded(x: f64) -> String {
    let text = format!("{x:.6}");
    text.trim_end_matches('0').trim_end_matches('.').to_string()
}
