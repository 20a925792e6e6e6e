//! Two ways on from one state whose shaping should come to the same, and does not.
//!
//! Along any episode from s the discounted sum of `γΦ(s′) − Φ(s)` telescopes to `−Φ(s)`, whatever
//! is done on the way (Ng, Harada & Russell 1999). Two episodes with different sums prove that there
//! is no such Φ.

use serde::Serialize;

use super::strict::forest::{Anchor, Forest, NONE, endless_step};
use crate::mdp::{Action, FiniteMdp};

/// One step of an episode.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct WalkStep {
    /// s.
    pub state: usize,
    /// The action played in it.
    pub action: Action,
    /// s′.
    pub next_state: usize,
    /// The native reward.
    pub reward: f64,
    /// What the learned reward adds to it, F.
    pub shaping: f64,
    /// Whether the episode ends there.
    pub terminated: bool,
}

/// A walk through the model, every step of which can happen.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Walk {
    /// Its steps.
    pub steps: Vec<WalkStep>,
    /// The step (from 0) from which on it goes round for ever, if it never ends.
    pub repeats_from: Option<usize>,
    /// Σ γᵗ F, to the end of all repetitions.
    pub sum: f64,
}

impl Walk {
    fn new(steps: Vec<WalkStep>, repeats_from: Option<usize>, gamma: f64) -> Self {
        let discounted = |steps: &[WalkStep]| {
            steps.iter().rev().fold((0.0, 1.0), |(sum, discount), step| {
                (step.shaping + gamma * sum, gamma * discount)
            })
        };
        let (before, around) = steps.split_at(repeats_from.unwrap_or(steps.len()));
        let (mut sum, discount) = discounted(before);
        if repeats_from.is_some() {
            let (round, shrinks) = discounted(around);
            sum += discount * round / (1.0 - shrinks);
        }
        Self { steps, repeats_from, sum }
    }
}

/// Two walks from one state whose sums differ. Both end, or neither does; with γ = 1 they may also
/// meet in a state from which no episode ends.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Certificate {
    /// Where both start.
    pub start: usize,
    /// The shorter way.
    pub direct: Walk,
    /// The way by the step that no potential explains, which is its first.
    pub detour: Walk,
    /// By how much the detour's sum is the larger: what an agent gains by it.
    pub gain: f64,
}

/// How the two walks on from a transition can be compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Comparison {
    /// To their ends, be they infinitely far.
    Whole,
    /// To a state that both come to.
    ToRoot,
    None,
}

/// Whether the transition at hand makes a certificate: walks that go on for ever need a discount,
/// and those that do not end must meet at the same time.
fn comparison(mdp: &FiniteMdp, gamma: f64, forest: &Forest, s: usize, i: usize) -> Comparison {
    let o = &mdp.outcomes()[i];
    let (near, next) = (forest.anchor[s], o.next_state as usize);
    let far = if o.terminated { forest.terminal[next] } else { forest.anchor[next] };
    let completes = |anchor: u32| match forest.anchors[anchor as usize] {
        Anchor::Terminal(_) => true,
        Anchor::Root(root) => gamma < 1.0 && endless_step(mdp, root).is_some(),
    };
    if completes(near) && completes(far) {
        Comparison::Whole
    } else if near == far && (gamma == 1.0 || forest.depth[s] == forest.depth[next] + 1) {
        Comparison::ToRoot
    } else {
        Comparison::None
    }
}

/// The length of the two walks on from the transition `i` out of `s`, together, if they can be
/// compared.
#[inline]
pub(super) fn length(
    mdp: &FiniteMdp,
    gamma: f64,
    forest: &Forest,
    s: usize,
    i: usize,
) -> Option<u32> {
    let o = &mdp.outcomes()[i];
    let rest = if o.terminated { 0 } else { forest.depth[o.next_state as usize] };
    (comparison(mdp, gamma, forest, s, i) != Comparison::None).then_some(forest.depth[s] + 1 + rest)
}

/// The two walks on from the transition `i` out of `s`: without it, and by it.
pub(super) fn certificate(
    mdp: &FiniteMdp,
    f: &[f64],
    gamma: f64,
    forest: &Forest,
    (s, i): (usize, usize),
) -> Certificate {
    let whole = comparison(mdp, gamma, forest, s, i) == Comparison::Whole;
    let o = &mdp.outcomes()[i];
    let mut steps = Vec::new();
    let end = follow(mdp, f, forest, s, &mut steps);
    let direct = complete(mdp, f, gamma, forest, steps, end.filter(|_| whole));
    let mut steps = vec![step(mdp, f, s, i)];
    let end =
        if o.terminated { None } else { follow(mdp, f, forest, o.next_state as usize, &mut steps) };
    let detour = complete(mdp, f, gamma, forest, steps, end.filter(|_| whole));
    let gain = detour.sum - direct.sum;
    Certificate { start: s, direct, detour, gain }
}

fn step(mdp: &FiniteMdp, f: &[f64], state: usize, i: usize) -> WalkStep {
    let o = &mdp.outcomes()[i];
    let action = (0..mdp.n_actions()).find(|&a| mdp.range(state, a).contains(&i));
    WalkStep {
        state,
        action: action.expect("an outcome belongs to an action"),
        next_state: o.next_state as usize,
        reward: o.reward,
        shaping: f[i],
        terminated: o.terminated,
    }
}

/// Adds the way from `s` to its anchor; the root where it does not end there.
fn follow(
    mdp: &FiniteMdp,
    f: &[f64],
    forest: &Forest,
    mut s: usize,
    steps: &mut Vec<WalkStep>,
) -> Option<u32> {
    while forest.step[s] != NONE {
        let next = step(mdp, f, s, forest.step[s] as usize);
        steps.push(next);
        if next.terminated {
            return None;
        }
        s = next.next_state;
    }
    Some(s as u32)
}

/// Adds the round that begins in `root`, if there is one.
fn complete(
    mdp: &FiniteMdp,
    f: &[f64],
    gamma: f64,
    forest: &Forest,
    mut steps: Vec<WalkStep>,
    root: Option<u32>,
) -> Walk {
    let from = root.and_then(|root| {
        let first = step(mdp, f, root as usize, endless_step(mdp, root)?);
        let from = steps.len();
        steps.push(first);
        follow(mdp, f, forest, first.next_state, &mut steps);
        Some(from)
    });
    Walk::new(steps, from, gamma)
}
