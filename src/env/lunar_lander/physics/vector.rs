//! Plane vectors, rotations, rigid transforms, and the motion of a body over one step.

use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

use crate::mdp::math::sin_cos_f32;

/// The smaller one; `b` if they are equal, so the sign of a zero is decided too.
#[inline]
pub(crate) fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The larger one; `b` if they are equal.
#[inline]
pub(crate) fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// `x`, or the limit that it exceeds.
#[inline]
pub(crate) fn clamp(x: f32, low: f32, high: f32) -> f32 {
    max(low, min(x, high))
}

/// A vector in the plane, in metres (or metres per second, or newton seconds).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Vec2 {
    pub(crate) x: f32,
    pub(crate) y: f32,
}

/// The vector (`x`, `y`).
#[inline]
pub(crate) const fn vec2(x: f32, y: f32) -> Vec2 {
    Vec2 { x, y }
}

impl Vec2 {
    pub(crate) const ZERO: Self = vec2(0.0, 0.0);

    #[inline]
    pub(crate) fn dot(self, other: Self) -> f32 {
        self.x * other.x + self.y * other.y
    }

    /// The z component of the cross product.
    #[inline]
    pub(crate) fn cross(self, other: Self) -> f32 {
        self.x * other.y - self.y * other.x
    }

    /// Turned right by 90°: from an edge of a counter-clockwise polygon to its outer normal.
    #[inline]
    pub(crate) fn right(self) -> Self {
        vec2(self.y, -self.x)
    }

    /// The velocity of a point at this place of a body that turns with `omega` about the origin.
    #[inline]
    pub(crate) fn spun(self, omega: f32) -> Self {
        vec2(-omega * self.y, omega * self.x)
    }

    #[inline]
    pub(crate) fn length_squared(self) -> f32 {
        self.x * self.x + self.y * self.y
    }

    #[inline]
    pub(crate) fn length(self) -> f32 {
        self.length_squared().sqrt()
    }

    /// The unit vector in its direction, and its length; a vector too short for that stays as it
    /// is, with length 0.
    #[inline]
    pub(crate) fn normalized(self) -> (Self, f32) {
        let length = self.length();
        if length < f32::EPSILON {
            return (self, 0.0);
        }
        let inverse = 1.0 / length;
        (vec2(self.x * inverse, self.y * inverse), length)
    }

    /// The smaller one of each coordinate.
    #[inline]
    pub(crate) fn min(self, other: Self) -> Self {
        vec2(min(self.x, other.x), min(self.y, other.y))
    }

    /// The larger one of each coordinate.
    #[inline]
    pub(crate) fn max(self, other: Self) -> Self {
        vec2(max(self.x, other.x), max(self.y, other.y))
    }
}

impl Add for Vec2 {
    type Output = Self;

    #[inline]
    fn add(self, other: Self) -> Self {
        vec2(self.x + other.x, self.y + other.y)
    }
}

impl AddAssign for Vec2 {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Sub for Vec2 {
    type Output = Self;

    #[inline]
    fn sub(self, other: Self) -> Self {
        vec2(self.x - other.x, self.y - other.y)
    }
}

impl SubAssign for Vec2 {
    #[inline]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl Neg for Vec2 {
    type Output = Self;

    #[inline]
    fn neg(self) -> Self {
        vec2(-self.x, -self.y)
    }
}

impl Mul<Vec2> for f32 {
    type Output = Vec2;

    #[inline]
    fn mul(self, v: Vec2) -> Vec2 {
        vec2(self * v.x, self * v.y)
    }
}

/// A rotation about the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rotation {
    pub(crate) sin: f32,
    pub(crate) cos: f32,
}

impl Rotation {
    #[inline]
    pub(crate) fn by(angle: f32) -> Self {
        let (sin, cos) = sin_cos_f32(angle);
        Self { sin, cos }
    }

    #[inline]
    pub(crate) fn apply(self, v: Vec2) -> Vec2 {
        vec2(self.cos * v.x - self.sin * v.y, self.sin * v.x + self.cos * v.y)
    }

    #[inline]
    pub(crate) fn apply_inverse(self, v: Vec2) -> Vec2 {
        vec2(self.cos * v.x + self.sin * v.y, -self.sin * v.x + self.cos * v.y)
    }
}

/// A rotation, then a translation: from a body's frame to the world's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Transform {
    pub(crate) position: Vec2,
    pub(crate) rotation: Rotation,
}

