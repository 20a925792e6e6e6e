//! What follows from mechanics, not from any implementation.

use super::body::{Body, Bounds, Place};
use super::distance::{Cache, distance};
use super::impact::time_of_impact;
use super::manifold::{Reference, collide};
use super::polygon::Polygon;
use super::vector::{Sweep, Transform, Vec2, vec2};
use super::world::{EDGES, HULL, LEGS, Part, World};
use super::{ANGULAR_SLOP, Edge, Hinge, LINEAR_SLOP, SKIN};

const DT: f32 = 0.02;

fn box_at(x: f32, y: f32, angle: f32) -> (Polygon, Transform) {
    let polygon = Polygon::rectangle(0.5, 0.25);
    (polygon, Transform::about_center(vec2(x, y), angle, Vec2::ZERO))
}

/// A floor at the height 0 from -50 m to 50 m; the other edges lie deep below it.
fn floor() -> [(Edge, f32); EDGES] {
    std::array::from_fn(|i| {
        let y = if i == 0 { 0.0 } else { -100.0 };
        (Edge { from: vec2(-50.0, y), to: vec2(50.0, y) }, 0.5)
    })
}

/// A hull of one square metre (4 kg) with a leg on each side, at the height `y`.
fn rig(gravity: f32, y: f32) -> World {
    let part = |x: f32, half: f32, y: f32| Part {
        shape: Polygon::rectangle(half, half),
        density: 4.0,
        friction: 0.5,
        position: vec2(x, y),
        angle: 0.0,
    };
    // Pins half-way between hull and leg; free to swing by ±0.5 rad; the motors are off.
    let hinge = |x: f32| Hinge::new([vec2(x, 0.0), vec2(-x, 0.0)], [-0.5, 0.5], [0.0, 0.0], 0.0);
    let parts = [part(0.0, 0.5, y), part(2.0, 0.25, y), part(-2.0, 0.25, y)];
    World::new(gravity, floor(), parts, [hinge(1.0), hinge(-1.0)])
}

fn momentum(world: &World) -> (Vec2, f32) {
    let mut linear = Vec2::ZERO;
    let mut angular = 0.0;
    for body in &world.bodies {
        let (m, i) = (1.0 / body.inverse_mass, 1.0 / body.inverse_inertia);
        linear += m * body.motion.v;
        angular += i * body.motion.w + m * body.sweep.center.cross(body.motion.v);
    }
    (linear, angular)
}

#[test]
fn boxes_overlap_if_they_touch() {
    let unit = Bounds { low: vec2(0.0, 0.0), high: vec2(1.0, 1.0) };
    let at = |x: f32, y: f32| Bounds { low: vec2(x, y), high: vec2(x + 1.0, y + 1.0) };
    assert!(unit.overlaps(&at(1.0, 1.0)) && unit.overlaps(&at(-0.5, 0.5)));
    assert!(!unit.overlaps(&at(1.01, 0.0)) && !unit.overlaps(&at(0.0, -1.01)));
}

#[test]
fn a_box_on_an_edge_touches_it_with_two_corners() {
    let edge = Edge { from: vec2(-5.0, 0.0), to: vec2(5.0, 0.0) };
    let (polygon, frame) = box_at(1.0, 0.26, 0.0);
    let manifold = collide(&edge, &polygon, frame);
    assert_eq!((manifold.reference, manifold.n), (Reference::Edge, 2));
    assert_eq!(manifold.normal, vec2(0.0, 1.0));
    let mut corners = manifold.points().iter().map(|p| p.local).collect::<Vec<_>>();
    corners.sort_by(|a, b| a.x.total_cmp(&b.x));
    for (corner, expected) in corners.into_iter().zip([vec2(-0.5, -0.25), vec2(0.5, -0.25)]) {
        assert!((corner - expected).length() < 1e-6);
    }
    // Beyond the skins there is nothing; on its tip there is one point.
    let (_, high) = box_at(1.0, 0.25 + 2.0 * SKIN + 1e-3, 0.0);
    assert_eq!(collide(&edge, &polygon, high).n, 0);
    let (_, tilted) = box_at(1.0, 0.5, 0.7);
    assert_eq!(collide(&edge, &polygon, tilted).n, 1);
}

#[test]
fn an_edge_that_ends_under_a_box_is_clipped() {
    // Three quarters of the box stand over the end at x = 1.25.
    let edge = Edge { from: vec2(-5.0, 0.0), to: vec2(1.25, 0.0) };
    let (polygon, frame) = box_at(1.0, 0.26, 0.0);
    let manifold = collide(&edge, &polygon, frame);
    let mut xs: Vec<f32> = manifold.points().iter().map(|p| frame.apply(p.local).x).collect();
    xs.sort_by(f32::total_cmp);
    assert!((xs[0] - 0.5).abs() < 1e-6 && (xs[1] - 1.25).abs() < 1e-6, "{xs:?}");
}

