//! Policies that never end an episode that nothing else would end.

use crate::mdp::{Action, FiniteMdp};
use crate::script::{Diagnostic, Variant};
use crate::shaping::Fault;

/// Refuses `policy`, which is played as it is, if an episode may come to a state from which it never
/// ends, and there is no time limit: training would not either.
pub(super) fn refuse_endless(
    variant: &Variant,
    mdp: &FiniteMdp,
    policy: &[Action],
) -> Result<(), Fault> {
    if variant.max_steps.is_some() || !never_ends(mdp, policy) {
        return Ok(());
    }
    let d = Diagnostic::error("the policy that is played may never end an episode")
        .at(variant.place.clone())
        .note(format!("{} has no time limit of its own", variant.env.id))
        .hint("set `max_steps`");
    Err(Fault(Box::new(d)))
}

/// Whether the policy leads from a start to a state from which it cannot end.
fn never_ends(mdp: &FiniteMdp, policy: &[Action]) -> bool {
    let n = mdp.n_states();
    let happens = |s: usize| mdp.of(s, policy[s]).iter().filter(|o| o.probability > 0.0);
    let mut met = vec![false; n];
    let mut open: Vec<usize> = (0..n).filter(|&s| mdp.initial()[s] > 0.0).collect();
    let mut order = Vec::new();
    while let Some(s) = open.pop() {
        if std::mem::replace(&mut met[s], true) {
            continue;
        }
        order.push(s);
        open.extend(happens(s).filter(|o| !o.terminated).map(|o| o.next_state as usize));
    }
    // From the ends backwards, until nothing is added.
    let mut ends = vec![false; n];
    loop {
        let mut found = false;
        for &s in order.iter().filter(|&&s| met[s]) {
            let leads = |o: &crate::mdp::Outcome| o.terminated || ends[o.next_state as usize];
            if !ends[s] && happens(s).any(leads) {
                ends[s] = true;
                found = true;
            }
        }
        if !found {
            return order.iter().any(|&s| !ends[s]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mdp::Outcome;

    #[test]
    fn a_policy_ends_if_from_everywhere_it_can() {
        let go = |next_state, terminated| {
            vec![Outcome { probability: 1.0, next_state, reward: 0.0, terminated }]
        };
        // 0: stay, or on to 1; 1: back, or out.
        let table = [vec![go(0, false), go(1, false)], vec![go(0, false), go(1, true)]];
        let mdp = FiniteMdp::new(&table, vec![1.0, 0.0]).unwrap();
        assert!(!never_ends(&mdp, &[1, 1]));
        assert!(never_ends(&mdp, &[1, 0]));
        assert!(never_ends(&mdp, &[0, 1]));
    }
}
