//! `CartPole-v0` and `CartPole-v1`: a pole stands on a cart that is pushed left or right
//! (Barto, Sutton & Anderson 1983). The dynamics are Gymnasium 1.4.0's.
//!
//! # Action Space
//! `Discrete(2)`: 0 pushes the cart to the left with 10 N, 1 to the right.
//!
//! # Observation Space
//! `Box(4, float32)`; the state is kept in float64 and rounded for the observation only.
//!
//! | # | field       | unit  | space                  | the episode ends beyond |
//! |---|-------------|-------|------------------------|-------------------------|
//! | 0 | `x`         | m     | ±4.8                   | ±2.4                    |
//! | 1 | `x_dot`     | m/s   | unbounded              |                         |
//! | 2 | `theta`     | rad   | ±0.41887903 (24°)      | ±0.20943951 (12°)       |
//! | 3 | `theta_dot` | rad/s | unbounded              |                         |
//!
//! # Rewards
//! 1 for every step, the first terminated one included; 0 for further terminated steps. With
//! `sutton_barto_reward`: 0 while the pole stands, -1 on every terminated step.
//!
//! # Starting State
//! All four numbers uniform in [-0.05, 0.05); the reset options `low` and `high` change the range.
//!
//! # Episode End
//! Terminated when the cart or the pole leaves the limits above, which are tested on the float64
//! state. Truncated after 200 steps (v0) or 500 steps (v1).
//!
//! # Arguments
//! `sutton_barto_reward` (false). The attribute `kinematics_integrator` is `"euler"` (the default)
//! or `"semi-implicit euler"`.
//!
//! # Exactness
//! All arithmetic is float64 in Gymnasium's order without fused operations, so a trajectory
//! differs from Gymnasium's only where the C library's sine or cosine is not the correctly rounded
//! one that is used here: less than one call in 300, by one unit in the last place. All recorded
//! trajectories are bit-exact. An episode that balances for hundreds of steps multiplies such a
//! unit by ten every 35 steps or so: of 200 more balanced episodes of 500 steps, one differed
//! visibly (in float32), from its step 209 on.
//!
//! Deviations:
//! 1. `kinematics_integrator` accepts those two names; Gymnasium takes anything but `"euler"` for
//!    the semi-implicit scheme.

mod draw;

use serde_json::{Map, Value};

use super::bounds;
use super::error::{EnvError, did_you_mean};
use super::kwargs::{KwargKind, KwargSpec, Kwargs};
use super::registered::{Example, Registered};
use crate::mdp::math;
use crate::mdp::numpy::NumpyRng;
use crate::mdp::{Action, Env, Field, Schema, Step, widen, within};

/// m/s².
const GRAVITY: f64 = 9.8;
/// kg.
const MASS_POLE: f64 = 0.1;
/// Cart and pole, kg.
const TOTAL_MASS: f64 = MASS_POLE + 1.0;
/// Half the pole's length, m.
const HALF_LENGTH: f64 = 0.5;
/// kg·m.
const POLE_MASS_LENGTH: f64 = MASS_POLE * HALF_LENGTH;
/// The push of either action, N.
const FORCES: [f64; 2] = [-10.0, 10.0];
/// Seconds per step.
const TAU: f64 = 0.02;
/// m.
const X_LIMIT: f64 = 2.4;
/// 12 degrees, rad.
const THETA_LIMIT: f64 = 12.0 * 2.0 * std::f64::consts::PI / 360.0;
/// The default range of every number of the starting state.
const START: (f64, f64) = (-0.05, 0.05);
/// The values of the attribute `kinematics_integrator`.
const INTEGRATORS: [&str; 2] = ["euler", "semi-implicit euler"];

/// The cart and its pole.
#[derive(Debug, Clone)]
pub struct CartPole {
    x: f64,
    x_dot: f64,
    theta: f64,
    theta_dot: f64,
    /// Whether this episode has seen a terminated step: further ones pay nothing.
    fallen: bool,
    /// The range of every number of the starting state.
    start: (f64, f64),
    sutton_barto_reward: bool,
    semi_implicit: bool,
}

impl CartPole {
    /// A cart at the origin, with the pole upright until the first reset.
    pub fn new(sutton_barto_reward: bool) -> Self {
        Self {
            x: 0.0,
            x_dot: 0.0,
            theta: 0.0,
            theta_dot: 0.0,
            fallen: false,
            start: START,
            sutton_barto_reward,
            semi_implicit: false,
        }
    }

    /// Chooses the semi-implicit Euler scheme (positions move with the *new* velocities) instead
    /// of the explicit one.
    pub fn set_semi_implicit(&mut self, semi_implicit: bool) {
        self.semi_implicit = semi_implicit;
    }

    #[inline]
    fn obs(&self) -> [f32; 4] {
        [self.x as f32, self.x_dot as f32, self.theta as f32, self.theta_dot as f32]
    }

    /// The accelerations of the cart (m/s²) and of the pole (rad/s²) under `force` (Florian 2007).
    #[inline]
    fn accelerations(&self, force: f64) -> (f64, f64) {
        // The order of every operation is Gymnasium's: each one rounds.
        let (sin, cos) = math::sin_cos(self.theta);
        let temp =
            (force + POLE_MASS_LENGTH * (self.theta_dot * self.theta_dot) * sin) / TOTAL_MASS;
        let theta_acc = (GRAVITY * sin - cos * temp)
            / (HALF_LENGTH * (4.0 / 3.0 - MASS_POLE * (cos * cos) / TOTAL_MASS));
        let x_acc = temp - POLE_MASS_LENGTH * theta_acc * cos / TOTAL_MASS;
        (x_acc, theta_acc)
    }
}

