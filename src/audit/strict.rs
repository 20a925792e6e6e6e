//! Is a shaping potential-based, transition by transition?
//!
//! `F = γΦ(s′) − Φ(s)` with Φ = 0 beyond a terminal transition (Ng, Harada & Russell 1999) leaves
//! one Φ at most: along the shortest way to a terminal transition `Φ(s) = γΦ(s′) − F` gives it, and
//! where no episode ends a way round does. Every other transition must then agree with it; an outcome
//! of probability 0 need not.
//!
//! All numbers are judged on the scale S, the largest |r|, |F| and |Φ| met: what is off by at most
//! `1e-9 S` agrees.

mod diagnosis;
pub(in crate::audit) mod forest;
pub(in crate::audit) mod recover;
#[cfg(test)]
mod tests;

use serde::Serialize;

pub use diagnosis::{Diagnosis, TerminalPotential};

use super::certificate::{Certificate, certificate, length};
use crate::mdp::FiniteMdp;
use forest::{Forest, leaving};
use recover::{Beyond, Recovered, recover};

/// What agrees, relative to the scale.
const TOLERANCE: f64 = 1e-9;
/// What certainly does not.
const CERTAIN: f64 = 1e-8;

/// What a check found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Finding {
    /// The claim holds.
    Holds,
    /// It does not.
    Fails,
    /// Rounding errors could be the reason for what was found.
    Inconclusive,
}

impl Finding {
    /// Of an error that should be 0, on the scale of the numbers it comes from.
    pub(super) fn of(error: f64, scale: f64) -> Self {
        if !error.is_finite() || !scale.is_finite() {
            Self::Inconclusive
        } else if error <= TOLERANCE * scale {
            Self::Holds
        } else if error > CERTAIN * scale {
            Self::Fails
        } else {
            Self::Inconclusive
        }
    }
}

/// A declared potential compared with the one that the rewards imply.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Difference {
    /// The largest difference of the two over the reachable states, without sign.
    pub largest: f64,
    /// The first state where it is that large.
    pub state: usize,
}

impl Difference {
    /// Of differences by state, in the order of the states. `None` if there are none.
    pub(super) fn largest(differences: impl Iterator<Item = (usize, f64)>) -> Option<Self> {
        let each = differences.map(|(state, d)| Self { largest: d.abs(), state });
        each.reduce(|a, b| if b.largest > a.largest { b } else { a })
    }
}

/// Whether F is a potential's, transition by transition.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Strict {
    /// Holds if every transition agrees with one potential.
    pub finding: Finding,
    /// Transitions out of reachable states: outcomes of positive probability, those that differ in
    /// nothing but their probability counted once.
    pub transitions: usize,
    /// How many of them disagree with the recovered potential.
    pub violations: usize,
    /// `max |γΦ(s′) − Φ(s) − F|`.
    pub largest_error: f64,
    /// S: the largest |r|, |F|, |Φ|.
    pub scale: f64,
    /// The recovered Φ, one value per state; 0 where no episode can be.
    #[serde(skip)]
    pub potential: Vec<f64>,
    /// How many constants of it are free: groups of states for which `Φ + c` does as well. None in a
    /// complete model with γ < 1.
    pub free_constants: usize,
    /// The recovered potential against the declared one.
    pub declared: Option<Difference>,
    /// What it is instead, if it is nearly a potential's.
    pub diagnosis: Option<Diagnosis>,
    /// The proof that it is none.
    pub certificate: Option<Certificate>,
}

