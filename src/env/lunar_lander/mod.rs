//! `LunarLander-v3` and `LunarLanderContinuous-v3`: a lander with three engines comes down on a pad
//! between hills. The game is Gymnasium 1.4.0's, the dynamics those of the engine under it: see
//! `physics`.
//!
//! # Action Space
//! `Discrete(4)`: 0 does nothing, 1 fires the left engine, 2 the main engine, 3 the right engine.
//! Continuous: `Box(-1, 1, (2,), float32)`, main and lateral, clipped. The main engine runs above
//! 0, with 50 % to 100 % of its power; a side engine runs below -0.5 (left) or above 0.5 (right),
//! with 50 % to 100 %. Agents that choose among a few actions choose among the discrete ones
//! unless a table says otherwise.
//!
//! # Observation Space
//! `Box(8, float32)`; the state is the engine's float32, scaled in float64.
//!
//! | # | field       | unit                                          | space |
//! |---|-------------|-----------------------------------------------|-------|
//! | 0 | `x`         | 10 m, from the middle of the pad              | ±2.5  |
//! | 1 | `y`         | 6.67 m, of the feet above the pad             | ±2.5  |
//! | 2 | `x_dot`     | 5 m/s                                         | ±10   |
//! | 3 | `y_dot`     | 7.5 m/s                                       | ±10   |
//! | 4 | `angle`     | rad, counter-clockwise from upright           | ±2π   |
//! | 5 | `angle_dot` | 2.5 rad/s                                     | ±10   |
//! | 6 | `left_leg`  | 1 if the first leg counts as on the ground    | 0, 1  |
//! | 7 | `right_leg` | 1 if the second leg counts as on the ground   | 0, 1  |
//!
//! The names of the legs are the usual ones; as drawn (x grows to the right), the first leg is the
//! one on the right. A leg that stands on two edges and leaves one of them counts as off the
//! ground until it touches another one: the last news counts, as in Gymnasium.
//!
//! # Rewards
//! Φ(s′) - Φ(s) less fuel, where Φ(s) is -100 times the distance from the pad, less 100 times the
//! speed, less 100 times the angle's size (all as observed), plus 10 for each leg on the ground. A
//! step of the main engine at full power costs 0.3, one of a side engine 0.03. The last step pays
//! -100 (crashed, or left the world) or +100 (came to rest) *instead*.
//!
//! That is no potential-based shaping in the sense of Ng, Harada & Russell (1999), which would
//! leave optimal policies alone: its discount is 1 whatever the learner's γ, and the last step's
//! ±100 overwrites its difference, so that Φ of the last state but one is never paid back. With
//! `shaping: "none"` only fuel and ±100 remain, and a script's potential can do it properly.
//!
//! # Starting State
//! Above the middle, at the upper border, pushed for one step by a force whose components are
//! uniform in ±1000 N. Nine of the hills' heights are drawn anew, five are the pad's. The first
//! observation is that of one step without engines.
//!
//! # Episode End
//! Terminated when the hull touches the ground, |x| reaches 1, or the lander falls asleep: all
//! parts slower than 0.01 m/s and 2°/s for half a second. Truncated after 1000 steps. Stepping on
//! after that works as in Gymnasium: engines wake a sleeping lander.
//!
//! # Arguments
//! `continuous` (false), `gravity` (-10 m/s², between -12 and 0), `enable_wind` (false),
//! `wind_power` (15 N, up to 20), `turbulence_power` (1.5 N·m, up to 2).
//! Beyond Gymnasium's: `shaping` (`"native"`, or `"none"`: see above) and `fuel_cost` (1), a factor
//! on the price of fuel.
//!
//! # Exactness
//! Bit for bit: all eight recordings, and 3 980 more episodes (744 329 steps) of random, heuristic
//! and mixed policies, discrete and continuous, with and without wind, under gravities from -1.3
//! to -11.9, some of them stepped on for 150 to 200 steps after their end: not one number differs.
//! Hull angle and wind pass through the C library's float64 functions in Gymnasium and through
//! correctly rounded ones here; rounding to float32 hides the difference (about one in 10⁹ would
//! show).
//!
//! Deviations:
//! 1. `wind_power` outside [0, 20] and `turbulence_power` outside [0, 2] are errors; Gymnasium warns.
//! 2. `shaping` and `fuel_cost` are additions; their defaults change nothing.

