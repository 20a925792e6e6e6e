//! Q-learning and SARSA on linear action values: semi-gradient, with eligibility traces or without.
//!
//! ```text
//! δ = R + γ v(S′) − q(S, A)
//! w ← w + α δ ∇q(S, A)      without traces (Sutton & Barto 2018, sections 10.1 and 11.1)
//! w ← w + α δ z             with traces (sections 12.7 and 12.10)
//! ```
//!
//! z fades by γλ, and a visit adds x to it (accumulating), sets it to 1 where x is 1 (replacing), or
//! adds `(1 − α zᵀx) x` (dutch), z having faded.

use super::LinearQ;
use crate::learn::control::{Trace, Traces};
use crate::learn::greedy::{is_greedy, max_allowed};
use crate::learn::{
    Agent, Behaviour, Explore, Last, Learn, QTable, Schedule, ScheduleState, td_error,
};
use crate::mdp::Action;
use crate::mdp::streams::Stream;
use crate::shaping::{Active, Features, Fields};

/// What a learner on linear values is built for.
#[derive(Debug)]
pub struct LinearSetup {
    /// The features.
    pub features: Features,
    /// Number of actions.
    pub n_actions: usize,
    /// Its randomness.
    pub stream: Stream,
}

/// What is bootstrapped from, v(S′).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// `max_a q(S′, a)`: Q-learning. A′ is chosen after the update, as in tables.
    Max,
    /// The same, A′ being chosen before the update; if it is not greedy, traces end: Watkins's Q(λ).
    Watkins,
    /// `q(S′, A′)`: SARSA. A′ is chosen before the update, and played.
    Sarsa,
    /// `Σ_a π(a | S′) q(S′, a)`: expected SARSA. A′ is chosen after the update.
    Expected,
}

/// A learner on linear action values.
///
/// Deviation 1: the step size α is divided among the features, so that it means the same as in a
/// table: by the number of tilings, or by each Fourier feature's `‖c‖`.
///
/// Deviation 2: where an episode is truncated, the book has no rule; SARSA's A′ is chosen from the
/// last state as anywhere else, bootstrapped from, and not played.
#[derive(Debug, Clone)]
pub struct LinearLearner {
    q: LinearQ,
    target: Target,
    gamma: f64,
    alpha: ScheduleState,
    behaviour: Behaviour,
    traces: Option<Traces>,
    /// The features of S, and of S′.
    s: Active,
    next: Active,
    a: Action,
    /// The action values of the state looked at.
    row: Vec<f64>,
}

impl LinearLearner {
    /// A learner that starts from `q`.
    pub fn new(
        q: LinearQ,
        target: Target,
        gamma: f64,
        alpha: Schedule,
        behaviour: Behaviour,
    ) -> Self {
        let (s, next) = (q.features().active(), q.features().active());
        let row = vec![0.0; q.weights().n_actions()];
        let alpha = ScheduleState::new(alpha);
        Self { q, target, gamma, alpha, behaviour, traces: None, s, next, a: 0, row }
    }

    /// The same with eligibility traces, one per weight.
    ///
    /// # Panics
    /// If traces are replacing and the features are not binary.
    #[must_use]
    pub fn with_traces(self, traces: Traces) -> Self {
        let is_defined = traces.kind() != Trace::Replacing || self.q.features().is_binary();
        assert!(is_defined, "replacing traces are defined for binary features only");
        Self { traces: Some(traces), ..self }
    }

    /// Looks at the state `s`: its features, and its action values.
    #[inline]
    fn look(&mut self, s: &Fields) {
        self.q.features().see(&s.values, &mut self.next);
        self.q.values(&self.next, &mut self.row);
    }

    /// Chooses an action in the state looked at.
    #[inline]
    fn choose(&mut self, s: Fields) -> Action {
        self.behaviour.choose(&self.row, s)
    }

    /// `z ← 0`.
    #[inline]
    fn forget(&mut self) {
        if let Some(traces) = &mut self.traces {
            traces.clear();
        }
    }

    /// The state looked at is where `a` is played.
    #[inline]
    fn play(&mut self, a: Action) -> Action {
        std::mem::swap(&mut self.s, &mut self.next);
        self.a = a;
        a
    }

    /// What is bootstrapped from in the state looked at, and the next action if it is chosen before
    /// the update.
    #[inline]
    fn target(&mut self, next: Fields) -> (f64, Option<Action>) {
        let row = &self.row;
        match self.target {
            Target::Max => (max_allowed(row, next), None),
            Target::Expected => (self.behaviour.expected(row, next), None),
            Target::Watkins => (max_allowed(row, next), Some(self.behaviour.choose(row, next))),
            Target::Sarsa => {
                let a = self.behaviour.choose(row, next);
                (row[a], Some(a))
            }
        }
    }

    /// `w ← w + α δ ∇q(S, A)`, or along the traces.
    #[inline]
    fn update(&mut self, reward: f64, next_value: f64) {
        let Self { q, s, a, .. } = self;
        let alpha = self.alpha.value();
        let size = alpha * td_error(q.value(s, *a), reward, self.gamma, next_value);
        match &mut self.traces {
            None => q.learn(s, *a, size),
            Some(traces) => {
                q.raise(traces, s, *a, alpha);
                q.learn_along(traces, size);
            }
        }
        self.alpha.step();
    }
}

impl Agent for LinearLearner {
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
        None
    }

    fn weights(&self) -> Option<&QTable> {
        Some(self.q.weights())
    }
}

impl Learn<Fields> for LinearLearner {
    fn begin(&mut self, s: Fields) -> Action {
        self.look(&s);
        let a = self.choose(s);
        self.play(a)
    }

    fn step(&mut self, reward: f64, next: Fields) -> Action {
        self.look(&next);
        let (value, chosen) = self.target(next);
        self.update(reward, value);
        if let Some(a) = chosen {
            if self.target == Target::Watkins && !is_greedy(&self.row, next, a) {
                self.forget();
            }
            return self.play(a);
        }
        // The update may have changed the values here too.
        self.q.values(&self.next, &mut self.row);
        let a = self.choose(next);
        self.play(a)
    }

    fn end(&mut self, reward: f64, last: Last<Fields>) {
        let value = match last {
            Last::Terminated => 0.0,
            Last::Truncated(next) => {
                self.look(&next);
                match self.target {
                    // Nothing is played here.
                    Target::Watkins => max_allowed(&self.row, next),
                    _ => self.target(next).0,
                }
            }
        };
        self.update(reward, value);
        self.forget();
        self.alpha.end_episode();
        self.behaviour.end_episode();
    }
}
