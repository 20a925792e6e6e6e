//! TD(λ) with eligibility traces, the backward view (Sutton 1988; Sutton & Barto 2018, section
//! 12.2; replacing traces: Singh & Sutton 1996).
//!
//! `δ = R + γ V(S′) − V(S)`; `e(S) ← e(S) + 1`, or `e(S) ← 1` for replacing traces; then for every
//! state s: `V(s) ← V(s) + α δ e(s)`, `e(s) ← γ λ e(s)`.

use super::{Estimate, Rule};
use crate::learn::control::Traces;
use crate::learn::{Last, Rate, td_error};

/// Temporal-difference prediction with eligibility traces, one per state.
#[derive(Debug, Clone)]
pub struct TdLambda {
    s: usize,
    traces: Traces,
}

impl TdLambda {
    /// With `traces` that decay by γ λ.
    pub fn new(traces: Traces) -> Self {
        Self { s: 0, traces }
    }

    fn learn(&mut self, estimate: &mut Estimate, reward: f64, next_value: f64) {
        let Estimate { v, gamma, alpha } = estimate;
        let delta = td_error(v[self.s], reward, *gamma, next_value);
        let step = alpha.visit(self.s);
        self.traces.visit(self.s, step);
        self.traces.learn(v, delta, step, alpha);
    }
}

impl Rule for TdLambda {
    const BOOTSTRAPS: bool = true;

    fn begin(&mut self, _estimate: &mut Estimate, s: usize) {
        self.traces.clear();
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
    use crate::learn::control::Trace;

    const V: [f64; 3] = [1.0, 4.0, 9.0];
    const REWARDS: [f64; 3] = [2.0, 4.0, 8.0];

    /// γ = 1/2.
    fn play(lambda: f64, kind: Trace) -> Vec<f64> {
        let rule = TdLambda::new(Traces::new(kind, 0.5 * lambda, 0.0, 3));
        after(rule, &V, HALF, &[0, 1, 0], &REWARDS, Last::Terminated)
    }

    #[test]
    fn an_episode_by_hand() {
        // γλ = 1/4. δ = 3: V(0) = 2.5, e(0) = 1/4. δ = 4 + 1.25 - 4 = 1.25: V(1) = 4.625, V(0) =
        // 2.5 + 1.25/8 = 2.65625, e = (1/16, 1/4). δ = 8 - 2.65625 = 5.34375: V(1) += 5.34375/8,
        // V(0) += 5.34375/2 · (1 + 1/16), or · 1 for replacing traces.
        let v = play(0.5, Trace::Accumulating);
        assert_eq!(v, [2.65625 + 2.671_875 * 1.0625, 4.625 + 0.667_968_75, 9.0]);
        let v = play(0.5, Trace::Replacing);
        assert_eq!(v, [2.65625 + 2.671_875, 4.625 + 0.667_968_75, 9.0]);
    }

    #[test]
    fn without_traces_it_is_td0() {
        let td0 = after(Td0::default(), &V, HALF, &[0, 1, 0], &REWARDS, Last::Terminated);
        assert_eq!(play(0.0, Trace::Accumulating), td0);
        assert_eq!(play(0.0, Trace::Replacing), td0);
    }

    #[test]
    fn traces_do_not_reach_into_the_next_episode() {
        let mut rule = TdLambda::new(Traces::new(Trace::Accumulating, 1.0, 0.0, 3));
        let mut estimate = Estimate::new(vec![0.0; 3], 1.0, HALF);
        for s in [0, 1] {
            rule.begin(&mut estimate, s);
            rule.end(&mut estimate, 1.0, Last::Terminated);
        }
        assert_eq!(estimate.v, [0.5, 0.5, 0.0]);
    }
}
