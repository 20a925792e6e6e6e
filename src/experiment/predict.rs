//! What a predictor plays, and the exact values that it should learn.

use super::assemble::{NotAModelError, diagnostic_of, for_each_cell, learned_model, shield};
use super::endless::refuse_endless;
use crate::env::EnvVisitor;
use crate::learn::ParamValue;
use crate::learn::planning::{Over, Planner, Policy, ValueIteration, policy_value};
use crate::mdp::{Action, Env, FiniteMdp, Outcome};
use crate::script::{Diagnostic, DiscretiserSpec, Host, Variant};
use crate::shaping::Fault;

/// What a predictor plays in each cell; `None` if it plays anything.
pub(super) fn given_policy<E: Env + Clone + 'static>(
    host: &Host,
    variant: &Variant,
    env: &E,
    n_cells: usize,
) -> Result<Option<Vec<Action>>, Fault> {
    match variant.agent.params["policy"] {
        ParamValue::Function => {
            let policy = scripted_policy(host, variant, env, n_cells)?;
            let by_state = matches!(variant.discretiser, DiscretiserSpec::StateIndex);
            if let Some(mdp) = env.finite().filter(|_| by_state) {
                refuse_endless(variant, mdp, &policy)?;
            }
            Ok(Some(policy))
        }
        ParamValue::Word("greedy") => {
            let model = learned_model(host, variant, env)?;
            let gamma = variant.agent.float("gamma");
            let planner = ValueIteration { gamma, theta: 1e-12, max_sweeps: 100_000 };
            let v0: Vec<f64> = model.phi.iter().map(|phi| -phi).collect();
            let solution = planner.solve(&model.shaped, &v0).map_err(|e| Fault(Box::new(e)))?;
            refuse_endless(variant, &model.shaped, &solution.policy)?;
            Ok(Some(solution.policy))
        }
        _ => Ok(None),
    }
}

/// The script's action in each cell, asked on the state that stands for it; 0 in states that cannot
/// be reached.
fn scripted_policy<E: Env + Clone + 'static>(
    host: &Host,
    variant: &Variant,
    env: &E,
    n_cells: usize,
) -> Result<Vec<Action>, Fault> {
    let callback = &variant.agent_functions["policy"];
    let mut action = host.callbacks().policy(callback, env.n_actions(), &env.schema());
    let mut actions = vec![0; n_cells];
    for_each_cell(variant, env, n_cells, |cell, fields| {
        actions[cell] = action(fields)?;
        Ok(())
    })?;
    Ok(actions)
}

/// The exact values of the policy that a predictor plays, of the reward that it learns from.
#[derive(Debug, Clone)]
pub(super) struct Exact {
    /// One per state; `None` where the policy does not lead, and nothing can be learned.
    pub(super) v: Vec<Option<f64>>,
    /// The states that the policy reaches, with their values.
    reached: Vec<(usize, f64)>,
}

/// Errors are computed after as many episodes as this many comparisons of a value allow, spread
/// evenly.
const COMPARISONS: u64 = 10_000_000;

impl Exact {
    /// Solves for the values; `None` where there is no model to solve, or the policy has no value
    /// (with γ = 1 it may never end).
    pub(super) fn new<E: Env + Clone + 'static>(
        host: &Host,
        variant: &Variant,
        env: &E,
        policy: Option<&[Action]>,
    ) -> Result<Option<Self>, Fault> {
        let by_state = matches!(variant.discretiser, DiscretiserSpec::StateIndex);
        if !by_state || variant.frame_skip > 1 || env.finite().is_none() {
            return Ok(None);
        }
        let mdp = match learned_model(host, variant, env) {
            Ok(model) => model.shaped,
            // A reward without a model has no exact value: no mistake.
            Err(fault) if fault.0.is::<NotAModelError>() => return Ok(None),
            Err(fault) => return Err(fault),
        };
        let chain = chain(&mdp, &shares(host, variant, env, &mdp, policy)?);
        let reached = chain.reachable();
        let gamma = variant.agent.float("gamma");
        let Ok(value) = policy_value(&chain, gamma, Policy::Uniform, Over::Reachable) else {
            return Ok(None);
        };
        let v: Vec<Option<f64>> =
            value.v.iter().zip(&reached).map(|(v, r)| r.then_some(*v)).collect();
        let reached = v.iter().enumerate().filter_map(|(s, v)| v.map(|v| (s, v))).collect();
        Ok(Some(Self { v, reached }))
    }

    /// The root mean square of the errors of `v`, over the states that the policy reaches.
    pub(super) fn error(&self, v: &[f64]) -> f64 {
        let squares = self.reached.iter().map(|&(s, exact)| (v[s] - exact) * (v[s] - exact));
        (squares.sum::<f64>() / self.reached.len() as f64).sqrt()
    }

    /// After every how many episodes the error is computed.
    pub(super) fn spacing(&self, episodes: u32) -> u32 {
        let all = self.reached.len() as u64 * u64::from(episodes);
        u32::try_from(all.div_ceil(COMPARISONS)).unwrap_or(u32::MAX).max(1)
    }
}

