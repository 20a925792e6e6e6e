//! The hinge between the hull and a leg: a revolute joint with a motor and limits.
#![expect(clippy::inline_always, reason = "the velocity iterations are one loop in registers")]

use super::body::{Body, Motion, Place};
use super::vector::{Rotation, Vec2, clamp, vec2};
use super::{ANGULAR_SLOP, LINEAR_SLOP, MAX_ANGULAR_CORRECTION};

/// Which limit of a hinge is active.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Limit {
    Inactive,
    Lower,
    Upper,
}

/// What a hinge has given in the last step, to start the next one with.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Impulse {
    /// At the pin, N·s.
    pin: Vec2,
    /// Of the limit, N·m·s.
    limit: f32,
    /// Of the motor, N·m·s.
    motor: f32,
}

/// A pin through a point of the hull and one of a leg, with a motor that turns the leg against
/// the hull, between two angles.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Hinge {
    /// The pin in the frames of the hull and of the leg.
    pub(crate) hull_anchor: Vec2,
    pub(crate) leg_anchor: Vec2,
    /// The leg's angle less the hull's at which the hinge's angle is 0.
    pub(crate) reference_angle: f32,
    pub(crate) lower: f32,
    pub(crate) upper: f32,
    /// What the motor wants, rad/s.
    pub(crate) motor_speed: f32,
    /// The most it can do, N·m.
    pub(crate) max_torque: f32,
    impulse: Impulse,
    limit: Limit,
}

/// The constants of a hinge during the iterations of one step, and its growing impulse.
#[derive(Debug, Clone, Copy)]
pub(crate) struct HingeRow {
    hull_arm: Vec2,
    leg_arm: Vec2,
    hull_mass: f32,
    leg_mass: f32,
    hull_inertia: f32,
    leg_inertia: f32,
    motor_mass: f32,
    motor_speed: f32,
    max_motor: f32,
    /// The columns of the symmetric mass matrix: x, y, and the angle.
    ex: [f32; 3],
    ey: [f32; 3],
    ez: [f32; 3],
    /// `ey × ez`.
    ey_ez: [f32; 3],
    /// Minus the inverse of the determinant.
    minus_inverse3: f32,
    /// The same of the upper left block.
    minus_inverse2: f32,
    limit: Limit,
    /// The sign of an impulse with which the limit would pull.
    pull: f32,
    impulse: Impulse,
}

impl Hinge {
    pub(crate) fn new(anchors: [Vec2; 2], limits: [f32; 2], motor: [f32; 2], at: f32) -> Self {
        Self {
            hull_anchor: anchors[0],
            leg_anchor: anchors[1],
            reference_angle: at,
            lower: limits[0],
            upper: limits[1],
            motor_speed: motor[0],
            max_torque: motor[1],
            impulse: Impulse { pin: Vec2::ZERO, limit: 0.0, motor: 0.0 },
            limit: Limit::Inactive,
        }
    }

    /// Chooses the limit for this step; a change of it forgets its impulse.
    fn choose_limit(&mut self, angle: f32) {
        let limit = if angle <= self.lower {
            Limit::Lower
        } else if angle >= self.upper {
            Limit::Upper
        } else {
            Limit::Inactive
        };
        if limit != self.limit || limit == Limit::Inactive {
            self.impulse.limit = 0.0;
        }
        self.limit = limit;
    }

