//! Is a shaping potential-based in expectation?
//!
//! A reward enters the values of a policy only by its expectation over the outcomes of (s, a). Under
//! any one policy π, `E[F | s, a] = γ E[Φ(s′)] − Φ(s)` if and only if `Φ = −V_F^π` and the advantages
//! `A_F(s, a) = E[F + γ V_F^π(s′)] − V_F^π(s)` are 0 everywhere (from `Q_F^π = Q^π − Φ` with r = 0; Ng,
//! Harada & Russell 1999). Here π is the uniform policy.
//!
//! Transition by transition is more than that: noise of mean 0 is no potential's, and yet changes no
//! value.

use serde::Serialize;

use super::strict::forest::leaving;
use super::strict::{Difference, Finding};
use crate::learn::planning::{Dynamics, PlanError, Policy};
use crate::mdp::{Action, FiniteMdp};

/// The advantages of the uniform policy for the native reward and for what is added to it. Those of
/// the learned reward are their sum. States go by their places in the dynamics.
#[derive(Debug)]
pub struct Advantages<'a> {
    pub(super) dynamics: &'a Dynamics,
    /// For the native reward, one per pair (s, a).
    pub(super) native: Vec<f64>,
    /// For F, one per pair.
    pub(super) shaping: Vec<f64>,
    /// `V_F`, one per place.
    value: Vec<f64>,
    /// The largest |r| and |`V_R`|, on which `native` is exact to some 1e-12.
    pub(super) native_scale: f64,
    /// The largest |r|, |F| and |`V_F`|, on which `shaping` is.
    pub(super) shaping_scale: f64,
}

impl<'a> Advantages<'a> {
    /// For `f`, learned minus native reward, one value per outcome of `mdp`. `dynamics` are the
    /// model's.
    ///
    /// # Errors
    /// If a value is not finite, or γ = 1 and the uniform policy may never end.
    pub fn new(
        mdp: &FiniteMdp,
        dynamics: &'a Dynamics,
        f: &[f64],
        gamma: f64,
    ) -> Result<Self, PlanError> {
        let n_actions = dynamics.n_actions();
        let advantages = |rewards: &[f64]| -> Result<_, PlanError> {
            let value = dynamics.value(rewards, gamma, Policy::Uniform)?.v;
            let mut q = dynamics.q_from_v(rewards, gamma, &value);
            q.iter_mut().enumerate().for_each(|(i, q)| *q -= value[i / n_actions]);
            Ok((q, value))
        };
        let (native, native_value) = advantages(&dynamics.rewards(mdp))?;
        let (shaping, value) = advantages(&dynamics.expect(mdp, |i| f[i]))?;
        let largest = |values: &[f64]| values.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let (mut native_scale, mut shaping_scale) = (largest(&native_value), largest(&value));
        for place in 0..dynamics.len() {
            let s = dynamics.state(place);
            for (i, o) in leaving(mdp, s) {
                let reward = o.reward.abs();
                native_scale = native_scale.max(reward);
                // F is a difference of two rewards, and no more exact than they are.
                shaping_scale = shaping_scale.max(reward).max(f[i].abs());
            }
        }
        Ok(Self { dynamics, native, shaping, value, native_scale, shaping_scale })
    }

    /// Whether F is a potential's in expectation. `declared` is the potential that is claimed, one
    /// value per state of the model.
    pub fn expected(&self, declared: Option<&[f64]>) -> Expected {
        let mut largest = (0, 0.0f64);
        for (i, a) in self.shaping.iter().enumerate() {
            if a.abs() > largest.1 {
                largest = (i, a.abs());
            }
        }
        let (pair, advantage) = largest;
        let n_actions = self.dynamics.n_actions();
        let potential: Vec<f64> = self.value.iter().map(|v| -v).collect();
        let states = (0..self.dynamics.len()).map(|place| self.dynamics.state(place));
        let declared = declared.and_then(|phi| {
            Difference::largest(states.zip(&potential).map(|(s, own)| (s, own - phi[s])))
        });
        Expected {
            finding: Finding::of(advantage, self.shaping_scale),
            largest_advantage: advantage,
            state: self.dynamics.state(pair / n_actions),
            action: pair % n_actions,
            scale: self.shaping_scale,
            potential: self.dynamics.unpack(&potential),
            declared,
        }
    }
}

