//! The lander's hull, legs and hinges.

use super::physics::{Hinge, Part, Polygon, World, vec2};
use super::terrain::Terrain;
use super::{HEIGHT, SCALE, WIDTH};

/// The hull's outline, in pixels.
const HULL_OUTLINE: [(f64, f64); 6] =
    [(-14.0, 17.0), (-17.0, 0.0), (-17.0, -10.0), (17.0, -10.0), (17.0, 0.0), (14.0, 17.0)];
/// From the hull's middle to a leg's, sideways and down; pixels.
const LEG_AWAY: f64 = 20.0;
pub(super) const LEG_DOWN: f64 = 18.0;
/// Half a leg's width and height, pixels.
const LEG_HALF: (f64, f64) = (2.0, 8.0);
/// N·m.
const LEG_SPRING_TORQUE: f32 = 40.0;
/// How fast the motors want to spread the legs, rad/s.
const LEG_SPEED: f64 = 0.3;
/// How far the legs are spread, rad: at least, at most.
const LEG_SPREAD: [f64; 2] = [0.9 - 0.5, 0.9];

/// A lander above the middle of `terrain`, at the upper border.
pub(super) fn world(gravity: f64, terrain: &Terrain) -> World {
    let at = |x: f64, y: f64| vec2(x as f32, y as f32);
    let hull = Part {
        shape: Polygon::hull(&HULL_OUTLINE.map(|(x, y)| at(x / SCALE, y / SCALE))),
        density: 5.0,
        friction: 0.1,
        position: at(WIDTH / 2.0, HEIGHT),
        angle: 0.0,
    };
    // The first leg (-1) hangs on the right.
    let leg = |i: f64| Part {
        shape: Polygon::rectangle((LEG_HALF.0 / SCALE) as f32, (LEG_HALF.1 / SCALE) as f32),
        density: 1.0,
        friction: 0.2,
        position: at(WIDTH / 2.0 - i * LEG_AWAY / SCALE, HEIGHT),
        angle: (i * 0.05) as f32,
    };
    let hinge = |i: f64| {
        let anchors = [at(0.0, 0.0), at(i * LEG_AWAY / SCALE, LEG_DOWN / SCALE)];
        let [near, far] = LEG_SPREAD.map(|angle| angle as f32);
        let limits = if i < 0.0 { [near, far] } else { [-far, -near] };
        let motor = [(LEG_SPEED * i) as f32, LEG_SPRING_TORQUE];
        Hinge::new(anchors, limits, motor, (i * 0.05) as f32)
    };
    let (parts, hinges) = ([hull, leg(-1.0), leg(1.0)], [-1.0, 1.0].map(hinge));
    World::new(gravity as f32, terrain.edges(), parts, hinges)
}
