//! Q-learning and SARSA on linear action values: semi-gradient, ε-greedy, with eligibility traces
//! or without.
//!
//! ```text
//! δ = R + γ v(S′) − q(S, A)
//! w ← w + α δ ∇q(S, A)      without traces (Sutton & Barto 2018, sections 10.1 and 11.1)
//! w ← w + α δ z             with traces (section 12.7)
//! ```

use super::{LinearQ, TraceKind, Traces};
use crate::learn::greedy::max_allowed;
use crate::learn::{Agent, Behaviour, Last, Learn, QTable, Schedule, ScheduleState, td_error};
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
    /// `q(S′, A′)`: SARSA. A′ is chosen before the update, and played.
    Sarsa,
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
    /// A learner that starts from `q`; exploration draws from `stream`.
    pub fn new(
        q: LinearQ,
        target: Target,
        gamma: f64,
        alpha: Schedule,
        epsilon: Schedule,
        stream: Stream,
    ) -> Self {
        let (s, next) = (q.features().active(), q.features().active());
        let row = vec![0.0; q.weights().n_actions()];
        let (alpha, behaviour) = (ScheduleState::new(alpha), Behaviour::new(epsilon, stream));
        Self { q, target, gamma, alpha, behaviour, traces: None, s, next, a: 0, row }
    }

    /// The same with eligibility traces that fade by `γλ`.
    ///
    /// # Panics
    /// If traces are to be replacing and the features are not binary.
    pub fn with_traces(mut self, kind: TraceKind, lambda: f64) -> Self {
        let is_defined = kind != TraceKind::Replacing || self.q.features().is_binary();
        assert!(is_defined, "replacing traces are defined for binary features only");
        self.traces = Some(Traces::new(kind, &self.q, self.gamma, lambda));
        self
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

    /// The state looked at is where `a` is played.
    #[inline]
    fn play(&mut self, a: Action) -> Action {
        std::mem::swap(&mut self.s, &mut self.next);
        self.a = a;
        a
    }

    /// `w ← w + α δ ∇q(S, A)`, or along the traces.
    #[inline]
    fn update(&mut self, reward: f64, next_value: f64) {
        let alpha = self.alpha.value();
        let q = self.q.value(&self.s, self.a);
        let size = alpha * td_error(q, reward, self.gamma, next_value);
        match &mut self.traces {
            None => self.q.learn(&self.s, self.a, size),
            Some(traces) => {
                traces.raise(&self.s, self.a, alpha);
                traces.learn(&mut self.q, size);
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
        let a = match self.target {
            Target::Sarsa => {
                let a = self.choose(next);
                self.update(reward, self.row[a]);
                a
            }
            Target::Max => {
                self.update(reward, max_allowed(&self.row, next));
                // The update may have changed the values here too.
                self.q.values(&self.next, &mut self.row);
                self.choose(next)
            }
        };
        self.play(a)
    }

    fn end(&mut self, reward: f64, last: Last<Fields>) {
        let value = match last {
            Last::Terminated => 0.0,
            Last::Truncated(next) => {
                self.look(&next);
                match self.target {
                    Target::Sarsa => {
                        let a = self.choose(next);
                        self.row[a]
                    }
                    Target::Max => max_allowed(&self.row, next),
                }
            }
        };
        self.update(reward, value);
        if let Some(traces) = &mut self.traces {
            traces.clear();
        }
        self.alpha.end_episode();
        self.behaviour.end_episode();
    }
}
