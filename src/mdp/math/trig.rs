//! Sine and cosine: a fast evaluation with a proven error bound, and CORE-MATH's wherever that
//! bound leaves the last bit open.
//!
//! The value is computed as an unevaluated sum `hi + lo` that is off by at most `e`. If
//! `hi + (lo - e)` and `hi + (lo + e)` round to the same number, so does the true value, because
//! rounding is monotone; otherwise (less than one argument in a thousand) CORE-MATH decides. Either
//! way the result is the correctly rounded one: this file can make it slow, but a bound that
//! holds cannot make it differ. No fused multiply-add is used, for it is slow in software.
//!
//! # Evaluation
//!
//! With a = k / 64 the grid point nearest to |x| and r = |x| - a, which is exact (both are
//! multiples of the last place of x, or a = 0), |r| <= 2^-7 and
//!
//! ```text
//! sin |x| = S + C r + S v + C w,    S = sin a,    v = cos r - 1,
//! cos |x| = C - S r + C v - S w,    C = cos a,    w = sin r - r.
//! ```
//!
//! The table holds S = S1 + S2 and C = C1 + C2, where S1 and C1 are multiples of 2^-27. Let R be
//! r cut to its first 26 bits and R' = r - R, so that |R'| < 2^-25 |r|. Then
//!
//! - C1 R is exact, having 27 + 26 bits, and so is `fast_two_sum(S1, C1 R)`, because S1 is a
//!   multiple of the last place of C1 R, which is at most 2^-60;
//! - everything else is small: S2 and C2 are at most 2^-28, |v| <= r^2 / 2 and |w| <= |r|^3 / 6.
//!
//! # The bound
//!
//! For the sine; u = 2^-53, and every operation is off by at most u times its result.
//!
//! - the rest S2 + (C1 R' + C2 r), which is below 1.1 * 2^-28: 1.1 * 2^-81 from its last
//!   addition, 2^-81 from S2 itself, 0.1 * 2^-81 from all else (the recurrence that makes S2 is
//!   good to 2^-104). It is exact where k = 0, for then S1 = S2 = C2 = 0 and C1 = 1.
//! - S v: u each from r^2, S1 + S2, the product r^2 (...) and the product S v; u / 2 from the
//!   last addition in (...); a tenth of u from the first term of the series left out,
//!   r^8 / 8! <= 2^-71.3. Together less than 4.7 u |S| r^2 / 2.
//! - C w: u each from r^2, r r^2, C1 + C2 and two products, 1.5 u from (...), 0.04 u from
//!   the first term left out, r^9 / 9!. Together less than 6.6 u |r|^3 / 6.
//! - the additions: of S v and C w, of the rest, of the error term of the two-sum, of -e or e.
//!   Four times u (|S| r^2 / 2 + |r|^3 / 6), and 3.4 * 2^-81 for the rest and the error term
//!   (where k = 0: 3.1 u 2^-25 |x|).
//! - after a reduction by π/2 (below), r is the first part of r + t with |t| <= u |r|, and t is
//!   added to R' alone, u 2^-25 |r| off. What t would have changed in v and w is less than
//!   2 u |S| r^2 / 2 and 3 u |r|^3 / 6.
//!
//! The sum is E = 10.7 u |S| r^2 / 2 + 13.6 u |r|^3 / 6 + 2^-78, where the last term is less than
//! 2^-75 |x| if k = 0. As u r^2 / 2 <= 2^-68 and 13.6 u r^2 / 6 <= 4.6 * 2^-68, in units of 2^-68
//!
//! - k = 0: S = 0 and |r| = |x|, so E <= 4.6 |r| + 2^-7 |r|;
//! - k > 0: E <= 10.7 |S| + 4.6 |r| + 2^-10, and no point but the first has |S| < 0.0009, so the
//!   last term is less than 1.1 |S|.
//!
//! The evaluation claims 12 |S1| + 5 |r| units. (Of this, no argument was seen to use up more than
//! a third.) Since the claim shrinks near a zero of the sine, few of the arguments there go to
//! CORE-MATH either, unless they are within 2^-13 or so of it. The cosine is the same with S and C
//! exchanged (no point has |C| < 0.0009, and k = 0 is nothing special).

/// Grid points to the unit.
const GRID: usize = 64;

/// Grid points in the table, from 0 on.
const POINTS: usize = 512;

/// Below this one of the grid points is the nearest: no reduction is needed. It includes
/// 5/2 π, which is as far as sums of two angles and a quarter turn go.
pub(super) const DIRECT: f64 = (POINTS - 1) as f64 / GRID as f64;

