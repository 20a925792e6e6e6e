//! The training loop.

use std::sync::atomic::{AtomicBool, Ordering};

use super::record::EpisodeRow;
use super::starts::Starts;
use crate::learn::dqn::Dqn;
use crate::learn::{Last, Learn, Seen};
use crate::mdp::numpy::NumpyRng;
use crate::mdp::{Action, Ending, Env, Step};
use crate::shaping::{Discretiser, Fault, Potential, RewardModel, Transition, potential_term};
use crate::stats::is_solved;

/// Everything an agent meets, seen through a discretiser and a reward model.
pub struct World<E, D, P, R> {
    /// The environment.
    pub env: E,
    /// Observation → cell.
    pub discretiser: D,
    /// Φ.
    pub potential: P,
    /// The learned reward before shaping.
    pub reward: R,
}

/// How much is played.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Number of episodes.
    pub episodes: u32,
    /// Steps after which an episode is truncated.
    pub max_steps: Option<u32>,
    /// Number of extra reward terms.
    pub n_terms: usize,
    /// How many steps of the environment an action is repeated, 1 or more. `max_steps` counts the
    /// environment's steps, an episode's own steps are the agent's.
    pub frame_skip: u32,
    /// The range to which the learned reward is clipped before the potential's part is added.
    pub clip_reward: Option<[f64; 2]>,
    /// Draws the first state of every episode from all that the environment's model can reach, by
    /// a stream of this seed, instead of the environment's own.
    pub exploring_starts: Option<u64>,
    /// Ends training before all episodes are played.
    pub stop_when: Option<Solved>,
}

/// When a task counts as solved: after the first episode at which the mean of the native returns of
/// the last `window` ones is at least `threshold`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solved {
    /// The mean return.
    pub threshold: f64,
    /// Number of episodes, 1 or more.
    pub window: usize,
}

impl Limits {
    /// One episode without a time limit, and nothing out of the ordinary.
    pub const EPISODE: Self = Self {
        episodes: 1,
        max_steps: None,
        n_terms: 0,
        frame_skip: 1,
        clip_reward: None,
        exploring_starts: None,
        stop_when: None,
    };
}

/// Why training ended early.
#[derive(Debug)]
pub enum TrainError {
    /// A callback failed, in this episode and step (both from 0).
    Fault {
        /// What happened.
        fault: Fault,
        /// Episode.
        episode: u32,
        /// Step of the episode.
        step: u32,
    },
    /// The learned return of this episode (from 0) is not finite: rewards or potentials are so
    /// large that sums of them overflow, and what is learned from them means nothing.
    NotFinite {
        /// Episode.
        episode: u32,
    },
    /// The loss of a network stopped being finite.
    Diverged {
        /// In this episode, from 0.
        episode: u32,
        /// At this step of the run, from 1.
        step: u64,
    },
    /// The run was asked to stop.
    Interrupted,
}

/// Steps between looks at the stop flag in an endless episode.
const STOP_INTERVAL: u32 = 1 << 16;

/// Plays `limits.episodes` episodes, or up to the one that solves the task where
/// `limits.stop_when` asks for that, teaching `agent`; calls `each` after every one, with the agent
/// as it is by then.
///
/// The reward learned from is `reward(t) + γΦ(s′) − Φ(s)`, with Φ(s′) = 0 on termination. On
/// truncation Φ(s′) is kept if and only if the agent bootstraps from s′: both sides must speak of
/// the same continuation, or the fixed point moves. What the agent adds itself
/// ([`Agent::shaping`](crate::learn::Agent::shaping)) is counted with it.
///
/// # Errors
/// If a callback fails, returns or a network's loss stop being finite, or `stop` is raised.
pub fn train<E, D, P, R, A>(
    world: &mut World<E, D, P, R>,
    agent: &mut A,
    limits: Limits,
    rng: &mut NumpyRng,
    stop: &AtomicBool,
    mut each: impl FnMut(EpisodeRow, &A),
) -> Result<(), TrainError>
where
    E: Env,
    D: Discretiser<E>,
    P: Potential<E>,
    R: RewardModel<E>,
    A: Learn<D::State>,
{
    go_on(world, agent, limits, &[], rng, stop, |row, agent, _| each(row, agent))
}

