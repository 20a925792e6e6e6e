//! `MountainCarContinuous-v0`: the mountain car with a continuous force, paid for by its square. The
//! dynamics are Gymnasium 1.4.0's.
//!
//! # Action Space
//! `Box(-1, 1, (1,), float32)`: the force; what is beyond is clipped, but paid for in full. Agents
//! that choose among a few play `[-1]`, `[0]`, `[1]`, unless the experiment names other `actions`.
//!
//! # Observation Space
//! `Box(2, float32)`
//!
//! | # | field      | unit               | space         |
//! |---|------------|--------------------|---------------|
//! | 0 | `position` | length             | [-1.2, 0.6]   |
//! | 1 | `velocity` | length per step    | [-0.07, 0.07] |
//!
//! # Rewards
//! `-0.1 a²` for every step with the force a as given, and 100 for reaching the goal.
//!
//! # Starting State
//! The position uniform in [-0.6, -0.4), at rest; the reset options `low` and `high` change the
//! range.
//!
//! # Episode End
//! Terminated when the position is at least 0.45 with a velocity of at least `goal_velocity`.
//! Truncated after 999 steps.
//!
//! # Arguments
//! `goal_velocity` (0).
//!
//! # Exactness
//! Gymnasium's state is float64 until the first step of an episode and float32 from then on, by
//! NumPy's rules of promotion; so it is here, operation by operation. The cosine is the correctly
//! rounded one, which differs from a C library's in the last place of a few calls in a thousand; in
//! all recorded trajectories none of that reaches the observation.
//!
//! Deviations:
//! 1. `goal_velocity` must be finite.
//! 2. A force of NaN is an error in a session; Gymnasium goes on with a state of NaN.

mod draw;

use serde_json::{Map, Value};

use super::actions::ActionTable;
use super::bounds;
use super::error::EnvError;
use super::kwargs::{KwargKind, KwargSpec, Kwargs};
use super::registered::{Example, Registered};
use crate::mdp::math;
use crate::mdp::numpy::NumpyRng;
use crate::mdp::{Action, ActionSpace, Env, Field, Schema, Step, widen, within};

const MIN_POSITION: f64 = -1.2;
const MAX_POSITION: f64 = 0.6;
const MAX_SPEED: f64 = 0.07;
const GOAL_POSITION: f64 = 0.45;
const POWER: f64 = 0.0015;
const GRAVITY: f64 = 0.0025;
/// The default range of the starting position.
const START: (f64, f64) = (-0.6, -0.4);

/// The car in its valley.
#[derive(Debug, Clone)]
pub struct MountainCarContinuous {
    state: State,
    /// The range of the starting position.
    start: (f64, f64),
    goal_velocity: f64,
    actions: ActionTable,
}

/// Position and velocity, in the type that Gymnasium has them in.
#[derive(Debug, Clone, Copy, PartialEq)]
enum State {
    /// After a reset.
    Double(f64, f64),
    /// After a step.
    Single(f32, f32),
}

impl MountainCarContinuous {
    /// A car at rest in the middle of the starting range until the first reset.
    pub fn new(goal_velocity: f64) -> Self {
        let actions = ActionTable::of(&[[-1.0], [0.0], [1.0]]);
        Self { state: State::Double(-0.5, 0.0), start: START, goal_velocity, actions }
    }

    /// The position and the velocity.
    pub fn car(&self) -> (f64, f64) {
        match self.state {
            State::Double(position, velocity) => (position, velocity),
            State::Single(position, velocity) => (position.into(), velocity.into()),
        }
    }

    #[inline]
    fn at_goal(&self, position: f32, velocity: f32) -> bool {
        position >= GOAL_POSITION as f32 && velocity >= self.goal_velocity as f32
    }

