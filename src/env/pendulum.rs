//! `Pendulum-v1`: swing a pendulum up and hold it there with a torque that is too weak to lift it.
//! The dynamics are Gymnasium 1.4.0's.
//!
//! # Action Space
//! `Box(-2, 2, (1,), float32)`: the torque on the joint, N·m; what is beyond is clipped. Agents
//! that choose among a few play `[-2]`, `[-1]`, `[0]`, `[1]`, `[2]`, unless the experiment names
//! other `actions`.
//!
//! # Observation Space
//! `Box(3, float32)`; the state (angle and angular velocity) is kept in float64.
//!
//! | # | field | unit  | space   |
//! |---|-------|-------|---------|
//! | 0 | `cos` |       | [-1, 1] | of the angle from upright
//! | 1 | `sin` |       | [-1, 1] |
//! | 2 | `dot` | rad/s | [-8, 8] |
//!
//! # Rewards
//! `-(θ² + 0.1 θ̇² + 0.001 u²)`, with the angle from upright in [-π, π] before the step and the
//! clipped torque u; from -16.2736 to 0 per step.
//!
//! # Starting State
//! The angle uniform in [-π, π), the angular velocity in [-1, 1); the reset options `x_init` and
//! `y_init` are the ends of these ranges.
//!
//! # Episode End
//! Never terminated. Truncated after 200 steps.
//!
//! # Arguments
//! `g` (10): the acceleration of gravity, m/s².
//!
//! # Exactness
//! The angle's dynamics are float64 in Gymnasium's order without fused operations, the torque is
//! float32, and so is its share of the cost. Sine and cosine are the correctly rounded ones, and
//! squares are correctly rounded products, while Gymnasium calls the C library's `sin`, `cos`,
//! `pow` and `powf`; all differ from the correctly rounded result in a few calls in a thousand, by
//! one unit in the last place. In 4900 recorded steps no observation differs, and 15 rewards do, by
//! at most 2.4e-10 (one unit of the float32 share of the torque). Where a policy balances the
//! pendulum for long, observations may part after some 80 steps.
//!
//! Deviations:
//! 1. `g` must be finite; Gymnasium takes a NaN, and then every number is one.
//! 2. A torque of NaN is an error in a session; Gymnasium goes on with a state of NaN.

mod draw;

use serde_json::{Map, Value};

use super::actions::ActionTable;
use super::bounds;
use super::error::EnvError;
use super::kwargs::{KwargKind, KwargSpec, Kwargs};
use super::registered::{Example, Registered};
use crate::mdp::math;
use crate::mdp::numpy::NumpyRng;
use crate::mdp::{Action, ActionSpace, Env, Field, Schema, Step, angle, widen, within};

/// rad/s.
const MAX_SPEED: f64 = 8.0;
/// N·m.
const MAX_TORQUE: f32 = 2.0;
/// Seconds per step.
const DT: f64 = 0.05;
/// kg, and m.
const MASS: f64 = 1.0;
const LENGTH: f64 = 1.0;
const PI: f64 = std::f64::consts::PI;
const TURN: f64 = 2.0 * PI;
/// The default ends of the starting ranges.
const START: (f64, f64) = (PI, 1.0);

/// The pendulum.
#[derive(Debug, Clone)]
pub struct Pendulum {
    theta: f64,
    theta_dot: f64,
    /// The ends of the ranges of the starting angle and angular velocity.
    start: (f64, f64),
    g: f64,
    actions: ActionTable,
}

impl Pendulum {
    /// A pendulum hanging at rest until the first reset; `g` in m/s².
    pub fn new(g: f64) -> Self {
        let actions = ActionTable::of(&[[-2.0], [-1.0], [0.0], [1.0], [2.0]]);
        Self { theta: PI, theta_dot: 0.0, start: START, g, actions }
    }

    /// The angle from upright, rad, not wrapped, and the angular velocity, rad/s.
    pub fn angle(&self) -> (f64, f64) {
        (self.theta, self.theta_dot)
    }

    #[inline]
    fn obs(&self) -> [f32; 3] {
        let (sin, cos) = math::sin_cos(self.theta);
        [cos as f32, sin as f32, self.theta_dot as f32]
    }

    /// Applies `torque` for a step. The order of every operation is Gymnasium's: each one rounds.
    #[inline]
    fn swing(&mut self, torque: f32) -> Step<[f32; 3]> {
        let u = torque.clamp(-MAX_TORQUE, MAX_TORQUE);
        let angle = wrap(self.theta);
        let effort = 0.001f32 * (u * u);
        let cost = (angle * angle + 0.1 * (self.theta_dot * self.theta_dot)) + f64::from(effort);
        let gravity = 3.0 * self.g / (2.0 * LENGTH) * math::sin(self.theta);
        // 3 / (m l²) is 3 here, and float32 like the torque.
        let push = (3.0 / (MASS * LENGTH * LENGTH)) as f32 * u;
        let speed = self.theta_dot + (gravity + f64::from(push)) * DT;
        self.theta_dot = speed.clamp(-MAX_SPEED, MAX_SPEED);
        self.theta += self.theta_dot * DT;
        Step { obs: self.obs(), reward: -cost, terminated: false }
    }
}

