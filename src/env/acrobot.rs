//! `Acrobot-v1`: two links hang from a joint; a motor between them must swing the tip up (Sutton
//! 1996). The dynamics are Gymnasium 1.4.0's.
//!
//! # Action Space
//! `Discrete(3)`: 0 applies a torque of -1 N·m between the links, 1 none, 2 one of +1 N·m.
//!
//! # Observation Space
//! `Box(6, float32)`; the state (two angles and their velocities) is kept in float64. The first
//! angle is the first link's from hanging down, the second the second link's from the first.
//!
//! | # | field  | unit  | space  |
//! |---|--------|-------|--------|
//! | 0 | `cos1` |       | ±1     |
//! | 1 | `sin1` |       | ±1     |
//! | 2 | `cos2` |       | ±1     |
//! | 3 | `sin2` |       | ±1     |
//! | 4 | `dot1` | rad/s | ±4π    |
//! | 5 | `dot2` | rad/s | ±9π    |
//!
//! # Rewards
//! -1 for every step, 0 for the one that reaches the height.
//!
//! # Starting State
//! All four numbers uniform in [-0.1, 0.1), rounded to float32; the reset options `low` and `high`
//! change the range.
//!
//! # Episode End
//! Terminated when the tip is more than one link above the joint: -cos θ₁ - cos(θ₁ + θ₂) > 1.
//! Truncated after 500 steps.
//!
//! # Arguments
//! None. Attributes: `book_or_nips` ("book": the equations of Sutton & Barto's book, with the
//! erratum's sign; or "nips": those of the paper), `torque_noise_max` (0: the greatest torque that
//! is added at random, N·m), `dt` (0.2 s per step).
//!
//! # Exactness
//! One Runge-Kutta step of fourth order in float64, in Gymnasium's order without fused operations.
//! The observation of a reset uses NumPy's own float32 sine and cosine, reproduced bit for bit.
//! Elsewhere sine, cosine and squares are correctly rounded, while Gymnasium calls the C library's
//! `sin`, `cos` and `pow`, which differ from that in a few calls in a thousand, by one unit in the
//! last place. In the recordings no observation differs in the first 150 steps of an episode;
//! after that an episode that swings high may part by 1e-5 or, near its end, 1e-3.
//!
//! Deviations:
//! 1. Actions are 0 to 2; Gymnasium takes -1 to -3 as well, by Python's negative indices.
//! 2. `book_or_nips`, `torque_noise_max` and `dt` are checked: a misspelt name, a negative noise or
//!    a `dt` that is not positive is an error.
//! 3. A starting angle beyond 71 476 rad, where NumPy's float32 polynomials end, is observed through
//!    the float64 functions.

mod draw;

use serde_json::{Map, Value};

use super::bounds;
use super::error::{EnvError, did_you_mean};
use super::kwargs::{KwargSpec, Kwargs};
use super::registered::{Example, Registered};
use crate::mdp::math;
use crate::mdp::numpy::{NumpyRng, sin_cos_f32};
use crate::mdp::{Action, Env, Field, Schema, Step, angle, widen, within};

const PI: f64 = std::f64::consts::PI;
/// rad/s.
const MAX_SPEED_1: f64 = 4.0 * PI;
/// rad/s.
const MAX_SPEED_2: f64 = 9.0 * PI;
/// The default range of every number of the starting state.
const START: (f64, f64) = (-0.1, 0.1);
/// The values of the attribute `book_or_nips`.
const EQUATIONS: [&str; 2] = ["book", "nips"];
const ATTRIBUTES: &[&str] = &["book_or_nips", "torque_noise_max", "dt"];

/// θ₁, θ₂ (rad) and their velocities (rad/s), or the derivatives of these.
type Four = [f64; 4];

/// The two links.
#[derive(Debug, Clone)]
pub struct Acrobot {
    state: Four,
    /// The range of every number of the starting state.
    start: (f64, f64),
    nips: bool,
    torque_noise_max: f64,
    dt: f64,
}

impl Default for Acrobot {
    /// Both links hanging down until the first reset.
    fn default() -> Self {
        Self { state: [0.0; 4], start: START, nips: false, torque_noise_max: 0.0, dt: 0.2 }
    }
}

impl Acrobot {
    /// θ₁ and θ₂, rad: the first link's angle from hanging down, the second's from the first.
    pub fn angles(&self) -> (f64, f64) {
        (self.state[0], self.state[1])
    }

    /// The time derivative of `y` under `torque`: every link has mass, length and moment of
    /// inertia 1, and its centre in the middle.
    #[inline]
    fn derivative(&self, y: &Four, torque: f64) -> Four {
        // The order of every operation is Gymnasium's: each one rounds.
        let &[t1, t2, w1, w2] = y;
        let (s2, c2) = math::sin_cos(t2);
        let d1 = 0.25 + 1.0 * (1.25 + 1.0 * c2) + 1.0 + 1.0;
        let d2 = (0.25 + 0.5 * c2) + 1.0;
        let phi2 = 4.9 * math::cos((t1 + t2) - PI / 2.0);
        let phi1 = ((-0.5 * (w2 * w2)) * s2 - ((1.0 * w2) * w1) * s2)
            + 14.700_000_000_000_001 * math::cos(t1 - PI / 2.0)
            + phi2;
        let a2 = if self.nips {
            ((torque + (d2 / d1) * phi1) - phi2) / (1.25 - (d2 * d2) / d1)
        } else {
            (((torque + (d2 / d1) * phi1) - (0.5 * (w1 * w1)) * s2) - phi2)
                / (1.25 - (d2 * d2) / d1)
        };
        let a1 = -(d2 * a2 + phi1) / d1;
        [w1, w2, a1, a2]
    }

