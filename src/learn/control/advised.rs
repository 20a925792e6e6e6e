//! One-step learners that take advice on actions: look-ahead advice (Wiewiora, Cottrell & Elkan
//! 2003).
//!
//! Advice is a potential Φ(s, a) of states and actions. The learner adds
//! `F = γ Φ(S′, A′) − Φ(S, A)` to the reward, where A′ is the action that its target bootstraps
//! from, and Φ is 0 where S′ is terminal:
//!
//! `Q_F(S, A) ← Q_F(S, A) + α [R + F + γ Q_F(S′, A′) − Q_F(S, A)]`
//!
//! What it learns tends to `Q − Φ`, whose greedy action is another than that of Q: actions, those
//! bootstrapped from included, are therefore chosen by the corrected values `Q_F + Φ`. Those are
//! what [`Agent::q`] shows.

use super::{Tabular, td_error};
use crate::learn::greedy::argmax_exact;
use crate::learn::{Agent, Explore, Last, Learn, QTable, Rate, Seen};
use crate::mdp::Action;
use crate::shaping::potential_term;

/// What a one-step target bootstraps from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Backup {
    /// The best action: Q-learning.
    Best,
    /// The action that is played next: SARSA.
    Played,
    /// All actions, each as likely as it is played: expected SARSA, for which `Q_F(S′, A′)` and
    /// Φ(S′, A′) are expectations.
    Expected,
}

/// A one-step learner with look-ahead advice.
///
/// Deviation 1: as in [`Sarsa`](super::Sarsa), where an episode is truncated A′ is chosen from the
/// last state as anywhere else, bootstrapped from, and not played.
#[derive(Debug, Clone)]
pub struct Advised {
    backup: Backup,
    /// Q_F + Φ, kept up to date entry by entry; step size and behaviour.
    corrected: Tabular,
    /// What is learned: Q_F.
    learned: QTable,
    /// The advice, Φ(s, a).
    phi: QTable,
    /// The sum of F over the episode.
    shaping: f64,
}

impl Advised {
    /// The learner that `table` would make, with `phi`, of the same shape, for advice.
    pub fn new(backup: Backup, table: Tabular, phi: QTable) -> Self {
        let (learned, mut corrected) = (table.q.clone(), table);
        let sums = learned.values().iter().zip(phi.values()).map(|(q, phi)| q + phi);
        corrected.q = QTable::from_values(learned.n_actions(), sums.collect());
        Self { backup, corrected, learned, phi, shaping: 0.0 }
    }

    /// The values learned from shaped rewards, `Q_F`, without the correction.
    pub fn learned(&self) -> &QTable {
        &self.learned
    }

    /// What is bootstrapped from in `next`, Q_F and Φ, and the action if it is a single one.
    fn ahead<S: Seen>(&mut self, next: S) -> (f64, f64, Option<Action>) {
        let s = next.cell();
        let a = match self.backup {
            Backup::Best => argmax_exact(self.corrected.q.row(s), next),
            Backup::Played => self.corrected.choose(next),
            Backup::Expected => {
                let (policy, q) = (&mut self.corrected.behaviour, self.corrected.q.row(s));
                let learned = policy.mean(q, next, self.learned.row(s));
                return (learned, policy.mean(q, next, self.phi.row(s)), None);
            }
        };
        (self.learned.get(s, a), self.phi.get(s, a), Some(a))
    }

    /// Learns from `reward` and what is bootstrapped from.
    fn update(&mut self, reward: f64, q_next: f64, phi_next: f64) {
        let (s, a) = (self.corrected.s, self.corrected.a);
        let phi = self.phi.get(s, a);
        let f = potential_term(self.corrected.gamma, phi, phi_next);
        self.shaping += f;
        let alpha = self.corrected.alpha.visit(self.learned.pair(s, a));
        let q = self.learned.get_mut(s, a);
        *q += alpha * td_error(*q, reward + f, self.corrected.gamma, q_next);
        *self.corrected.q.get_mut(s, a) = *q + phi;
    }
}

impl Agent for Advised {
    fn gamma(&self) -> f64 {
        self.corrected.gamma
    }

    fn bootstraps_when_truncated(&self) -> bool {
        true
    }

    fn epsilon(&self) -> f64 {
        self.corrected.behaviour.epsilon()
    }