/// π(a | s), shape `[n_states, n_actions]`: 1 for the action of `policy`, or else the same for all
/// that the shield allows.
fn shares<E: Env + Clone + 'static>(
    host: &Host,
    variant: &Variant,
    env: &E,
    mdp: &FiniteMdp,
    policy: Option<&[Action]>,
) -> Result<Vec<f64>, Fault> {
    let n_actions = mdp.n_actions();
    let mut shares = vec![1.0 / n_actions as f64; mdp.n_states() * n_actions];
    if let Some(policy) = policy {
        shares.fill(0.0);
        for (row, &a) in shares.chunks_exact_mut(n_actions).zip(policy) {
            row[a] = 1.0;
        }
    } else if let Some(mut shield) = shield(host, variant, env) {
        let reachable = mdp.reachable();
        for (s, row) in shares.chunks_exact_mut(n_actions).enumerate() {
            if reachable[s] {
                let obs = env.state(s).expect("a finite environment");
                let allowed = shield.allowed(env, &obs)?;
                let n = (0..n_actions).filter(|&a| allowed.contains(a)).count();
                for (a, share) in row.iter_mut().enumerate() {
                    *share = if allowed.contains(a) { 1.0 / n as f64 } else { 0.0 };
                }
            }
        }
    }
    Ok(shares)
}

/// The Markov chain that playing with probabilities `shares` makes of a model: the same states, one
/// action.
fn chain(mdp: &FiniteMdp, shares: &[f64]) -> FiniteMdp {
    let n_actions = mdp.n_actions();
    let outcomes = |s: usize| -> Vec<Outcome> {
        let row = shares[s * n_actions..].iter().take(n_actions).enumerate();
        let played = row.filter(|&(_, &share)| share > 0.0);
        let scaled = played.flat_map(|(a, &share)| {
            let scale = move |o: &Outcome| Outcome { probability: share * o.probability, ..*o };
            mdp.of(s, a).iter().map(scale)
        });
        scaled.collect()
    };
    let table: Vec<_> = (0..mdp.n_states()).map(|s| vec![outcomes(s)]).collect();
    FiniteMdp::new(&table, mdp.initial().to_vec()).expect("the states are those of a model")
}

/// Whether the values that `variant` learns are known exactly, so that their errors are.
///
/// # Errors
/// If a callback fails.
pub fn has_exact_values(host: &Host, variant: &Variant) -> Result<bool, Diagnostic> {
    let by_state = matches!(variant.discretiser, DiscretiserSpec::StateIndex);
    if !variant.agent.is_predictor() || !by_state {
        return Ok(false);
    }
    let env = variant.environment().map_err(|e| Diagnostic::error(e.message).maybe_hint(e.hint))?;
    env.visit(Ask { host, variant }).map_err(|fault| host.annotate(diagnostic_of(fault)))
}

struct Ask<'a> {
    host: &'a Host,
    variant: &'a Variant,
}

impl EnvVisitor for Ask<'_> {
    type Out = Result<bool, Fault>;

    fn visit<E: Env + Clone + 'static>(self, env: E) -> Self::Out {
        let Some(n_states) = env.n_states() else { return Ok(false) };
        let policy = given_policy(self.host, self.variant, &env, n_states)?;
        Ok(Exact::new(self.host, self.variant, &env, policy.as_deref())?.is_some())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_over_the_states_that_the_policy_reaches() {
        let v = vec![Some(1.0), None, Some(-2.0)];
        let exact = Exact { v, reached: vec![(0, 1.0), (2, -2.0)] };
        // The root of (3² + 4²) / 2.
        assert_eq!(exact.error(&[4.0, 99.0, 2.0]), 12.5f64.sqrt());
        assert_eq!(exact.error(&[1.0, 99.0, -2.0]), 0.0);
    }

    #[test]
    fn errors_are_spaced_where_they_would_cost() {
        let exact = |n| Exact { v: Vec::new(), reached: vec![(0, 0.0); n] };
        assert_eq!(exact(1000).spacing(10_000), 1);
        assert_eq!(exact(1000).spacing(10_001), 2);
        assert_eq!(exact(500).spacing(1_000_000), 50);
        assert_eq!(exact(1).spacing(1), 1);
    }

    #[test]
    fn a_chain_is_the_model_under_the_policy() {
        // Action 0 ends with 1, action 1 stays for -1: with π(0) = 1/4, V = 1/4 - 3/4 + 3/4 γ V.
        let outcome = |reward, terminated| {
            vec![Outcome { probability: 1.0, next_state: 0, reward, terminated }]
        };
        let table = [vec![outcome(1.0, true), outcome(-1.0, false)]];
        let mdp = FiniteMdp::new(&table, vec![1.0]).unwrap();
        let chain = chain(&mdp, &[0.25, 0.75]);
        assert_eq!(chain.n_actions(), 1);
        let value = policy_value(&chain, 0.8, Policy::Uniform, Over::Reachable).unwrap().v[0];
        assert!((value - -0.5 / (1.0 - 0.75 * 0.8)).abs() < 1e-15, "{value}");
    }
}
