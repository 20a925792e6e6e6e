//! Hull, legs and ground: a step of everything.

use super::SKIN;
use super::body::{Body, Bounds};
use super::contact::{Change, Contact};
use super::friction::ContactRow;
use super::hinge::Hinge;
use super::impact::time_of_impact;
use super::manifold::{Edge, collide};
use super::polygon::Polygon;
use super::vector::{Vec2, min, vec2};

/// The index of the hull among the bodies.
pub(crate) const HULL: usize = 0;
/// The indices of the legs.
pub(crate) const LEGS: [usize; 2] = [1, 2];

/// How many edges the ground has: a floor, and the hills upon it.
pub(crate) const EDGES: usize = 11;
/// The box of an edge is this much larger than the edge and its skin, m.
const EDGE_MARGIN: f32 = 0.1;
/// A contact that has had more impacts than this in one step is let go.
const MAX_IMPACTS: u32 = 8;

/// What a body is made of.
pub(crate) struct Part {
    pub(crate) shape: Polygon,
    /// kg/m².
    pub(crate) density: f32,
    pub(crate) friction: f32,
    pub(crate) position: Vec2,
    pub(crate) angle: f32,
}

/// Three bodies above a ground.
#[derive(Debug, Clone)]
pub(crate) struct World {
    pub(crate) gravity: Vec2,
    pub(crate) bodies: [Body; 3],
    /// `hinges[i]` holds leg `i`.
    pub(crate) hinges: [Hinge; 2],
    edges: [Edge; EDGES],
    edge_bounds: [Bounds; EDGES],
    edge_friction: [f32; EDGES],
    /// Where the ground's (motionless) sweep starts: how much of the step has been looked at.
    pub(crate) ground_start: f32,
    /// Pairs whose boxes overlap, the newest last. They are visited newest first.
    pub(crate) contacts: Vec<Contact>,
    /// Room for the constraints of a step.
    pub(crate) rows: Vec<ContactRow>,
    /// 1/s, of the last step; 0 before the first one.
    last_rate: f32,
    /// Whether the hull has ever begun to touch the ground.
    pub(crate) hull_has_touched: bool,
    /// Whether the last news of each leg was that it began to touch an edge. A leg on two edges
    /// that leaves one of them is thus taken to be off the ground.
    pub(crate) leg_contact: [bool; 2],
}

impl World {
    pub(crate) fn new(
        gravity: f32,
        edges: [(Edge, f32); EDGES],
        parts: [Part; 3],
        hinges: [Hinge; 2],
    ) -> Self {
        let bounds = edges.map(|(Edge { from, to }, _)| {
            let skin = Bounds::around(from.min(to), from.max(to), SKIN);
            Bounds::around(skin.low, skin.high, EDGE_MARGIN)
        });
        Self {
            gravity: vec2(0.0, gravity),
            bodies: parts.map(|part| {
                Body::new(part.shape, part.density, part.friction, part.position, part.angle)
            }),
            hinges,
            edges: edges.map(|(edge, _)| edge),
            edge_bounds: bounds,
            edge_friction: edges.map(|(_, friction)| friction),
            ground_start: 0.0,
            contacts: Vec::with_capacity(3 * EDGES),
            rows: Vec::with_capacity(3 * EDGES),
            last_rate: 0.0,
            hull_has_touched: false,
            leg_contact: [false; 2],
        }
    }

    /// Goes on by `dt` seconds.
    pub(crate) fn step(&mut self, dt: f32) {
        if self.last_rate == 0.0 {
            self.find_contacts();
        }
        self.update_contacts();
        self.solve(dt, self.last_rate * dt);
        self.solve_impacts(dt);
        self.last_rate = 1.0 / dt;
        for body in &mut self.bodies {
            body.clear_forces();
        }
    }

    /// Adds pairs whose boxes have begun to overlap, by edge and then by body.
    pub(crate) fn find_contacts(&mut self) {
        if !self.bodies.iter().any(|body| body.moved) {
            return;
        }
        for edge in 0..EDGES {
            for (i, body) in self.bodies.iter_mut().enumerate() {
                if !body.moved || !self.edge_bounds[edge].overlaps(&body.bounds) {
                    continue;
                }
                if self.contacts.iter().any(|c| (c.edge, c.body) == (edge, i)) {
                    continue;
                }
                let frictions = (self.edge_friction[edge], body.friction);
                self.contacts.push(Contact::new(edge, i, frictions));
                body.wake();
            }
        }
        for body in &mut self.bodies {
            body.moved = false;
        }
    }