    /// The state after one step of Runge-Kutta's method of fourth order.
    #[inline]
    fn integrate(&self, torque: f64) -> Four {
        let (y, dt) = (self.state, self.dt);
        let half = dt / 2.0;
        let ahead = |h: f64, k: &Four| std::array::from_fn(|i| y[i] + h * k[i]);
        let k1 = self.derivative(&y, torque);
        let k2 = self.derivative(&ahead(half, &k1), torque);
        let k3 = self.derivative(&ahead(half, &k2), torque);
        let k4 = self.derivative(&ahead(dt, &k3), torque);
        let sixth = dt / 6.0;
        std::array::from_fn(|i| y[i] + sixth * (((k1[i] + 2.0 * k2[i]) + 2.0 * k3[i]) + k4[i]))
    }
}

/// What a state after a step looks like, and whether the tip is high enough.
#[inline]
fn seen(&[t1, t2, w1, w2]: &Four) -> ([f32; 6], bool) {
    let ((s1, c1), (s2, c2)) = (math::sin_cos(t1), math::sin_cos(t2));
    let terminated = (-c1) - math::cos(t2 + t1) > 1.0;
    ([c1, s1, c2, s2, w1, w2].map(|x| x as f32), terminated)
}

/// The angle in [-π, π], by whole turns.
#[inline]
fn wrap(mut x: f64) -> f64 {
    while x > PI {
        x -= 2.0 * PI;
    }
    while x < -PI {
        x += 2.0 * PI;
    }
    x
}

impl Env for Acrobot {
    type Obs = [f32; 6];

    fn n_actions(&self) -> usize {
        3
    }

    #[inline]
    fn reset(&mut self, rng: &mut NumpyRng) -> [f32; 6] {
        let (low, high) = self.start;
        let start: [f32; 4] = std::array::from_fn(|_| rng.uniform(low, high) as f32);
        self.state = start.map(f64::from);
        let [t1, t2, w1, w2] = start;
        let ((s1, c1), (s2, c2)) = (sin_cos_f32(t1), sin_cos_f32(t2));
        [c1, s1, c2, s2, w1, w2]
    }

    #[inline]
    fn step(&mut self, action: Action, rng: &mut NumpyRng) -> Step<[f32; 6]> {
        let mut torque = action as f64 - 1.0;
        if self.torque_noise_max > 0.0 {
            torque += rng.uniform(-self.torque_noise_max, self.torque_noise_max);
        }
        let [t1, t2, w1, w2] = self.integrate(torque);
        let (t1, t2) = (wrap(t1), wrap(t2));
        let w1 = w1.clamp(-MAX_SPEED_1, MAX_SPEED_1);
        let w2 = w2.clamp(-MAX_SPEED_2, MAX_SPEED_2);
        self.state = [t1, t2, w1, w2];
        let (obs, terminated) = seen(&self.state);
        let reward = if terminated { 0.0 } else { -1.0 };
        Step { obs, reward, terminated }
    }

    fn set_state(&mut self, fields: &[f64]) -> Option<[f32; 6]> {
        let &[c1, s1, c2, s2, w1, w2] = fields else { return None };
        let (t1, t2) = (angle(c1, s1)?, angle(c2, s2)?);
        let w1 = within(w1, -MAX_SPEED_1, MAX_SPEED_1)?;
        let w2 = within(w2, -MAX_SPEED_2, MAX_SPEED_2)?;
        let state = [t1, t2, w1, w2];
        let (obs, terminated) = seen(&state);
        if terminated {
            return None;
        }
        self.state = state;
        Some(obs)
    }

    fn schema(&self) -> Schema {
        Schema {
            fields: vec![
                Field::symmetric("cos1", "cosine of the first link's angle from hanging down", 1.0),
                Field::symmetric("sin1", "sine of the first link's angle from hanging down", 1.0),
                Field::symmetric("cos2", "cosine of the second link's angle from the first", 1.0),
                Field::symmetric("sin2", "sine of the second link's angle from the first", 1.0),
                Field::symmetric("dot1", "angular velocity of the first link, rad/s", MAX_SPEED_1),
                Field::symmetric("dot2", "angular velocity of the second link, rad/s", MAX_SPEED_2),
            ],
            facts: Vec::new(),
            actions: ["-1", "0", "+1"].map(Into::into).into(),
            grid: None,
        }
    }

    #[inline]
    fn fields(&self, obs: &[f32; 6], out: &mut [f64]) {
        widen(obs, out);
    }
}