    fn q(&self) -> Option<&QTable> {
        Some(&self.corrected.q)
    }

    fn shaping(&self) -> f64 {
        self.shaping
    }
}

impl<S: Seen> Learn<S> for Advised {
    fn begin(&mut self, s: S) -> Action {
        self.shaping = 0.0;
        let a = self.corrected.choose(s);
        self.corrected.play(s, a)
    }

    fn step(&mut self, reward: f64, next: S) -> Action {
        let (q_next, phi_next, a) = self.ahead(next);
        self.update(reward, q_next, phi_next);
        let a = match (self.backup, a) {
            (Backup::Played, Some(a)) => a,
            _ => self.corrected.choose(next),
        };
        self.corrected.play(next, a)
    }

    fn end(&mut self, reward: f64, last: Last<S>) {
        let (q_next, phi_next) = match last {
            Last::Terminated => (0.0, 0.0),
            Last::Truncated(next) => {
                let (q_next, phi_next, _) = self.ahead(next);
                (q_next, phi_next)
            }
        };
        self.update(reward, q_next, phi_next);
        self.corrected.end_episode();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::{AlphaSource, Exploration, Schedule};
    use crate::mdp::streams::Stream;

    fn table(q: QTable, alpha: f64, epsilon: f64) -> Tabular {
        let alpha = AlphaSource::Schedule(Schedule::constant(alpha));
        let behaviour = (Exploration::EpsilonGreedy, Schedule::constant(epsilon));
        Tabular::new(q, 0.9, alpha, behaviour, Stream::new(0, "test"))
    }

    /// State 0: action 0 is worth 1 and ends; state 1 is worth 4 or 2.
    fn learner(backup: Backup, phi: Vec<f64>) -> Advised {
        let q = QTable::from_values(2, vec![0.0, 1.0, 4.0, 2.0]);
        Advised::new(backup, table(q, 0.5, 0.0), QTable::from_values(2, phi))
    }

    #[test]
    fn a_step_by_hand() {
        for backup in [Backup::Best, Backup::Played, Backup::Expected] {
            // Corrected: (3, 1) and (4, 7).
            let mut agent = learner(backup, vec![3.0, 0.0, 0.0, 5.0]);
            assert_eq!(agent.begin(0), 0, "by the corrected values");
            assert_eq!(agent.step(10.0, 1), 1);
            // F = 0.9 * 5 - 3 = 1.5; bootstrapped from Q_F(1, 1) = 2, not from the 4 beside it.
            assert_eq!(agent.learned().get(0, 0), 0.5 * (10.0 + 1.5 + 0.9 * 2.0));
            assert_eq!(agent.q().unwrap().get(0, 0), agent.learned().get(0, 0) + 3.0);
            agent.end(1.0, Last::<usize>::Terminated);
            // F = -5.
            assert_eq!(agent.learned().get(1, 1), 2.0 + 0.5 * (1.0 - 5.0 - 2.0));
            assert_eq!(agent.shaping(), 1.5 - 5.0);
            agent.begin(0);
            assert_eq!(agent.shaping(), 0.0, "an episode's own");
        }
    }

    #[test]
    fn the_target_of_a_truncated_state_keeps_its_advice() {
        let mut agent = learner(Backup::Best, vec![3.0, 0.0, 0.0, 5.0]);
        agent.begin(0);
        agent.end(10.0, Last::Truncated(1));
        assert_eq!(agent.learned().get(0, 0), 0.5 * (10.0 + 1.5 + 0.9 * 2.0));
    }

    /// Two arms paying 1 and 0, advice 2 for the first: Q_F = (-1, 0), whose greedy arm is wrong.
    #[test]
    fn a_bandit_by_hand() {
        let (zero, phi) = (QTable::new(1, 2, 0.0), QTable::from_values(2, vec![2.0, 0.0]));
        let mut agent = Advised::new(Backup::Best, table(zero, 1.0, 1.0), phi);
        for _ in 0..20 {
            let arm = agent.begin(0);
            agent.end([1.0, 0.0][arm], Last::<usize>::Terminated);
        }
        assert_eq!(agent.learned().values(), [-1.0, 0.0]);
        assert_eq!(agent.q().unwrap().values(), [1.0, 0.0]);
    }
}
