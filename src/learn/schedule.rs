//! Schedules of ε and α.

use serde::{Deserialize, Serialize};

/// What advances a schedule.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Unit {
    /// Once per episode.
    Episode,
    /// Once per step.
    Step,
}

/// A number that changes as training goes on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "schedule")]
pub enum Schedule {
    /// Always `value`.
    Constant {
        /// The value.
        value: f64,
    },
    /// From `start` to `end` in `over` equal strides, then `end`.
    Linear {
        /// Value at the beginning.
        start: f64,
        /// Value from stride `over` on.
        end: f64,
        /// Number of strides.
        over: u64,
        /// Episodes or steps.
        unit: Unit,
    },
    /// `max(min, start · factorⁿ)`, by repeated multiplication.
    Exponential {
        /// Value at the beginning.
        start: f64,
        /// Factor per stride.
        factor: f64,
        /// Lower limit.
        min: f64,
        /// Episodes or steps.
        unit: Unit,
    },
}

impl Schedule {
    /// Always `value`.
    pub fn constant(value: f64) -> Self {
        Self::Constant { value }
    }

    /// The smallest and largest value it ever takes, for validation.
    pub fn range(&self) -> (f64, f64) {
        match *self {
            Self::Constant { value } => (value, value),
            Self::Linear { start, end, .. } => (start.min(end), start.max(end)),
            Self::Exponential { start, min, .. } => (start.min(min), start.max(min)),
        }
    }
}

/// A schedule at work.
#[derive(Debug, Clone)]
pub struct ScheduleState {
    schedule: Schedule,
    n: u64,
    value: f64,
    per_step: bool,
}

impl ScheduleState {
    /// At its start.
    pub fn new(schedule: Schedule) -> Self {
        let (value, per_step) = match schedule {
            Schedule::Constant { value } => (value, false),
            Schedule::Linear { start, end, over, unit } => {
                (if over == 0 { end } else { start }, unit == Unit::Step)
            }
            Schedule::Exponential { start, min, unit, .. } => (start.max(min), unit == Unit::Step),
        };
        Self { schedule, n: 0, value, per_step }
    }

    /// The value at present.
    #[inline]
    pub fn value(&self) -> f64 {
        self.value
    }

    /// How far it has come: what [`Self::restore`] needs.
    pub fn state(&self) -> (u64, f64) {
        (self.n, self.value)
    }

    /// As far as it was at [`Self::state`].
    pub fn restore(&mut self, (n, value): (u64, f64)) {
        (self.n, self.value) = (n, value);
    }

    /// A step has been made.
    #[inline]
    pub fn step(&mut self) {
        if self.per_step {
            self.advance();
        }
    }

    /// An episode has ended.
    pub fn end_episode(&mut self) {
        if !self.per_step {
            self.advance();
        }
    }

    fn advance(&mut self) {
        self.n += 1;
        self.value = match self.schedule {
            Schedule::Constant { value } => value,
            Schedule::Linear { start, end, over, .. } => {
                if self.n >= over {
                    end
                } else {
                    start + (end - start) * (self.n as f64 / over as f64)
                }
            }
            Schedule::Exponential { factor, min, .. } => (self.value * factor).max(min),
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(schedule: Schedule, n: usize) -> Vec<f64> {
        let mut state = ScheduleState::new(schedule);
        (0..n)
            .map(|_| {
                let value = state.value();
                state.end_episode();
                value
            })
            .collect()
    }

    #[test]
    fn schedules_by_hand() {
        let unit = Unit::Episode;
        assert_eq!(values(Schedule::constant(0.3), 3), [0.3, 0.3, 0.3]);
        assert_eq!(
            values(Schedule::Linear { start: 1.0, end: 0.0, over: 4, unit }, 6),
            [1.0, 0.75, 0.5, 0.25, 0.0, 0.0]
        );
        assert_eq!(
            values(Schedule::Exponential { start: 1.0, factor: 0.5, min: 0.2, unit }, 4),
            [1.0, 0.5, 0.25, 0.2]
        );
    }

    #[test]
    fn the_unit_decides_what_advances() {
        let schedule = |unit| Schedule::Linear { start: 1.0, end: 0.0, over: 2, unit };
        let mut by_step = ScheduleState::new(schedule(Unit::Step));
        by_step.end_episode();
        assert_eq!(by_step.value(), 1.0);
        by_step.step();
        assert_eq!(by_step.value(), 0.5);
        let mut by_episode = ScheduleState::new(schedule(Unit::Episode));
        by_episode.step();
        assert_eq!(by_episode.value(), 1.0);
        by_episode.end_episode();
        assert_eq!(by_episode.value(), 0.5);
    }
}