impl Registered for Acrobot {
    const SUMMARY: &'static str = "swing up two links by a motor between them: -1 per step";

    const EXAMPLE: Example = Example {
        // The tip's height: cos(θ₁ + θ₂) by the addition theorem.
        potential: "10.0 * (s.sin1 * s.sin2 - s.cos1 * s.cos2 - s.cos1)",
        bins: "cos1: [-1.0, 1.0, 5], sin1: [-1.0, 1.0, 5], cos2: [-1.0, 1.0, 5], sin2: [-1.0, 1.0, 5], dot1: [-6.0, 6.0, 7], dot2: [-9.0, 9.0, 7]",
    };

    const KWARGS: &'static [KwargSpec] = &[];

    const RESET_OPTIONS: &'static [&'static str] = bounds::OPTIONS;

    const ATTRIBUTES: &'static [&'static str] = ATTRIBUTES;

    fn from_kwargs(_kwargs: &Kwargs) -> Result<Self, EnvError> {
        Ok(Self::default())
    }

    fn set_reset_options(&mut self, options: &Map<String, Value>) -> Result<(), EnvError> {
        self.start = bounds::parse(options, START)?;
        Ok(())
    }

    fn set_attribute(&mut self, name: &str, value: &Value) -> Result<(), EnvError> {
        let wrong = |allowed: &str| {
            EnvError::about(name, format!("`{name}` must be {allowed}, not {value}"))
        };
        let number = value.as_f64().filter(|x| x.is_finite());
        match name {
            "book_or_nips" => {
                let index = EQUATIONS.iter().position(|known| value == known).ok_or_else(|| {
                    let error = wrong("`book` or `nips`");
                    match value.as_str().and_then(|text| did_you_mean(text, EQUATIONS)) {
                        Some(known) => error.hint(format!("did you mean `{known}`?")),
                        None => error,
                    }
                })?;
                self.nips = index == 1;
            }
            "torque_noise_max" => {
                self.torque_noise_max =
                    number.filter(|&x| x >= 0.0).ok_or_else(|| wrong("a number of 0 or more"))?;
            }
            _ => {
                self.dt = number.filter(|&x| x > 0.0).ok_or_else(|| wrong("a positive number"))?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn rng() -> NumpyRng {
        NumpyRng::from_u64(0)
    }

    #[test]
    fn links_at_rest_stay_at_rest_and_gravity_pulls_them_down() {
        let mut env = Acrobot::default();
        let step = env.step(1, &mut rng());
        // cos(-π/2) is not quite 0 in floating point.
        assert!(env.state.iter().all(|x| x.abs() < 1e-15), "{:?}", env.state);
        assert_eq!((step.reward, step.terminated), (-1.0, false));
        env.state = [0.3, 0.0, 0.0, 0.0];
        env.step(1, &mut rng());
        assert!(env.state[2] < 0.0);
    }

    #[test]
    fn without_a_motor_energy_is_kept() {
        // Kinetic and potential energy of two rods of mass, length and moment of inertia 1 about
        // their centres (the book's constants).
        let energy = |y: &Four| {
            let [t1, t2, w1, w2] = *y;
            let (c1, c12, c2) = (math::cos(t1), math::cos(t1 + t2), math::cos(t2));
            let kinetic = 0.5 * (0.25 + 1.0) * w1 * w1
                + 0.5 * (w1 * w1 + 0.25 * (w1 + w2) * (w1 + w2) + w1 * (w1 + w2) * c2)
                + 0.5 * (w1 + w2) * (w1 + w2);
            kinetic - 9.8 * (1.5 * c1 + 0.5 * c12)
        };
        let mut env = Acrobot { state: [1.0, 0.5, 0.2, -0.3], dt: 0.01, ..Acrobot::default() };
        let before = energy(&env.state);
        for _ in 0..100 {
            env.step(1, &mut rng());
        }
        assert!((energy(&env.state) - before).abs() < 1e-5, "{before} {}", energy(&env.state));
    }

    #[test]
    fn the_tip_above_one_link_ends_the_episode() {
        let mut env = Acrobot { state: [PI, 0.0, 0.0, 0.0], ..Acrobot::default() };
        let step = env.step(1, &mut rng());
        assert_eq!((step.reward, step.terminated), (0.0, true));
    }

    #[test]
    fn attributes_are_checked() {
        let mut env = Acrobot::default();
        env.set_attribute("book_or_nips", &json!("nips")).unwrap();
        env.set_attribute("dt", &json!(0.05)).unwrap();
        env.set_attribute("torque_noise_max", &json!(0)).unwrap();
        assert!(env.nips && env.dt == 0.05);
        for (name, value, message) in [
            ("book_or_nips", json!("nip"), "`book_or_nips` must be `book` or `nips`, not \"nip\""),
            (
                "torque_noise_max",
                json!(-1),
                "`torque_noise_max` must be a number of 0 or more, not -1",
            ),
            ("dt", json!(0), "`dt` must be a positive number, not 0"),
        ] {
            assert_eq!(env.set_attribute(name, &value).unwrap_err().message, message);
        }
    }
}