/// The angle in [-π, π): `((x + π) mod 2π) - π` with Python's modulo, whose result is not negative.
#[inline]
fn wrap(x: f64) -> f64 {
    let x = x + PI;
    // `%` is exact, so the commonest cases need no division.
    let rest = if (0.0..TURN).contains(&x) { x } else { x % TURN };
    (if rest < 0.0 { rest + TURN } else { rest }) - PI
}

impl Env for Pendulum {
    type Obs = [f32; 3];

    fn n_actions(&self) -> usize {
        self.actions.len()
    }

    fn action_space(&self) -> ActionSpace {
        ActionSpace::Box { low: &[-MAX_TORQUE], high: &[MAX_TORQUE] }
    }

    #[inline]
    fn reset(&mut self, rng: &mut NumpyRng) -> [f32; 3] {
        let (x, y) = self.start;
        self.theta = rng.uniform(-x, x);
        self.theta_dot = rng.uniform(-y, y);
        self.obs()
    }

    #[inline]
    fn step(&mut self, action: Action, _rng: &mut NumpyRng) -> Step<[f32; 3]> {
        self.swing(self.actions.scalar(action))
    }

    #[inline]
    fn step_box(&mut self, action: &[f32], _rng: &mut NumpyRng) -> Step<[f32; 3]> {
        self.swing(action[0])
    }

    fn set_state(&mut self, fields: &[f64]) -> Option<[f32; 3]> {
        let &[cos, sin, dot] = fields else { return None };
        let theta = angle(cos, sin)?;
        self.theta_dot = within(dot, -MAX_SPEED, MAX_SPEED)?;
        self.theta = theta;
        Some(self.obs())
    }

    fn schema(&self) -> Schema {
        Schema {
            fields: vec![
                Field::symmetric("cos", "cosine of the angle from upright", 1.0),
                Field::symmetric("sin", "sine of the angle from upright", 1.0),
                Field::symmetric("dot", "angular velocity, rad/s", MAX_SPEED),
            ],
            facts: Vec::new(),
            actions: self.actions.names(),
            grid: None,
        }
    }

    #[inline]
    fn fields(&self, obs: &[f32; 3], out: &mut [f64]) {
        widen(obs, out);
    }
}

impl Registered for Pendulum {
    const SUMMARY: &'static str =
        "swing a pendulum up and hold it there: the less torque the better";

    const EXAMPLE: Example = Example {
        potential: "-10.0 * (1.0 - s.cos) - 0.1 * s.dot * s.dot",
        bins: "cos: [-1.0, 1.0, 11], sin: [-1.0, 1.0, 11], dot: [-8.0, 8.0, 17]",
    };

    const KWARGS: &'static [KwargSpec] = &[KwargSpec {
        name: "g",
        kind: KwargKind::Float,
        default: "10",
        doc: "acceleration of gravity, m/s²",
    }];

    const RESET_OPTIONS: &'static [&'static str] = &["x_init", "y_init"];

    fn from_kwargs(kwargs: &Kwargs) -> Result<Self, EnvError> {
        Ok(Self::new(kwargs.float("g")))
    }

    fn set_reset_options(&mut self, options: &Map<String, Value>) -> Result<(), EnvError> {
        let end = |key: &str, default: f64| bounds::symmetric(options, key, default);
        self.start = (end("x_init", START.0)?, end("y_init", START.1)?);
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

    #[test]
    fn angles_wrap_as_in_python() {
        // Python: ((x + math.pi) % (2 * math.pi)) - math.pi
        for (x, wrapped) in [
            (0.5, 0.5),
            (4.0, -2.283_185_307_179_586_2),
            (-4.0, 2.283_185_307_179_586_2),
            (100.0, -0.530_964_914_873_376_2),
            (-100.0, 0.530_964_914_873_383_3),
            (-PI, -PI),
        ] {
            assert_eq!(wrap(x).to_bits(), f64::to_bits(wrapped), "{x}: {}", wrap(x));
        }
    }

    #[test]
    fn one_step_by_hand() {
        let mut env = Pendulum { theta: 0.0, theta_dot: 1.0, ..Pendulum::new(10.0) };
        let step = env.swing(5.0);
        // Upright there is no torque from gravity: 3 u dt = 0.3, and the torque is clipped to 2.
        assert_eq!(env.theta_dot, 1.0 + 6.0 * 0.05);
        assert_eq!(env.theta, env.theta_dot * 0.05);
        assert_eq!(step.reward, -(0.1 + f64::from(0.004f32)));
        assert!(!step.terminated);
    }

    #[test]
    fn hanging_still_costs_the_most_at_rest() {
        let mut env = Pendulum { theta: PI, theta_dot: 0.0, ..Pendulum::new(10.0) };
        assert_eq!(env.swing(0.0).reward, -(PI * PI));
        let mut fast = Pendulum { theta: 1.0, theta_dot: 7.9, ..Pendulum::new(10.0) };
        fast.swing(2.0);
        assert_eq!(fast.theta_dot, MAX_SPEED);
    }
}