/// Up to this the reduction by π/2 is accurate enough: x * 2/π stays below 2^17.
const REDUCIBLE: f64 = pow2(17);

/// Below this, r^3 and its products would come near to the least normal number.
const TINY: f64 = pow2(-300);

/// The units of the bound.
const UNIT: f64 = pow2(-68);

/// What the reduction by π/2 adds to either.
const REDUCTION_ERROR: f64 = pow2(-94);

/// Sine of `x` radians.
#[must_use]
pub fn sin(x: f64) -> f64 {
    if !is_direct(x) {
        return far_sin_cos::<true, false>(x).0;
    }
    match direct(x).sin().round() {
        Some(sin) => times_sign_of(x, sin),
        None => slow_sin(x),
    }
}

/// Cosine of `x` radians.
#[must_use]
pub fn cos(x: f64) -> f64 {
    if !is_direct(x) {
        return far_sin_cos::<false, true>(x).1;
    }
    match direct(x).cos().round() {
        Some(cos) => cos,
        None => slow_cos(x),
    }
}

/// Sine and cosine of `x` radians: the bits of [`sin`] and [`cos`], sooner.
#[must_use]
pub fn sin_cos(x: f64) -> (f64, f64) {
    if !is_direct(x) {
        return far_sin_cos::<true, true>(x);
    }
    let near = direct(x);
    match (near.sin().round(), near.cos().round()) {
        (Some(sin), Some(cos)) => (times_sign_of(x, sin), cos),
        _ => (slow_sin(x), slow_cos(x)),
    }
}

/// The wanted ones of sine and cosine where `direct` does not serve; the others are 0.
#[inline(never)]
fn far_sin_cos<const SIN: bool, const COS: bool>(x: f64) -> (f64, f64) {
    if x.abs() < TINY {
        // |x|^3 / 6 and x^2 / 2 are far less than half a last place, even of a subnormal x.
        return (x, 1.0);
    }
    let reduced = (DIRECT..REDUCIBLE).contains(&x.abs()).then(|| Reduced::new(x));
    let sin = || match reduced.as_ref().and_then(Reduced::sin) {
        Some(sin) => sin,
        None => slow_sin(x),
    };
    let cos = || match reduced.as_ref().and_then(Reduced::cos) {
        Some(cos) => cos,
        None => slow_cos(x),
    };
    (if SIN { sin() } else { 0.0 }, if COS { cos() } else { 0.0 })
}

#[cold]
#[inline(never)]
fn slow_sin(x: f64) -> f64 {
    core_math::sin(x)
}

#[cold]
#[inline(never)]
fn slow_cos(x: f64) -> f64 {
    core_math::cos(x)
}

/// TINY <= |x| < DIRECT, in one comparison.
#[inline]
fn is_direct(x: f64) -> bool {
    x.abs().to_bits().wrapping_sub(TINY.to_bits()) < DIRECT.to_bits() - TINY.to_bits()
}

/// |x| as a grid point and a rest.
#[inline]
fn direct(x: f64) -> Near {
    let (point, r) = nearest_point(x.abs());
    Near::new(point, r)
}

/// `v` with its sign changed if `x` is negative.
#[inline]
fn times_sign_of(x: f64, v: f64) -> f64 {
    f64::from_bits(v.to_bits() ^ (x.to_bits() & (1 << 63)))
}

/// Added to a number and subtracted again, it rounds to the nearest integer, which also stands
/// in the last bits of the sum: 1.5 * 2^52.
const ROUNDER: f64 = 1.5 * pow2(52);

/// The grid point nearest to `a`, for 0 <= a < DIRECT, and how far `a` lies beyond it.
#[inline]
pub(super) fn nearest_point(a: f64) -> (&'static Point, f64) {
    const GRID_ROUNDER: f64 = ROUNDER / GRID as f64;
    let shifted = a + GRID_ROUNDER;
    (&TABLE[shifted.to_bits() as usize % POINTS], a - (shifted - GRID_ROUNDER))
}

/// A value within `error` of `hi + lo`.
#[derive(Clone, Copy)]
struct Value {
    hi: f64,
    lo: f64,
    error: f64,
}

impl Value {
    /// The number nearest to the value, if the bound decides it.
    #[inline]
    fn round(self) -> Option<f64> {
        let low = self.hi + (self.lo - self.error);
        let high = self.hi + (self.lo + self.error);
        (low == high).then_some(low)
    }
}

