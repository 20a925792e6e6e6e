//! One rigid body.

use super::polygon::Polygon;
use super::vector::{Rotation, Sweep, Transform, Vec2, vec2};
use super::{MAX_ROTATION, MAX_TRANSLATION, SKIN};

/// How much larger than its shape a body's box is kept, m, so that it need not change every step.
const MARGIN: f32 = 0.1;
/// How many steps ahead the box reaches in the direction of motion.
const LOOK_AHEAD: f32 = 2.0;

/// An axis-parallel box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bounds {
    pub(crate) low: Vec2,
    pub(crate) high: Vec2,
}

impl Bounds {
    /// The box between two corners, with a margin around it.
    #[inline]
    pub(crate) fn around(low: Vec2, high: Vec2, margin: f32) -> Self {
        let margin = vec2(margin, margin);
        Self { low: low - margin, high: high + margin }
    }

    #[inline]
    pub(crate) fn overlaps(&self, other: &Self) -> bool {
        let (right, left) = (other.low - self.high, self.low - other.high);
        !(right.x > 0.0 || right.y > 0.0 || left.x > 0.0 || left.y > 0.0)
    }

    #[inline]
    fn contains(&self, other: &Self) -> bool {
        self.low.x <= other.low.x
            && self.low.y <= other.low.y
            && other.high.x <= self.high.x
            && other.high.y <= self.high.y
    }
}

/// A velocity and an angular velocity.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Motion {
    /// Of the centre of mass, m/s.
    pub(crate) v: Vec2,
    /// rad/s.
    pub(crate) w: f32,
}

/// A dynamic body with one polygon.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Body {
    pub(crate) shape: Polygon,
    pub(crate) frame: Transform,
    pub(crate) sweep: Sweep,
    pub(crate) motion: Motion,
    /// Gathered until the next step, N and N·m.
    force: Vec2,
    torque: f32,
    pub(crate) inverse_mass: f32,
    pub(crate) inverse_inertia: f32,
    pub(crate) friction: f32,
    pub(crate) awake: bool,
    /// Seconds at rest.
    pub(crate) rested: f32,
    /// Its shape's box with a margin: what decides whether a contact is looked at.
    pub(crate) bounds: Bounds,
    /// Whether the box has changed since contacts were last looked for.
    pub(crate) moved: bool,
}

impl Body {
    pub(crate) fn new(
        shape: Polygon,
        density: f32,
        friction: f32,
        position: Vec2,
        angle: f32,
    ) -> Self {
        let frame = Transform { position, rotation: Rotation::by(angle) };
        let mass = shape.mass(density);
        let inverse_mass = 1.0 / mass.mass;
        // The mass-weighted mean over the shapes, of which there is one: not quite its centre.
        let local_center = inverse_mass * (mass.mass * mass.center);
        let inertia = mass.inertia - mass.mass * local_center.dot(local_center);
        let center = frame.apply(local_center);
        let (low, high) = shape.bounds(frame);
        let bounds = Bounds::around(low, high, SKIN);
        Self {
            shape,
            frame,
            sweep: Sweep {
                local_center,
                center0: center,
                center,
                angle0: angle,
                angle,
                start: 0.0,
            },
            motion: Motion::default(),
            force: Vec2::ZERO,
            torque: 0.0,
            inverse_mass,
            inverse_inertia: 1.0 / inertia,
            friction,
            awake: true,
            rested: 0.0,
            bounds: Bounds::around(bounds.low, bounds.high, MARGIN),
            moved: true,
        }
    }

    #[inline]
    pub(crate) fn angle(&self) -> f32 {
        self.sweep.angle
    }

    /// Of the centre of mass, m/s.
    #[inline]
    pub(crate) fn velocity(&self) -> Vec2 {
        self.motion.v
    }

    /// rad/s.
    #[inline]
    pub(crate) fn angular_velocity(&self) -> f32 {
        self.motion.w
    }

    #[inline]
    pub(crate) fn is_awake(&self) -> bool {
        self.awake
    }

    pub(crate) fn wake(&mut self) {
        if !self.awake {
            self.awake = true;
            self.rested = 0.0;
        }
    }