mod craft;
mod draw;
mod engines;
mod entry;
mod physics;
mod terrain;
mod view;
mod wind;

use super::actions::ActionTable;
use super::error::EnvError;
use crate::mdp::Step;
use crate::mdp::numpy::NumpyRng;
use craft::LEG_DOWN;
pub use engines::{Jet, Jets};
use engines::{Throttle, fire};
use physics::{HULL, World, vec2};
use terrain::{PAD_Y, Terrain};
use wind::Wind;

/// Pixels per metre.
const SCALE: f64 = 30.0;
/// The width of the world, m.
pub const WIDTH: f64 = 600.0 / SCALE;
/// The height of the world, m.
pub const HEIGHT: f64 = 400.0 / SCALE;
/// Steps per second.
const FPS: f64 = 50.0;
/// The largest component of the force that the lander starts under, N.
const INITIAL_FORCE: f64 = 1000.0;
/// The reward per step of the main engine and of a side engine at full power.
const MAIN_COST: f64 = 0.30;
const SIDE_COST: f64 = 0.03;
/// The ranges of the wind's arguments.
const WIND_POWERS: (f64, f64) = (0.0, 20.0);
const TURBULENCE_POWERS: (f64, f64) = (0.0, 2.0);

/// What the constructor may be told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mission {
    /// Whether actions are two real numbers instead of one of four.
    pub continuous: bool,
    /// m/s², between -12 and 0 (both excluded).
    pub gravity: f64,
    /// Whether there is wind while both legs are off the ground.
    pub enable_wind: bool,
    /// The greatest force of the wind, N; 0 to 20.
    pub wind_power: f64,
    /// The greatest torque of the wind, N·m; 0 to 2.
    pub turbulence_power: f64,
    /// Whether the reward contains Gymnasium's own shaping.
    pub native_shaping: bool,
    /// A factor on the price of fuel.
    pub fuel_cost: f64,
}

impl Default for Mission {
    fn default() -> Self {
        Self {
            continuous: false,
            gravity: -10.0,
            enable_wind: false,
            wind_power: 15.0,
            turbulence_power: 1.5,
            native_shaping: true,
            fuel_cost: 1.0,
        }
    }
}

/// The lander above its moon.
#[derive(Debug, Clone)]
pub struct LunarLander {
    mission: Mission,
    terrain: Box<Terrain>,
    world: Box<World>,
    wind: Option<Wind>,
    /// The built-in shaping's potential of the state before.
    potential: Option<f64>,
    jets: Jets,
    /// The last step's wind: N, N·m.
    gust: [f64; 2],
    actions: ActionTable,
}

impl LunarLander {
    /// A lander above a plain until the first reset.
    ///
    /// # Errors
    /// If a number of `mission` is outside its range.
    pub fn new(mission: Mission) -> Result<Self, EnvError> {
        let Mission { gravity, wind_power, turbulence_power, fuel_cost, .. } = mission;
        if !(-12.0 < gravity && gravity < 0.0) {
            let message = format!("`gravity` must be between -12 and 0 (excluded), not {gravity}");
            return Err(EnvError::about("gravity", message));
        }
        for (name, power, (low, high)) in [
            ("wind_power", wind_power, WIND_POWERS),
            ("turbulence_power", turbulence_power, TURBULENCE_POWERS),
        ] {
            if !(low..=high).contains(&power) {
                let message = format!("`{name}` must be between {low} and {high}, not {power}");
                return Err(EnvError::about(name, message));
            }
        }
        if !(fuel_cost.is_finite() && fuel_cost >= 0.0) {
            let message = format!("`fuel_cost` must be 0 or more, not {fuel_cost}");
            return Err(EnvError::about("fuel_cost", message));
        }
        let terrain = Box::new(Terrain::flat());
        Ok(Self {
            world: Box::new(craft::world(gravity, &terrain)),
            terrain,
            mission,
            wind: None,
            potential: None,
            jets: Jets::default(),
            gust: [0.0; 2],
            // The four actions of the discrete lander.
            actions: ActionTable::of(&[[0.0, 0.0], [0.0, -1.0], [1.0, 0.0], [0.0, 1.0]]),
        })
    }

