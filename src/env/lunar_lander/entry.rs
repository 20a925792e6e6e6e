//! The lander as an environment, and in the registry.

use super::{LunarLander, Mission};
use crate::env::actions::ActionTable;
use crate::env::error::EnvError;
use crate::env::kwargs::{KwargKind, KwargSpec, Kwargs};
use crate::env::registered::{Example, Registered};
use crate::mdp::numpy::NumpyRng;
use crate::mdp::{Action, ActionSpace, Env, Field, Schema, Step, widen};

/// The values of the argument `shaping`.
const SHAPINGS: [&str; 2] = ["native", "none"];

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

    fn own_shaping(&self) -> Option<&'static str> {
        self.mission.native_shaping.then_some(
            "the environment's own reward is shaped by the difference of a potential with γ = 1, of \
             which the last value is never taken back: with a smaller γ that is no potential's. \
             `shaping: \"none\"` leaves it out, and a `potential` does it properly",
        )
    }

    fn schema(&self) -> Schema {
        let turn = 2.0 * std::f64::consts::PI;
        let actions = if self.mission.continuous {
            self.actions.names()
        } else {
            ["none", "left", "main", "right"].map(String::from).to_vec()
        };
        Schema {
            fields: vec![
                Field::symmetric("x", "position from the pad's middle, in half widths (10 m)", 2.5),
                Field::symmetric(
                    "y",
                    "height of the legs over the pad, in half heights (6.67 m)",
                    2.5,
                ),
                Field::symmetric("x_dot", "horizontal velocity, 5 m/s", 10.0),
                Field::symmetric("y_dot", "vertical velocity, 7.5 m/s", 10.0),
                Field::symmetric("angle", "angle from upright, positive to the left, rad", turn),
                Field::symmetric("angle_dot", "angular velocity, 2.5 rad/s", 10.0),
                Field::float(
                    "left_leg",
                    "1 if Gymnasium's first leg touches the ground",
                    -0.0,
                    1.0,
                ),
                Field::float(
                    "right_leg",
                    "1 if Gymnasium's second leg touches the ground",
                    -0.0,
                    1.0,
                ),
            ],
            facts: Vec::new(),
            actions,
            grid: None,
        }
    }

    #[inline]
    fn fields(&self, obs: &[f32; 8], out: &mut [f64]) {
        widen(obs, out);
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
            kind: KwargKind::Choice(&SHAPINGS),
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
        Self::new(Mission {
            continuous: kwargs.bool("continuous"),
            gravity: kwargs.float("gravity"),
            enable_wind: kwargs.bool("enable_wind"),
            wind_power: kwargs.float("wind_power"),
            turbulence_power: kwargs.float("turbulence_power"),
            native_shaping: kwargs.choice("shaping") == "native",
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