/// `a + b`, exactly, if `a` is a multiple of the last place of `b` or is at least as large.
///
/// Let u be that place, and |a| < |b| (otherwise this is well known). |a + b| < 2 |b| < 2^54 u,
/// so hi is a multiple of u and off by u at most; then hi - a is within u of b, hence a multiple
/// of u not beyond 2^53 u: exact. The last difference is 0, u or -u.
#[inline]
fn fast_two_sum(a: f64, b: f64) -> (f64, f64) {
    let hi = a + b;
    (hi, b - (hi - a))
}

/// `a + b`, exactly (Knuth).
#[inline]
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let hi = a + b;
    let b_in_hi = hi - a;
    (hi, (a - (hi - b_in_hi)) + (b - b_in_hi))
}

/// A grid point and a rest r.
struct Near {
    point: &'static Point,
    r: f64,
    /// The first 26 bits of r.
    r_head: f64,
    /// The others.
    r_tail: f64,
    /// cos r - 1.
    v: f64,
    /// sin r - r.
    w: f64,
}

impl Near {
    #[inline]
    fn new(point: &'static Point, r: f64) -> Self {
        let r_head = f64::from_bits(r.to_bits() & !((1 << 27) - 1));
        let q = r * r;
        let v = q * (-1.0 / 2.0 + q * (1.0 / 24.0 + q * (-1.0 / 720.0)));
        let w = (r * q) * (-1.0 / 6.0 + q * (1.0 / 120.0 + q * (-1.0 / 5040.0)));
        Near { point, r, r_head, r_tail: r - r_head, v, w }
    }

    #[inline]
    fn sin(&self) -> Value {
        let &Point { s1, s2, c1, c2 } = self.point;
        let (hi, lo) = fast_two_sum(s1, c1 * self.r_head);
        let rest = s2 + (c1 * self.r_tail + c2 * self.r);
        let bend = (s1 + s2) * self.v + (c1 + c2) * self.w;
        Value { hi, lo: lo + (rest + bend), error: self.bound(s1) }
    }

    #[inline]
    fn cos(&self) -> Value {
        let &Point { s1, s2, c1, c2 } = self.point;
        let (hi, lo) = fast_two_sum(c1, -(s1 * self.r_head));
        let rest = c2 - (s1 * self.r_tail + s2 * self.r);
        let bend = (c1 + c2) * self.v - (s1 + s2) * self.w;
        Value { hi, lo: lo + (rest + bend), error: self.bound(c1) }
    }

    #[inline]
    fn bound(&self, at_point: f64) -> f64 {
        12.0 * UNIT * at_point.abs() + 5.0 * UNIT * self.r.abs()
    }
}

/// x = n π/2 + y, |y| about π/4 at most.
struct Reduced {
    /// n modulo 4, in the last two bits.
    quadrant: u64,
    /// Has the sign of y.
    y: f64,
    /// |y|.
    near: Near,
}

impl Reduced {
    /// For DIRECT <= |x| < REDUCIBLE.
    ///
    /// |n| < 2^17, and the first two parts of π/2 have 35 bits, so n P1 and n P2 are exact.
    /// x - n P1 is exact too: a multiple of 2^-50, as x and P1 are, and below 1. y1 + y2 is
    /// exact, and of multiples of 2^-69. y2 and n P3 are below 2^-53; the product is off by
    /// 2^-107, the difference of the two by 2^-106, and the next sum is exact because y1 is a
    /// multiple of 2^-69. The parts add up to π/2 within 2^-112, which n makes 2^-95. Together
    /// less than `REDUCTION_ERROR`.
    fn new(x: f64) -> Self {
        let shifted = x * std::f64::consts::FRAC_2_PI + ROUNDER;
        let n = shifted - ROUNDER;
        let (y1, y2) = two_sum(x - n * HALF_PI[0], -(n * HALF_PI[1]));
        let (y, beyond) = fast_two_sum(y1, y2 - n * HALF_PI[2]);
        // The sign of y times `beyond` joins r, which is a multiple of the last place of y, and so
        // of that of `beyond`.
        let (point, r) = nearest_point(y.abs());
        let (r, t) = fast_two_sum(r, times_sign_of(y, beyond));
        let mut near = Near::new(point, r);
        near.r_tail += t;
        Reduced { quadrant: shifted.to_bits(), y, near }
    }

    fn sin(&self) -> Option<f64> {
        let v = if self.quadrant & 1 == 0 { self.sin_y() } else { self.cos_y() }?;
        Some(if self.quadrant & 2 == 0 { v } else { -v })
    }

