//! Soft Q-learning: Q-learning of the entropy-regularised return `Σ γ^t (R + τ H(π(· | S)))`
//! (Ziebart 2010; Haarnoja et al. 2017, for a table).
//!
//! `Q(S, A) ← Q(S, A) + α [R + γ V(S′) − Q(S, A)]`, `V(s) = τ ln Σ_a exp(Q(s, a) / τ)`
//!
//! The behaviour is the optimal policy of that return, softmax with the same temperature τ, and is
//! chosen after the update. V exceeds the largest value by up to τ ln n: what the entropy is worth.
//! As τ goes to 0 this is Q-learning with greedy behaviour.

use super::Tabular;
use super::tabular::agent_of_table;
use crate::learn::softmax::{Softmax, weight};
use crate::learn::{AlphaSource, Last, Learn, QTable, Seen, StepSize};
use crate::mdp::Action;
use crate::mdp::math::ln;
use crate::mdp::streams::Stream;

/// Tabular soft Q-learning.
#[derive(Debug, Clone)]
pub struct SoftQLearning {
    table: Tabular<Softmax>,
    rows: Rows,
}

impl SoftQLearning {
    /// A learner with the table `q`; its behaviour draws from `stream`. `temperature` is in units
    /// of the rewards, above 0.
    pub fn new(
        q: QTable,
        gamma: f64,
        alpha: AlphaSource,
        temperature: f64,
        stream: Stream,
    ) -> Self {
        let behaviour = Softmax::new(temperature, q.n_actions(), stream);
        let alpha = StepSize::new(alpha, q.values().len());
        let rows = Rows::new(&q, temperature);
        Self { table: Tabular { q, gamma, alpha, behaviour, s: 0, a: 0 }, rows }
    }

    /// V(s), over the actions that `s` allows.
    fn value<S: Seen>(&mut self, s: S) -> f64 {
        if S::SHIELDED {
            self.table.behaviour.log_sum_exp(self.table.q.row(s.cell()), s)
        } else {
            self.rows.value[s.cell()]
        }
    }

    fn update(&mut self, reward: f64, next_value: f64) {
        self.table.update(reward, next_value);
        self.rows.refresh(&self.table.q, self.table.s, Some(self.table.a));
    }
}

/// What the exponentials of each row come to. A step changes one value, and with it one exponential
/// of a row unless the largest has changed, which is cheaper than to weigh two rows per step.
/// Without regard to a shield, under which the allowed actions of a row may vary.
#[derive(Debug, Clone)]
struct Rows {
    temperature: f64,
    /// `exp((Q − max Q) / τ)`, one per pair.
    weights: Vec<f64>,
    /// `max Q`, one per state.
    best: Vec<f64>,
    /// The sum of the weights, one per state.
    sum: Vec<f64>,
    /// V, one per state.
    value: Vec<f64>,
}

impl Rows {
    fn new(q: &QTable, temperature: f64) -> Self {
        let n_states = q.n_states();
        let mut rows = Self {
            temperature,
            weights: vec![0.0; q.values().len()],
            best: vec![0.0; n_states],
            sum: vec![0.0; n_states],
            value: vec![0.0; n_states],
        };
        for s in 0..n_states {
            rows.refresh(q, s, None);
        }
        rows
    }

    /// The weights of row `s`.
    fn weights(&self, q: &QTable, s: usize) -> &[f64] {
        &self.weights[q.pair(s, 0)..][..q.n_actions()]
    }

    /// Row `s` has changed: in `a`, or all of it.
    #[inline]
    fn refresh(&mut self, q: &QTable, s: usize, a: Option<Action>) {
        let (row, best) = (q.row(s), q.max(s));
        let weights = &mut self.weights[q.pair(s, 0)..][..row.len()];
        match a {
            Some(a) if best == self.best[s] => weights[a] = weight(row[a], best, self.temperature),
            _ => {
                for (w, &value) in weights.iter_mut().zip(row) {
                    *w = weight(value, best, self.temperature);
                }
            }
        }
        self.best[s] = best;
        self.sum[s] = weights.iter().sum();
        self.value[s] = best + self.temperature * ln(self.sum[s]);
    }
}

agent_of_table!(SoftQLearning, table);