    pub(crate) fn sleep(&mut self) {
        self.awake = false;
        self.rested = 0.0;
        self.motion = Motion::default();
        self.clear_forces();
    }

    /// Pushes at the centre of mass for the next step, N.
    pub(crate) fn apply_force(&mut self, force: Vec2) {
        self.wake();
        self.force += force;
    }

    /// Turns for the next step, N·m.
    pub(crate) fn apply_torque(&mut self, torque: f32) {
        self.wake();
        self.torque += torque;
    }

    /// Kicks at a point of the world, N·s.
    pub(crate) fn apply_impulse(&mut self, impulse: Vec2, point: Vec2) {
        self.wake();
        self.motion.v += self.inverse_mass * impulse;
        self.motion.w += self.inverse_inertia * (point - self.sweep.center).cross(impulse);
    }

    #[inline]
    pub(crate) fn clear_forces(&mut self) {
        self.force = Vec2::ZERO;
        self.torque = 0.0;
    }

    /// Its motion after `dt` of the forces on it.
    #[inline]
    pub(crate) fn accelerated(&self, gravity: Vec2, dt: f32) -> Motion {
        Motion {
            v: self.motion.v + dt * (gravity + self.inverse_mass * self.force),
            w: self.motion.w + dt * self.inverse_inertia * self.torque,
        }
    }

    /// Puts it where `place` says.
    #[inline]
    pub(crate) fn put(&mut self, place: Place, motion: Motion) {
        self.sweep.center = place.center;
        self.sweep.angle = place.angle;
        self.motion = motion;
        self.update_frame();
    }

    #[inline]
    pub(crate) fn update_frame(&mut self) {
        let Sweep { center, angle, local_center, .. } = self.sweep;
        self.frame = Transform::about_center(center, angle, local_center);
    }

    /// Moves it to where its sweep is at the fraction `time` of the step.
    pub(crate) fn advance(&mut self, time: f32) {
        self.sweep.advance(time);
        self.sweep.center = self.sweep.center0;
        self.sweep.angle = self.sweep.angle0;
        self.update_frame();
    }

    /// Adapts the box to the movement of this step.
    pub(crate) fn update_bounds(&mut self) {
        let Sweep { center0, angle0, local_center, .. } = self.sweep;
        let before = Transform::about_center(center0, angle0, local_center);
        let (low0, high0) = self.shape.bounds(before);
        let (low1, high1) = self.shape.bounds(self.frame);
        let (old, new) = (Bounds::around(low0, high0, SKIN), Bounds::around(low1, high1, SKIN));
        let swept = Bounds { low: old.low.min(new.low), high: old.high.max(new.high) };
        if self.bounds.contains(&swept) {
            return;
        }
        let mut bounds = Bounds::around(swept.low, swept.high, MARGIN);
        let ahead = LOOK_AHEAD * (self.frame.position - before.position);
        let low = |ahead: f32| if ahead < 0.0 { ahead } else { 0.0 };
        let high = |ahead: f32| if ahead < 0.0 { 0.0 } else { ahead };
        bounds.low += vec2(low(ahead.x), low(ahead.y));
        bounds.high += vec2(high(ahead.x), high(ahead.y));
        self.bounds = bounds;
        self.moved = true;
    }

    /// The place it has now.
    #[inline]
    pub(crate) fn place(&self) -> Place {
        Place { center: self.sweep.center, angle: self.sweep.angle }
    }
}

/// Where a body is: its centre of mass and its angle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Place {
    pub(crate) center: Vec2,
    pub(crate) angle: f32,
}

impl Place {
    /// The place after `dt`, and the motion, slowed down if it is too fast for one step.
    #[inline]
    pub(crate) fn after(self, mut motion: Motion, dt: f32) -> (Self, Motion) {
        let translation = dt * motion.v;
        if translation.length_squared() > MAX_TRANSLATION * MAX_TRANSLATION {
            motion.v = (MAX_TRANSLATION / translation.length()) * motion.v;
        }
        let rotation = dt * motion.w;
        if rotation * rotation > MAX_ROTATION * MAX_ROTATION {
            motion.w *= MAX_ROTATION / rotation.abs();
        }
        let place = Self { center: self.center + dt * motion.v, angle: self.angle + dt * motion.w };
        (place, motion)
    }
}
