//! The main engine and the side engines.

use super::SCALE;
use super::physics::{Body, vec2};
use crate::mdp::math;
use crate::mdp::numpy::NumpyRng;

/// N·s per step at full power.
const MAIN_POWER: f64 = 13.0;
const SIDE_POWER: f64 = 0.6;
/// Where the main engine sits, pixels below the hull's middle.
const MAIN_DOWN: f64 = 4.0;
/// Where the side engines sit, pixels from the hull's middle and above it.
const SIDE_AWAY: f64 = 12.0;
const SIDE_UP: f64 = 14.0;

/// What the engines are told to do in one step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Throttle {
    /// 0 (off), or 0.5 to 1.
    pub(super) main: f64,
    /// 0 (off), or 0.5 to 1.
    pub(super) side: f64,
    /// The orientation engine that fires: -1 the left one, 1 the right one, 0 neither.
    pub(super) direction: f64,
}

impl Throttle {
    /// Gymnasium's discrete actions: nothing, left engine, main engine, right engine.
    pub(super) fn discrete(action: usize) -> Self {
        match action {
            1 => Self { side: 1.0, direction: -1.0, ..Self::default() },
            2 => Self { main: 1.0, ..Self::default() },
            3 => Self { side: 1.0, direction: 1.0, ..Self::default() },
            _ => Self::default(),
        }
    }

    /// Gymnasium's continuous actions: the main engine runs above 0, a side engine beyond ±0.5.
    pub(super) fn continuous([main, lateral]: [f32; 2]) -> Self {
        let (main, lateral) =
            (f64::from(main.clamp(-1.0, 1.0)), f64::from(lateral.clamp(-1.0, 1.0)));
        let mut throttle = Self::default();
        if main > 0.0 {
            throttle.main = (main + 1.0) * 0.5;
        }
        if lateral.abs() > 0.5 {
            throttle.side = lateral.abs();
            throttle.direction = lateral.signum();
        }
        throttle
    }
}

/// What the engines did in a step, for drawing: where each one's exhaust starts, in metres, and
/// its impulse on the exhaust in N·s, both in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jet {
    /// The power, from 0.5 to 1.
    pub power: f64,
    /// Where the exhaust leaves.
    pub at: [f64; 2],
    /// The impulse of the exhaust: opposite to the one on the lander.
    pub impulse: [f64; 2],
}

/// The engines' exhaust in the last step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Jets {
    /// Of the main engine, if it ran.
    pub main: Option<Jet>,
    /// Of a side engine, if one ran.
    pub side: Option<Jet>,
    /// Which side engine: -1 the left one, 1 the right one, 0 neither.
    pub direction: f64,
}

/// Fires the engines: two draws, whatever they do. The arithmetic is float64 in Gymnasium's order.
pub(super) fn fire(hull: &mut Body, throttle: Throttle, rng: &mut NumpyRng) -> Jets {
    let (sin, cos) = math::sin_cos(f64::from(hull.angle()));
    let (tip, side) = ([sin, cos], [-cos, sin]);
    let scatter = [(); 2].map(|()| rng.uniform(-1.0, 1.0) / SCALE);
    let position = hull.frame.position;
    let (x, y) = (f64::from(position.x), f64::from(position.y));
    let mut jets = Jets { direction: throttle.direction, ..Jets::default() };
    if throttle.main > 0.0 {
        let down = MAIN_DOWN / SCALE + 2.0 * scatter[0];
        let ox = tip[0] * down + side[0] * scatter[1];
        let oy = -tip[1] * down - side[1] * scatter[1];
        let power = throttle.main;
        let kick = [-ox * MAIN_POWER * power, -oy * MAIN_POWER * power];
        jets.main = Some(push(hull, power, kick, [x + ox, y + oy]));
    }
    if throttle.side > 0.0 {
        let away = 3.0 * scatter[1] + throttle.direction * SIDE_AWAY / SCALE;
        let ox = tip[0] * scatter[0] + side[0] * away;
        let oy = -tip[1] * scatter[0] - side[1] * away;
        // 17 and 14 pixels: with two heights, the torque depends on the orientation.
        let at = [x + ox - tip[0] * 17.0 / SCALE, y + oy + tip[1] * SIDE_UP / SCALE];
        let power = throttle.side;
        let kick = [-ox * SIDE_POWER * power, -oy * SIDE_POWER * power];
        jets.side = Some(push(hull, power, kick, at));
    }
    jets
}

fn push(hull: &mut Body, power: f64, kick: [f64; 2], at: [f64; 2]) -> Jet {
    let rounded = |[x, y]: [f64; 2]| vec2(x as f32, y as f32);
    hull.apply_impulse(rounded(kick), rounded(at));
    Jet { power, at, impulse: kick.map(|x| -x) }
}
