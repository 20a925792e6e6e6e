//! `MountainCar-v0`: a car too weak to climb a hill must swing up to it (Moore 1990). The dynamics
//! are Gymnasium 1.4.0's.
//!
//! # Action Space
//! `Discrete(3)`: 0 accelerates to the left, 1 not at all, 2 to the right.
//!
//! # Observation Space
//! `Box(2, float32)`; the state is kept in float64 and rounded for the observation only.
//!
//! | # | field      | unit               | space         |
//! |---|------------|--------------------|---------------|
//! | 0 | `position` | length             | [-1.2, 0.6]   |
//! | 1 | `velocity` | length per step    | [-0.07, 0.07] |
//!
//! # Rewards
//! -1 for every step.
//!
//! # Starting State
//! The position uniform in [-0.6, -0.4), at rest; the reset options `low` and `high` change the
//! range.
//!
//! # Episode End
//! Terminated when the position is at least 0.5 with a velocity of at least `goal_velocity`
//! (tested on the float64 state). Truncated after 200 steps.
//!
//! # Arguments
//! `goal_velocity` (0).
//!
//! # Exactness
//! All arithmetic is float64 in Gymnasium's order without fused operations; the cosine is the
//! correctly rounded one, which differs from a C library's in the last place of a few calls in a
//! thousand. In all recorded trajectories none of that reaches the float32 observation.
//!
//! Deviations:
//! 1. `goal_velocity` must be finite; Gymnasium takes a NaN, and then no episode terminates.

mod draw;

pub(in crate::env) use draw::valley;

use serde_json::{Map, Value};

use super::bounds;
use super::error::EnvError;
use super::kwargs::{KwargKind, KwargSpec, Kwargs};
use super::registered::{Example, Registered};
use crate::mdp::math;
use crate::mdp::numpy::NumpyRng;
use crate::mdp::{Action, Env, Field, Schema, Step, widen, within};

const MIN_POSITION: f64 = -1.2;
const MAX_POSITION: f64 = 0.6;
const MAX_SPEED: f64 = 0.07;
const GOAL_POSITION: f64 = 0.5;
const FORCE: f64 = 0.001;
const GRAVITY: f64 = 0.0025;
/// The default range of the starting position.
const START: (f64, f64) = (-0.6, -0.4);

/// The car in its valley.
#[derive(Debug, Clone)]
pub struct MountainCar {
    position: f64,
    velocity: f64,
    /// The range of the starting position.
    start: (f64, f64),
    goal_velocity: f64,
}

impl MountainCar {
    /// A car at rest in the middle of the starting range until the first reset.
    pub fn new(goal_velocity: f64) -> Self {
        Self { position: -0.5, velocity: 0.0, start: START, goal_velocity }
    }

    #[inline]
    fn obs(&self) -> [f32; 2] {
        [self.position as f32, self.velocity as f32]
    }

    #[inline]
    fn at_goal(&self, position: f64, velocity: f64) -> bool {
        position >= GOAL_POSITION && velocity >= self.goal_velocity
    }
}

/// `x` between `low` and `high`.
#[cold]
#[inline(never)]
fn bounded(x: f64, low: f64, high: f64) -> f64 {
    x.clamp(low, high)
}

impl Env for MountainCar {
    type Obs = [f32; 2];

    fn n_actions(&self) -> usize {
        3
    }

    #[inline]
    fn reset(&mut self, rng: &mut NumpyRng) -> [f32; 2] {
        let (low, high) = self.start;
        self.position = rng.uniform(low, high);
        self.velocity = 0.0;
        self.obs()
    }

    #[inline]
    fn step(&mut self, action: Action, _rng: &mut NumpyRng) -> Step<[f32; 2]> {
        // The order of every operation is Gymnasium's: each one rounds.
        self.velocity +=
            (action as f64 - 1.0) * FORCE + math::cos(3.0 * self.position) * (-GRAVITY);
        // The next step's cosine waits for all of this, and bounds are seldom met: a branch is
        // foreseen, a minimum and a maximum have to be waited for.
        if !(-MAX_SPEED..=MAX_SPEED).contains(&self.velocity) {
            self.velocity = bounded(self.velocity, -MAX_SPEED, MAX_SPEED);
        }
        self.position += self.velocity;
        if self.position <= MIN_POSITION || self.position >= MAX_POSITION {
            self.position = bounded(self.position, MIN_POSITION, MAX_POSITION);
            if self.position == MIN_POSITION && self.velocity < 0.0 {
                self.velocity = 0.0;
            }
        }
        let terminated = self.at_goal(self.position, self.velocity);
        Step { obs: self.obs(), reward: -1.0, terminated }
    }

