//! Models behind a shield.

use super::assemble::shield;
use crate::mdp::{Action, Env, FiniteMdp};
use crate::script::{Host, Variant};
use crate::shaping::{ActionSet, Fault};

/// `mdp`, a model of `env`, as it is for an agent behind the variant's shield: a refused action does
/// what the state's first allowed one does, so that planning has nothing else to choose among, and
/// what only refused actions reach is not reachable. The shield is asked of reachable states only.
///
/// # Errors
/// If the shield fails, or allows nothing in a reachable state.
pub(super) fn playable<E: Env>(
    host: &Host,
    variant: &Variant,
    env: &E,
    mdp: FiniteMdp,
) -> Result<FiniteMdp, Fault> {
    let Some(mut shield) = shield(host, variant, env) else { return Ok(mdp) };
    let initial: Vec<f64> = mdp.initial().to_vec();
    let mut allowed = vec![None; mdp.n_states()];
    let mut open: Vec<usize> = (0..mdp.n_states()).filter(|&s| initial[s] > 0.0).collect();
    while let Some(s) = open.pop() {
        if allowed[s].is_some() {
            continue;
        }
        let obs = env.state(s).expect("a finite environment");
        let set = shield.allowed(env, &obs)?;
        allowed[s] = Some(set);
        for a in (0..mdp.n_actions()).filter(|&a| set.contains(a)) {
            let reached = mdp.of(s, a).iter().filter(|o| o.probability > 0.0 && !o.terminated);
            open.extend(reached.map(|o| o.next_state as usize));
        }
    }
    let played = |s: usize, a: Action| {
        let set = allowed[s].unwrap_or(ActionSet::ALL);
        (!set.contains(a)).then(|| (0..mdp.n_actions()).find(|&a| set.contains(a))).flatten()
    };
    let table: Vec<Vec<Vec<_>>> = (0..mdp.n_states())
        .map(|s| {
            (0..mdp.n_actions()).map(|a| mdp.of(s, played(s, a).unwrap_or(a)).to_vec()).collect()
        })
        .collect();
    Ok(FiniteMdp::new(&table, initial).expect("it has the shape of the model it is made from"))
}
