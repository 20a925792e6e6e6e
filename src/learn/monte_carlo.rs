//! On-policy Monte Carlo control (Sutton & Barto 2018, sections 5.3 and 5.4).
//!
//! `G ← γ G + R`, `Q(S, A) ← Q(S, A) + α [G − Q(S, A)]`, from the episode's last step to its first,
//! for the first visit of (S, A) in the episode or for every one. With α = 1 / N(S, A) the value is
//! the mean of the returns. The policy changes between episodes only.

use super::episode::{Episode, Visits};
use super::greedy::pick_allowed;
use super::{
    Agent, AlphaSource, Behaviour, Exploration, Explore, Last, Learn, QTable, Rate, Schedule, Seen,
    StepSize,
};
use crate::mdp::Action;
use crate::mdp::streams::Stream;

/// Monte Carlo control.
///
/// Deviation 1: the book's episodes end. One that the time limit cuts off counts with the rewards
/// that it had: there is nothing to bootstrap from.
#[derive(Debug, Clone)]
pub struct MonteCarlo {
    q: QTable,
    gamma: f64,
    alpha: StepSize,
    behaviour: Behaviour,
    visits: Visits,
    /// Draws the first action of every episode, if starts explore.
    starts: Option<Stream>,
    episode: Episode,
}

impl MonteCarlo {
    /// A learner with the table `q`; `behaviour` is the policy and the schedule of its ε, and draws
    /// from `stream`.
    pub fn new(
        q: QTable,
        gamma: f64,
        alpha: AlphaSource,
        behaviour: (Exploration, Schedule),
        visits: Visits,
        stream: Stream,
    ) -> Self {
        let n_entries = q.values().len();
        let (exploration, epsilon) = behaviour;
        let shape = [q.n_states(), q.n_actions()];
        Self {
            gamma,
            alpha: StepSize::new(alpha, n_entries),
            behaviour: Behaviour::new(exploration, epsilon, shape, stream),
            visits,
            starts: None,
            episode: Episode::new(n_entries),
            q,
        }
    }

    /// The same with a first action that `stream` draws uniformly from those allowed: one half of
    /// exploring starts. The other, a start state drawn from all, is not the agent's part.
    #[must_use]
    pub fn with_exploring_starts(self, stream: Stream) -> Self {
        Self { starts: Some(stream), ..self }
    }

    /// `a` is what is played in `s`.
    #[inline]
    fn play<S: Seen>(&mut self, s: S, a: Action) -> Action {
        self.behaviour.played(s.cell(), a);
        self.episode.visit(self.q.pair(s.cell(), a));
        a
    }
}

impl Agent for MonteCarlo {
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

impl<S: Seen> Learn<S> for MonteCarlo {
    fn begin(&mut self, s: S) -> Action {
        self.episode.begin();
        let row = self.q.row(s.cell());
        let a = match &mut self.starts {
            Some(stream) => pick_allowed(row.len(), s, stream.uniform()),
            None => self.behaviour.choose(row, s),
        };
        self.play(s, a)
    }

    #[inline]
    fn step(&mut self, reward: f64, next: S) -> Action {
        self.episode.reward(reward);
        let a = self.behaviour.choose(self.q.row(next.cell()), next);
        self.play(next, a)
    }

    fn end(&mut self, reward: f64, _last: Last<S>) {
        self.episode.reward(reward);
        let Self { episode, q, alpha, .. } = self;
        episode.returns(self.gamma, self.visits, |entry, g| {
            let alpha = alpha.visit(entry);
            let value = &mut q.values_mut()[entry];
            *value += alpha * (g - *value);
        });
        self.alpha.end_episode();
        self.behaviour.end_episode();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HALF: AlphaSource = AlphaSource::Schedule(Schedule::Constant { value: 0.5 });
    const MEAN: AlphaSource = AlphaSource::VisitCount { omega: 1.0 };

    fn learner(alpha: AlphaSource, visits: Visits) -> MonteCarlo {
        let q = QTable::from_values(2, vec![0.0, 1.0, 4.0, 2.0]);
        let behaviour = (Exploration::EpsilonGreedy, Schedule::constant(0.0));
        MonteCarlo::new(q, 0.5, alpha, behaviour, visits, Stream::new(0, "test"))
    }

    /// (0, 1) for 2, (1, 0) for 4, (0, 1) for 8 and the end: returns 6, 8, 8.
    fn play(agent: &mut MonteCarlo, last: Last) {
        assert_eq!(agent.begin(0), 1);
        assert_eq!(agent.step(2.0, 1), 0);
        // The policy does not change within an episode.
        assert_eq!(agent.step(4.0, 0), 1);
        agent.end(8.0, last);
    }

    #[test]
    fn an_episode_by_hand() {
        let mut every = learner(HALF, Visits::Every);
        play(&mut every, Last::Terminated);
        // The last visit first: 1 + (8 - 1) / 2 = 4.5, then 4.5 + (6 - 4.5) / 2.
        assert_eq!(every.q.values(), [0.0, 5.25, 6.0, 2.0]);
        let mut first = learner(HALF, Visits::First);
        play(&mut first, Last::Terminated);
        assert_eq!(first.q.values(), [0.0, 3.5, 6.0, 2.0]);
    }

    #[test]
    fn sample_averages_forget_the_initial_value() {
        let mut every = learner(MEAN, Visits::Every);
        play(&mut every, Last::Terminated);
        assert_eq!(every.q.values(), [0.0, 7.0, 8.0, 2.0]);
        let mut first = learner(MEAN, Visits::First);
        play(&mut first, Last::Terminated);
        assert_eq!(first.q.values(), [0.0, 6.0, 8.0, 2.0]);
        // The mean of 6 and of another first return of 10, from (0, 1) straight to the end.
        assert_eq!(first.begin(0), 1);
        first.end(10.0, Last::<usize>::Terminated);
        assert_eq!(first.q.get(0, 1), 8.0);
    }

    #[test]
    fn a_truncated_episode_counts_with_the_rewards_it_had() {
        let mut agent = learner(HALF, Visits::First);
        play(&mut agent, Last::Truncated(1));
        assert_eq!(agent.q.values(), [0.0, 3.5, 6.0, 2.0]);
        assert!(!agent.bootstraps_when_truncated());
    }

    #[test]
    fn exploring_starts_try_every_first_action_and_are_greedy_afterwards() {
        let mut agent =
            learner(HALF, Visits::First).with_exploring_starts(Stream::new(0, "starts"));
        let mut firsts = [0; 2];
        for _ in 0..200 {
            let before = agent.q.clone();
            firsts[agent.begin(0)] += 1;
            assert_eq!(agent.step(0.0, 1), 0);
            agent.end(0.0, Last::<usize>::Terminated);
            agent.q = before;
        }
        assert!(firsts.iter().all(|n| (70..130).contains(n)), "{firsts:?}");
    }
}