    /// Pushes with `force`. The order and the type of every operation is Gymnasium's: each rounds.
    #[inline]
    fn push(&mut self, force: f32) -> Step<[f32; 2]> {
        // A float32 within the bounds stays float32, and so do its products; the bounds themselves
        // are Python's floats, and beyond them the product is float64.
        let inside = (-1.0..=1.0).contains(&force);
        let angle = match self.state {
            State::Double(position, _) => 3.0 * position,
            State::Single(position, _) => f64::from(3.0 * position),
        };
        let (narrow, wide) = if inside {
            let acceleration = force * POWER as f32 - slope_f32(angle);
            (acceleration, f64::from(acceleration))
        } else {
            let slope = GRAVITY * math::cos(angle);
            let acceleration = f64::from(force).signum() * POWER - slope;
            (acceleration as f32, acceleration)
        };
        let (position, velocity, terminated) = match self.state {
            State::Double(position, velocity) => {
                let velocity = (velocity + wide).clamp(-MAX_SPEED, MAX_SPEED);
                let position = (position + velocity).clamp(MIN_POSITION, MAX_POSITION);
                let stopped = position == MIN_POSITION && velocity < 0.0;
                let velocity = if stopped { 0.0 } else { velocity };
                let terminated = position >= GOAL_POSITION && velocity >= self.goal_velocity;
                (position as f32, velocity as f32, terminated)
            }
            State::Single(position, velocity) => {
                let (min, max, speed) =
                    (MIN_POSITION as f32, MAX_POSITION as f32, MAX_SPEED as f32);
                // The next step's cosine waits for all of this, and bounds are seldom met: a
                // branch is foreseen, a minimum and a maximum have to be waited for.
                let mut velocity = velocity + narrow;
                if !(-speed..=speed).contains(&velocity) {
                    velocity = bounded(velocity, -speed, speed);
                }
                let mut position = position + velocity;
                if position <= min || position >= max {
                    position = bounded(position, min, max);
                    if position == min && velocity < 0.0 {
                        velocity = 0.0;
                    }
                }
                (position, velocity, self.at_goal(position, velocity))
            }
        };
        self.state = State::Single(position, velocity);
        let goal = if terminated { 100.0 } else { 0.0 };
        let force = f64::from(force);
        Step { obs: [position, velocity], reward: goal - force * force * 0.1, terminated }
    }
}

/// `GRAVITY * cos(angle)`, each rounded to float64, and then to float32.
#[inline]
fn slope_f32(angle: f64) -> f32 {
    // Beyond what the coarse cosine is off, the product and the exact one round once each.
    const ERROR: f64 = GRAVITY * (1.5 * math::COARSE_ERROR);
    let slope = GRAVITY * math::coarse_cos(angle);
    let (low, high) = ((slope - ERROR) as f32, (slope + ERROR) as f32);
    // Rounding is monotone: the exact slope is between these two. Not so one time in 10^5 or less.
    if low == high { low } else { exact_slope_f32(angle) }
}

#[cold]
#[inline(never)]
fn exact_slope_f32(angle: f64) -> f32 {
    (GRAVITY * math::cos(angle)) as f32
}

/// `x` between `low` and `high`.
#[cold]
#[inline(never)]
fn bounded(x: f32, low: f32, high: f32) -> f32 {
    x.clamp(low, high)
}

impl Env for MountainCarContinuous {
    type Obs = [f32; 2];

    fn n_actions(&self) -> usize {
        self.actions.len()
    }

    fn action_space(&self) -> ActionSpace {
        ActionSpace::Box { low: &[-1.0], high: &[1.0] }
    }

    #[inline]
    fn reset(&mut self, rng: &mut NumpyRng) -> [f32; 2] {
        let (low, high) = self.start;
        let position = rng.uniform(low, high);
        self.state = State::Double(position, 0.0);
        [position as f32, 0.0]
    }

    #[inline]
    fn step(&mut self, action: Action, _rng: &mut NumpyRng) -> Step<[f32; 2]> {
        self.push(self.actions.scalar(action))
    }

    #[inline]
    fn step_box(&mut self, action: &[f32], _rng: &mut NumpyRng) -> Step<[f32; 2]> {
        self.push(action[0])
    }