    /// Starts an episode over new hills; its first observation is that of a step without engines.
    pub fn reset(&mut self, rng: &mut NumpyRng) -> [f32; 8] {
        *self.terrain = Terrain::draw(rng);
        *self.world = craft::world(self.mission.gravity, &self.terrain);
        let force = [(); 2].map(|()| rng.uniform(-INITIAL_FORCE, INITIAL_FORCE) as f32);
        self.world.bodies[HULL].apply_force(vec2(force[0], force[1]));
        self.wind = self.mission.enable_wind.then(|| Wind::draw(rng));
        self.potential = None;
        self.play(Throttle::default(), rng).obs
    }

    /// Plays a discrete action: 0 nothing, 1 left engine, 2 main engine, 3 right engine.
    pub fn step_discrete(&mut self, action: usize, rng: &mut NumpyRng) -> Step<[f32; 8]> {
        self.play(Throttle::discrete(action), rng)
    }

    /// Plays a real-valued action: main engine and lateral engines, clipped to [-1, 1].
    pub fn step_continuous(&mut self, action: [f32; 2], rng: &mut NumpyRng) -> Step<[f32; 8]> {
        self.play(Throttle::continuous(action), rng)
    }

    fn play(&mut self, throttle: Throttle, rng: &mut NumpyRng) -> Step<[f32; 8]> {
        self.blow();
        self.jets = fire(&mut self.world.bodies[HULL], throttle, rng);
        self.world.step((1.0 / FPS) as f32);
        let state = self.state();
        let reward = self.reward(&state, throttle);
        let asleep = !self.world.bodies[HULL].is_awake();
        let lost = self.world.hull_has_touched || state[0].abs() >= 1.0;
        let reward = if asleep {
            100.0
        } else if lost {
            -100.0
        } else {
            reward
        };
        Step { obs: state.map(|x| x as f32), reward, terminated: asleep || lost }
    }

    /// Lets the wind act on the hull, if there is any.
    fn blow(&mut self) {
        self.gust = [0.0; 2];
        let Some(wind) = &mut self.wind else { return };
        if self.world.leg_contact.contains(&true) {
            return;
        }
        let [force, torque] = wind.next();
        self.gust = [force * self.mission.wind_power, torque * self.mission.turbulence_power];
        let hull = &mut self.world.bodies[HULL];
        hull.apply_force(vec2(self.gust[0] as f32, 0.0));
        hull.apply_torque(self.gust[1] as f32);
    }

    /// The observation before it is rounded.
    fn state(&self) -> [f64; 8] {
        let hull = &self.world.bodies[HULL];
        let (position, velocity) = (hull.frame.position, hull.velocity());
        let contact = self.world.leg_contact.map(|touches| f64::from(u8::from(touches)));
        // The order of every operation is Gymnasium's: each one rounds.
        [
            (f64::from(position.x) - WIDTH / 2.0) / (WIDTH / 2.0),
            (f64::from(position.y) - (PAD_Y + LEG_DOWN / SCALE)) / (HEIGHT / 2.0),
            f64::from(velocity.x) * (WIDTH / 2.0) / FPS,
            f64::from(velocity.y) * (HEIGHT / 2.0) / FPS,
            f64::from(hull.angle()),
            20.0 * f64::from(hull.angular_velocity()) / FPS,
            contact[0],
            contact[1],
        ]
    }

    /// The reward of a step that does not end the episode.
    fn reward(&mut self, s: &[f64; 8], throttle: Throttle) -> f64 {
        let mut reward = 0.0;
        if self.mission.native_shaping {
            let potential = -100.0 * (s[0] * s[0] + s[1] * s[1]).sqrt()
                - 100.0 * (s[2] * s[2] + s[3] * s[3]).sqrt()
                - 100.0 * s[4].abs()
                + 10.0 * s[6]
                + 10.0 * s[7];
            if let Some(before) = self.potential.replace(potential) {
                reward = potential - before;
            }
        }
        reward -= throttle.main * MAIN_COST * self.mission.fuel_cost;
        reward -= throttle.side * SIDE_COST * self.mission.fuel_cost;
        reward
    }
}

#[cfg(test)]
mod tests;
