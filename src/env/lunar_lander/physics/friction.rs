//! The impulses of contacts: the ground pushes, never pulls, and rubs (Coulomb).
//!
//! The ground has infinite mass and does not move, so that only the body's side is computed.
//! Restitution is 0.

use super::body::{Body, Motion, Place};
use super::contact::Contact;
use super::manifold::{Manifold, Reference};
use super::vector::{Transform, Vec2, clamp, max, min};
use super::{LINEAR_SLOP, MAX_CORRECTION, SKIN};

/// Beyond this condition number, two points are solved as if they were one.
const MAX_CONDITION: f32 = 1000.0;

/// One point of a contact during the iterations.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct PointRow {
    /// From the body's centre of mass, in the world.
    arm: Vec2,
    normal_impulse: f32,
    tangent_impulse: f32,
    normal_mass: f32,
    tangent_mass: f32,
}

/// A symmetric matrix of two rows.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Symmetric {
    xx: f32,
    xy: f32,
    yy: f32,
}

impl Symmetric {
    #[inline]
    fn apply(self, x: f32, y: f32) -> (f32, f32) {
        (self.xx * x + self.xy * y, self.xy * x + self.yy * y)
    }

    fn inverse(self) -> Self {
        let determinant = self.xx * self.yy - self.xy * self.xy;
        let d = if determinant == 0.0 { determinant } else { 1.0 / determinant };
        Self { xx: d * self.yy, xy: -d * self.xy, yy: d * self.xx }
    }
}

/// The constants of a contact during the iterations of one step, and its growing impulses.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ContactRow {
    /// Where the contact stands in the list.
    pub(crate) contact: usize,
    /// The body's index.
    pub(crate) body: usize,
    inverse_mass: f32,
    inverse_inertia: f32,
    friction: f32,
    /// From the ground to the body.
    normal: Vec2,
    tangent: Vec2,
    points: [PointRow; 2],
    /// How many points are solved for: one of two if they hardly differ.
    n: usize,
    /// The two points' joint inverse mass, and its inverse.
    k: Symmetric,
    mass: Symmetric,
}

/// The world's normal, and the points half-way between both skins.
fn world_points(manifold: &Manifold, frame: Transform) -> (Vec2, [Vec2; 2]) {
    let mut points = [Vec2::ZERO; 2];
    match manifold.reference {
        Reference::Edge => {
            let normal = manifold.normal;
            for (out, point) in points.iter_mut().zip(manifold.points()) {
                let corner = frame.apply(point.local);
                let depth = SKIN - (corner - manifold.point).dot(normal);
                let ground = corner + depth * normal;
                let body = corner - SKIN * normal;
                *out = 0.5 * (ground + body);
            }
            (normal, points)
        }
        Reference::Polygon => {
            let normal = frame.rotation.apply(manifold.normal);
            let plane = frame.apply(manifold.point);
            for (out, point) in points.iter_mut().zip(manifold.points()) {
                let corner = point.local;
                let depth = SKIN - (corner - plane).dot(normal);
                let body = corner + depth * normal;
                let ground = corner - SKIN * normal;
                *out = 0.5 * (ground + body);
            }
            (-normal, points)
        }
    }
}

impl ContactRow {
    /// Prepares a contact that touches; `warm` scales the last step's impulses, if they are to be
    /// started with.
    pub(crate) fn new(
        index: usize,
        contact: &Contact,
        body: &Body,
        place: Place,
        frame: Transform,
        warm: Option<f32>,
    ) -> Self {
        let manifold = &contact.manifold;
        let (normal, at) = world_points(manifold, frame);
        let tangent = normal.right();
        let (m, i) = (body.inverse_mass, body.inverse_inertia);
        let mut points = [PointRow::default(); 2];
        for (j, point) in manifold.points().iter().enumerate() {
            let arm = at[j] - place.center;
            let (rn, rt) = (arm.cross(normal), arm.cross(tangent));
            let (kn, kt) = (m + i * rn * rn, m + i * rt * rt);
            let inverse = |k: f32| if k > 0.0 { 1.0 / k } else { 0.0 };
            points[j] = PointRow {
                arm,
                normal_impulse: warm.map_or(0.0, |ratio| ratio * point.normal_impulse),
                tangent_impulse: warm.map_or(0.0, |ratio| ratio * point.tangent_impulse),
                normal_mass: inverse(kn),
                tangent_mass: inverse(kt),
            };
        }
        let mut row = Self {
            contact: index,
            body: contact.body,
            inverse_mass: m,
            inverse_inertia: i,
            friction: contact.friction,
            normal,
            tangent,
            points,
            n: manifold.n,
            k: Symmetric::default(),
            mass: Symmetric::default(),
        };
        if row.n == 2 {
            let [r1, r2] = points.map(|point| point.arm.cross(normal));
            let k = Symmetric { xx: m + i * r1 * r1, xy: m + i * r1 * r2, yy: m + i * r2 * r2 };
            if k.xx * k.xx < MAX_CONDITION * (k.xx * k.yy - k.xy * k.xy) {
                row.k = k;
                row.mass = k.inverse();
            } else {
                row.n = 1;
            }
        }
        row
    }

