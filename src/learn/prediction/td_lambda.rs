//! TD(λ) with eligibility traces, the backward view (Sutton 1988; Sutton & Barto 2018, section
//! 12.2; replacing traces: Singh & Sutton 1996).
//!
//! `δ = R + γ V(S′) − V(S)`; `e(S) ← e(S) + 1`, or `e(S) ← 1` for replacing traces; then for every
//! state s: `V(s) ← V(s) + α δ e(s)`, `e(s) ← γ λ e(s)`.

use super::{Estimate, Rule};
use crate::learn::{Last, Rate};

/// Traces below this are dropped: they no longer reach the last digits of a value.
const FAINT: f64 = 1e-12;

/// What a further visit does to the trace of a state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Traces {
    /// Adds 1.
    Accumulating,
    /// Makes it 1.
    Replacing,
}

impl Traces {
    /// The words that [`Self::of_word`] reads.
    pub const WORDS: &'static [&'static str] = &["accumulating", "replacing"];

    /// `"replacing"`, else accumulating.
    pub fn of_word(word: &str) -> Self {
        if word == "replacing" { Self::Replacing } else { Self::Accumulating }
    }
}

/// Temporal-difference prediction with eligibility traces.
///
/// Deviation 1: traces that have decayed below 1e-12 are forgotten.
#[derive(Debug, Clone)]
pub struct TdLambda {
    lambda: f64,
    kind: Traces,
    s: usize,
    /// e, one per state.
    traces: Vec<f64>,
    /// The states whose trace is not 0.
    active: Vec<u32>,
}

impl TdLambda {
    /// With traces over `n_states` that decay by γ `lambda`.
    pub fn new(lambda: f64, kind: Traces, n_states: usize) -> Self {
        Self { lambda, kind, s: 0, traces: vec![0.0; n_states], active: Vec::new() }
    }

    fn learn(&mut self, estimate: &mut Estimate, reward: f64, next_value: f64) {
        let error = reward + estimate.gamma * next_value - estimate.v[self.s];
        let trace = &mut self.traces[self.s];
        if *trace == 0.0 {
            self.active.push(self.s as u32);
        }
        *trace = if self.kind == Traces::Replacing { 1.0 } else { *trace + 1.0 };
        estimate.alpha.visit(self.s);
        let decay = estimate.gamma * self.lambda;
        let traces = &mut self.traces;
        self.active.retain(|&s| {
            let trace = &mut traces[s as usize];
            estimate.v[s as usize] += estimate.alpha.of(s as usize) * error * *trace;
            *trace *= decay;
            if *trace < FAINT {
                *trace = 0.0;
            }
            *trace > 0.0
        });
    }
}

impl Rule for TdLambda {
    const BOOTSTRAPS: bool = true;

    fn begin(&mut self, _estimate: &mut Estimate, s: usize) {
        self.active.drain(..).for_each(|s| self.traces[s as usize] = 0.0);
        self.s = s;
    }

    fn step(&mut self, estimate: &mut Estimate, reward: f64, next: usize) {
        self.learn(estimate, reward, estimate.v[next]);
        self.s = next;
    }

    fn end(&mut self, estimate: &mut Estimate, reward: f64, last: Last) {
        self.learn(estimate, reward, estimate.after(last));
    }
}

#[cfg(test)]
mod tests {
    use super::super::Td0;
    use super::super::tests::{HALF, after};
    use super::*;

    const V: [f64; 3] = [1.0, 4.0, 9.0];
    const REWARDS: [f64; 3] = [2.0, 4.0, 8.0];

    fn play(lambda: f64, kind: Traces) -> Vec<f64> {
        let rule = TdLambda::new(lambda, kind, 3);
        after(rule, &V, HALF, &[0, 1, 0], &REWARDS, Last::Terminated)
    }

    #[test]
    fn an_episode_by_hand() {
        // γλ = 1/4. δ = 3: V(0) = 2.5, e(0) = 1/4. δ = 4 + 1.25 - 4 = 1.25: V(1) = 4.625, V(0) =
        // 2.5 + 1.25/8 = 2.65625, e = (1/16, 1/4). δ = 8 - 2.65625 = 5.34375: V(1) += 5.34375/8,
        // V(0) += 5.34375/2 · (1 + 1/16), or · 1 for replacing traces.
        let v = play(0.5, Traces::Accumulating);
        assert_eq!(v, [2.65625 + 2.671_875 * 1.0625, 4.625 + 0.667_968_75, 9.0]);
        let v = play(0.5, Traces::Replacing);
        assert_eq!(v, [2.65625 + 2.671_875, 4.625 + 0.667_968_75, 9.0]);
    }

    #[test]
    fn without_traces_it_is_td0() {
        let td0 = after(Td0::default(), &V, HALF, &[0, 1, 0], &REWARDS, Last::Terminated);
        assert_eq!(play(0.0, Traces::Accumulating), td0);
        assert_eq!(play(0.0, Traces::Replacing), td0);
    }

    #[test]
    fn traces_do_not_reach_into_the_next_episode() {
        let mut rule = TdLambda::new(1.0, Traces::Accumulating, 3);
        let mut estimate = Estimate::new(vec![0.0; 3], 1.0, HALF);
        rule.begin(&mut estimate, 0);
        rule.end(&mut estimate, 1.0, Last::Terminated);
        rule.begin(&mut estimate, 1);
        rule.end(&mut estimate, 1.0, Last::Terminated);
        assert_eq!(estimate.v, [0.5, 0.5, 0.0]);
    }
}
