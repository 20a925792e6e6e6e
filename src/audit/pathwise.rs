//! Whether every way from a state is paid the same: a test of shaping that needs no model.
//!
//! Along any trajectory the terms `F = γΦ(s′) − Φ(s)` telescope (Ng, Harada & Russell 1999),
//!
//! `Σ_{k<T} γᵏ F_k = γᵀ Φ(s_T) − Φ(s_0)`,
//!
//! and Φ is 0 beyond a terminal transition. So whatever is played from the same state, the sum is
//! `−Φ(s_0)` when the episode has terminated, and nearly so (γ < 1) once γᵀ is negligible. Two
//! trajectories from one state with different sums show that F is not potential-based; they are the
//! certificate. Agreement is no proof: it bounds, with a confidence of 95 %, how often trajectories
//! of the kind that was tried can disagree ([`rule_of_three`]).
//!
//! A sum over an episode that goes on is known up to `γᵀ |Φ(s_T)|`, which is at most
//! `γᵀ max|F| / (1 − γ)` if F is potential-based and is nowhere larger than it was seen to be.

mod play;
#[cfg(test)]
mod tests;

use serde::{Serialize, Serializer};

use crate::mdp::numpy::NumpyRng;
use crate::mdp::{Action, Ending, Env, Step, math};
use crate::shaping::{Fault, Transition};
use play::{Player, Trajectory};

/// What [`pathwise`] plays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathwiseSettings {
    /// The learner's discount factor γ.
    pub gamma: f64,
    /// Number of states to start from: in turn the first one of an episode, and one that an episode
    /// came to.
    pub starts: usize,
    /// The longest trajectory, in steps of the agent. Those that do not end on their own are shorter
    /// if less is enough for γᵀ to be negligible.
    pub longest: u32,
    /// The time limit of the episodes that are learned from, in steps of the environment. It cuts
    /// nothing off here, but `t.step` never exceeds what it allows.
    pub time_limit: Option<u32>,
    /// How many steps of the environment an action is repeated, 1 or more.
    pub frame_skip: u32,
    /// The seed of everything that is drawn.
    pub seed: u64,
}

impl PathwiseSettings {
    /// Twenty starts and trajectories of at most 5000 steps, without a time limit and without
    /// skipped frames.
    pub fn new(gamma: f64) -> Self {
        Self { gamma, starts: 20, longest: 5_000, time_limit: None, frame_skip: 1, seed: 0 }
    }

    /// Steps after which what is still to come is below 1e-14 of the largest F.
    fn horizon(&self) -> u32 {
        if self.gamma >= 1.0 {
            return self.longest;
        }
        let steps = math::ln((1.0 - self.gamma) * 1e-14) / math::ln(self.gamma);
        (steps.ceil() as u32).clamp(1, self.longest.max(1))
    }

    /// The largest `t.step` of an episode.
    fn last_step(&self) -> u32 {
        self.time_limit.map_or(u32::MAX, |limit| limit.div_ceil(self.frame_skip).max(1) - 1)
    }
}

/// What came of [`pathwise`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Pathwise {
    /// Trajectories that were played.
    pub trajectories: usize,
    /// How many of them have a sum that is known and could be compared with another one's from the
    /// same state: the N of [`Self::bound`].
    pub comparisons: usize,
    /// The largest difference of two sums from the same state, less what is not known of them.
    pub spread: f64,
    /// The largest sum of discounted |F|.
    pub scale: f64,
    /// What rounding can explain: sums that differ by more are different.
    pub tolerance: f64,
    /// Two trajectories from the same state with different sums, if there are any: F is not
    /// potential-based.
    pub violation: Option<Divergence>,
    /// A transition that is paid differently at different steps of an episode, if there is one: F is
    /// no function of the transition (it may still be a potential that changes with time).
    pub step_dependence: Option<StepDependence>,
}

impl Pathwise {
    /// With a confidence of 95 %, the most frequent that a disagreement can be among trajectories of
    /// this kind, if none was found.
    pub fn bound(&self) -> Option<f64> {
        self.violation.is_none().then(|| rule_of_three(self.comparisons))
    }
}

/// The upper end of the 95 % interval of a probability if none of `n` independent trials was a hit,
/// `3 / n` (Hanley & Lippman-Hand 1983); 1 if there were none to speak of.
pub fn rule_of_three(n: usize) -> f64 {
    if n == 0 { 1.0 } else { (3.0 / n as f64).min(1.0) }
}

/// One step of the agent: `action`, repeated over the skipped frames.
pub(super) fn advance<E: Env>(
    env: &mut E,
    action: Action,
    frame_skip: u32,
    rng: &mut NumpyRng,
) -> Step<E::Obs> {
    let mut step = env.step(action, rng);
    for _ in 1..frame_skip {
        if step.terminated {
            break;
        }
        let more = env.step(action, rng);
        step = Step { reward: step.reward + more.reward, ..more };
    }
    step
}

