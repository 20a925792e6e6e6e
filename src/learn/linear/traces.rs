//! Eligibility traces over weights (Sutton & Barto 2018, chapter 12).

use super::LinearQ;
use crate::mdp::Action;
use crate::shaping::Active;

/// How a visit adds to a trace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TraceKind {
    /// `z ← γλz + x` (equation 12.5).
    Accumulating,
    /// `z ← 1` where a feature is 1 (equation 12.12): for binary features only.
    Replacing,
    /// `z ← γλz + (1 − αγλ zᵀx) x` (equation 12.11).
    Dutch,
}

/// Faded traces below this are dropped.
const FADED: f64 = 1e-12;

/// Traces of weights, those that are not 0 listed.
///
/// They hold `A z`, where z is the book's trace and A the diagonal matrix of the features' shares
/// of the step size: the equations keep their form, and α may change from step to step.
///
/// Deviation 1: a trace that has faded below 1e-12 is dropped, so that a step takes time for what
/// was visited lately only.
#[derive(Debug, Clone)]
pub struct Traces {
    kind: TraceKind,
    /// γλ.
    decay: f64,
    n_actions: usize,
    /// One per weight, shape `[n_features, n_actions]`.
    z: Vec<f64>,
    /// Where z is not 0.
    live: Vec<u32>,
}

impl Traces {
    /// For `q`, none of them raised yet.
    pub fn new(kind: TraceKind, q: &LinearQ, gamma: f64, lambda: f64) -> Self {
        let n = q.weights().values().len();
        Self {
            kind,
            decay: gamma * lambda,
            n_actions: q.weights().n_actions(),
            z: vec![0.0; n],
            live: Vec::with_capacity(n),
        }
    }

    /// Forgets everything.
    pub(super) fn clear(&mut self) {
        for &i in &self.live {
            self.z[i as usize] = 0.0;
        }
        self.live.clear();
    }

    /// Raises the traces of (s, a), which is now updated with step size `alpha`.
    #[inline]
    pub(super) fn raise(&mut self, s: &Active, a: Action, alpha: f64) {
        let at = |i: u32| i as usize * self.n_actions + a;
        let share = match self.kind {
            TraceKind::Dutch => {
                let mut product = 0.0;
                for (&i, x) in s.index.iter().zip(&s.value) {
                    product += self.z[at(i)] * x;
                }
                1.0 - alpha * product
            }
            TraceKind::Accumulating | TraceKind::Replacing => 1.0,
        };
        for (&i, step) in s.index.iter().zip(&s.step) {
            let i = at(i);
            let z = &mut self.z[i];
            if *z == 0.0 {
                self.live.push(i as u32);
            }
            *z = if self.kind == TraceKind::Replacing { *step } else { *z + share * step };
        }
    }

    /// Moves the weights by `size` along the traces, and lets these fade.
    #[inline]
    pub(super) fn learn(&mut self, q: &mut LinearQ, size: f64) {
        let mut k = 0;
        while let Some(&i) = self.live.get(k) {
            let i = i as usize;
            q.add(i / self.n_actions, i % self.n_actions, size * self.z[i]);
            self.z[i] *= self.decay;
            if self.z[i].abs() < FADED {
                self.z[i] = 0.0;
                self.live.swap_remove(k);
            } else {
                k += 1;
            }
        }
    }
}
