//! Learning the state values of a policy that is given (Sutton & Barto 2018, sections 5.1, 6.1, 7.1
//! and 12.2).
//!
//! - [`Prediction`]: plays a [`GivenPolicy`] and learns its V by a [`Rule`]
//! - [`MonteCarloPrediction`], [`Td0`], [`TdLambda`], [`NStepTd`]: the rules

mod monte_carlo;
mod n_step_td;
mod policy;
mod td0;
mod td_lambda;

pub use monte_carlo::MonteCarloPrediction;
pub use n_step_td::NStepTd;
pub use policy::GivenPolicy;
pub use td_lambda::TdLambda;
pub use td0::Td0;

use super::{Agent, AlphaSource, Last, Learn, QTable, Rate, Seen, StepSize};
use crate::mdp::Action;

/// State values being learned.
#[derive(Debug, Clone)]
pub struct Estimate {
    v: Vec<f64>,
    gamma: f64,
    alpha: StepSize,
}

impl Estimate {
    /// Starting from `v`, one value per state.
    pub fn new(v: Vec<f64>, gamma: f64, alpha: AlphaSource) -> Self {
        Self { alpha: StepSize::new(alpha, v.len()), v, gamma }
    }

    /// `V(S) ← V(S) + α [target − V(S)]`, one visit of S.
    #[inline]
    fn learn(&mut self, s: usize, target: f64) {
        let alpha = self.alpha.visit(s);
        self.v[s] += alpha * (target - self.v[s]);
    }

    /// What follows a step: 0 at the end of the episode, the value of the last state where it was
    /// cut off.
    fn after(&self, last: Last) -> f64 {
        match last {
            Last::Terminated => 0.0,
            Last::Truncated(s) => self.v[s],
        }
    }
}

/// How values are learned from the states and rewards of episodes.
pub trait Rule {
    /// Whether the last state of a truncated episode is bootstrapped from.
    const BOOTSTRAPS: bool;

    /// An episode starts in `s`.
    fn begin(&mut self, estimate: &mut Estimate, s: usize);

    /// The step from the state before brought `reward` and led to `next`.
    fn step(&mut self, estimate: &mut Estimate, reward: f64, next: usize);

    /// The last step brought `reward`.
    fn end(&mut self, estimate: &mut Estimate, reward: f64, last: Last);
}

/// Plays a given policy and learns its state values by the rule `R`.
#[derive(Debug, Clone)]
pub struct Prediction<R> {
    estimate: Estimate,
    policy: GivenPolicy,
    rule: R,
}

impl<R: Rule> Prediction<R> {
    /// Learns the values of `policy` by `rule`.
    pub fn new(estimate: Estimate, policy: GivenPolicy, rule: R) -> Self {
        Self { estimate, policy, rule }
    }
}

impl<R: Rule> Agent for Prediction<R> {
    fn gamma(&self) -> f64 {
        self.estimate.gamma
    }

    fn bootstraps_when_truncated(&self) -> bool {
        R::BOOTSTRAPS
    }

    fn epsilon(&self) -> f64 {
        0.0
    }

    fn q(&self) -> Option<&QTable> {
        None
    }

    fn v(&self) -> Option<&[f64]> {
        Some(&self.estimate.v)
    }
}

impl<S: Seen, R: Rule> Learn<S> for Prediction<R> {
    fn begin(&mut self, s: S) -> Action {
        self.rule.begin(&mut self.estimate, s.cell());
        self.policy.choose(s)
    }

    #[inline]
    fn step(&mut self, reward: f64, next: S) -> Action {
        self.rule.step(&mut self.estimate, reward, next.cell());
        self.policy.choose(next)
    }

    fn end(&mut self, reward: f64, last: Last<S>) {
        let last = match last {
            Last::Terminated => Last::Terminated,
            Last::Truncated(s) => Last::Truncated(s.cell()),
        };
        self.rule.end(&mut self.estimate, reward, last);
        self.estimate.alpha.end_episode();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::Schedule;
    use crate::mdp::streams::Stream;
    use crate::shaping::{ActionSet, Shielded};

    pub(super) const HALF: AlphaSource = AlphaSource::Schedule(Schedule::Constant { value: 0.5 });
    pub(super) const MEAN: AlphaSource = AlphaSource::VisitCount { omega: 1.0 };

    /// The values after an episode through `states` with `rewards`, by `rule`; γ = 1/2.
    pub(super) fn after<R: Rule>(
        rule: R,
        v: &[f64],
        alpha: AlphaSource,
        states: &[usize],
        rewards: &[f64],
        last: Last,
    ) -> Vec<f64> {
        let estimate = Estimate::new(v.to_vec(), 0.5, alpha);
        let policy = GivenPolicy::Fixed(vec![0; v.len()]);
        let mut agent = Prediction::new(estimate, policy, rule);
        agent.begin(states[0]);
        for (&s, &r) in states[1..].iter().zip(rewards) {
            agent.step(r, s);
        }
        agent.end(rewards[states.len() - 1], last);
        agent.estimate.v
    }

    #[test]
    fn policies_are_played_as_given() {
        let mut fixed = GivenPolicy::Fixed(vec![2, 0]);
        assert_eq!((fixed.choose(0), fixed.choose(1)), (2, 0));
        let mut random = GivenPolicy::Random { n_actions: 3, stream: Stream::new(0, "test") };
        let mut counts = [0; 3];
        (0..3000).for_each(|_| counts[random.choose(0)] += 1);
        assert!(counts.iter().all(|n| (900..1100).contains(n)), "{counts:?}");
        let allowed = ActionSet(0b110);
        (0..100).for_each(|_| assert_ne!(random.choose(Shielded { cell: 0, allowed }), 0));
    }
}
