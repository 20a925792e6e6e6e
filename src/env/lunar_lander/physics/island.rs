//! One step of velocities and positions.
//!
//! Hull and legs hang together and are solved as one island; the ground belongs to it but does not
//! move.

use super::LINEAR_SLOP;
use super::body::{Motion, Place};
use super::contact::Contact;
use super::friction::{ContactRow, correct};
use super::hinge::HingeRow;
use super::vector::{Transform, min};
use super::world::{HULL, LEGS, World};

const VELOCITY_ITERATIONS: u32 = 180;
const POSITION_ITERATIONS: u32 = 60;
/// Of positions, in the sub-step after an impact.
const IMPACT_ITERATIONS: u32 = 20;
/// The share of an overlap that is corrected in one iteration (Baumgarte).
const BAUMGARTE: f32 = 0.2;
/// The same after an impact.
const IMPACT_BAUMGARTE: f32 = 0.75;
/// Below these speeds for this time, the lander falls asleep: s, m/s, rad/s.
const TIME_TO_SLEEP: f32 = 0.5;
const SLEEP_SPEED: f32 = 0.01;
const SLEEP_ANGULAR_SPEED: f32 = 2.0 / 180.0 * std::f32::consts::PI;

/// In which order bodies and hinges are solved: a walk along the hinges that begins at the first
/// awake body of the second leg, the first leg, the hull.
struct Order {
    bodies: [usize; 3],
    hinges: [usize; 2],
}

impl World {
    fn order(&self) -> Option<Order> {
        let [first, second] = LEGS;
        if self.bodies[second].awake {
            Some(Order { bodies: [second, HULL, first], hinges: [1, 0] })
        } else if self.bodies[first].awake {
            Some(Order { bodies: [first, HULL, second], hinges: [0, 1] })
        } else if self.bodies[HULL].awake {
            Some(Order { bodies: [HULL, first, second], hinges: [1, 0] })
        } else {
            None
        }
    }

    /// Moves everything by `dt`, if anything is awake; `dt_ratio` is `dt` over the last one.
    pub(crate) fn solve(&mut self, dt: f32, dt_ratio: f32) {
        let Some(order) = self.order() else { return };
        let mut places = [Place::default(); 3];
        let mut motions = [Motion::default(); 3];
        for (i, body) in self.bodies.iter_mut().enumerate() {
            body.wake();
            body.sweep.center0 = body.sweep.center;
            body.sweep.angle0 = body.sweep.angle;
            places[i] = body.place();
            motions[i] = body.accelerated(self.gravity, dt);
        }
        let mut rows = std::mem::take(&mut self.rows);
        self.contact_rows(&order, &places, dt_ratio, &mut rows);
        for row in &rows {
            row.warm_start(&mut motions[row.body]);
        }
        let [hull_motion, leg_motions @ ..] = &mut motions;
        let start = |world: &mut Self, i: usize, hull: &mut Motion, legs: &mut [Motion; 2]| {
            let leg = LEGS[i];
            let rotations = [world.bodies[HULL].frame.rotation, world.bodies[leg].frame.rotation];
            world.hinges[i].start(
                (&world.bodies[HULL], places[HULL], hull),
                (&world.bodies[leg], places[leg], &mut legs[i]),
                rotations,
                dt,
                dt_ratio,
            )
        };
        let mut hinges = order.hinges.map(|i| start(self, i, hull_motion, leg_motions));
        iterate(&order, &mut hinges, &mut rows, &mut motions);
        for (&i, row) in order.hinges.iter().zip(&hinges) {
            self.hinges[i].finish(row);
        }
        for row in &rows {
            row.finish(&mut self.contacts[row.contact]);
        }
        for (place, motion) in places.iter_mut().zip(&mut motions) {
            (*place, *motion) = place.after(*motion, dt);
        }
        let settled = self.correct_positions(&order, &rows, &mut places);
        rows.clear();
        self.rows = rows;
        for ((body, place), motion) in self.bodies.iter_mut().zip(places).zip(motions) {
            body.put(place, motion);
        }
        self.rest(dt, settled);
        for body in &mut self.bodies {
            body.update_bounds();
        }
        self.find_contacts();
    }

    /// The constraints of all contacts that touch, body by body.
    fn contact_rows(
        &self,
        order: &Order,
        places: &[Place; 3],
        dt_ratio: f32,
        rows: &mut Vec<ContactRow>,
    ) {
        if self.contacts.is_empty() {
            return;
        }
        let live = |c: &Contact, body| c.body == body && c.enabled && c.touching;
        for i in order.bodies {
            let body = &self.bodies[i];
            let touching = self.contacts.iter().enumerate().rev().filter(|(_, c)| live(c, i));
            rows.extend(touching.map(|(at, contact)| {
                ContactRow::new(at, contact, body, places[i], body.frame, Some(dt_ratio))
            }));
        }
    }