#[test]
fn points_keep_their_impulses_while_they_last() {
    let edge = Edge { from: vec2(-5.0, 0.0), to: vec2(5.0, 0.0) };
    let (polygon, frame) = box_at(1.0, 0.26, 0.0);
    let mut old = collide(&edge, &polygon, frame);
    old.points[0].normal_impulse = 1.0;
    old.points[1].normal_impulse = 2.0;
    let mut new = collide(&edge, &polygon, frame);
    new.inherit(&old);
    assert_eq!(new.points.map(|p| p.normal_impulse), [1.0, 2.0]);
    // Turned upside down it touches with other corners.
    let (_, over) = box_at(1.0, 0.26, std::f32::consts::PI);
    let mut other = collide(&edge, &polygon, over);
    other.inherit(&old);
    assert_eq!(other.points.map(|p| p.normal_impulse), [0.0; 2]);
}

#[test]
fn distances_by_hand() {
    let edge = [vec2(-1.0, 0.0), vec2(1.0, 0.0)];
    for (x, y, angle, expected) in [
        // Above the middle, beside the end, off the corner, overlapping.
        (0.0, 2.0, 0.0, 1.75),
        (3.0, 0.0, 0.0, 1.5),
        (4.5, 4.25, 0.0, 5.0),
        (0.0, 0.1, 0.0, 0.0),
        // On its tip: half the diagonal below the centre.
        (0.0, 2.0, std::f32::consts::FRAC_PI_2 - 0.463_647_6, 2.0 - 0.559_017),
    ] {
        let (polygon, frame) = box_at(x, y, angle);
        let got = distance(&edge, &polygon, frame, &mut Cache::default());
        assert!((got - expected).abs() < 1e-5, "({x}, {y}): {got}");
    }
}

#[test]
fn a_falling_box_meets_the_floor_when_it_should() {
    let edge = [vec2(-50.0, 0.0), vec2(50.0, 0.0)];
    let polygon = Polygon::rectangle(0.5, 0.25);
    let fall = |from: f32, to: f32| Sweep {
        local_center: Vec2::ZERO,
        center0: vec2(0.0, from),
        center: vec2(0.0, to),
        angle0: 0.0,
        angle: 0.0,
        start: 0.0,
    };
    // From 1.25 m the lower side has 1 m to fall, of that of the whole step.
    for whole in [1.1, 1.25, 2.0, 2.5, 7.0] {
        let time = time_of_impact(&edge, &polygon, &fall(1.25, 1.25 - whole)).unwrap();
        assert!((whole * time - 1.0).abs() < 2.0 * LINEAR_SLOP, "{whole}: {time}");
    }
    assert_eq!(time_of_impact(&edge, &polygon, &fall(1.25, 0.75)), None);
    assert_eq!(time_of_impact(&edge, &polygon, &fall(1.25, 1.75)), None);
}

#[test]
fn no_speed_carries_a_body_through_the_floor() {
    // One step would lead from 1 m above it to 0.8 m below.
    let mut world = rig(0.0, 1.0);
    for body in &mut world.bodies {
        body.motion.v = vec2(0.0, -90.0);
    }
    for _ in 0..10 {
        world.step(DT);
        assert!(world.bodies.iter().all(|body| body.frame.position.y > 0.0));
    }
    assert!(world.hull_has_touched);
}

#[test]
fn hinges_and_motors_conserve_momentum() {
    let mut world = rig(0.0, 30.0);
    for hinge in &mut world.hinges {
        hinge.motor_speed = 0.7;
        hinge.max_torque = 5.0;
    }
    world.bodies[HULL].motion.v = vec2(1.0, -0.5);
    world.bodies[LEGS[0]].motion.w = 3.0;
    let (linear, angular) = momentum(&world);
    for _ in 0..100 {
        world.step(DT);
        let (now_linear, now_angular) = momentum(&world);
        assert!((now_linear - linear).length() < 1e-3, "{now_linear:?}");
        // Positions are corrected without regard to it, a little every step.
        assert!((now_angular - angular).abs() < 0.05, "{now_angular} {angular}");
    }
}

#[test]
fn pins_hold_and_limits_stop() {
    let mut world = rig(0.0, 30.0);
    for hinge in &mut world.hinges {
        hinge.motor_speed = 2.0;
        hinge.max_torque = 50.0;
    }
    let angle = |world: &World| world.bodies[LEGS[0]].angle() - world.bodies[HULL].angle();
    world.step(DT);
    // Strong enough, the motor has its speed at once.
    assert!((angle(&world) - 2.0 * DT).abs() < 1e-4, "{}", angle(&world));
    for _ in 0..100 {
        world.step(DT);
        let hull = world.bodies[HULL].frame.apply(vec2(1.0, 0.0));
        let leg = world.bodies[LEGS[0]].frame.apply(vec2(-1.0, 0.0));
        assert!((hull - leg).length() <= LINEAR_SLOP);
    }
    assert!((angle(&world) - 0.5).abs() <= ANGULAR_SLOP, "{}", angle(&world));
}

