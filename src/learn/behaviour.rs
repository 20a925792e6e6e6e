//! Behaviour policies: how an agent that learns action values chooses what to play.
//!
//! Each depends on the differences of the values within a state only, so that adding a number to
//! all of them changes no choice (which is why shaping by a potential is the same as starting from
//! it, Wiewiora 2003), and each draws the same number of random numbers per choice whatever comes
//! of it, so that two learners with the same seed stay on the same stream.

use serde::Serialize;

use super::greedy::{argmax_allowed, pick_allowed};
use super::softmax::Softmax;
use super::ucb::Ucb;
use super::{Schedule, ScheduleState, Seen};
use crate::mdp::Action;
use crate::mdp::streams::Stream;

/// A behaviour policy over the values of a state's actions, shape `[n_actions]`.
pub trait Explore {
    /// Chooses among the actions that `s` allows.
    fn choose<S: Seen>(&mut self, q: &[f64], s: S) -> Action;

    /// Action `a` is what is played in row `s`.
    fn played(&mut self, _s: usize, _a: Action) {}

    /// `Σ_a π(a | s) x(a)`, π being what [`Self::choose`] would do now.
    fn mean<S: Seen>(&mut self, q: &[f64], s: S, x: &[f64]) -> f64;

    /// `Σ_a π(a | s) Q(s, a)`.
    #[inline]
    fn expected<S: Seen>(&mut self, q: &[f64], s: S) -> f64 {
        self.mean(q, s, q)
    }

    /// ε at present; 0 where there is none.
    fn epsilon(&self) -> f64;

    /// Tells a per-episode schedule that an episode has ended.
    fn end_episode(&mut self);
}

/// Which behaviour policy.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Exploration {
    /// With probability ε any action, else the greedy one.
    EpsilonGreedy,
    /// `π(a | s) ∝ exp(Q(s, a) / temperature)`.
    Softmax {
        /// In units of the values, above 0.
        temperature: f64,
    },
    /// The largest `Q(s, a) + c √(ln N(s) / N(s, a))`, actions never tried first.
    Ucb {
        /// In units of the values, 0 or more.
        c: f64,
    },
}

impl std::fmt::Display for Exploration {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::EpsilonGreedy => write!(f, "{:?}", Self::DEFAULT),
            Self::Softmax { temperature } => write!(f, "softmax({temperature:?})"),
            Self::Ucb { c } => write!(f, "ucb({c:?})"),
        }
    }
}

impl Exploration {
    /// How scripts call [`Self::EpsilonGreedy`].
    pub const DEFAULT: &'static str = "epsilon_greedy";
}

/// ε-greedy behaviour (Sutton & Barto 2018, section 2.2). Draws one 64-bit number per choice.
#[derive(Debug, Clone)]
pub struct EpsilonGreedy {
    epsilon: ScheduleState,
    stream: Stream,
}

impl EpsilonGreedy {
    /// ε by `schedule`, randomness from `stream`.
    pub fn new(schedule: Schedule, stream: Stream) -> Self {
        Self { epsilon: ScheduleState::new(schedule), stream }
    }

    /// How far it has come: what [`Self::restore`] needs.
    pub fn state(&self) -> (Stream, (u64, f64)) {
        (self.stream.clone(), self.epsilon.state())
    }

    /// As far as it was at [`Self::state`].
    pub fn restore(&mut self, (stream, epsilon): (Stream, (u64, f64))) {
        self.stream = stream;
        self.epsilon.restore(epsilon);
    }
}

impl Explore for EpsilonGreedy {
    #[inline]
    fn choose<S: Seen>(&mut self, q: &[f64], s: S) -> Action {
        let epsilon = self.epsilon.value();
        let u = self.stream.uniform();
        self.epsilon.step();
        if u < epsilon {
            // Given u < ε, u / ε is uniform in [0, 1): it picks the action without another draw.
            pick_allowed(q.len(), s, u / epsilon)
        } else {
            argmax_allowed(q, s)
        }
    }

    #[inline]
    fn mean<S: Seen>(&mut self, q: &[f64], s: S, x: &[f64]) -> f64 {
        let (mut sum, mut n) = (0.0, 0u32);
        for (a, &value) in x.iter().enumerate() {
            if s.allows(a) {
                sum += value;
                n += 1;
            }
        }
        let epsilon = self.epsilon.value();
        epsilon * (sum / f64::from(n)) + (1.0 - epsilon) * x[argmax_allowed(q, s)]
    }

    fn epsilon(&self) -> f64 {
        self.epsilon.value()
    }

    fn end_episode(&mut self) {
        self.epsilon.end_episode();
    }
}

/// Any of the behaviour policies, chosen per run.
#[derive(Debug, Clone)]
pub enum Behaviour {
    /// ε-greedy.
    EpsilonGreedy(EpsilonGreedy),
    /// Softmax with a fixed temperature.
    Softmax(Softmax),
    /// Upper confidence bounds.
    Ucb(Ucb),
}

