//! Eligibility traces of pairs (s, a) (Sutton & Barto 2018, section 12.7; Singh & Sutton 1996).
//!
//! Per step, with the error δ of the pair just visited, for every pair: `e ← γ λ e`, then for the
//! visited one `e ← e + 1` (accumulating), `e ← 1` (replacing) or `e ← e + 1 − α e` (dutch; section
//! 12.5), then `Q ← Q + α δ e`. Only pairs whose trace is not 0 are kept. Traces are stored as multiples of one factor that decays, so
//! that a step costs each of them one multiplication and no write but that of Q.
//!
//! Deviation 1: a trace below `cutoff` counts as 0. With a cutoff of 0 none does.
//!
//! Deviation 2: where step sizes differ from pair to pair, each pair is changed with its own.

use super::{Tabular, td_error};
use crate::learn::{Rate, StepSize};

/// What a visit does to a trace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trace {
    /// `e ← e + 1`
    Accumulating,
    /// `e ← 1`; the traces of the state's other actions stay.
    Replacing,
    /// `e ← e + 1 − α e`
    Dutch,
}

/// Below this the common factor is multiplied into the traces, before it vanishes.
const SMALLEST_SCALE: f64 = 1e-100;

/// The place of a pair that has no trace.
const NOWHERE: u32 = u32::MAX;

/// The trace of a pair is `base · scale`.
#[derive(Debug, Clone, Copy)]
struct Entry {
    pair: u32,
    base: f64,
}

/// The traces that are not 0.
#[derive(Debug, Clone)]
pub struct Traces {
    kind: Trace,
    /// γ λ
    decay: f64,
    cutoff: f64,
    scale: f64,
    entries: Vec<Entry>,
    /// Per pair, its place in `entries`.
    place: Vec<u32>,
}

impl Traces {
    /// Traces of `n_pairs` pairs that decay by `decay` = γ λ per step and vanish below `cutoff`.
    pub fn new(kind: Trace, decay: f64, cutoff: f64, n_pairs: usize) -> Self {
        Self { kind, decay, cutoff, scale: 1.0, entries: Vec::new(), place: vec![NOWHERE; n_pairs] }
    }

    /// Learns from the last step: its error, the visit of its pair, every pair's change, and the
    /// decay. `next_value` is what the algorithm bootstraps from.
    #[inline]
    pub(super) fn update(&mut self, table: &mut Tabular, reward: f64, next_value: f64) {
        let Tabular { q, gamma, alpha, s, a, .. } = table;
        let pair = q.pair(*s, *a);
        let delta = td_error(q.values()[pair], reward, *gamma, next_value);
        let step = alpha.visit(pair);
        self.visit(pair, step);
        self.learn(q.values_mut(), delta, step, alpha);
    }

    /// `pair` has been visited; its values are learned with step size `alpha`.
    #[inline]
    pub(in crate::learn) fn visit(&mut self, pair: usize, alpha: f64) {
        match self.kind {
            Trace::Dutch => self.raise(pair, 1.0 - alpha * self.get(pair)),
            Trace::Accumulating | Trace::Replacing => self.raise(pair, 1.0),
        }
    }

    /// What a visit does to a trace.
    pub(in crate::learn) fn kind(&self) -> Trace {
        self.kind
    }

    /// The trace of `pair`.
    #[inline]
    pub(in crate::learn) fn get(&self, pair: usize) -> f64 {
        let entry = self.entries.get(self.place[pair] as usize);
        entry.map_or(0.0, |entry| entry.base * self.scale)
    }

    /// Adds `x` to the trace of `pair`, or replaces it by `x`.
    #[inline]
    pub(in crate::learn) fn raise(&mut self, pair: usize, x: f64) {
        let x = x / self.scale;
        let place = self.place[pair];
        if place == NOWHERE {
            self.place[pair] = self.entries.len() as u32;
            self.entries.push(Entry { pair: pair as u32, base: x });
        } else {
            let base = &mut self.entries[place as usize].base;
            *base = match self.kind {
                Trace::Accumulating | Trace::Dutch => *base + x,
                Trace::Replacing => x,
            };
        }
    }

    /// `Q ← Q + α δ e` for every pair of `values`, then `e ← γ λ e`. `alpha` is that of the step,
    /// `rates` those of the pairs where they differ.
    #[inline]
    pub(in crate::learn) fn learn(
        &mut self,
        values: &mut [f64],
        delta: f64,
        alpha: f64,
        rates: &StepSize,
    ) {
        match rates.rates() {
            None => self.spread(alpha * delta, |pair, change| values[pair] += change),
            Some(rates) => {
                self.spread(delta, |pair, change| values[pair] += rates[pair] * change);
            }
        }
    }

