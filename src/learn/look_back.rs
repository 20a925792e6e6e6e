//! Look-back advice (Wiewiora, Cottrell & Elkan 2003).
//!
//! The reward of a step gets `F = Φ(S, A) − γ⁻¹ Φ(S⁻, A⁻)` added, where (S⁻, A⁻) is the step before;
//! Φ is 0 before the first step and for the last one. Over an episode the discounted sum is
//! then 0, and from any step on it is `−γ⁻¹ Φ(S⁻, A⁻)`, whatever is done from there: an on-policy
//! learner of whole returns learns `Q(s, a)` less a number that depends on s alone, and its choices
//! need no correction.
//!
//! A learner that bootstraps forgets which step was before the state it bootstraps from. Where
//! several lead to the same state, only the average of their Φ is taken back, and the advice leaves
//! a trace in what is learned: what such a learner converges to need not be best.

use super::registry::TabularAgent;
use super::{Agent, Last, Learn, QTable, Seen};
use crate::mdp::Action;

/// An on-policy agent with look-back advice.
pub struct LookBack {
    agent: Box<dyn TabularAgent>,
    /// The advice, Φ(s, a).
    phi: QTable,
    /// Φ(S, A) and `γ⁻¹ Φ(S⁻, A⁻)`.
    present: f64,
    before: f64,
    /// The sum of F over the episode.
    shaping: f64,
}

impl LookBack {
    /// `agent`, advised by `phi`, which has the shape of its table. Its γ must not be 0.
    pub fn new(agent: Box<dyn TabularAgent>, phi: QTable) -> Self {
        Self { agent, phi, present: 0.0, before: 0.0, shaping: 0.0 }
    }

    /// F of the step that was made; `present` is its Φ.
    fn term(&mut self, present: f64) -> f64 {
        let f = present - self.before;
        self.shaping += f;
        f
    }
}

impl Agent for LookBack {
    fn gamma(&self) -> f64 {
        self.agent.gamma()
    }

    fn bootstraps_when_truncated(&self) -> bool {
        self.agent.bootstraps_when_truncated()
    }

    fn epsilon(&self) -> f64 {
        self.agent.epsilon()
    }

    fn q(&self) -> Option<&QTable> {
        self.agent.q()
    }

    fn v(&self) -> Option<&[f64]> {
        self.agent.v()
    }

    fn shaping(&self) -> f64 {
        self.shaping + self.agent.shaping()
    }
}

impl<S: Seen> Learn<S> for LookBack
where
    Box<dyn TabularAgent>: Learn<S>,
{
    fn begin(&mut self, s: S) -> Action {
        let a = self.agent.begin(s);
        self.present = self.phi.get(s.cell(), a);
        (self.before, self.shaping) = (0.0, 0.0);
        a
    }

    fn step(&mut self, reward: f64, next: S) -> Action {
        let f = self.term(self.present);
        let a = self.agent.step(reward + f, next);
        self.before = self.present / self.agent.gamma();
        self.present = self.phi.get(next.cell(), a);
        a
    }

    /// The last step has Φ = 0, but not where the episode goes on for the agent, which bootstraps
    /// from the state it was cut off in.
    fn end(&mut self, reward: f64, last: Last<S>) {
        let truncated = matches!(last, Last::Truncated(_));
        let goes_on = truncated && self.agent.bootstraps_when_truncated();
        let f = self.term(if goes_on { self.present } else { 0.0 });
        self.agent.end(reward + f, last);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::{Sarsa, Schedule};
    use crate::mdp::streams::Stream;

    const PHI: [f64; 4] = [3.0, 1.0, 2.0, 5.0];

    /// Greedy, and learning nothing to speak of: action 1 in state 0, action 0 in state 1.
    fn agent() -> LookBack {
        let q = QTable::from_values(2, vec![0.0, 1.0, 4.0, 2.0]);
        let (alpha, epsilon) = (Schedule::constant(1e-300), Schedule::constant(0.0));
        let sarsa = Sarsa::new(q, 0.5, alpha, epsilon, Stream::new(0, "test"));
        LookBack::new(Box::new(sarsa), QTable::from_values(2, PHI.to_vec()))
    }

    #[test]
    fn the_discounted_terms_of_an_episode_cancel() {
        let mut agent = agent();
        let mut terms = Vec::new();
        let mut before = 0.0;
        let mut heard = |agent: &LookBack| {
            terms.push(agent.shaping() - before);
            before = agent.shaping();
        };
        assert_eq!(agent.begin(0usize), 1);
        assert_eq!(agent.step(0.0, 1usize), 0);
        heard(&agent);
        assert_eq!(agent.step(0.0, 0usize), 1);
        heard(&agent);
        agent.end(0.0, Last::<usize>::Terminated);
        heard(&agent);
        // 1, then 2 - 1 / 0.5, then 0 - 2 / 0.5.
        assert_eq!(terms, [1.0, 0.0, -4.0]);
        assert_eq!(1.0 + 0.5 * 0.0 + 0.25 * -4.0, 0.0);
    }

    #[test]
    fn an_episode_that_is_cut_off_keeps_its_last_advice() {
        let mut agent = agent();
        agent.begin(0usize);
        agent.step(0.0, 1usize);
        // Not the last step for SARSA, which bootstraps: 1 + 2 - 1 / 0.5.
        agent.end(0.0, Last::Truncated(0usize));
        assert_eq!(agent.shaping(), 1.0);
    }
}