    /// Projects positions until nothing overlaps or parts too much; whether it got there.
    fn correct_positions(
        &self,
        order: &Order,
        rows: &[ContactRow],
        places: &mut [Place; 3],
    ) -> bool {
        for _ in 0..POSITION_ITERATIONS {
            let mut deepest = 0.0;
            for row in rows {
                let place = &mut places[row.body];
                let contact = &self.contacts[row.contact];
                let depth = correct(contact, &self.bodies[row.body], place, BAUMGARTE);
                deepest = min(deepest, depth);
            }
            let mut settled = deepest >= -3.0 * LINEAR_SLOP;
            let [hull_place, leg_places @ ..] = &mut *places;
            for i in order.hinges {
                let (hull, leg) = (&self.bodies[HULL], &self.bodies[LEGS[i]]);
                settled &= self.hinges[i].correct((hull, hull_place), (leg, &mut leg_places[i]));
            }
            if settled {
                return true;
            }
        }
        false
    }

    /// Counts the time at rest, and lets all bodies fall asleep after enough of it.
    fn rest(&mut self, dt: f32, settled: bool) {
        let mut least = f32::MAX;
        for body in &mut self.bodies {
            let Motion { v, w } = body.motion;
            if w * w > SLEEP_ANGULAR_SPEED * SLEEP_ANGULAR_SPEED
                || v.dot(v) > SLEEP_SPEED * SLEEP_SPEED
            {
                body.rested = 0.0;
                least = 0.0;
            } else {
                body.rested += dt;
                least = min(least, body.rested);
            }
        }
        if least >= TIME_TO_SLEEP && settled {
            for body in &mut self.bodies {
                body.sleep();
            }
        }
    }

    /// Moves one body by `dt` from where it met the ground; `first` is the contact that did.
    pub(crate) fn solve_sub_step(&mut self, body: usize, first: usize, dt: f32) {
        let mut rows = std::mem::take(&mut self.rows);
        let others = (0..self.contacts.len())
            .rev()
            .filter(|&i| i != first && self.contacts[i].body == body && self.contacts[i].touching);
        let moving = &self.bodies[body];
        let mut place = moving.place();
        let touching = || std::iter::once(first).chain(others.clone()).map(|i| &self.contacts[i]);
        for _ in 0..IMPACT_ITERATIONS {
            let mut deepest = 0.0;
            for contact in touching() {
                deepest = min(deepest, correct(contact, moving, &mut place, IMPACT_BAUMGARTE));
            }
            if deepest >= -1.5 * LINEAR_SLOP {
                break;
            }
        }
        let frame = Transform::about_center(place.center, place.angle, moving.sweep.local_center);
        rows.extend(
            touching().map(|contact| ContactRow::new(0, contact, moving, place, frame, None)),
        );
        let mut motion = moving.motion;
        for _ in 0..VELOCITY_ITERATIONS {
            for row in &mut rows {
                row.solve(&mut motion);
            }
        }
        rows.clear();
        self.rows = rows;
        let moving = &mut self.bodies[body];
        moving.sweep.center0 = place.center;
        moving.sweep.angle0 = place.angle;
        let (place, motion) = place.after(motion, dt);
        moving.put(place, motion);
    }
}

/// The velocity iterations: hinges, then contacts.
fn iterate(
    order: &Order,
    hinges: &mut [HingeRow; 2],
    rows: &mut [ContactRow],
    motions: &mut [Motion; 3],
) {
    let legs = order.hinges.map(|i| LEGS[i]);
    let [hinge_a, hinge_b] = hinges;
    let (mut hull, mut a, mut b) = (motions[HULL], motions[legs[0]], motions[legs[1]]);
    if rows.is_empty() {
        for _ in 0..VELOCITY_ITERATIONS {
            hinge_a.solve(&mut hull, &mut a);
            hinge_b.solve(&mut hull, &mut b);
        }
    } else {
        for _ in 0..VELOCITY_ITERATIONS {
            hinge_a.solve(&mut hull, &mut a);
            hinge_b.solve(&mut hull, &mut b);
            for row in &mut *rows {
                if row.body == HULL {
                    row.solve(&mut hull);
                } else if row.body == legs[0] {
                    row.solve(&mut a);
                } else {
                    row.solve(&mut b);
                }
            }
        }
    }
    motions[HULL] = hull;
    motions[legs[0]] = a;
    motions[legs[1]] = b;
}