impl Behaviour {
    /// The policy `exploration` for a table of `n_states` and `n_actions`; `epsilon` is of use to
    /// ε-greedy behaviour only.
    pub fn new(
        exploration: Exploration,
        epsilon: Schedule,
        [n_states, n_actions]: [usize; 2],
        stream: Stream,
    ) -> Self {
        match exploration {
            Exploration::EpsilonGreedy => Self::EpsilonGreedy(EpsilonGreedy::new(epsilon, stream)),
            Exploration::Softmax { temperature } => {
                Self::Softmax(Softmax::new(temperature, n_actions, stream))
            }
            Exploration::Ucb { c } => Self::Ucb(Ucb::new(c, n_states, n_actions)),
        }
    }
}

impl Explore for Behaviour {
    #[inline]
    fn choose<S: Seen>(&mut self, q: &[f64], s: S) -> Action {
        match self {
            Self::EpsilonGreedy(policy) => policy.choose(q, s),
            Self::Softmax(policy) => policy.choose(q, s),
            Self::Ucb(policy) => policy.choose(q, s),
        }
    }

    #[inline]
    fn played(&mut self, s: usize, a: Action) {
        if let Self::Ucb(policy) = self {
            policy.played(s, a);
        }
    }

    #[inline]
    fn mean<S: Seen>(&mut self, q: &[f64], s: S, x: &[f64]) -> f64 {
        match self {
            Self::EpsilonGreedy(policy) => policy.mean(q, s, x),
            Self::Softmax(policy) => policy.mean(q, s, x),
            Self::Ucb(policy) => policy.mean(q, s, x),
        }
    }

    fn epsilon(&self) -> f64 {
        match self {
            Self::EpsilonGreedy(policy) => policy.epsilon(),
            Self::Softmax(_) | Self::Ucb(_) => 0.0,
        }
    }

    fn end_episode(&mut self) {
        if let Self::EpsilonGreedy(policy) = self {
            policy.end_episode();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shaping::{ActionSet, Shielded};

    #[test]
    fn epsilon_greedy_explores_at_the_stated_rate_and_uniformly() {
        let mut b = EpsilonGreedy::new(Schedule::constant(0.4), Stream::new(1, "test"));
        let mut counts = [0u32; 4];
        for _ in 0..100_000 {
            counts[b.choose(&[0.0, 1.0, 0.0, 0.0], 0)] += 1;
        }
        // Each other action: 10 %, standard deviation 95; the greedy one 70 %.
        for a in [0, 2, 3] {
            assert!((9_400..10_600).contains(&counts[a]), "{counts:?}");
        }
        assert!((69_100..70_900).contains(&counts[1]), "{counts:?}");
    }

    #[test]
    fn one_draw_per_choice_whatever_the_branch() {
        let mut explorer = EpsilonGreedy::new(Schedule::constant(1.0), Stream::new(3, "test"));
        let mut miser = EpsilonGreedy::new(Schedule::constant(0.0), Stream::new(3, "test"));
        for _ in 0..100 {
            explorer.choose(&[0.0, 1.0], 0);
            miser.choose(&[0.0, 1.0], 0);
        }
        assert_eq!(explorer.stream.next_u64(), miser.stream.next_u64());
    }

    #[test]
    fn what_epsilon_greedy_expects_by_hand() {
        let mut b = EpsilonGreedy::new(Schedule::constant(0.4), Stream::new(0, "test"));
        // 0.4 * (1 + 2 + 6) / 3 + 0.6 * 6 = 1.2 + 3.6.
        assert!((b.expected(&[1.0, 2.0, 6.0], 0) - 4.8).abs() < 1e-15);
        // Without the last action: 0.4 * (1 + 2) / 2 + 0.6 * 2 = 0.6 + 1.2.
        let s = Shielded { cell: 0, allowed: ActionSet(0b011) };
        assert!((b.expected(&[1.0, 2.0, 6.0], s) - 1.8).abs() < 1e-15);
    }

    /// The mean value of what is chosen is what is expected, for every policy and shield.
    #[test]
    fn the_expectation_is_that_of_the_choices() {
        let q = [0.3, 1.1, -0.4, 0.9];
        let policies = [
            Exploration::EpsilonGreedy,
            Exploration::Softmax { temperature: 0.7 },
            Exploration::Ucb { c: 1.5 },
        ];
        for exploration in policies {
            for allowed in [ActionSet::ALL, ActionSet(0b1101), ActionSet(0b0100)] {
                let s = Shielded { cell: 0, allowed };
                let stream = Stream::new(8, "test");
                let mut b = Behaviour::new(exploration, Schedule::constant(0.3), [1, 4], stream);
                let expected = b.expected(&q, s);
                let n = 40_000;
                let mut sum = 0.0;
                for _ in 0..n {
                    let a = b.choose(&q, s);
                    assert!(s.allows(a), "{exploration:?} takes a refused action");
                    sum += q[a];
                }
                // The values spread by less than 0.6: the mean's standard error is below 0.003.
                let mean = sum / f64::from(n);
                assert!((mean - expected).abs() < 0.015, "{exploration:?}: {mean}, {expected}");
            }
        }
    }
}