/// Goes on with what [`train`] has begun, `past` being the native returns of the episodes that were
/// played by then: agent and generator are as they were after the last of them. `each` sees the
/// generator as well.
///
/// # Errors
/// As [`train`].
pub(super) fn go_on<E, D, P, R, A>(
    world: &mut World<E, D, P, R>,
    agent: &mut A,
    limits: Limits,
    past: &[f64],
    rng: &mut NumpyRng,
    stop: &AtomicBool,
    mut each: impl FnMut(EpisodeRow, &A, &NumpyRng),
) -> Result<(), TrainError>
where
    E: Env,
    D: Discretiser<E>,
    P: Potential<E>,
    R: RewardModel<E>,
    A: Learn<D::State>,
{
    let mut starts = limits.exploring_starts.and_then(|seed| Starts::new(&world.env, seed));
    let mut returns = past.to_vec();
    let solved = |returns: &[f64]| {
        limits.stop_when.is_some_and(|s| is_solved(returns, s.window, s.threshold))
    };
    // A crash may have come between the episode that solved the task and its being stored.
    if solved(&returns) {
        return Ok(());
    }
    for episode in past.len() as u32..limits.episodes {
        if stop.load(Ordering::Relaxed) {
            return Err(TrainError::Interrupted);
        }
        world.potential.begin_episode(episode + 1);
        match play(world, agent, limits, starts.as_mut(), rng, stop) {
            Ok(row) if !row.learned.is_finite() => return Err(TrainError::NotFinite { episode }),
            Ok(row) => {
                let native = row.native;
                each(row, agent, rng);
                if let Some(step) = agent.dqn().and_then(Dqn::failed_at) {
                    return Err(TrainError::Diverged { episode, step });
                }
                returns.push(native);
                if solved(&returns) {
                    break;
                }
            }
            Err((None, _)) => return Err(TrainError::Interrupted),
            Err((Some(fault), step)) => return Err(TrainError::Fault { fault, episode, step }),
        }
    }
    Ok(())
}

/// Plays `action` up to `times` more, to the end of the episode at most, and adds the rewards up in
/// `s`. Returns how often it was played.
///
/// Out of line, so that the step of an episode without skipped frames stays the one that the
/// compiler puts into the loop.
#[cold]
#[inline(never)]
fn repeat<E: Env>(
    env: &mut E,
    action: Action,
    times: u32,
    s: &mut Step<E::Obs>,
    rng: &mut NumpyRng,
) -> u32 {
    let mut played = 0;
    while played < times && !s.terminated {
        let more = env.step(action, rng);
        *s = Step { reward: s.reward + more.reward, ..more };
        played += 1;
    }
    played
}

/// One episode. The error is a fault (or `None` for an interruption) and its step.
#[inline]
fn play<E, D, P, R, A>(
    world: &mut World<E, D, P, R>,
    agent: &mut A,
    limits: Limits,
    starts: Option<&mut Starts>,
    rng: &mut NumpyRng,
    stop: &AtomicBool,
) -> Result<EpisodeRow, (Option<Fault>, u32)>
where
    E: Env,
    D: Discretiser<E>,
    P: Potential<E>,
    R: RewardModel<E>,
    A: Learn<D::State>,
{
    let World { env, discretiser, potential, reward } = world;
    let max_steps = limits.max_steps.unwrap_or(u32::MAX);
    let gamma = agent.gamma();
    let keep_truncated = agent.bootstraps_when_truncated();
    let epsilon = agent.epsilon();
    let mut terms = vec![0.0; limits.n_terms];
    let (mut native, mut learned, mut shaping) = (0.0, 0.0, 0.0);

    let mut obs = env.reset(rng);
    if let Some(starts) = starts {
        obs = starts.place(env);
    }
    let start = discretiser.see(env, &obs).map_err(|f| (Some(f), 0))?;
    let mut phi = potential.phi(env, start.cell(), &obs).map_err(|f| (Some(f), 0))?;
    let mut action = agent.begin(start);
    // Steps of the agent, and of the environment.
    let (mut step, mut frames) = (0u32, 0u32);
    loop {
        let failed = |f| (Some(f), step);
        let mut s = env.step(action, rng);
        frames += 1;
        if limits.frame_skip > 1 {
            let left = limits.frame_skip.min(max_steps - frames + 1) - 1;
            frames += repeat(env, action, left, &mut s, rng);
        }
        let truncated = !s.terminated && frames >= max_steps;
        let t = Transition {
            state: &obs,
            action,
            reward: s.reward,
            next_state: &s.obs,
            terminated: s.terminated,
            truncated,
            step,
        };
        let mut r = reward.reward(env, &t, &mut terms).map_err(failed)?;
        if let Some([low, high]) = limits.clip_reward {
            r = r.clamp(low, high);
        }
        // A terminal state is seen by nobody: scripts need not have a cell or an action for it.
        let next =
            if s.terminated { None } else { Some(discretiser.see(env, &s.obs).map_err(failed)?) };
        if P::ACTIVE {
            let phi_next = match next {
                Some(next) if keep_truncated || !truncated => {
                    potential.phi(env, next.cell(), &s.obs).map_err(failed)?
                }
                _ => 0.0,
            };
            let f = potential_term(gamma, phi, phi_next);
            r += f;
            shaping += f;
            phi = phi_next;
        }
        native += s.reward;
        learned += r;
        step += 1;
        let next = match next {
            Some(next) if !truncated => next,
            last => {
                let (last, ending) = match last {
                    None => (Last::Terminated, Ending::Terminated),
                    Some(next) => (Last::Truncated(next), Ending::Truncated),
                };
                agent.end(r, last);
                let own = agent.shaping();
                learned += own;
                shaping += own;
                return Ok(EpisodeRow {
                    steps: step,
                    native,
                    learned,
                    shaping,
                    terms,
                    epsilon,
                    ending,
                    value_error: None,
                    start: None,
                });
            }
        };
        if step.is_multiple_of(STOP_INTERVAL) && stop.load(Ordering::Relaxed) {
            return Err((None, step));
        }
        action = agent.step(r, next);
        obs = s.obs;
    }
}