    /// Hands every pair and `size · e` to `each`; then `e ← γ λ e`, and those that this takes below
    /// the cutoff are forgotten.
    #[inline]
    pub(in crate::learn) fn spread(&mut self, size: f64, mut each: impl FnMut(usize, f64)) {
        let size = size * self.scale;
        let least = self.cutoff / (self.scale * self.decay);
        let mut i = 0;
        while let Some(&Entry { pair, base }) = self.entries.get(i) {
            each(pair as usize, size * base);
            if base.abs() < least {
                self.forget(i);
            } else {
                i += 1;
            }
        }
        self.scale *= self.decay;
        if self.scale < SMALLEST_SCALE {
            self.rescale();
        }
    }

    fn forget(&mut self, i: usize) {
        self.place[self.entries[i].pair as usize] = NOWHERE;
        self.entries.swap_remove(i);
        if let Some(moved) = self.entries.get(i) {
            self.place[moved.pair as usize] = i as u32;
        }
    }

    /// Multiplies the factor into the bases, and forgets those that are 0 by now.
    #[cold]
    fn rescale(&mut self) {
        let scale = std::mem::replace(&mut self.scale, 1.0);
        for i in (0..self.entries.len()).rev() {
            let base = &mut self.entries[i].base;
            *base *= scale;
            if base.abs() <= self.cutoff {
                self.forget(i);
            }
        }
    }

    /// `e ← 0` for every pair.
    #[inline]
    pub(in crate::learn) fn clear(&mut self) {
        for entry in self.entries.drain(..) {
            self.place[entry.pair as usize] = NOWHERE;
        }
        self.scale = 1.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::{AlphaSource, QTable, Schedule};
    use crate::mdp::streams::Stream;

    const PAIRS: usize = 12;

    /// A random walk over pairs with random errors, and the same with a trace for every pair.
    /// Returns the largest difference of the values.
    fn against_dense(kind: Trace, decay: f64, cutoff: f64, source: AlphaSource) -> f64 {
        let mut alpha = StepSize::new(source, PAIRS);
        let mut traces = Traces::new(kind, decay, cutoff, PAIRS);
        let mut q = QTable::new(PAIRS / 2, 2, 0.0);
        let (mut dense, mut values) = ([0.0; PAIRS], [0.0; PAIRS]);
        let mut random = Stream::new(6, "traces");
        for _ in 0..3_000 {
            let (pair, delta) = (random.below(PAIRS), random.uniform() - 0.5);
            let step = alpha.visit(pair);
            traces.visit(pair, step);
            traces.learn(q.values_mut(), delta, step, &alpha);
            dense[pair] = match kind {
                Trace::Accumulating => dense[pair] + 1.0,
                Trace::Replacing => 1.0,
                Trace::Dutch => dense[pair] * (1.0 - step) + 1.0,
            };
            for i in 0..PAIRS {
                values[i] += alpha.rates().map_or(step, |rates| rates[i]) * delta * dense[i];
                dense[i] *= decay;
                if dense[i] < cutoff {
                    dense[i] = 0.0;
                }
            }
            if random.below(100) == 0 {
                traces.clear();
                dense = [0.0; PAIRS];
            }
        }
        q.values().iter().zip(values).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn sparse_traces_are_dense_traces() {
        let constant = AlphaSource::Schedule(Schedule::constant(0.1));
        let counted = AlphaSource::VisitCount { omega: 0.7 };
        for kind in [Trace::Accumulating, Trace::Replacing, Trace::Dutch] {
            for source in [constant, counted] {
                // 2e-3 per step takes the factor to its limit within a few dozen steps.
                for decay in [0.0, 2e-3, 0.5, 0.9, 1.0] {
                    for cutoff in [0.0, 1e-3, 0.1] {
                        let difference = against_dense(kind, decay, cutoff, source);
                        assert!(difference < 1e-12, "{kind:?} {decay} {cutoff}: {difference}");
                    }
                }
            }
        }
    }

    #[test]
    fn what_has_decayed_is_forgotten() {
        let mut q = QTable::new(2, 2, 0.0);
        let alpha = StepSize::new(AlphaSource::Schedule(Schedule::constant(1.0)), 4);
        let mut traces = Traces::new(Trace::Accumulating, 0.5, 0.1, 4);
        traces.visit(0, 1.0);
        // The trace is 1, 0.5, 0.25, 0.125, and then below the cutoff.
        for left in [1, 1, 1, 0, 0] {
            traces.learn(q.values_mut(), 1.0, 1.0, &alpha);
            assert_eq!(traces.entries.len(), left);
        }
        assert_eq!(q.values(), [1.875, 0.0, 0.0, 0.0]);
    }
}
