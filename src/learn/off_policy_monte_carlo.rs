//! Off-policy Monte Carlo control by weighted importance sampling (Sutton & Barto 2018, section
//! 5.7).
//!
//! Target policy: greedy. Behaviour: ε-greedy, the same for the whole episode. From the episode's
//! last step to its first, starting with `G = 0` and `W = 1`:
//!
//! `G ← γ G + R`, `C(S, A) ← C(S, A) + W`, `Q(S, A) ← Q(S, A) + W / C(S, A) [G − Q(S, A)]`;
//! unless A is greedy in S, stop; `W ← W / b(A | S)`.
//!
//! Hence it learns from the tails of episodes only, from the last exploring action on.

use super::greedy::argmax_allowed;
use super::{Agent, EpsilonGreedy, Explore, Last, Learn, QTable, Schedule, Seen};
use crate::mdp::Action;
use crate::mdp::streams::Stream;
use crate::shaping::{ActionSet, Shielded};

/// A step of the present episode.
#[derive(Debug, Clone, Copy)]
struct Decision {
    s: Shielded,
    a: Action,
    /// b(A | S).
    probability: f64,
    reward: f64,
}

/// Off-policy Monte Carlo control.
///
/// Deviation 1: an episode that the time limit cuts off counts with the rewards that it had.
#[derive(Debug, Clone)]
pub struct OffPolicyMonteCarlo {
    q: QTable,
    /// The sum of the weights so far, one per entry of `q`.
    weights: Vec<f64>,
    gamma: f64,
    behaviour: EpsilonGreedy,
    episode: Vec<Decision>,
}

impl OffPolicyMonteCarlo {
    /// A learner with the table `q`; the behaviour draws from `stream`.
    pub fn new(q: QTable, gamma: f64, epsilon: Schedule, stream: Stream) -> Self {
        Self {
            weights: vec![0.0; q.values().len()],
            q,
            gamma,
            behaviour: EpsilonGreedy::new(epsilon, stream),
            episode: Vec::new(),
        }
    }

    #[inline]
    fn play<S: Seen>(&mut self, s: S) -> Action {
        let row = self.q.row(s.cell());
        let n_allowed =
            if S::SHIELDED { (0..row.len()).filter(|&a| s.allows(a)).count() } else { row.len() };
        let epsilon = self.behaviour.epsilon();
        let greedy = argmax_allowed(row, s);
        let a = self.behaviour.choose(row, s);
        let explored = epsilon / n_allowed as f64;
        let probability = if a == greedy { 1.0 - epsilon + explored } else { explored };
        let allowed = if S::SHIELDED { allowed(s, row.len()) } else { ActionSet::ALL };
        let s = Shielded { cell: s.cell(), allowed };
        self.episode.push(Decision { s, a, probability, reward: 0.0 });
        a
    }

    fn reward(&mut self, reward: f64) {
        if let Some(last) = self.episode.last_mut() {
            last.reward = reward;
        }
    }
}

/// The actions that `s` allows.
fn allowed<S: Seen>(s: S, n_actions: usize) -> ActionSet {
    let n = n_actions.min(ActionSet::CAPACITY);
    ActionSet((0..n).fold(0, |set, a| set | u64::from(s.allows(a)) << a))
}

impl Agent for OffPolicyMonteCarlo {
    fn gamma(&self) -> f64 {
        self.gamma
    }

    fn bootstraps_when_truncated(&self) -> bool {
        false
    }

    fn epsilon(&self) -> f64 {
        self.behaviour.epsilon()
    }

    fn q(&self) -> Option<&QTable> {
        Some(&self.q)
    }
}

impl<S: Seen> Learn<S> for OffPolicyMonteCarlo {
    fn begin(&mut self, s: S) -> Action {
        self.episode.clear();
        self.play(s)
    }

    #[inline]
    fn step(&mut self, reward: f64, next: S) -> Action {
        self.reward(reward);
        self.play(next)
    }

    fn end(&mut self, reward: f64, _last: Last<S>) {
        self.reward(reward);
        let (mut g, mut w) = (0.0, 1.0);
        for &Decision { s, a, probability, reward } in self.episode.iter().rev() {
            g = reward + self.gamma * g;
            let weight = &mut self.weights[self.q.pair(s.cell, a)];
            *weight += w;
            let value = self.q.get_mut(s.cell, a);
            *value += w / *weight * (g - *value);
            if argmax_allowed(self.q.row(s.cell), s) != a {
                break;
            }
            w /= probability;
        }
        self.behaviour.end_episode();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With ε = 1/2 and two actions: b = 3/4 for the greedy one, 1/4 for the other.
    fn learner() -> OffPolicyMonteCarlo {
        let q = QTable::from_values(2, vec![0.0, 1.0, 4.0, 2.0]);
        OffPolicyMonteCarlo::new(q, 0.5, Schedule::constant(0.5), Stream::new(0, "test"))
    }

    /// Plays 0, 1, 0 until the actions are `wanted`, then ends the episode: rewards 2, 4, 8, hence
    /// returns 6, 8, 8. Returns the table.
    fn play(agent: &mut OffPolicyMonteCarlo, wanted: [Action; 3]) -> Vec<f64> {
        loop {
            let actions = [agent.begin(0), agent.step(2.0, 1), agent.step(4.0, 0)];
            if actions == wanted {
                agent.end(8.0, Last::<usize>::Terminated);
                return agent.q.values().to_vec();
            }
        }
    }

    #[test]
    fn an_episode_by_hand() {
        let mut agent = learner();
        // Greedy throughout. (0, 1): C = 1, Q = 8, W = 4/3; (1, 0): C = 4/3, Q = 8, W = 16/9;
        // (0, 1) again: C = 25/9, Q = 8 + (16/25) (6 - 8).
        let q = play(&mut agent, [1, 0, 1]);
        assert_eq!((q[0], q[2], q[3]), (0.0, 8.0, 2.0));
        assert!((q[1] - 6.72).abs() < 1e-12, "{q:?}");
        assert!((agent.weights[1] - 25.0 / 9.0).abs() < 1e-12);
    }

    #[test]
    fn what_came_before_an_exploring_action_teaches_nothing() {
        let mut agent = learner();
        // (1, 1) explores: it learns 8, which makes it greedy by then, so that the tail goes on
        // with W = 4/3 / (1/4).
        let q = play(&mut agent, [1, 1, 1]);
        assert_eq!((q[2], q[3]), (4.0, 8.0));
        assert!((agent.weights[1] - (1.0 + 16.0 / 3.0)).abs() < 1e-12);
        // (0, 0) explores and stays worse than (0, 1): the tail ends there.
        let mut agent = learner();
        agent.q = QTable::from_values(2, vec![0.0, 100.0, 4.0, 2.0]);
        let q = play(&mut agent, [1, 0, 0]);
        assert_eq!(q, [8.0, 100.0, 4.0, 2.0]);
    }

    #[test]
    fn refused_actions_are_not_greedy() {
        let mut agent = learner();
        let only_first = Shielded { cell: 0, allowed: ActionSet(0b01) };
        assert_eq!(agent.begin(only_first), 0);
        assert_eq!(agent.step(1.0, only_first), 0);
        agent.end(1.0, Last::<Shielded>::Terminated);
        // Both steps count, each with b = 1: the mean of 1 and 1.5.
        assert_eq!(agent.q.get(0, 0), 1.25);
    }
}