/// Checks whether `f` (learned minus native reward, one value per outcome of `mdp`) is potential-based
/// for the learner's `gamma`, on the states that are `reachable`. `declared` is the potential that is
/// claimed, one value per state.
pub fn strict(
    mdp: &FiniteMdp,
    f: &[f64],
    gamma: f64,
    reachable: &[bool],
    declared: Option<&[f64]>,
) -> Strict {
    let forest = Forest::new(mdp, reachable);
    let recovered = recover(mdp, f, gamma, &forest, Beyond::Zero, declared);
    let magnitude = magnitude(mdp, f, &forest);
    let check = check(mdp, f, gamma, &forest, &recovered, magnitude);
    let finding = match check.finding() {
        Finding::Fails if !recovered.sound => Finding::Inconclusive,
        finding => finding,
    };
    let proof = check.shortest.filter(|_| finding == Finding::Fails);
    let certificate = proof.map(|(_, at)| certificate(mdp, f, gamma, &forest, at));
    let diagnosis = (finding == Finding::Fails)
        .then(|| {
            let question = Question { mdp, f, gamma, forest: &forest, magnitude, declared };
            diagnosis::diagnose(&question, certificate.as_ref())
        })
        .flatten();
    Strict {
        finding,
        transitions: check.transitions,
        violations: check.violations,
        largest_error: check.largest,
        scale: check.scale,
        declared: declared.and_then(|phi| {
            let reached = (0..phi.len()).filter(|&s| forest.anchor[s] != forest::NONE);
            Difference::largest(reached.map(|s| (s, recovered.phi[s] - phi[s])))
        }),
        potential: recovered.phi,
        free_constants: recovered.free,
        diagnosis,
        certificate,
    }
}

/// How well a potential agrees with the rewards.
#[derive(Debug)]
struct Check {
    transitions: usize,
    violations: usize,
    largest: f64,
    scale: f64,
    /// The violation from which two walks prove it in the fewest steps: how many they are, and the
    /// transition as its state and outcome.
    shortest: Option<(u32, (usize, usize))>,
}

impl Check {
    fn finding(&self) -> Finding {
        Finding::of(self.largest, self.scale)
    }
}

/// What a diagnosis is made for.
#[derive(Debug, Clone, Copy)]
struct Question<'a> {
    mdp: &'a FiniteMdp,
    f: &'a [f64],
    gamma: f64,
    forest: &'a Forest,
    magnitude: f64,
    declared: Option<&'a [f64]>,
}

/// The largest |r| and |F|.
fn magnitude(mdp: &FiniteMdp, f: &[f64], forest: &Forest) -> f64 {
    let mut largest = 0.0f64;
    for &s in &forest.order {
        for (i, o) in leaving(mdp, s as usize) {
            largest = largest.max(o.reward.abs()).max(f[i].abs());
        }
    }
    largest
}

fn check(
    mdp: &FiniteMdp,
    f: &[f64],
    gamma: f64,
    forest: &Forest,
    recovered: &Recovered,
    magnitude: f64,
) -> Check {
    let scale = recovered.scale(magnitude);
    let mut check = Check { transitions: 0, violations: 0, largest: 0.0, scale, shortest: None };
    let mut first = vec![usize::MAX; 2 * mdp.n_states()];
    let reached = |s: &usize| forest.anchor[*s] != forest::NONE;
    for s in (0..mdp.n_states()).filter(reached) {
        for a in 0..mdp.n_actions() {
            let range = mdp.range(s, a);
            for i in range.clone() {
                let o = &mdp.outcomes()[i];
                if o.probability <= 0.0 || o.probability.is_nan() {
                    continue;
                }
                let seen = &mut first[2 * o.next_state as usize + usize::from(o.terminated)];
                if range.contains(seen) {
                    let same = |j: usize| {
                        let other = &mdp.outcomes()[j];
                        (other.next_state, other.terminated) == (o.next_state, o.terminated)
                            && other.probability > 0.0
                            && f[j] == f[i]
                    };
                    if (*seen..i).any(same) {
                        continue;
                    }
                } else {
                    *seen = i;
                }
                let next = recovered.beyond(forest, o.next_state, o.terminated);
                let error = (gamma * next - recovered.phi[s] - f[i]).abs();
                let error = if error.is_nan() { f64::INFINITY } else { error };
                check.transitions += 1;
                check.largest = check.largest.max(error);
                if error <= TOLERANCE * scale {
                    continue;
                }
                check.violations += 1;
                if let Some(steps) = length(mdp, gamma, forest, s, i)
                    && check.shortest.is_none_or(|(least, _)| steps < least)
                {
                    check.shortest = Some((steps, (s, i)));
                }
            }
        }
    }
    check
}
