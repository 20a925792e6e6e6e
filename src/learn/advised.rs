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

use super::greedy::argmax_exact;
use super::{Agent, Behaviour, Last, Learn, QTable, Schedule, ScheduleState, Seen, td_error};
use crate::mdp::Action;
use crate::mdp::streams::Stream;
use crate::shaping::potential_term;

/// Which action a one-step target bootstraps from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Backup {
    /// The best one: Q-learning.
    Best,
    /// The one that is played next: SARSA.
    Played,
}

/// A one-step learner with look-ahead advice.
///
/// Deviation 1: as in [`Sarsa`](super::Sarsa), where an episode is truncated A′ is chosen from the
/// last state as anywhere else, bootstrapped from, and not played.
#[derive(Debug, Clone)]
pub struct Advised {
    backup: Backup,
    /// What is learned: Q_F.
    learned: QTable,
    /// The advice, Φ(s, a).
    phi: QTable,
    /// Q_F + Φ, kept up to date entry by entry.
    corrected: QTable,
    gamma: f64,
    alpha: ScheduleState,
    behaviour: Behaviour,
    s: usize,
    a: Action,
    /// The sum of F over the episode.
    shaping: f64,
}

impl Advised {
    /// A learner that starts with `learned` and is advised by `phi`, a table of the same shape;
    /// exploration draws from `stream`.
    pub fn new(
        backup: Backup,
        learned: QTable,
        phi: QTable,
        gamma: f64,
        alpha: Schedule,
        epsilon: Schedule,
        stream: Stream,
    ) -> Self {
        let sums = learned.values().iter().zip(phi.values()).map(|(q, phi)| q + phi);
        let corrected = QTable::from_values(learned.n_actions(), sums.collect());
        let (alpha, behaviour) = (ScheduleState::new(alpha), Behaviour::new(epsilon, stream));
        Self { backup, learned, phi, corrected, gamma, alpha, behaviour, s: 0, a: 0, shaping: 0.0 }
    }

    /// The values learned from shaped rewards, `Q_F`, without the correction.
    pub fn learned(&self) -> &QTable {
        &self.learned
    }

    fn choose<S: Seen>(&mut self, s: S) -> Action {
        self.behaviour.choose(self.corrected.row(s.cell()), s)
    }

    /// Learns from `reward` and the bootstrap from `next`, `None` where that is terminal.
    fn update(&mut self, reward: f64, next: Option<(usize, Action)>) {
        let (q_next, phi_next) = match next {
            Some((s, a)) => (self.learned.get(s, a), self.phi.get(s, a)),
            None => (0.0, 0.0),
        };
        let phi = self.phi.get(self.s, self.a);
        let f = potential_term(self.gamma, phi, phi_next);
        self.shaping += f;
        let q = self.learned.get_mut(self.s, self.a);
        *q += self.alpha.value() * td_error(*q, reward + f, self.gamma, q_next);
        *self.corrected.get_mut(self.s, self.a) = *q + phi;
        self.alpha.step();
    }

    fn play<S: Seen>(&mut self, s: S, a: Action) -> Action {
        (self.s, self.a) = (s.cell(), a);
        a
    }

    /// The action bootstrapped from in `next`.
    fn ahead<S: Seen>(&mut self, next: S) -> Action {
        match self.backup {
            Backup::Best => argmax_exact(self.corrected.row(next.cell()), next),
            Backup::Played => self.choose(next),
        }
    }
}

impl Agent for Advised {
    fn gamma(&self) -> f64 {
        self.gamma
    }

    fn bootstraps_when_truncated(&self) -> bool {
        true
    }

    fn epsilon(&self) -> f64 {
        self.behaviour.epsilon()
    }

    fn q(&self) -> Option<&QTable> {
        Some(&self.corrected)
    }

    fn shaping(&self) -> f64 {
        self.shaping
    }
}

impl<S: Seen> Learn<S> for Advised {
    fn begin(&mut self, s: S) -> Action {
        self.shaping = 0.0;
        let a = self.choose(s);
        self.play(s, a)
    }

    fn step(&mut self, reward: f64, next: S) -> Action {
        let ahead = self.ahead(next);
        self.update(reward, Some((next.cell(), ahead)));
        let a = match self.backup {
            Backup::Best => self.choose(next),
            Backup::Played => ahead,
        };
        self.play(next, a)
    }

    fn end(&mut self, reward: f64, last: Last<S>) {
        let next = match last {
            Last::Terminated => None,
            Last::Truncated(next) => Some((next.cell(), self.ahead(next))),
        };
        self.update(reward, next);
        self.alpha.end_episode();
        self.behaviour.end_episode();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// State 0: action 0 is worth 1 and ends; state 1 is worth 4 or 2.
    fn learner(backup: Backup, phi: Vec<f64>) -> Advised {
        let q = QTable::from_values(2, vec![0.0, 1.0, 4.0, 2.0]);
        let (alpha, epsilon) = (Schedule::constant(0.5), Schedule::constant(0.0));
        let phi = QTable::from_values(2, phi);
        Advised::new(backup, q, phi, 0.9, alpha, epsilon, Stream::new(0, "test"))
    }

    #[test]
    fn a_step_by_hand() {
        for backup in [Backup::Best, Backup::Played] {
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
        let (alpha, epsilon) = (Schedule::constant(1.0), Schedule::constant(1.0));
        let (zero, phi) = (QTable::new(1, 2, 0.0), QTable::from_values(2, vec![2.0, 0.0]));
        let stream = Stream::new(0, "test");
        let mut agent = Advised::new(Backup::Best, zero, phi, 0.9, alpha, epsilon, stream);
        for _ in 0..20 {
            let arm = agent.begin(0);
            agent.end([1.0, 0.0][arm], Last::<usize>::Terminated);
        }
        assert_eq!(agent.learned().values(), [-1.0, 0.0]);
        assert_eq!(agent.q().unwrap().values(), [1.0, 0.0]);
    }
}