impl Env for CartPole {
    type Obs = [f32; 4];

    fn n_actions(&self) -> usize {
        2
    }

    #[inline]
    fn reset(&mut self, rng: &mut NumpyRng) -> [f32; 4] {
        let (low, high) = self.start;
        self.x = rng.uniform(low, high);
        self.x_dot = rng.uniform(low, high);
        self.theta = rng.uniform(low, high);
        self.theta_dot = rng.uniform(low, high);
        self.fallen = false;
        self.obs()
    }

    #[inline]
    fn step(&mut self, action: Action, _rng: &mut NumpyRng) -> Step<[f32; 4]> {
        // Looked up, because a random action is not foreseen, and a branch on it costs as much as
        // the rest of the step.
        let force = FORCES[usize::from(action == 1)];
        let (x_acc, theta_acc) = self.accelerations(force);
        if self.semi_implicit {
            self.x_dot += TAU * x_acc;
            self.x += TAU * self.x_dot;
            self.theta_dot += TAU * theta_acc;
            self.theta += TAU * self.theta_dot;
        } else {
            self.x += TAU * self.x_dot;
            self.x_dot += TAU * x_acc;
            self.theta += TAU * self.theta_dot;
            self.theta_dot += TAU * theta_acc;
        }
        let terminated = self.x < -X_LIMIT
            || self.x > X_LIMIT
            || self.theta < -THETA_LIMIT
            || self.theta > THETA_LIMIT;
        let reward = match (self.sutton_barto_reward, terminated) {
            (true, true) => -1.0,
            (true, false) => 0.0,
            (false, true) if self.fallen => 0.0,
            (false, _) => 1.0,
        };
        self.fallen |= terminated;
        Step { obs: self.obs(), reward, terminated }
    }

    fn set_state(&mut self, fields: &[f64]) -> Option<[f32; 4]> {
        let &[x, x_dot, theta, theta_dot] = fields else { return None };
        let x = within(x, -X_LIMIT, X_LIMIT)?;
        let theta = within(theta, -THETA_LIMIT, THETA_LIMIT)?;
        if !(x_dot.is_finite() && theta_dot.is_finite()) {
            return None;
        }
        (self.x, self.x_dot, self.theta, self.theta_dot) = (x, x_dot, theta, theta_dot);
        self.fallen = false;
        Some(self.obs())
    }

    fn schema(&self) -> Schema {
        Schema {
            fields: vec![
                Field::symmetric("x", "position of the cart, m", 2.0 * X_LIMIT),
                Field::symmetric("x_dot", "velocity of the cart, m/s", f64::INFINITY),
                Field::symmetric("theta", "angle of the pole from upright, rad", 2.0 * THETA_LIMIT),
                Field::symmetric("theta_dot", "angular velocity of the pole, rad/s", f64::INFINITY),
            ],
            facts: Vec::new(),
            actions: ["left", "right"].map(Into::into).into(),
            grid: None,
        }
    }

    #[inline]
    fn fields(&self, obs: &[f32; 4], out: &mut [f64]) {
        widen(obs, out);
    }
}

impl Registered for CartPole {
    const SUMMARY: &'static str = "balance a pole on a cart: 1 per step until it falls";

    const EXAMPLE: Example = Example {
        potential: "-20.0 * abs(s.theta) - 2.0 * abs(s.theta_dot + 4.0 * s.theta)",
        bins: "x: [-2.4, 2.4, 12], x_dot: [-3.0, 3.0, 12], theta: [-0.5, 0.5, 24], theta_dot: [-2.0, 2.0, 24]",
    };

    const KWARGS: &'static [KwargSpec] = &[KwargSpec {
        name: "sutton_barto_reward",
        kind: KwargKind::Bool,
        default: "false",
        doc: "pay 0 per step and -1 for falling, instead of 1 per step",
    }];

    const RESET_OPTIONS: &'static [&'static str] = bounds::OPTIONS;

    const ATTRIBUTES: &'static [&'static str] = &["kinematics_integrator"];

    fn from_kwargs(kwargs: &Kwargs) -> Result<Self, EnvError> {
        Ok(Self::new(kwargs.bool("sutton_barto_reward")))
    }

    fn set_reset_options(&mut self, options: &Map<String, Value>) -> Result<(), EnvError> {
        self.start = bounds::parse(options, START)?;
        Ok(())
    }

    fn set_attribute(&mut self, name: &str, value: &Value) -> Result<(), EnvError> {
        let index = INTEGRATORS.iter().position(|name| value == name).ok_or_else(|| {
            let [euler, semi_implicit] = INTEGRATORS;
            let message = format!("`{name}` must be `{euler}` or `{semi_implicit}`, not {value}");
            let error = EnvError::about(name, message);
            match value.as_str().and_then(|text| did_you_mean(text, INTEGRATORS)) {
                Some(name) => error.hint(format!("did you mean `{name}`?")),
                None => error,
            }
        })?;
        self.set_semi_implicit(index == 1);
        Ok(())
    }
}

#[cfg(test)]
mod tests;
