//! Step sizes: constant, by a schedule, or by the number of visits.

use super::{Schedule, ScheduleState};
use crate::mdp::math::pow;

/// A step size α for every pair (s, a) of a table.
pub trait Rate {
    /// α of an update of `pair`, which counts as a visit and as a step.
    fn visit(&mut self, pair: usize) -> f64;

    /// Tells a per-episode schedule that an episode has ended.
    fn end_episode(&mut self);
}

impl Rate for ScheduleState {
    #[inline]
    fn visit(&mut self, _pair: usize) -> f64 {
        let alpha = self.value();
        self.step();
        alpha
    }

    fn end_episode(&mut self) {
        Self::end_episode(self);
    }
}

/// Where a step size comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AlphaSource {
    /// A constant or a schedule, the same for every pair.
    Schedule(Schedule),
    /// `N(s, a)^−omega`, N counting the pair's updates, the present one included. With 1 the value
    /// is the mean of its targets; values above 1/2 converge (Robbins & Monro 1951).
    VisitCount {
        /// ω, above 0 and at most 1.
        omega: f64,
    },
}

/// Any step size at work.
#[derive(Debug, Clone)]
pub enum StepSize {
    /// The same for every pair.
    Schedule(ScheduleState),
    /// By the number of visits.
    VisitCount {
        /// ω.
        omega: f64,
        /// N, one per pair.
        visits: Vec<u32>,
        /// α of each pair's latest visit.
        rates: Vec<f64>,
    },
}

impl StepSize {
    /// For `n_pairs` pairs.
    pub fn new(source: AlphaSource, n_pairs: usize) -> Self {
        match source {
            AlphaSource::Schedule(schedule) => Self::Schedule(ScheduleState::new(schedule)),
            AlphaSource::VisitCount { omega } => {
                Self::VisitCount { omega, visits: vec![0; n_pairs], rates: vec![1.0; n_pairs] }
            }
        }
    }

    /// α of `pair` without a visit: a schedule's present value, or that of the latest visit.
    #[inline]
    pub fn of(&self, pair: usize) -> f64 {
        match self {
            Self::Schedule(schedule) => schedule.value(),
            Self::VisitCount { rates, .. } => rates[pair],
        }
    }

    /// The latest α of each pair, where they differ from pair to pair.
    pub(super) fn rates(&self) -> Option<&[f64]> {
        match self {
            Self::Schedule(_) => None,
            Self::VisitCount { rates, .. } => Some(rates),
        }
    }
}

impl Rate for StepSize {
    #[inline]
    fn visit(&mut self, pair: usize) -> f64 {
        match self {
            Self::Schedule(schedule) => schedule.visit(pair),
            Self::VisitCount { omega, visits, rates } => {
                visits[pair] = visits[pair].saturating_add(1);
                let n = f64::from(visits[pair]);
                rates[pair] = pow(n, -*omega);
                rates[pair]
            }
        }
    }

    fn end_episode(&mut self) {
        if let Self::Schedule(schedule) = self {
            schedule.end_episode();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn visit_counts_by_hand() {
        let mut alpha = StepSize::new(AlphaSource::VisitCount { omega: 1.0 }, 2);
        assert_eq!(
            [alpha.visit(0), alpha.visit(0), alpha.visit(1), alpha.visit(0)],
            [1.0, 0.5, 1.0, 1.0 / 3.0]
        );
        assert_eq!(alpha.of(0), 1.0 / 3.0);
        let mut alpha = StepSize::new(AlphaSource::VisitCount { omega: 0.5 }, 1);
        let four: Vec<f64> = (0..4).map(|_| alpha.visit(0)).collect();
        assert_eq!([four[0], four[3]], [1.0, 0.5]);
    }

    #[test]
    fn a_schedule_is_the_same_for_every_pair() {
        let unit = crate::learn::Unit::Step;
        let schedule = Schedule::Linear { start: 1.0, end: 0.0, over: 4, unit };
        let mut alpha = StepSize::new(AlphaSource::Schedule(schedule), 9);
        assert_eq!([alpha.visit(3), alpha.visit(8), alpha.visit(3)], [1.0, 0.75, 0.5]);
        assert_eq!(alpha.of(0), 0.25);
        assert!(alpha.rates().is_none());
    }
}
