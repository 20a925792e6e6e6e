//! When a moving polygon first meets an edge: conservative advancement along separating axes
//! (Mirtich 1996; Catto 2013).

use super::distance::{Cache, distance};
use super::polygon::{Polygon, support};
use super::vector::{Sweep, Vec2};
use super::{LINEAR_SLOP, SKIN};

/// The polygon is to come this close, so that its skin still holds it off.
const TARGET: f32 = {
    let within_skins = 2.0 * SKIN - 3.0 * LINEAR_SLOP;
    if LINEAR_SLOP > within_skins { LINEAR_SLOP } else { within_skins }
};
const TOLERANCE: f32 = 0.25 * LINEAR_SLOP;
const MAX_ITERATIONS: u32 = 20;
const MAX_ROOT_ITERATIONS: u32 = 50;
/// The most axes that are tried at one time: a limit on polygons' corners.
const MAX_AXES: u32 = 16;

/// A direction in which edge and polygon are apart, fixed to one of them.
enum Axis {
    /// Between two corners, fixed to the world.
    Points(Vec2),
    /// The normal of the edge, and its middle.
    Edge { normal: Vec2, middle: Vec2 },
    /// The normal of a side of the polygon, and its middle, in the polygon's frame.
    Polygon { normal: Vec2, middle: Vec2 },
}

/// The corners (of the edge, of the polygon) whose distance along an axis counts.
type Witness = (usize, usize);

/// The moving polygon and the edge.
struct Approach<'a> {
    edge: &'a [Vec2; 2],
    polygon: &'a Polygon,
    sweep: Sweep,
}

impl Approach<'_> {
    /// The axis that the nearest features at `time` suggest.
    fn axis(&self, cache: &Cache, time: f32) -> Axis {
        let frame = self.sweep.transform(time);
        let corner = |j: u8| self.polygon.corners()[usize::from(j)];
        let point = |i: u8| self.edge[usize::from(i)];
        match *cache.pairs() {
            [(i, j)] => Axis::Points((frame.apply(corner(j)) - point(i)).normalized().0),
            [(i, j1), (i2, j2), ..] if i == i2 => {
                let (b1, b2) = (corner(j1), corner(j2));
                let normal = (b2 - b1).right().normalized().0;
                let middle = 0.5 * (b1 + b2);
                let gap = (point(i) - frame.apply(middle)).dot(frame.rotation.apply(normal));
                Axis::Polygon { normal: if gap < 0.0 { -normal } else { normal }, middle }
            }
            [(i1, j), (i2, _), ..] => {
                let (a1, a2) = (point(i1), point(i2));
                let normal = (a2 - a1).right().normalized().0;
                let middle = 0.5 * (a1 + a2);
                let gap = (frame.apply(corner(j)) - middle).dot(normal);
                Axis::Edge { normal: if gap < 0.0 { -normal } else { normal }, middle }
            }
            [] => Axis::Points(Vec2::ZERO),
        }
    }

    /// The corners that are closest along `axis` at `time`, and their separation.
    fn closest(&self, axis: &Axis, time: f32) -> (Witness, f32) {
        let frame = self.sweep.transform(time);
        let on_polygon = |direction| self.polygon.support(frame.rotation.apply_inverse(direction));
        let witness = match *axis {
            Axis::Points(axis) => (support(self.edge, axis), on_polygon(-axis)),
            Axis::Edge { normal, .. } => (0, on_polygon(-normal)),
            Axis::Polygon { normal, .. } => (support(self.edge, -frame.rotation.apply(normal)), 0),
        };
        (witness, self.separation(axis, witness, time))
    }

    /// The separation of two corners along `axis` at `time`.
    fn separation(&self, axis: &Axis, (i, j): Witness, time: f32) -> f32 {
        let frame = self.sweep.transform(time);
        let corner = || frame.apply(self.polygon.corners()[j]);
        match *axis {
            Axis::Points(axis) => (corner() - self.edge[i]).dot(axis),
            Axis::Edge { normal, middle } => (corner() - middle).dot(normal),
            Axis::Polygon { normal, middle } => {
                (self.edge[i] - frame.apply(middle)).dot(frame.rotation.apply(normal))
            }
        }
    }

    /// The time between `from` and `to`, with the separations `s1` and `s2`, at which two corners
    /// are as close as they should come: bisection and secants in turn.
    fn root(
        &self,
        axis: &Axis,
        witness: Witness,
        (mut from, mut s1): (f32, f32),
        (mut to, mut s2): (f32, f32),
    ) -> Option<f32> {
        for i in 0..MAX_ROOT_ITERATIONS {
            let time = if i % 2 == 1 {
                from + (TARGET - s1) * (to - from) / (s2 - s1)
            } else {
                0.5 * (from + to)
            };
            let s = self.separation(axis, witness, time);
            if (s - TARGET).abs() < TOLERANCE {
                return Some(time);
            }
            if s > TARGET {
                (from, s1) = (time, s);
            } else {
                (to, s2) = (time, s);
            }
        }
        None
    }
}

/// When `polygon`, moving along `sweep`, first comes close to `edge`, as a fraction of the rest of
/// the step; `None` if it does not, or is too close already.
pub(crate) fn time_of_impact(edge: &[Vec2; 2], polygon: &Polygon, sweep: &Sweep) -> Option<f32> {
    let approach = Approach { edge, polygon, sweep: sweep.unwound() };
    let mut cache = Cache::default();
    let mut now = 0.0;
    for _ in 0..MAX_ITERATIONS {
        let frame = approach.sweep.transform(now);
        let apart = distance(edge, polygon, frame, &mut cache);
        if apart <= 0.0 {
            return None;
        }
        if apart < TARGET + TOLERANCE {
            return Some(now);
        }
        let axis = approach.axis(&cache, now);
        let mut end = 1.0;
        for _ in 0..MAX_AXES {
            let (witness, s2) = approach.closest(&axis, end);
            if s2 > TARGET + TOLERANCE {
                // Apart all the way along this axis.
                return None;
            }
            if s2 > TARGET - TOLERANCE {
                // They come just close enough: look for a better axis there.
                now = end;
                break;
            }
            let s1 = approach.separation(&axis, witness, now);
            if s1 < TARGET - TOLERANCE {
                return None;
            }
            if s1 <= TARGET + TOLERANCE {
                return Some(now);
            }
            if let Some(time) = approach.root(&axis, witness, (now, s1), (end, s2)) {
                end = time;
            }
        }
    }
    None
}
