//! What a shaping that is not potential-based is nearly.

use serde::Serialize;

use super::forest::{Anchor, leaving};
use super::recover::{Beyond, Recovered, recover};
use super::{Finding, Question};
use crate::audit::certificate::{Certificate, Walk};

/// Where discounts other than the learner's are looked for: up to 1.25, in steps of 1/256.
const STEPS: i32 = 320;
const PER_UNIT: f64 = 256.0;

/// Φ of a terminal state.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TerminalPotential {
    /// The state in which episodes end.
    pub state: usize,
    /// What Φ would have to be there. It should be 0 (Grześ 2017).
    pub phi: f64,
}

/// `F = γ_F Φ(s′) − Φ(s)` with another γ than the learner's, or with a Φ that is not 0 beyond a
/// terminal transition: what all transitions agree with.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Diagnosis {
    /// `γ_F`; the learner's if that is not the mistake.
    pub gamma: f64,
    /// Φ of every terminal state, in order; empty if it is 0 in all of them.
    pub terminals: Vec<TerminalPotential>,
    /// Whether other values of the terminals would do as well (these are the ones of which the
    /// largest is 0, or those that fit a declared potential).
    pub ambiguous: bool,
    /// Φ, one value per state: as a potential of the learner's γ, 0 at the end, it would do no harm.
    #[serde(skip)]
    pub potential: Vec<f64>,
}

impl Diagnosis {
    /// Φ of the terminal states, if it is the same in all of them.
    pub fn common(&self) -> Option<f64> {
        let first = self.terminals.first()?.phi;
        let same = |t: &TerminalPotential| (t.phi - first).abs() <= 1e-9 * first.abs();
        self.terminals.iter().all(same).then_some(first)
    }
}

/// Looks for a mistake that explains F: a terminal potential, then another discount, then both.
pub(super) fn diagnose(
    question: &Question<'_>,
    certificate: Option<&Certificate>,
) -> Option<Diagnosis> {
    let &Question { mdp, f, gamma, forest, declared, .. } = question;
    let explains = |gamma_f: f64, beyond: Beyond| {
        let recovered = recover(mdp, f, gamma_f, forest, beyond, declared);
        (recovered.sound && question.agrees(gamma_f, &recovered)).then(|| {
            let mut terminals = Vec::new();
            for (anchor, &phi) in forest.anchors.iter().zip(&recovered.anchors) {
                if let (Anchor::Terminal(state), Beyond::Unknown) = (anchor, beyond) {
                    terminals.push(TerminalPotential { state: *state as usize, phi });
                }
            }
            terminals.sort_by_key(|t| t.state);
            let ambiguous = recovered.free > 0;
            Diagnosis { gamma: gamma_f, terminals, ambiguous, potential: recovered.phi }
        })
    };
    // The differences of a potential, and a discount at the wrong one of the two.
    let usual = [1.0, 1.0 / gamma].into_iter().filter(|&g| g != gamma && g.is_finite());
    let mut discounts: Vec<f64> = usual.clone().collect();
    for root in certificate.map(equal_sums).unwrap_or_default() {
        discounts.extend([(root * 1e6).round() / 1e6, root]);
    }
    explains(gamma, Beyond::Unknown)
        .or_else(|| discounts.into_iter().find_map(|g| explains(g, Beyond::Zero)))
        .or_else(|| usual.into_iter().find_map(|g| explains(g, Beyond::Unknown)))
}

impl Question<'_> {
    /// Whether every transition agrees with a potential of this discount.
    fn agrees(&self, gamma: f64, recovered: &Recovered) -> bool {
        let scale = recovered.scale(self.magnitude);
        let mut outcomes = self
            .forest
            .order
            .iter()
            .flat_map(|&s| leaving(self.mdp, s as usize).map(move |(i, o)| (s as usize, i, o)));
        outcomes.all(|(s, i, o)| {
            let next = recovered.beyond(self.forest, o.next_state, o.terminated);
            let error = (gamma * next - recovered.phi[s] - self.f[i]).abs();
            Finding::of(error, scale) == Finding::Holds
        })
    }
}

/// The discounts for which the two walks of a certificate have equal sums. Both must end.
fn equal_sums(certificate: &Certificate) -> Vec<f64> {
    let Certificate { direct, detour, .. } = certificate;
    let ends = |walk: &Walk| walk.steps.last().is_some_and(|step| step.terminated);
    if !ends(direct) || !ends(detour) {
        return Vec::new();
    }
    let sum = |walk: &Walk, g: f64| walk.steps.iter().rev().fold(0.0, |sum, t| t.shaping + g * sum);
    let gap = |g: f64| sum(detour, g) - sum(direct, g);
    let mut roots = Vec::new();
    for k in 1..=STEPS {
        let (mut low, mut high) = (f64::from(k - 1) / PER_UNIT, f64::from(k) / PER_UNIT);
        let rises = gap(high) > 0.0;
        if (gap(low) > 0.0) == rises {
            continue;
        }
        loop {
            let middle = f64::midpoint(low, high);
            if middle <= low || middle >= high {
                break;
            }
            if (gap(middle) > 0.0) == rises {
                high = middle;
            } else {
                low = middle;
            }
        }
        roots.push(high);
    }
    roots
}