    /// Applies the impulses it starts with.
    pub(crate) fn warm_start(&self, motion: &mut Motion) {
        for point in &self.points[..self.n] {
            let impulse = point.normal_impulse * self.normal + point.tangent_impulse * self.tangent;
            motion.w += self.inverse_inertia * point.arm.cross(impulse);
            motion.v += self.inverse_mass * impulse;
        }
    }

    /// Keeps the impulses for the next step.
    pub(crate) fn finish(&self, contact: &mut Contact) {
        for (point, row) in contact.manifold.points.iter_mut().zip(&self.points[..self.n]) {
            point.normal_impulse = row.normal_impulse;
            point.tangent_impulse = row.tangent_impulse;
        }
    }

    /// One iteration: friction first, because not sinking in is more important.
    #[inline]
    pub(crate) fn solve(&mut self, motion: &mut Motion) {
        let (m, i) = (self.inverse_mass, self.inverse_inertia);
        for point in &mut self.points[..self.n] {
            let slip = (motion.v + point.arm.spun(motion.w)).dot(self.tangent);
            let limit = self.friction * point.normal_impulse;
            let wanted = point.tangent_impulse + point.tangent_mass * -slip;
            let new = clamp(wanted, -limit, limit);
            let impulse = (new - point.tangent_impulse) * self.tangent;
            point.tangent_impulse = new;
            motion.v += m * impulse;
            motion.w += i * point.arm.cross(impulse);
        }
        if self.n == 2 {
            self.solve_pair(motion);
            return;
        }
        let point = &mut self.points[0];
        let approach = (motion.v + point.arm.spun(motion.w)).dot(self.normal);
        let new = max(point.normal_impulse + -point.normal_mass * approach, 0.0);
        let impulse = (new - point.normal_impulse) * self.normal;
        point.normal_impulse = new;
        motion.v += m * impulse;
        motion.w += i * point.arm.cross(impulse);
    }

    /// Two points at once: the linear complementarity problem of their total impulses, by trying
    /// which of the two push (Catto; Murty 1988).
    #[inline]
    fn solve_pair(&mut self, motion: &mut Motion) {
        let [p1, p2] = &mut self.points;
        let old = (p1.normal_impulse, p2.normal_impulse);
        let v1 = (motion.v + p1.arm.spun(motion.w)).dot(self.normal);
        let v2 = (motion.v + p2.arm.spun(motion.w)).dot(self.normal);
        let (k1, k2) = self.k.apply(old.0, old.1);
        // The velocities without the impulses given so far.
        let (b1, b2) = (v1 - k1, v2 - k2);
        let (x1, x2) = self.mass.apply(b1, b2);
        let both = (-x1, -x2);
        let first = (-p1.normal_mass * b1, 0.0);
        let second = (0.0, -p2.normal_mass * b2);
        let new = if both.0 >= 0.0 && both.1 >= 0.0 {
            both
        } else if first.0 >= 0.0 && self.k.xy * first.0 + b2 >= 0.0 {
            first
        } else if second.1 >= 0.0 && self.k.xy * second.1 + b1 >= 0.0 {
            second
        } else if b1 >= 0.0 && b2 >= 0.0 {
            (0.0, 0.0)
        } else {
            // Rounding left no case: no change.
            return;
        };
        let impulse1 = (new.0 - old.0) * self.normal;
        let impulse2 = (new.1 - old.1) * self.normal;
        motion.v += self.inverse_mass * (impulse1 + impulse2);
        motion.w += self.inverse_inertia * (p1.arm.cross(impulse1) + p2.arm.cross(impulse2));
        p1.normal_impulse = new.0;
        p2.normal_impulse = new.1;
    }
}

/// Moves `place` out of the ground by the share `rate` of the overlap; returns the separation of
/// the deepest point, or 0.
pub(crate) fn correct(contact: &Contact, body: &Body, place: &mut Place, rate: f32) -> f32 {
    let manifold = &contact.manifold;
    let (m, i) = (body.inverse_mass, body.inverse_inertia);
    let mut deepest = 0.0;
    for point in manifold.points() {
        let frame = Transform::about_center(place.center, place.angle, body.sweep.local_center);
        let (normal, at, separation) = match manifold.reference {
            Reference::Edge => {
                let corner = frame.apply(point.local);
                let gap = (corner - manifold.point).dot(manifold.normal) - SKIN - SKIN;
                (manifold.normal, corner, gap)
            }
            Reference::Polygon => {
                let normal = frame.rotation.apply(manifold.normal);
                let gap = (point.local - frame.apply(manifold.point)).dot(normal) - SKIN - SKIN;
                (-normal, point.local, gap)
            }
        };
        let arm = at - place.center;
        deepest = min(deepest, separation);
        let correction = clamp(rate * (separation + LINEAR_SLOP), -MAX_CORRECTION, 0.0);
        let rn = arm.cross(normal);
        let k = m + i * rn * rn;
        let size = if k > 0.0 { -correction / k } else { 0.0 };
        let impulse = size * normal;
        place.center += m * impulse;
        place.angle += i * arm.cross(impulse);
    }
    deepest
}
