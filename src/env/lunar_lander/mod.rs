//! placeholder
mod craft;
mod draw;
mod engines;
mod physics;
mod terrain;
mod view;
mod wind;

use super::actions::ActionTable;
use super::error::EnvError;
use super::kwargs::{KwargKind, KwargSpec, Kwargs};
use super::registered::{Example, Registered};
use crate::mdp::numpy::NumpyRng;
use crate::mdp::{Action, ActionSpace, Env, Field, FieldKind, Schema, Step};
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
/// The values of the argument `shaping`.
const SHAPINGS: [&str; 2] = ["native", "none"];
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
    terrain: Terrain,
    world: World,
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
        let terrain = Terrain::flat();
        Ok(Self {
            world: craft::world(gravity, &terrain),
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
        self.terrain = Terrain::draw(rng);
        self.world = craft::world(self.mission.gravity, &self.terrain);
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

impl Env for LunarLander {
    type Obs = [f32; 8];

    fn n_actions(&self) -> usize {
        if self.mission.continuous { self.actions.len() } else { 4 }
    }

    fn action_space(&self) -> ActionSpace {
        if self.mission.continuous {
            ActionSpace::Box { low: &[-1.0; 2], high: &[1.0; 2] }
        } else {
            ActionSpace::Discrete(4)
        }
    }

    fn reset(&mut self, rng: &mut NumpyRng) -> [f32; 8] {
        Self::reset(self, rng)
    }

    fn step(&mut self, action: Action, rng: &mut NumpyRng) -> Step<[f32; 8]> {
        if self.mission.continuous {
            let entry = self.actions.get(action);
            return self.step_continuous([entry[0], entry[1]], rng);
        }
        self.step_discrete(action, rng)
    }

    fn step_box(&mut self, action: &[f32], rng: &mut NumpyRng) -> Step<[f32; 8]> {
        self.step_continuous([action[0], action[1]], rng)
    }

    fn schema(&self) -> Schema {
        let field = |name, doc, low: f64, high: f64| {
            let (low, high) = (f64::from(low as f32), f64::from(high as f32));
            Field { name, kind: FieldKind::Float, doc, low, high }
        };
        let both = |name, doc, bound: f64| field(name, doc, -bound, bound);
        let turn = 2.0 * std::f64::consts::PI;
        let actions = if self.mission.continuous {
            self.actions.names()
        } else {
            ["none", "left", "main", "right"].map(String::from).to_vec()
        };
        Schema {
            fields: vec![
                both("x", "position from the pad's middle, in half widths (10 m)", 2.5),
                both("y", "height of the legs over the pad, in half heights (6.67 m)", 2.5),
                both("x_dot", "horizontal velocity, 5 m/s", 10.0),
                both("y_dot", "vertical velocity, 7.5 m/s", 10.0),
                both("angle", "angle from upright, positive to the left, rad", turn),
                both("angle_dot", "angular velocity, 2.5 rad/s", 10.0),
                field("left_leg", "1 if Gymnasium's first leg touches the ground", -0.0, 1.0),
                field("right_leg", "1 if Gymnasium's second leg touches the ground", -0.0, 1.0),
            ],
            facts: Vec::new(),
            actions,
            grid: None,
        }
    }

    #[inline]
    fn fields(&self, obs: &[f32; 8], out: &mut [f64]) {
        for (out, &x) in out.iter_mut().zip(obs) {
            *out = f64::from(x);
        }
    }
}

impl Registered for LunarLander {
    const SUMMARY: &'static str = "land on the pad between hills, gently and with little fuel";

    const EXAMPLE: Example = Example {
        potential: "-100.0 * sqrt(s.x * s.x + s.y * s.y) - 100.0 * abs(s.angle)",
        bins: "x: [-1.0, 1.0, 6], y: [-0.1, 1.5, 6], x_dot: [-1.0, 1.0, 5], y_dot: [-1.5, 0.5, 6], angle: [-1.0, 1.0, 6], angle_dot: [-1.0, 1.0, 5], left_leg: [0.0, 1.0, 2], right_leg: [0.0, 1.0, 2]",
    };

    const KWARGS: &'static [KwargSpec] = &[
        KwargSpec {
            name: "continuous",
            kind: KwargKind::Bool,
            default: "false",
            doc: "whether actions are two real numbers instead of one of four",
        },
        KwargSpec {
            name: "gravity",
            kind: KwargKind::Float,
            default: "-10",
            doc: "m/s², between -12 and 0",
        },
        KwargSpec {
            name: "enable_wind",
            kind: KwargKind::Bool,
            default: "false",
            doc: "whether there is wind while both legs are off the ground",
        },
        KwargSpec {
            name: "wind_power",
            kind: KwargKind::Float,
            default: "15",
            doc: "the greatest force of the wind, N, from 0 to 20",
        },
        KwargSpec {
            name: "turbulence_power",
            kind: KwargKind::Float,
            default: "1.5",
            doc: "the greatest torque of the wind, N·m, from 0 to 2",
        },
        KwargSpec {
            name: "shaping",
            kind: KwargKind::Name(&SHAPINGS),
            default: "\"native\"",
            doc: "\"native\": Gymnasium's reward; \"none\": only fuel and the last step's ±100",
        },
        KwargSpec {
            name: "fuel_cost",
            kind: KwargKind::Float,
            default: "1",
            doc: "a factor on the price of fuel",
        },
    ];

    fn from_kwargs(kwargs: &Kwargs) -> Result<Self, EnvError> {
        let shaping = kwargs.name("shaping").ok_or_else(|| {
            let message = "`shaping` must be one of `native`, `none`, not null";
            EnvError::about("shaping", message)
        })?;
        Self::new(Mission {
            continuous: kwargs.bool("continuous"),
            gravity: kwargs.float("gravity"),
            enable_wind: kwargs.bool("enable_wind"),
            wind_power: kwargs.float("wind_power"),
            turbulence_power: kwargs.float("turbulence_power"),
            native_shaping: shaping == "native",
            fuel_cost: kwargs.float("fuel_cost"),
        })
    }

    fn action_table(&self) -> Option<&ActionTable> {
        self.mission.continuous.then_some(&self.actions)
    }

    fn set_action_table(&mut self, table: ActionTable) {
        self.actions = table;
    }
}