#[test]
fn limits_do_not_hold_back() {
    let mut world = rig(0.0, 30.0);
    for (hinge, spin) in world.hinges.iter_mut().zip([1.0, -1.0]) {
        hinge.motor_speed = 2.0 * spin;
        hinge.max_torque = 50.0;
    }
    let angle = |world: &World| world.bodies[LEGS[0]].angle() - world.bodies[HULL].angle();
    // Not so long that it falls asleep there.
    for _ in 0..20 {
        world.step(DT);
    }
    assert!((angle(&world) - 0.5).abs() < 0.05);
    // Back from the limit, with the impulse that it still has from the last step.
    for hinge in &mut world.hinges {
        hinge.motor_speed *= -1.0;
    }
    let before = angle(&world);
    world.step(DT);
    // Most of the motor's push goes into undoing the one before.
    assert!(angle(&world) < before - DT, "{}", angle(&world) - before);
}

#[test]
fn a_free_fall_is_the_textbooks() {
    let mut world = rig(-10.0, 30.0);
    for _ in 0..50 {
        world.step(DT);
    }
    // Velocities move first: after n steps, v = g n dt and y = y0 + g dt² n(n + 1)/2.
    let hull = &world.bodies[HULL];
    assert!((hull.motion.v.y + 10.0).abs() < 1e-3);
    assert!((hull.frame.position.y - (30.0 - 10.0 * 0.0004 * 50.0 * 51.0 / 2.0)).abs() < 1e-3);
}

#[test]
fn at_rest_for_half_a_second_it_falls_asleep_and_a_push_wakes_it() {
    let mut world = rig(-10.0, 0.52);
    // The legs' lower sides level with the hull's.
    for leg in LEGS {
        let body = &mut world.bodies[leg];
        body.put(Place { center: vec2(body.sweep.center.x, 0.52), angle: 0.0 }, body.motion);
    }
    let mut quiet = 0;
    while world.bodies[HULL].awake {
        world.step(DT);
        let slow = |body: &Body| body.motion.v.length() <= 0.01 && body.motion.w.abs() <= 0.0349;
        quiet = if world.bodies.iter().all(slow) { quiet + 1 } else { 0 };
        assert!(quiet <= 26, "{:?}", world.bodies);
    }
    assert!(quiet >= 25 && world.bodies.iter().all(|body| !body.awake), "{quiet}");
    let before = world.bodies[HULL].frame.position;
    world.step(DT);
    assert_eq!(world.bodies[HULL].frame.position, before);
    world.bodies[HULL].apply_impulse(vec2(0.0, 20.0), before);
    world.step(DT);
    assert!(world.bodies[HULL].awake && world.bodies[HULL].frame.position.y > before.y);
}

#[test]
fn friction_stops_what_slides() {
    // Decelerated by 0.5 g = 5 m/s², 1 m/s lasts 0.2 s and 0.1 m.
    let mut world = rig(-10.0, 0.51);
    for body in &mut world.bodies {
        let x = body.sweep.center.x;
        body.put(Place { center: vec2(x, 0.51), angle: 0.0 }, body.motion);
        body.motion.v = vec2(1.0, 0.0);
    }
    for _ in 0..30 {
        world.step(DT);
    }
    let hull = &world.bodies[HULL];
    assert!(hull.motion.v.x.abs() < 0.02, "{:?}", hull.motion);
    assert!((hull.frame.position.x - 0.1).abs() < 0.05, "{:?}", hull.frame.position);
}

#[test]
fn a_body_is_accelerated_by_force_over_mass() {
    let mut body = Body::new(Polygon::rectangle(0.5, 0.5), 4.0, 0.5, vec2(1.0, 2.0), 0.0);
    body.apply_force(vec2(8.0, 0.0));
    body.apply_torque(2.0);
    // 4 kg; m(w² + h²)/12 = 4·2/12 kg·m².
    let motion = body.accelerated(vec2(0.0, -10.0), 0.5);
    assert!((motion.v - vec2(1.0, -5.0)).length() < 1e-6);
    assert!((motion.w - 0.5 * 2.0 / (8.0 / 12.0)).abs() < 1e-5);
    // An impulse to the right, one metre above the centre: clockwise.
    body.apply_impulse(vec2(4.0, 0.0), vec2(1.0, 3.0));
    assert!((body.motion.v.x - 1.0).abs() < 1e-6 && (body.motion.w + 6.0).abs() < 1e-4);
}