/// Whether F is a potential's in expectation: enough for every claim about values and greedy
/// policies.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Expected {
    /// Holds if all advantages are 0.
    pub finding: Finding,
    /// `max |A_F(s, a)|`.
    pub largest_advantage: f64,
    /// The state where it is that large.
    pub state: usize,
    /// The action.
    pub action: Action,
    /// S: the largest |r|, |F| and |`V_F`|.
    pub scale: f64,
    /// `−V_F`, the one potential that is possible, one value per state; 0 where no episode can be.
    #[serde(skip)]
    pub potential: Vec<f64>,
    /// That potential against the declared one.
    pub declared: Option<Difference>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::audit::specimens::{potential_rewards, random_model, rewards, symmetric};
    use crate::audit::strict::strict;
    use crate::learn::planning::Over;
    use crate::mdp::Outcome;
    use crate::mdp::streams::Stream;

    fn run(mdp: &FiniteMdp, f: &[f64], gamma: f64, declared: Option<&[f64]>) -> Expected {
        let dynamics = Dynamics::new(mdp, Over::Reachable);
        Advantages::new(mdp, &dynamics, f, gamma).unwrap().expected(declared)
    }

    #[test]
    fn a_potential_is_recovered_and_has_no_advantages() {
        let mut stream = Stream::new(1, "expected");
        for round in 0..200 {
            let gamma = [0.5, 0.9, 0.99][round % 3];
            let size = [1.0, 1e3, 1e6][round / 3 % 3];
            let n = 1 + stream.below(30);
            let mdp = random_model(&mut stream, n, 0.1);
            let phi: Vec<f64> = (0..n).map(|_| size * symmetric(&mut stream)).collect();
            let found = run(&mdp, &potential_rewards(&mdp, gamma, &phi), gamma, Some(&phi));
            assert_eq!(found.finding, Finding::Holds);
            let scale = found.scale.max(1.0);
            let (error, advantage) = (found.declared.unwrap().largest, found.largest_advantage);
            assert!(error <= 9e-14 * scale, "{error} on {scale}");
            assert!(advantage <= 2e-14 * scale, "{advantage} on {scale}");
        }
    }

    #[test]
    fn a_small_perturbation_of_any_pair_is_found() {
        let mut stream = Stream::new(2, "expected");
        for _ in 0..40 {
            let n = 2 + stream.below(10);
            let mdp = random_model(&mut stream, n, 0.1);
            if mdp.n_actions() == 1 {
                // Without a choice there are no advantages: any reward is a potential's.
                continue;
            }
            let reachable = mdp.reachable();
            let phi: Vec<f64> = (0..n).map(|_| symmetric(&mut stream)).collect();
            let f = potential_rewards(&mdp, 0.99, &phi);
            for s in (0..n).filter(|&s| reachable[s]) {
                for i in mdp.range(s, 0).start..mdp.range(s, mdp.n_actions() - 1).end {
                    let mut f = f.clone();
                    f[i] += 1e-4;
                    assert_eq!(run(&mdp, &f, 0.99, None).finding, Finding::Fails);
                }
            }
        }
    }

    #[test]
    fn noise_of_mean_zero_is_a_potential_in_expectation_only() {
        let to = |next_state| Outcome {
            probability: 0.5,
            next_state,
            reward: 0.0,
            terminated: next_state == 2,
        };
        let row = || vec![to(0), to(1)];
        let mdp = FiniteMdp::new(
            &[vec![row(), row()], vec![vec![to(0), to(2)]; 2], vec![vec![to(2)]; 2]],
            vec![1.0, 0.0, 0.0],
        )
        .unwrap();
        let phi = [3.0, -1.0, 0.0];
        let mut f = potential_rewards(&mdp, 0.9, &phi);
        f[0] += 0.5;
        f[1] -= 0.5;
        let found = run(&mdp, &f, 0.9, Some(&phi));
        assert_eq!(found.finding, Finding::Holds);
        assert!(found.largest_advantage < 1e-13 && found.declared.unwrap().largest < 1e-13);
        let strictly = strict(&mdp, &f, 0.9, &mdp.reachable(), None);
        assert_eq!(strictly.finding, Finding::Fails);
        // Both outcomes of s0 at the second action agree with Φ; the noise does not.
        assert!(strictly.violations >= 1);
    }

    #[test]
    fn the_largest_advantage_is_located() {
        let mut stream = Stream::new(3, "expected");
        let mdp = random_model(&mut stream, 8, 0.1);
        let (s, a) = (mdp.n_states() - 1, mdp.n_actions() - 1);
        assert!(mdp.reachable()[s] && a > 0);
        let f = rewards(&mdp, |at, action, _| if (at, action) == (s, a) { 1.0 } else { 0.0 });
        let found = run(&mdp, &f, 0.9, None);
        assert_eq!((found.finding, found.state, found.action), (Finding::Fails, s, a));
    }
}