    /// Prepares a step of `dt`, and applies the last one's impulses, scaled to this one.
    #[allow(clippy::too_many_arguments)]
    pub(crate) fn start(
        &mut self,
        (hull, hull_at, hull_motion): (&Body, Place, &mut Motion),
        (leg, leg_at, leg_motion): (&Body, Place, &mut Motion),
        rotations: [Rotation; 2],
        dt: f32,
        dt_ratio: f32,
    ) -> HingeRow {
        let a = rotations[0].apply(self.hull_anchor - hull.sweep.local_center);
        let b = rotations[1].apply(self.leg_anchor - leg.sweep.local_center);
        let (ma, mb) = (hull.inverse_mass, leg.inverse_mass);
        let (ia, ib) = (hull.inverse_inertia, leg.inverse_inertia);
        let xy = -a.y * a.x * ia - b.y * b.x * ib;
        let xz = -a.y * ia - b.y * ib;
        let yz = a.x * ia + b.x * ib;
        let ex = [ma + mb + a.y * a.y * ia + b.y * b.y * ib, xy, xz];
        let ey = [xy, ma + mb + a.x * a.x * ia + b.x * b.x * ib, yz];
        let ez = [xz, yz, ia + ib];
        let ey_ez = cross3(ey, ez);
        self.choose_limit(leg_at.angle - hull_at.angle - self.reference_angle);
        let impulse = &mut self.impulse;
        impulse.pin = dt_ratio * impulse.pin;
        impulse.limit *= dt_ratio;
        impulse.motor *= dt_ratio;
        let Impulse { pin, limit, motor } = *impulse;
        hull_motion.v -= ma * pin;
        hull_motion.w -= ia * (a.cross(pin) + motor + limit);
        leg_motion.v += mb * pin;
        leg_motion.w += ib * (b.cross(pin) + motor + limit);
        HingeRow {
            hull_arm: a,
            leg_arm: b,
            hull_mass: ma,
            leg_mass: mb,
            hull_inertia: ia,
            leg_inertia: ib,
            motor_mass: 1.0 / (ia + ib),
            motor_speed: self.motor_speed,
            max_motor: dt * self.max_torque,
            ex,
            ey,
            ez,
            ey_ez,
            minus_inverse3: -inverse_or_zero(dot3(ex, ey_ez)),
            minus_inverse2: -inverse_or_zero(ex[0] * ey[1] - ey[0] * ex[1]),
            limit: self.limit,
            pull: if self.limit == Limit::Lower { -1.0 } else { 1.0 },
            impulse: self.impulse,
        }
    }

    /// Keeps the impulse for the next step.
    pub(crate) fn finish(&mut self, row: &HingeRow) {
        self.impulse = row.impulse;
    }

    /// Moves both bodies towards where the hinge wants them; whether they were close enough
    /// already.
    pub(crate) fn correct(
        &self,
        (hull, a): (&Body, &mut Place),
        (leg, b): (&Body, &mut Place),
    ) -> bool {
        let (ia, ib) = (hull.inverse_inertia, leg.inverse_inertia);
        let (ma, mb) = (hull.inverse_mass, leg.inverse_mass);
        let mut angular_error = 0.0;
        if self.limit != Limit::Inactive {
            let angle = b.angle - a.angle - self.reference_angle;
            let correction = if self.limit == Limit::Lower {
                let beyond = angle - self.lower;
                angular_error = -beyond;
                clamp(beyond + ANGULAR_SLOP, -MAX_ANGULAR_CORRECTION, 0.0)
            } else {
                let beyond = angle - self.upper;
                angular_error = beyond;
                clamp(beyond - ANGULAR_SLOP, 0.0, MAX_ANGULAR_CORRECTION)
            };
            let impulse = -(1.0 / (ia + ib)) * correction;
            a.angle -= ia * impulse;
            b.angle += ib * impulse;
        }
        let arm_a = Rotation::by(a.angle).apply(self.hull_anchor - hull.sweep.local_center);
        let arm_b = Rotation::by(b.angle).apply(self.leg_anchor - leg.sweep.local_center);
        let gap = b.center + arm_b - a.center - arm_a;
        let xx = ma + mb + ia * arm_a.y * arm_a.y + ib * arm_b.y * arm_b.y;
        let xy = -ia * arm_a.x * arm_a.y - ib * arm_b.x * arm_b.y;
        let yy = ma + mb + ia * arm_a.x * arm_a.x + ib * arm_b.x * arm_b.x;
        let inverse = inverse_or_zero(xx * yy - xy * xy);
        let impulse =
            -vec2(inverse * (yy * gap.x - xy * gap.y), inverse * (xx * gap.y - xy * gap.x));
        a.center -= ma * impulse;
        a.angle -= ia * arm_a.cross(impulse);
        b.center += mb * impulse;
        b.angle += ib * arm_b.cross(impulse);
        gap.length() <= LINEAR_SLOP && angular_error <= ANGULAR_SLOP
    }
}