    fn set_state(&mut self, fields: &[f64]) -> Option<[f32; 2]> {
        let &[position, velocity] = fields else { return None };
        // In float32, as after every step.
        let position = within(position, MIN_POSITION, MAX_POSITION)? as f32;
        let velocity = within(velocity, -MAX_SPEED, MAX_SPEED)? as f32;
        if self.at_goal(position, velocity) {
            return None;
        }
        self.state = State::Single(position, velocity);
        Some([position, velocity])
    }

    fn schema(&self) -> Schema {
        Schema {
            fields: vec![
                Field::float(
                    "position",
                    "position of the car; the goal is at 0.45, the valley's floor at -0.5236",
                    MIN_POSITION,
                    MAX_POSITION,
                ),
                Field::float(
                    "velocity",
                    "velocity of the car, position per step",
                    -MAX_SPEED,
                    MAX_SPEED,
                ),
            ],
            facts: Vec::new(),
            actions: self.actions.names(),
            grid: None,
        }
    }

    #[inline]
    fn fields(&self, obs: &[f32; 2], out: &mut [f64]) {
        widen(obs, out);
    }
}

impl Registered for MountainCarContinuous {
    const SUMMARY: &'static str = "swing a weak car up a hill with as little force as possible";

    const EXAMPLE: Example = Example {
        potential: "20.0 * abs(s.velocity) / 0.07 + 20.0 * sin(3.0 * s.position)",
        bins: "position: [-1.2, 0.6, 40], velocity: [-0.07, 0.07, 40]",
    };

    const KWARGS: &'static [KwargSpec] = &[KwargSpec {
        name: "goal_velocity",
        kind: KwargKind::Float,
        default: "0",
        doc: "the least velocity at which the goal counts as reached",
    }];

    const RESET_OPTIONS: &'static [&'static str] = bounds::OPTIONS;

    fn from_kwargs(kwargs: &Kwargs) -> Result<Self, EnvError> {
        Ok(Self::new(kwargs.float("goal_velocity")))
    }

    fn set_reset_options(&mut self, options: &Map<String, Value>) -> Result<(), EnvError> {
        self.start = bounds::parse(options, START)?;
        Ok(())
    }

    fn action_table(&self) -> Option<&ActionTable> {
        Some(&self.actions)
    }

    fn set_action_table(&mut self, table: ActionTable) {
        self.actions = table;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(position: f32, velocity: f32) -> MountainCarContinuous {
        MountainCarContinuous {
            state: State::Single(position, velocity),
            ..MountainCarContinuous::new(0.0)
        }
    }

    #[test]
    fn a_force_beyond_the_bounds_moves_no_further_but_costs_more() {
        let (mut one, mut four) = (at(-0.5, 0.01), at(-0.5, 0.01));
        let (a, b) = (one.push(1.0), four.push(4.0));
        assert!((a.obs[1] - b.obs[1]).abs() < 1e-8);
        assert_eq!((a.reward, b.reward), (-0.1, -1.6));
    }

    #[test]
    fn the_fast_slope_is_the_exact_one() {
        let mut stream = crate::mdp::streams::Stream::new(0, "slope");
        for _ in 0..1_000_000 {
            // Positions as they occur, and some that do not.
            let position = (-1.3 + 2.0 * stream.uniform()) as f32;
            let angle = f64::from(3.0 * position);
            assert_eq!(slope_f32(angle).to_bits(), exact_slope_f32(angle).to_bits(), "{angle}");
        }
        for angle in [std::f64::consts::FRAC_PI_2, -std::f64::consts::FRAC_PI_2, 1e9, 0.0] {
            assert_eq!(slope_f32(angle).to_bits(), exact_slope_f32(angle).to_bits(), "{angle}");
        }
    }

    #[test]
    fn the_goal_pays_100_and_the_left_end_stops_the_car() {
        let step = at(0.449, 0.03).push(1.0);
        assert_eq!((step.terminated, step.reward), (true, 100.0 - 0.1));
        let step = at(-1.19, -0.06).push(-1.0);
        assert_eq!((step.obs, step.terminated), ([-1.2, 0.0], false));
        let mut demanding = MountainCarContinuous { goal_velocity: 0.05, ..at(0.449, 0.03) };
        assert!(!demanding.push(1.0).terminated);
    }
}