    /// Looks at every pair of an awake body: are the boxes apart, or where do the shapes touch?
    fn update_contacts(&mut self) {
        for i in (0..self.contacts.len()).rev() {
            let Contact { edge, body, touching, .. } = self.contacts[i];
            if !self.bodies[body].awake {
                continue;
            }
            if self.edge_bounds[edge].overlaps(&self.bodies[body].bounds) {
                self.update_contact(i);
            } else {
                if touching {
                    self.notice(body, Change::End);
                }
                self.contacts.remove(i);
            }
        }
    }

    fn update_contact(&mut self, i: usize) {
        let contact = &mut self.contacts[i];
        let body = &self.bodies[contact.body];
        let change = contact.update(collide(&self.edges[contact.edge], &body.shape, body.frame));
        let body = contact.body;
        self.notice(body, change);
    }

    fn notice(&mut self, body: usize, change: Change) {
        let begins = match change {
            Change::None => return,
            Change::Begin => true,
            Change::End => false,
        };
        if body == HULL {
            self.hull_has_touched |= begins;
        } else {
            self.leg_contact[body - 1] = begins;
        }
    }

    /// Takes back the bodies that would pass into the ground during the step, to where they meet
    /// it, and goes on from there with the rest of the step, body by body.
    fn solve_impacts(&mut self, dt: f32) {
        self.ground_start = 0.0;
        for body in &mut self.bodies {
            body.sweep.start = 0.0;
        }
        for contact in &mut self.contacts {
            contact.impact = None;
            contact.impacts = 0;
        }
        while let Some((contact, time)) = self.first_impact() {
            self.solve_impact(contact, time, dt);
        }
    }

    /// The contact that meets first, and when, as a fraction of the step.
    fn first_impact(&mut self) -> Option<(usize, f32)> {
        let mut first = None;
        let mut earliest = 1.0;
        for (i, contact) in self.contacts.iter_mut().enumerate().rev() {
            if !contact.enabled || contact.impacts > MAX_IMPACTS {
                continue;
            }
            let body = &mut self.bodies[contact.body];
            let time = match contact.impact {
                Some(time) => time,
                None if !body.awake => continue,
                None => {
                    // Both have to start from the same time.
                    if self.ground_start < body.sweep.start {
                        self.ground_start = body.sweep.start;
                    } else if body.sweep.start < self.ground_start {
                        body.sweep.advance(self.ground_start);
                    }
                    let start = self.ground_start;
                    let Edge { from, to } = self.edges[contact.edge];
                    let time = match time_of_impact(&[from, to], &body.shape, &body.sweep) {
                        Some(share) => min(start + (1.0 - start) * share, 1.0),
                        None => 1.0,
                    };
                    contact.impact = Some(time);
                    time
                }
            };
            if time < earliest {
                first = Some(i);
                earliest = time;
            }
        }
        first.filter(|_| earliest <= 1.0 - 10.0 * f32::EPSILON).map(|i| (i, earliest))
    }

    fn solve_impact(&mut self, first: usize, time: f32, dt: f32) {
        let body = self.contacts[first].body;
        let before = (self.bodies[body].sweep, self.ground_start);
        self.bodies[body].advance(time);
        self.ground_start = time;
        self.update_contact(first);
        let contact = &mut self.contacts[first];
        contact.impact = None;
        contact.impacts += 1;
        if !contact.touching {
            contact.enabled = false;
            (self.bodies[body].sweep, self.ground_start) = before;
            self.bodies[body].update_frame();
            return;
        }
        for i in (0..self.contacts.len()).rev() {
            if i != first && self.contacts[i].body == body {
                self.update_contact(i);
            }
        }
        self.solve_sub_step(body, first, (1.0 - time) * dt);
        self.bodies[body].update_bounds();
        for contact in &mut self.contacts {
            if contact.body == body {
                contact.impact = None;
            }
        }
        self.find_contacts();
    }
}