/// `f`, unless nothing can be said about it.
pub(super) fn finite(f: f64) -> Result<f64, Fault> {
    if f.is_finite() {
        return Ok(f);
    }
    Err(Fault(format!("what shaping adds to the reward is not finite: {f}").into()))
}

/// Two trajectories that should have been paid the same.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Divergence {
    /// The fields of the state from which both start.
    pub start: Vec<f64>,
    /// Which step of its episode that is.
    pub step: u32,
    /// The one with the smaller sum, and the other.
    pub trajectories: [Path; 2],
}

/// One trajectory of a [`Divergence`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Path {
    /// The actions, each with how often it is played in a row.
    pub actions: Vec<(Action, u32)>,
    /// Number of steps.
    pub steps: u32,
    /// `Σ γᵏ F_k`.
    pub sum: f64,
    /// What further steps could add to the sum, at most; 0 if it terminated.
    pub rest: f64,
    /// Terminated, or cut off here.
    #[serde(serialize_with = "word")]
    pub ending: Ending,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's signature")]
fn word<S: Serializer>(ending: &Ending, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(ending.as_str())
}

/// One transition, paid twice.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StepDependence {
    /// The fields of s.
    pub state: Vec<f64>,
    /// The action.
    pub action: Action,
    /// The fields of s′.
    pub next_state: Vec<f64>,
    /// Whether s′ is terminal.
    pub terminated: bool,
    /// Two steps of an episode (`t.step`), and F of the transition there.
    pub paid: [(u32, f64); 2],
}

/// Plays from many states, several trajectories from each, and compares their sums of `f`: the
/// reward learned from less the native one, the potential's part included, as the training loop
/// would compute it in the middle of an episode (nothing here is truncated).
///
/// From each state uniformly random actions are played, each action all the time (four at most),
/// and random actions held for a while, of 4, 16 and 64 steps on average. The trajectories of a
/// stochastic environment differ in its randomness too.
///
/// # Errors
/// If `f` fails or is not finite.
pub fn pathwise<E, F>(env: &E, settings: &PathwiseSettings, f: F) -> Result<Pathwise, Fault>
where
    E: Env + Clone,
    F: FnMut(&E, &Transition<'_, E::Obs>) -> Result<f64, Fault>,
{
    let mut player = Player::new(env, settings, f);
    let mut groups = Vec::with_capacity(settings.starts);
    for i in 0..settings.starts {
        groups.push(player.group(env, i)?);
    }
    // What is not known of a sum rests on the largest F of all trajectories.
    for trajectory in groups.iter_mut().flat_map(|group| &mut group.trajectories) {
        trajectory.path.rest *= player.largest;
    }
    let all = || groups.iter().flat_map(|group| &group.trajectories);
    let largest = |size: fn(&Trajectory) -> f64| all().map(size).fold(0.0, f64::max);
    let scale = largest(|t| t.size);
    // Rewards are rounded when F is added to them.
    let tolerance = 1e-9 * scale + 8.0 * f64::EPSILON * largest(|t| t.native);

    let (mut comparisons, mut spread) = (0, 0.0f64);
    for group in &groups {
        let known = group.trajectories.iter().filter(|t| t.path.rest <= tolerance).count();
        comparisons += known.saturating_sub(1);
        for (a, b) in pairs(&group.trajectories) {
            spread = spread.max(apart(&a.path, &b.path));
        }
    }
    // Of the clear cases the shortest, for it is to be read.
    let clear = tolerance.max(spread / 2.0);
    let violating = groups.iter().flat_map(|group| {
        pairs(&group.trajectories)
            .filter(|(a, b)| apart(&a.path, &b.path) > clear)
            .map(move |(a, b)| (group, &a.path, &b.path))
    });
    let violation = violating.min_by_key(|(_, a, b)| a.steps + b.steps).map(|(group, a, b)| {
        let (low, high) = if a.sum <= b.sum { (a, b) } else { (b, a) };
        Divergence {
            start: group.start.clone(),
            step: group.step,
            trajectories: [low.clone(), high.clone()],
        }
    });
    Ok(Pathwise {
        trajectories: all().count(),
        comparisons,
        spread,
        scale,
        tolerance,
        violation,
        step_dependence: player.step_dependence,
    })
}

/// The least that two sums differ.
fn apart(a: &Path, b: &Path) -> f64 {
    (a.sum - b.sum).abs() - a.rest - b.rest
}

fn pairs<T>(items: &[T]) -> impl Iterator<Item = (&T, &T)> {
    items.iter().enumerate().flat_map(|(i, a)| items[..i].iter().map(move |b| (a, b)))
}