    fn set_state(&mut self, fields: &[f64]) -> Option<[f32; 2]> {
        let &[position, velocity] = fields else { return None };
        let position = within(position, MIN_POSITION, MAX_POSITION)?;
        let velocity = within(velocity, -MAX_SPEED, MAX_SPEED)?;
        if self.at_goal(position, velocity) {
            return None;
        }
        (self.position, self.velocity) = (position, velocity);
        Some(self.obs())
    }

    fn schema(&self) -> Schema {
        Schema {
            fields: vec![
                Field::float(
                    "position",
                    "position of the car; the goal is at 0.5, the valley's floor at -0.5236",
                    MIN_POSITION,
                    MAX_POSITION,
                ),
                Field::symmetric("velocity", "velocity of the car, position per step", MAX_SPEED),
            ],
            facts: Vec::new(),
            actions: ["left", "none", "right"].map(Into::into).into(),
            grid: None,
        }
    }

    #[inline]
    fn fields(&self, obs: &[f32; 2], out: &mut [f64]) {
        widen(obs, out);
    }
}

impl Registered for MountainCar {
    const SUMMARY: &'static str = "swing a weak car up a hill: -1 per step until it is there";

    const EXAMPLE: Example = Example {
        potential: "80.0 * (abs(s.velocity) / 0.07 - 1.0)",
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
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rng() -> NumpyRng {
        NumpyRng::from_u64(0)
    }

    #[test]
    fn one_step_by_hand() {
        // cos 0 = 1: at the top of the slope gravity takes 0.0025 and the engine gives 0.001.
        let mut env = MountainCar::new(0.0);
        env.position = 0.0;
        let step = env.step(2, &mut rng());
        assert_eq!(env.velocity, 0.001 - 0.0025);
        assert_eq!(env.position, 0.001 - 0.0025);
        assert_eq!(step, Step { obs: [-0.0015, -0.0015], reward: -1.0, terminated: false });
        // cos(3π/6) is nearly 0: at the floor of the valley nothing moves a coasting car.
        env.position = -std::f64::consts::FRAC_PI_6;
        env.velocity = 0.0;
        env.step(1, &mut rng());
        assert!(env.velocity.abs() < 1e-18);
    }

    #[test]
    fn float64_states_are_gymnasiums() {
        // One step of Gymnasium each: (action, state, bits of the next state). The float32
        // observations would hide most roundings.
        #[rustfmt::skip]
        let steps = [
            (0, [-0.1648, 0.0277], [0xbfc1_f55f_0529_0304, 0x3f99_165c_a03d_d84e]),
            (1, [-0.1805, 0.0417], [0xbfc2_0a66_0d36_b03f, 0x3fa4_40e6_c500_61d4]),
            (2, [-1.0406, 0.0029], [0xbff0_8c15_d00a_4468, 0x3f7a_365f_7936_e244]),
            (0, [-0.411, -0.0438], [0xbfdd_3966_d5ff_6abc, 0xbfa7_5c9f_22ab_76a7]),
            (1, [-0.138, 0.0353], [0xbfba_e08b_bc46_9ac4, 0x3fa0_e6d8_2524_f788]),
            (2, [-0.2106, -0.024], [0xbfce_28b6_207f_3b10, 0xbf99_9e2a_41d3_57de]),
            (0, [0.1598, 0.0009], [0x3fc4_285d_4237_790e, 0xbf62_fd93_2ef5_1716]),
            (1, [-0.3337, 0.0253], [0xbfd3_d2eb_1fea_81e5, 0x3f98_86c1_ec0b_4950]),
        ];
        for (action, [position, velocity], bits) in steps {
            let mut env = MountainCar { position, velocity, ..MountainCar::new(0.0) };
            env.step(action, &mut rng());
            assert_eq!([env.position, env.velocity].map(f64::to_bits), bits);
        }
    }

    #[test]
    fn speed_is_clipped_and_the_left_wall_stops_the_car() {
        let mut env = MountainCar::new(0.0);
        env.velocity = 1.0;
        env.step(2, &mut rng());
        assert_eq!(env.velocity, 0.07);
        env.position = -1.19;
        env.velocity = -0.05;
        let step = env.step(0, &mut rng());
        assert_eq!(step.obs, [-1.2, 0.0]);
    }

    #[test]
    fn the_goal_needs_its_velocity() {
        for (goal_velocity, terminated) in [(0.0, true), (0.045, true), (0.0699, false)] {
            let mut env = MountainCar::new(goal_velocity);
            env.position = 0.5;
            env.velocity = 0.07;
            // Gravity at 0.5 is 0.0025 * cos 1.5 = 0.000177, the engine pushes on.
            assert_eq!(env.step(1, &mut rng()).terminated, terminated, "{goal_velocity}");
        }
    }
}