impl Transform {
    /// The frame of a body whose centre of mass, at `local_center` in it, is at `center`.
    #[inline]
    pub(crate) fn about_center(center: Vec2, angle: f32, local_center: Vec2) -> Self {
        let rotation = Rotation::by(angle);
        Self { position: center - rotation.apply(local_center), rotation }
    }

    #[inline]
    pub(crate) fn apply(self, v: Vec2) -> Vec2 {
        // The grouping matters: the products are summed before the translation is added.
        self.rotation.apply(v) + self.position
    }

    #[inline]
    pub(crate) fn apply_inverse(self, v: Vec2) -> Vec2 {
        self.rotation.apply_inverse(v - self.position)
    }
}

/// The motion of a body's centre of mass over one step, taken to be linear in time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sweep {
    /// The centre of mass in the body's frame.
    pub(crate) local_center: Vec2,
    /// The centre at `start`, in the world.
    pub(crate) center0: Vec2,
    /// The centre at the end of the step.
    pub(crate) center: Vec2,
    pub(crate) angle0: f32,
    pub(crate) angle: f32,
    /// The fraction of the step that is already behind, at which `center0` and `angle0` hold.
    pub(crate) start: f32,
}

impl Sweep {
    /// The body's frame at the fraction `beta` of what is left of the step.
    #[inline]
    pub(crate) fn transform(&self, beta: f32) -> Transform {
        let center = (1.0 - beta) * self.center0 + beta * self.center;
        let angle = (1.0 - beta) * self.angle0 + beta * self.angle;
        Transform::about_center(center, angle, self.local_center)
    }

    /// Lets the sweep begin at the fraction `time` of the step.
    #[inline]
    pub(crate) fn advance(&mut self, time: f32) {
        let beta = (time - self.start) / (1.0 - self.start);
        self.center0 = (1.0 - beta) * self.center0 + beta * self.center;
        self.angle0 = (1.0 - beta) * self.angle0 + beta * self.angle;
        self.start = time;
    }

    /// The same motion with `angle0` in [0, 2π).
    #[inline]
    pub(crate) fn unwound(mut self) -> Self {
        const TURN: f32 = 2.0 * std::f32::consts::PI;
        let turns = TURN * (self.angle0 / TURN).floor();
        self.angle0 -= turns;
        self.angle -= turns;
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_decide_between_zeros() {
        assert!(max(0.0, -0.0).is_sign_negative() && !max(-0.0, 0.0).is_sign_negative());
        assert!(min(0.0, -0.0).is_sign_negative() && !min(-0.0, 0.0).is_sign_negative());
        assert_eq!(
            [clamp(3.0, -1.0, 1.0), clamp(-3.0, -1.0, 1.0), clamp(0.5, -1.0, 1.0)],
            [1.0, -1.0, 0.5]
        );
    }

    #[test]
    fn a_transform_and_its_inverse_cancel() {
        let frame =
            Transform::about_center(vec2(3.0, 4.0), std::f32::consts::FRAC_PI_2, vec2(1.0, 0.0));
        // A quarter turn carries (1, 0) to (0, 1), which is where the centre (3, 4) lies.
        assert!((frame.position - vec2(3.0, 3.0)).length() < 1e-6);
        assert!((frame.apply(vec2(2.0, 0.0)) - vec2(3.0, 5.0)).length() < 1e-6);
        assert!((frame.apply_inverse(vec2(3.0, 5.0)) - vec2(2.0, 0.0)).length() < 1e-6);
    }

    #[test]
    fn a_sweep_advances_along_its_line() {
        let mut sweep = Sweep {
            local_center: Vec2::ZERO,
            center0: vec2(0.0, 0.0),
            center: vec2(8.0, 4.0),
            angle0: 0.0,
            angle: 1.0,
            start: 0.0,
        };
        sweep.advance(0.25);
        assert_eq!((sweep.center0, sweep.angle0, sweep.start), (vec2(2.0, 1.0), 0.25, 0.25));
        // Two thirds of the remaining three quarters lead to three quarters of the whole.
        sweep.advance(0.75);
        assert!((sweep.center0 - vec2(6.0, 3.0)).length() < 1e-6);
        let whole = Sweep { angle0: 7.0, angle: 7.5, ..sweep }.unwound();
        assert!((whole.angle0 - 0.716_815).abs() < 1e-5 && (whole.angle - 1.216_815).abs() < 1e-5);
    }
}