impl HingeRow {
    /// One iteration: the motor, then the pin, together with the limit if one is active.
    ///
    /// Each operation here waits for the one before, 180 times a step; that is where a simulation's
    /// time goes. The tests for NaN, which are predicted, keep x and y in different basic blocks:
    /// otherwise the compiler packs them in pairs, and moving them in and out of the pairs takes
    /// longer than it saves. (A state of NaN stays one.)
    #[inline(always)]
    pub(crate) fn solve(&mut self, hull: &mut Motion, leg: &mut Motion) {
        self.drive(hull, leg);
        let (a, b) = (self.hull_arm, self.leg_arm);
        // The point of the leg at the pin, as seen from the hull's.
        let slip_x = leg.v.x + -leg.w * b.y - hull.v.x - -hull.w * a.y;
        if slip_x.is_nan() {
            return;
        }
        let slip_y = leg.v.y + leg.w * b.x - hull.v.y - hull.w * a.x;
        let (ex, ey, ez) = (self.ex, self.ey, self.ez);
        let (x, y, limit);
        if self.limit == Limit::Inactive {
            limit = 0.0;
            x = self.minus_inverse2 * (ey[1] * slip_x - ey[0] * slip_y);
            y = self.minus_inverse2 * (ex[0] * slip_y - ex[1] * slip_x);
            self.push(hull, leg, x, y, limit);
            return;
        }
        let spin = leg.w - hull.w;
        let slip = [slip_x, slip_y, spin];
        let [c0, c1, c2] = cross3(ey, slip);
        let wanted = self.minus_inverse3 * (ex[0] * c0 + ex[1] * c1 + ex[2] * c2);
        let old = self.impulse.limit;
        let total = old + wanted;
        let pulls = total * self.pull > 0.0;
        if pulls {
            // A limit only pushes: without it, the pin alone must make up for what it had given.
            let rest_x = slip_x - old * ez[0];
            let rest_y = slip_y - old * ez[1];
            x = self.minus_inverse2 * (ey[1] * rest_x - ey[0] * rest_y);
            y = self.minus_inverse2 * (ex[0] * rest_y - ex[1] * rest_x);
            limit = -old;
            self.impulse.limit = 0.0;
            self.push(hull, leg, x, y, limit);
            return;
        }
        self.impulse.limit = total;
        x = self.minus_inverse3 * dot3(slip, self.ey_ez);
        y = self.minus_inverse3 * dot3(ex, cross3(slip, ez));
        self.push(hull, leg, x, y, wanted);
    }

    /// The motor's part of an iteration.
    #[inline(always)]
    fn drive(&mut self, hull: &mut Motion, leg: &mut Motion) {
        let error = leg.w - hull.w - self.motor_speed;
        let old = self.impulse.motor;
        let wanted = old + -self.motor_mass * error;
        let max = self.max_motor;
        if (wanted >= max && old == max) || (wanted <= -max && old == -max) {
            // At its limit the motor gives nothing more. That is the rule in the air, and a branch
            // is predicted where the arithmetic would be waited for.
            return;
        }
        let new = clamp(wanted, -max, max);
        self.impulse.motor = new;
        let impulse = new - old;
        hull.w -= self.hull_inertia * impulse;
        leg.w += self.leg_inertia * impulse;
    }

    #[inline(always)]
    fn push(&mut self, hull: &mut Motion, leg: &mut Motion, x: f32, y: f32, limit: f32) {
        let (a, b) = (self.hull_arm, self.leg_arm);
        self.impulse.pin.x += x;
        hull.v.x -= self.hull_mass * x;
        leg.v.x += self.leg_mass * x;
        if x.is_nan() {
            return;
        }
        self.impulse.pin.y += y;
        hull.v.y -= self.hull_mass * y;
        leg.v.y += self.leg_mass * y;
        hull.w -= self.hull_inertia * (a.x * y - a.y * x + limit);
        leg.w += self.leg_inertia * (b.x * y - b.y * x + limit);
    }
}

#[inline(always)]
fn inverse_or_zero(x: f32) -> f32 {
    if x == 0.0 { x } else { 1.0 / x }
}

#[inline(always)]
fn dot3(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn cross3(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
