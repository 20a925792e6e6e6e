//! The trajectories of [`pathwise`](super::pathwise): where they start, what is played, what is
//! paid.

use super::{Path, PathwiseSettings, StepDependence, advance, finite};
use crate::mdp::numpy::NumpyRng;
use crate::mdp::streams::Stream;
use crate::mdp::{Action, Ending, Env, MAX_FIELDS};
use crate::shaping::{Fault, Transition};

/// Transitions between two at which `t.step` is varied; terminal ones always are.
const PROBE_INTERVAL: u32 = 16;
/// Actions that are played all the time, at most.
const ALWAYS: usize = 4;
/// How many steps random actions are held on average, each for two trajectories.
const HOLDS: [u32; 4] = [1, 4, 16, 64];

/// What is played.
#[derive(Debug, Clone, Copy)]
enum Policy {
    /// One action.
    Always(Action),
    /// Random actions, each held for a random number of steps with this mean.
    Held(u32),
}

/// A policy on its way.
struct Choice {
    policy: Policy,
    n_actions: usize,
    action: Action,
    left: u32,
}

impl Choice {
    fn new(policy: Policy, n_actions: usize) -> Self {
        Self { policy, n_actions, action: 0, left: 0 }
    }

    fn next(&mut self, stream: &mut Stream) -> Action {
        match self.policy {
            Policy::Always(action) => action,
            Policy::Held(mean) => {
                if self.left == 0 {
                    self.action = stream.below(self.n_actions);
                    self.left = 1 + stream.below(2 * mean as usize - 1) as u32;
                }
                self.left -= 1;
                self.action
            }
        }
    }
}

/// A trajectory and what its tolerance needs.
pub(super) struct Trajectory {
    /// `rest` is per unit of the largest F until that is known.
    pub(super) path: Path,
    /// `Σ γᵏ |F_k|`.
    pub(super) size: f64,
    /// `Σ γᵏ |r_k|` of the native rewards.
    pub(super) native: f64,
}

/// Trajectories from the same state.
pub(super) struct Group {
    pub(super) start: Vec<f64>,
    pub(super) step: u32,
    pub(super) trajectories: Vec<Trajectory>,
}

/// Plays and adds up.
pub(super) struct Player<'a, F> {
    settings: &'a PathwiseSettings,
    f: F,
    policies: Vec<Policy>,
    n_fields: usize,
    rng: NumpyRng,
    stream: Stream,
    /// The largest |F| so far.
    pub(super) largest: f64,
    pub(super) step_dependence: Option<StepDependence>,
}

impl<'a, F> Player<'a, F> {
    pub(super) fn new<E: Env>(env: &E, settings: &'a PathwiseSettings, f: F) -> Self {
        let n = env.n_actions();
        let fixed = n.min(ALWAYS);
        // The first and the last one, and some between.
        let always = (0..fixed).map(|i| Policy::Always(i * (n - 1) / (fixed - 1).max(1)));
        let held = HOLDS.into_iter().flat_map(|mean| [Policy::Held(mean); 2]);
        Self {
            settings,
            f,
            policies: always.chain(held).collect(),
            n_fields: env.schema().fields.len(),
            rng: NumpyRng::from_u64(settings.seed),
            stream: Stream::new(settings.seed, "audit pathwise"),
            largest: 0.0,
            step_dependence: None,
        }
    }