    fn cos(&self) -> Option<f64> {
        let v = if self.quadrant & 1 == 0 { self.cos_y() } else { self.sin_y() }?;
        Some(if self.quadrant.wrapping_add(1) & 2 == 0 { v } else { -v })
    }

    fn sin_y(&self) -> Option<f64> {
        Some(times_sign_of(self.y, reduced(self.near.sin()).round()?))
    }

    fn cos_y(&self) -> Option<f64> {
        reduced(self.near.cos()).round()
    }
}

fn reduced(value: Value) -> Value {
    Value { error: value.error + REDUCTION_ERROR, ..value }
}

/// sin and cos of a grid point, each in a multiple of 2^-27 and a rest.
#[derive(Clone, Copy)]
#[repr(align(32))]
pub(super) struct Point {
    s1: f64,
    s2: f64,
    c1: f64,
    c2: f64,
}

impl Point {
    /// sin and cos of the point, in float64.
    #[inline]
    pub(super) fn rounded(&self) -> (f64, f64) {
        (self.s1 + self.s2, self.c1 + self.c2)
    }
}

static TABLE: [Point; POINTS] = table();

/// Turns by one grid step from point to point. An error of some 30 units of fixed point in the
/// step and in each product adds up to less than 512 * 64 units, 2^-105.
const fn table() -> [Point; POINTS] {
    let mut table = [Point { s1: 0.0, s2: 0.0, c1: 1.0, c2: 0.0 }; POINTS];
    let (sin_step, cos_step) = sin_cos_of_inverse(GRID as i128);
    let (mut sin, mut cos) = (sin_step, cos_step);
    let mut k = 1;
    while k < POINTS {
        let (s1, s2) = split(sin, 27);
        let (c1, c2) = split(cos, 27);
        table[k] = Point { s1, s2: to_f64(s2), c1, c2: to_f64(c2) };
        (sin, cos) =
            (mul(sin, cos_step) + mul(cos, sin_step), mul(cos, cos_step) - mul(sin, sin_step));
        k += 1;
    }
    table
}

/// π/2 in three parts: a multiple of 2^-34, one of 2^-69, and the rest. (Machin's formula.)
const HALF_PI: [f64; 3] = {
    let half_pi = 8 * atan_of_inverse(5) - 2 * atan_of_inverse(239);
    let (first, rest) = split(half_pi, 34);
    let (second, rest) = split(rest, 69);
    [first, second, to_f64(rest)]
};

/// Bits after the point of the fixed-point numbers that the constants are made from.
const FRACTION: u32 = 120;

/// 1 in fixed point.
const ONE: i128 = 1 << FRACTION;

/// The product of two numbers of at most 1 in size, less 2 units at most.
const fn mul(a: i128, b: i128) -> i128 {
    const HALF: u32 = FRACTION / 2;
    const LOW: i128 = (1 << HALF) - 1;
    let (a1, a0) = (a >> HALF, a & LOW);
    let (b1, b0) = (b >> HALF, b & LOW);
    a1 * b1 + ((a1 * b0 + a0 * b1) >> HALF)
}

/// sin(1 / d) and cos(1 / d), a unit off for each of the 18 or so terms at most.
const fn sin_cos_of_inverse(d: i128) -> (i128, i128) {
    let (mut sin, mut cos, mut term, mut n) = (0, 0, ONE, 0);
    while term != 0 {
        match n % 4 {
            0 => cos += term,
            1 => sin += term,
            2 => cos -= term,
            _ => sin -= term,
        }
        n += 1;
        term /= d * n;
    }
    (sin, cos)
}

/// atan(1 / d), 30 units off at most for d = 5 (26 terms), 10 for d = 239 (8 terms).
const fn atan_of_inverse(d: i128) -> i128 {
    let (mut sum, mut power, mut n) = (0, ONE / d, 1);
    while power != 0 {
        sum += if n % 4 == 1 { power / n } else { -(power / n) };
        power /= d * d;
        n += 2;
    }
    sum
}

/// The nearest multiple of 2^-`bits`, and the rest.
const fn split(v: i128, bits: u32) -> (f64, i128) {
    let shift = FRACTION - bits;
    let head = (v + (1 << (shift - 1))) >> shift;
    (head as f64 * pow2(-(bits as i32)), v - (head << shift))
}

/// The nearest number.
const fn to_f64(v: i128) -> f64 {
    v as f64 * pow2(-(FRACTION as i32))
}

/// 2^n, for a normal number.
const fn pow2(n: i32) -> f64 {
    f64::from_bits(((1023 + n) as u64) << 52)
}

#[cfg(test)]
mod tests;
