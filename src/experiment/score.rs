//! What the potentials of a study promise before anything is trained.

use super::assemble::diagnostic_of;
use super::audit::{Thorough, sample};
use super::shaped::potential;
use super::shielded::playable;
use crate::audit::{Score, Scorer, Shift};
use crate::env::EnvVisitor;
use crate::mdp::{Env, FiniteMdp};
use crate::script::{Diagnostic, DiscretiserSpec, Host, Variant};
use crate::shaping::{Fault, Potential};

/// The scores of a variant's potential; one of 0 everywhere, if it has none.
#[derive(Debug, Clone, PartialEq)]
pub struct Scored {
    /// Its scores.
    pub score: Score,
    /// A constant that would help; `None` if it cannot be computed.
    pub shift: Option<Shift>,
    /// The discounted return of an optimal policy.
    pub optimal: f64,
    /// That of uniformly random actions.
    pub random: f64,
    /// Number of states sampled per cell, where the model is one of samples.
    pub samples: Option<usize>,
}

/// Scores the potential of `variant` on its environment's model, or on the sampled model of its
/// bins. The error within is why that cannot be.
///
/// # Errors
/// If a callback fails.
pub fn score_variant(
    host: &Host,
    variant: &Variant,
    thorough: Thorough<'_>,
) -> Result<Result<Scored, String>, Diagnostic> {
    let refuse = |why: &str| Ok(Err(why.to_string()));
    if variant.changes_reward() {
        return refuse("it changes the reward by more than a potential");
    }
    if variant.is_dynamic() || variant.shaping.learned.is_some() || variant.shaping.advice.is_some()
    {
        return refuse("it is shaped by more than a function of the state");
    }
    let env = variant.environment().map_err(|e| Diagnostic::error(e.message).maybe_hint(e.hint))?;
    env.visit(ScoreVariant { host, variant, thorough }).map_err(|fault| {
        host.annotate(diagnostic_of(fault).note(format!("in variant `{}`", variant.name)))
    })
}

struct ScoreVariant<'a> {
    host: &'a Host,
    variant: &'a Variant,
    thorough: Thorough<'a>,
}

impl EnvVisitor for ScoreVariant<'_> {
    type Out = Result<Result<Scored, String>, Fault>;

    fn visit<E: Env + Clone + 'static>(self, env: E) -> Self::Out {
        let Self { host, variant, thorough } = self;
        let gamma = variant.agent.float("gamma");
        if let DiscretiserSpec::StateIndex = variant.discretiser {
            let Some(mdp) = env.finite().filter(|_| variant.frame_skip == 1) else {
                return Ok(Err("there is no model of its environment".into()));
            };
            let mdp = playable(host, variant, &env, (**mdp).clone())?;
            let reachable = mdp.reachable();
            let mut of_state = potential(host, variant, &env, mdp.n_states())?;
            let mut phi = vec![0.0; mdp.n_states()];
            for s in (0..mdp.n_states()).filter(|&s| reachable[s]) {
                let obs = env.state(s).expect("a finite environment");
                phi[s] = of_state.phi(&env, s, &obs)?;
            }
            return Ok(scored(&mdp, gamma, &phi, None));
        }
        match sample(variant, &env, thorough)? {
            Some((found, samples)) => Ok(scored(&found.mdp, gamma, &found.phi, Some(samples))),
            None => Ok(Err("it has no bins that could be sampled".into())),
        }
    }
}

fn scored(
    mdp: &FiniteMdp,
    gamma: f64,
    phi: &[f64],
    samples: Option<usize>,
) -> Result<Scored, String> {
    let words = |e: crate::learn::planning::PlanError| e.to_string();
    let scorer = Scorer::new(mdp, gamma).map_err(words)?;
    Ok(Scored {
        score: scorer.score(phi).map_err(words)?,
        shift: scorer.shift(phi).ok(),
        optimal: scorer.optimal_return(),
        random: scorer.random_return(),
        samples,
    })
}