    /// Every policy from the `i`-th state.
    pub(super) fn group<E>(&mut self, env: &E, i: usize) -> Result<Group, Fault>
    where
        E: Env + Clone,
        F: FnMut(&E, &Transition<'_, E::Obs>) -> Result<f64, Fault>,
    {
        let start = self.start(env, i);
        let trajectories: Result<_, Fault> =
            self.policies.clone().into_iter().map(|policy| self.play(&start, policy)).collect();
        Ok(Group {
            start: self.fields(&start.env, &start.obs),
            step: start.step,
            trajectories: trajectories?,
        })
    }

    fn fields<E: Env>(&self, env: &E, obs: &E::Obs) -> Vec<f64> {
        let mut fields = [0.0; MAX_FIELDS];
        env.fields(obs, &mut fields);
        fields[..self.n_fields].to_vec()
    }

    /// The first state of an episode, or one that an episode of random actions comes to.
    fn start<E: Env + Clone>(&mut self, env: &E, i: usize) -> Start<E> {
        let mut env = env.clone();
        let obs = env.reset(&mut self.rng);
        let first = Start { env, obs, step: 0 };
        if i.is_multiple_of(2) {
            return first;
        }
        let policy = Policy::Held(HOLDS[i / 2 % HOLDS.len()]);
        let end = self.settings.last_step().min(self.settings.longest - 1);
        let (rng, stream) = (self.rng.clone(), self.stream.clone());
        let mut there = first.clone();
        self.wander(&mut there, policy, end);
        let stop = self.stream.below(there.step as usize + 1) as u32;
        // The same again, but not so far.
        let after =
            (std::mem::replace(&mut self.rng, rng), std::mem::replace(&mut self.stream, stream));
        let mut start = first;
        self.wander(&mut start, policy, stop);
        (self.rng, self.stream) = after;
        start
    }

    /// Plays to step `end` or the end of the episode, whose last step it does not count: the
    /// environment is beyond it then.
    fn wander<E: Env>(&mut self, at: &mut Start<E>, policy: Policy, end: u32) {
        let mut choice = Choice::new(policy, at.env.n_actions());
        while at.step < end {
            let action = choice.next(&mut self.stream);
            let step = advance(&mut at.env, action, self.settings.frame_skip, &mut self.rng);
            if step.terminated {
                break;
            }
            at.obs = step.obs;
            at.step += 1;
        }
    }

    fn play<E>(&mut self, start: &Start<E>, policy: Policy) -> Result<Trajectory, Fault>
    where
        E: Env + Clone,
        F: FnMut(&E, &Transition<'_, E::Obs>) -> Result<f64, Fault>,
    {
        let &PathwiseSettings { gamma, frame_skip, .. } = self.settings;
        let (horizon, last_step) = (self.settings.horizon(), self.settings.last_step());
        let Start { mut env, mut obs, .. } = start.clone();
        let mut choice = Choice::new(policy, env.n_actions());
        let mut actions: Vec<(Action, u32)> = Vec::new();
        let (mut sum, mut size, mut native, mut discount) = (0.0, 0.0, 0.0, 1.0);
        let mut steps = 0;
        loop {
            let action = choice.next(&mut self.stream);
            let step = advance(&mut env, action, frame_skip, &mut self.rng);
            let t = Transition {
                state: &obs,
                action,
                reward: step.reward,
                next_state: &step.obs,
                terminated: step.terminated,
                truncated: false,
                step: start.step.saturating_add(steps).min(last_step),
            };
            let f = self.paid(&env, &t)?;
            if self.step_dependence.is_none()
                && (t.terminated || steps.is_multiple_of(PROBE_INTERVAL))
            {
                self.probe(&env, &t, f)?;
            }
            match actions.last_mut() {
                Some((last, times)) if *last == action => *times += 1,
                _ => actions.push((action, 1)),
            }
            self.largest = self.largest.max(f.abs());
            sum += discount * f;
            size += discount * f.abs();
            native += discount * step.reward.abs();
            discount *= gamma;
            steps += 1;
            if step.terminated || steps >= horizon {
                let (ending, rest) = if step.terminated {
                    (Ending::Terminated, 0.0)
                } else {
                    (Ending::Truncated, discount / (1.0 - gamma))
                };
                let path = Path { actions, steps, sum, rest, ending };
                return Ok(Trajectory { path, size, native });
            }
            obs = step.obs;
        }
    }

    fn paid<E: Env>(&mut self, env: &E, t: &Transition<'_, E::Obs>) -> Result<f64, Fault>
    where
        F: FnMut(&E, &Transition<'_, E::Obs>) -> Result<f64, Fault>,
    {
        finite((self.f)(env, t)?)
    }

    /// Asks what the same transition is paid at other steps of an episode.
    fn probe<E: Env>(&mut self, env: &E, t: &Transition<'_, E::Obs>, f: f64) -> Result<(), Fault>
    where
        F: FnMut(&E, &Transition<'_, E::Obs>) -> Result<f64, Fault>,
    {
        let last = self.settings.last_step().min(2 * self.settings.longest);
        for step in [0, 1, last / 2, last] {
            let other = self.paid(env, &Transition { step, ..*t })?;
            let rounding = 1e-12 * f.abs().max(other.abs()) + 8.0 * f64::EPSILON * t.reward.abs();
            if (other - f).abs() > rounding {
                self.step_dependence = Some(StepDependence {
                    state: self.fields(env, t.state),
                    action: t.action,
                    next_state: self.fields(env, t.next_state),
                    terminated: t.terminated,
                    paid: [(t.step, f), (step, other)],
                });
                return Ok(());
            }
        }
        Ok(())
    }
}

/// A state to start from, with everything that the observation does not show.
#[derive(Clone)]
struct Start<E: Env> {
    env: E,
    obs: E::Obs,
    step: u32,
}
