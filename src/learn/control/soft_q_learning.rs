//! Soft Q-learning: Q-learning of the entropy-regularised return `Σ γ^t (R + τ H(π(· | S)))`
//! (Ziebart 2010; Haarnoja et al. 2017, for a table).
//!
//! `Q(S, A) ← Q(S, A) + α [R + γ V(S′) − Q(S, A)]`, `V(s) = τ ln Σ_a exp(Q(s, a) / τ)`
//!
//! The behaviour is the optimal policy of that return, softmax with the same temperature τ, and is
//! chosen after the update. V exceeds the largest value by up to τ ln n: what the entropy is worth.
//! As τ goes to 0 this is Q-learning with greedy behaviour.

use super::Tabular;
use super::tabular::agent_of_table;
use crate::learn::softmax::Softmax;
use crate::learn::{AlphaSource, Last, Learn, QTable, Seen, StepSize};
use crate::mdp::Action;
use crate::mdp::streams::Stream;

/// Tabular soft Q-learning.
#[derive(Debug, Clone)]
pub struct SoftQLearning(Tabular<Softmax>);

impl SoftQLearning {
    /// A learner with the table `q`; its behaviour draws from `stream`. `temperature` is in units
    /// of the rewards, above 0.
    pub fn new(
        q: QTable,
        gamma: f64,
        alpha: AlphaSource,
        temperature: f64,
        stream: Stream,
    ) -> Self {
        let behaviour = Softmax::new(temperature, q.n_actions(), stream);
        let alpha = StepSize::new(alpha, q.values().len());
        Self(Tabular { q, gamma, alpha, behaviour, s: 0, a: 0 })
    }

    fn value<S: Seen>(&mut self, s: S) -> f64 {
        self.0.behaviour.log_sum_exp(self.0.q.row(s.cell()), s)
    }
}

agent_of_table!(SoftQLearning, 0);

impl<S: Seen> Learn<S> for SoftQLearning {
    fn begin(&mut self, s: S) -> Action {
        let a = self.0.choose(s);
        self.0.play(s, a)
    }

    fn step(&mut self, reward: f64, next: S) -> Action {
        let value = self.value(next);
        let updated = self.0.s;
        self.0.update(reward, value);
        // The exponentials that V(S′) took are those of the choice, unless the update was of S′.
        if updated == next.cell() {
            return self.begin(next);
        }
        let a = self.0.behaviour.choose_weighed();
        self.0.play(next, a)
    }

    fn end(&mut self, reward: f64, last: Last<S>) {
        let value = match last {
            Last::Terminated => 0.0,
            Last::Truncated(next) => self.value(next),
        };
        self.0.update(reward, value);
        self.0.end_episode();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::{Agent, Schedule};
    use crate::mdp::math::ln;
    use crate::shaping::{ActionSet, Shielded};

    fn learner(values: Vec<f64>, temperature: f64) -> SoftQLearning {
        let alpha = AlphaSource::Schedule(Schedule::constant(0.5));
        let q = QTable::from_values(2, values);
        SoftQLearning::new(q, 0.9, alpha, temperature, Stream::new(0, "test"))
    }

    #[test]
    fn a_step_by_hand() {
        // V(1) = 2 ln (e^(2 ln 3 / 2) + e^0) = 2 ln 4, so the target is 10 + 0.9 * 2 ln 4.
        let mut agent = learner(vec![1.0, 1.0, 2.0 * ln(3.0), 0.0], 2.0);
        let a = agent.begin(0);
        agent.step(10.0, 1);
        let target = 10.0 + 0.9 * 2.0 * ln(4.0);
        assert!((agent.q().unwrap().get(0, a) - (1.0 + 0.5 * (target - 1.0))).abs() < 1e-14);
        // With the better action refused, V(1) = 2 ln e^0 = 0.
        let mut agent = learner(vec![1.0, 1.0, 2.0 * ln(3.0), 0.0], 2.0);
        let allowed = ActionSet(0b10);
        let a = agent.begin(Shielded { cell: 0, allowed });
        assert_eq!(a, 1);
        agent.end(10.0, Last::Truncated(Shielded { cell: 1, allowed }));
        assert!((agent.q().unwrap().get(0, 1) - (1.0 + 0.5 * (10.0 - 1.0))).abs() < 1e-15);
    }

    #[test]
    fn choices_are_by_the_updated_values() {
        // From state 1 back to it: the update takes all from the action played.
        let mut agent = learner(vec![0.0, 0.0, 50.0, 40.0], 0.1);
        assert_eq!(agent.begin(1), 0);
        assert_eq!(agent.step(-1000.0, 1), 1);
    }

    #[test]
    fn the_entropy_of_a_coin_is_worth_tau_ln_2() {
        // Both actions end the episode for nothing from state 1; getting there costs 1. In the
        // end Q(1, ·) = 0, so V(1) = τ ln 2 and Q(0, ·) = -1 + 0.9 τ ln 2.
        let mut agent = learner(vec![0.0; 4], 0.5);
        for _ in 0..400 {
            agent.begin(0);
            agent.step(-1.0, 1);
            agent.end(0.0, Last::<usize>::Terminated);
        }
        for a in 0..2 {
            assert!((agent.q().unwrap().get(0, a) - (-1.0 + 0.45 * ln(2.0))).abs() < 1e-12);
        }
    }
}