impl<S: Seen> Learn<S> for SoftQLearning {
    fn begin(&mut self, s: S) -> Action {
        let a = if S::SHIELDED {
            self.table.choose(s)
        } else {
            let weights = self.rows.weights(&self.table.q, s.cell());
            self.table.behaviour.choose_by(weights, self.rows.sum[s.cell()])
        };
        self.table.play(s, a)
    }

    fn step(&mut self, reward: f64, next: S) -> Action {
        let value = self.value(next);
        self.update(reward, value);
        self.begin(next)
    }

    fn end(&mut self, reward: f64, last: Last<S>) {
        let value = match last {
            Last::Terminated => 0.0,
            Last::Truncated(next) => self.value(next),
        };
        self.update(reward, value);
        self.table.end_episode();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::{Agent, Schedule};
    use crate::mdp::math::ln;
    use crate::shaping::{ActionSet, Shielded};

    fn learner(values: Vec<f64>, temperature: f64) -> SoftQLearning {
        let alpha = AlphaSource::Schedule(Schedule::constant(0.5));
        let q = QTable::from_values(2, values);
        SoftQLearning::new(q, 0.9, alpha, temperature, Stream::new(0, "test"))
    }

    #[test]
    fn a_step_by_hand() {
        // V(1) = 2 ln (e^(2 ln 3 / 2) + e^0) = 2 ln 4, so the target is 10 + 0.9 * 2 ln 4.
        let mut agent = learner(vec![1.0, 1.0, 2.0 * ln(3.0), 0.0], 2.0);
        let a = agent.begin(0);
        agent.step(10.0, 1);
        let target = 10.0 + 0.9 * 2.0 * ln(4.0);
        assert!((agent.q().unwrap().get(0, a) - (1.0 + 0.5 * (target - 1.0))).abs() < 1e-14);
        // With the better action refused, V(1) = 2 ln e^0 = 0.
        let mut agent = learner(vec![1.0, 1.0, 2.0 * ln(3.0), 0.0], 2.0);
        let allowed = ActionSet(0b10);
        let a = agent.begin(Shielded { cell: 0, allowed });
        assert_eq!(a, 1);
        agent.end(10.0, Last::Truncated(Shielded { cell: 1, allowed }));
        assert!((agent.q().unwrap().get(0, 1) - (1.0 + 0.5 * (10.0 - 1.0))).abs() < 1e-15);
    }

    #[test]
    fn choices_are_by_the_updated_values() {
        // From state 1 back to it: the update takes all from the action played.
        let mut agent = learner(vec![0.0, 0.0, 50.0, 40.0], 0.1);
        assert_eq!(agent.begin(1), 0);
        assert_eq!(agent.step(-1000.0, 1), 1);
    }

    /// What is kept of each row is what the row says, and behind a shield that allows everything
    /// the same is learned without it.
    #[test]
    fn the_rows_are_kept_up_to_date() {
        let mut agent = learner(vec![0.3, -0.2, 1.0, 0.7], 0.5);
        let mut other = agent.clone();
        let mut random = Stream::new(5, "walk");
        let seen = |cell| Shielded { cell, allowed: ActionSet::ALL };
        for _ in 0..50 {
            let s = random.below(2);
            assert_eq!(agent.begin(s), other.begin(seen(s)));
            for _ in 0..random.below(6) {
                let (r, next) = (2.0 * random.uniform() - 1.0, random.below(2));
                assert_eq!(agent.step(r, next), other.step(r, seen(next)));
            }
            agent.end(0.5, Last::<usize>::Terminated);
            other.end(0.5, Last::<Shielded>::Terminated);
            let anew = Rows::new(&agent.table.q, 0.5);
            assert_eq!(agent.rows.value, anew.value);
            assert_eq!(agent.rows.weights, anew.weights);
        }
        assert_eq!(agent.q(), other.q());
    }

    #[test]
    fn the_entropy_of_a_coin_is_worth_tau_ln_2() {
        // Both actions end the episode for nothing from state 1; getting there costs 1. In the
        // end Q(1, ·) = 0, so V(1) = τ ln 2 and Q(0, ·) = -1 + 0.9 τ ln 2.
        let mut agent = learner(vec![0.0; 4], 0.5);
        for _ in 0..400 {
            agent.begin(0);
            agent.step(-1.0, 1);
            agent.end(0.0, Last::<usize>::Terminated);
        }
        for a in 0..2 {
            assert!((agent.q().unwrap().get(0, a) - (-1.0 + 0.45 * ln(2.0))).abs() < 1e-12);
        }
    }
}
