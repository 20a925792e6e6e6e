//! Where a polygon touches an edge of the ground: separating axes, then clipping.
//!
//! Coordinates are the world's: the ground is at rest at its origin.

use super::polygon::{MAX_CORNERS, Polygon};
use super::vector::{Transform, Vec2, min};
use super::{ANGULAR_SLOP, SKIN};

/// The skins of the two shapes.
const REACH: f32 = 2.0 * SKIN;

/// A segment of the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Edge {
    pub(crate) from: Vec2,
    pub(crate) to: Vec2,
}

/// Whose side is the flat one that the other's corners touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reference {
    Edge,
    Polygon,
}

/// What a contact point is made of. Points of successive steps with the same features are the
/// same point.
///
/// | point | `first` | `second` | `cut` |
/// |---|---|---|---|
/// | corner of the polygon at the edge | 0 | the corner | no |
/// | side of the polygon, cut at an end of the edge | the end | a corner of the side | yes |
/// | end of the edge at a side of the polygon | the side | 0 | no |
/// | edge, cut at a corner of the polygon's side | the side | the corner | no |
///
/// The names are not unique: two different points may go by the same one, and then share impulses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Feature {
    first: u8,
    second: u8,
    cut: bool,
}

/// One of up to two points of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ManifoldPoint {
    /// A corner, in the frame of the shape that is not the reference.
    pub(crate) local: Vec2,
    pub(crate) feature: Feature,
    /// N·s, of the last step.
    pub(crate) normal_impulse: f32,
    /// N·s, of the last step.
    pub(crate) tangent_impulse: f32,
}

impl ManifoldPoint {
    const fn new(local: Vec2, feature: Feature) -> Self {
        Self { local, feature, normal_impulse: 0.0, tangent_impulse: 0.0 }
    }
}

/// How a polygon and an edge touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Manifold {
    pub(crate) reference: Reference,
    /// Of the reference's side, in the reference's frame.
    pub(crate) normal: Vec2,
    /// A point of the reference's side, in the reference's frame.
    pub(crate) point: Vec2,
    pub(crate) points: [ManifoldPoint; 2],
    /// How many of the points there are.
    pub(crate) n: usize,
}

impl Manifold {
    /// No contact.
    pub(crate) const NONE: Self = Self {
        reference: Reference::Edge,
        normal: Vec2::ZERO,
        point: Vec2::ZERO,
        points: [ManifoldPoint::new(Vec2::ZERO, Feature { first: 0, second: 0, cut: false }); 2],
        n: 0,
    };

    #[inline]
    pub(crate) fn points(&self) -> &[ManifoldPoint] {
        &self.points[..self.n]
    }

    /// Takes over the impulses of the points that were there before.
    pub(crate) fn inherit(&mut self, old: &Self) {
        for point in &mut self.points[..self.n] {
            if let Some(before) = old.points().iter().find(|p| p.feature == point.feature) {
                point.normal_impulse = before.normal_impulse;
                point.tangent_impulse = before.tangent_impulse;
            }
        }
    }
}

/// A point on its way through the clipping.
#[derive(Debug, Clone, Copy)]
struct Clipped {
    at: Vec2,
    feature: Feature,
}

/// A side that clips: its ends, their indices, and its outer normal.
struct Side {
    ends: [Vec2; 2],
    indices: [u8; 2],
    normal: Vec2,
}

/// How `polygon`, placed by `frame`, touches `edge`.
pub(crate) fn collide(edge: &Edge, polygon: &Polygon, frame: Transform) -> Manifold {
    let Edge { from, to } = *edge;
    let below = (to - from).normalized().0.right();
    // An edge has two sides; the one that counts is where the polygon's centroid is.
    let front = below.dot(frame.apply(polygon.centroid) - from) >= 0.0;
    let normal = if front { below } else { -below };
    let mut corners = [Vec2::ZERO; MAX_CORNERS];
    let mut normals = [Vec2::ZERO; MAX_CORNERS];
    let n = polygon.corners().len();
    for i in 0..n {
        corners[i] = frame.apply(polygon.corners()[i]);
        normals[i] = frame.rotation.apply(polygon.normals()[i]);
    }
    let (corners, normals) = (&corners[..n], &normals[..n]);

    let mut edge_gap = f32::MAX;
    for &corner in corners {
        edge_gap = min_strict(normal.dot(corner - from), edge_gap);
    }
    if edge_gap > REACH {
        return Manifold::NONE;
    }
    let side_axis = polygon_axis(edge, normal, corners, normals);
    if side_axis.is_some_and(|(gap, _)| gap > REACH) {
        return Manifold::NONE;
    }
    // Prefer the edge's side, so that the choice does not flicker.
    let side_axis = side_axis.filter(|&(gap, _)| gap > 0.98 * edge_gap + 0.001);
    let Some((_, side)) = side_axis else {
        return on_edge(edge, front, normal, corners, normals, frame);
    };
    on_polygon(edge, polygon, side, corners, normals)
}

#[inline]
fn min_strict(new: f32, old: f32) -> f32 {
    if new < old { new } else { old }
}

/// The side of the polygon with the largest gap to the edge, among those that face it.
fn polygon_axis(
    edge: &Edge,
    normal: Vec2,
    corners: &[Vec2],
    normals: &[Vec2],
) -> Option<(f32, usize)> {
    let mut best = None;
    let mut largest = -f32::MAX;
    for (i, (&corner, &outer)) in corners.iter().zip(normals).enumerate() {
        let inner = -outer;
        let gap = min(inner.dot(corner - edge.from), inner.dot(corner - edge.to));
        if gap > REACH {
            return Some((gap, i));
        }
        // A lone edge admits the same normals towards both of its ends.
        if (inner + normal).dot(normal) < -ANGULAR_SLOP {
            continue;
        }
        if gap > largest {
            largest = gap;
            best = Some((gap, i));
        }
    }
    best
}

/// The edge's side is the reference: the polygon's most opposed side is clipped to it.
fn on_edge(
    edge: &Edge,
    front: bool,
    normal: Vec2,
    corners: &[Vec2],
    normals: &[Vec2],
    frame: Transform,
) -> Manifold {
    let mut i1 = 0;
    let mut most_opposed = normal.dot(normals[0]);
    for (i, &outer) in normals.iter().enumerate().skip(1) {
        let value = normal.dot(outer);
        if value < most_opposed {
            (i1, most_opposed) = (i, value);
        }
    }
    let i2 = if i1 + 1 < corners.len() { i1 + 1 } else { 0 };
    let incident = [i1, i2].map(|i| Clipped {
        at: corners[i],
        feature: Feature { first: 0, second: i as u8, cut: false },
    });
    let side = if front {
        Side { ends: [edge.from, edge.to], indices: [0, 1], normal }
    } else {
        Side { ends: [edge.to, edge.from], indices: [1, 0], normal }
    };
    let points = clip(&incident, &side, true);
    manifold(Reference::Edge, side.normal, side.ends[0], &side, points, |point| {
        ManifoldPoint::new(frame.apply_inverse(point.at), point.feature)
    })
}

/// A side of the polygon is the reference: the edge is clipped to it.
fn on_polygon(
    edge: &Edge,
    polygon: &Polygon,
    i1: usize,
    corners: &[Vec2],
    normals: &[Vec2],
) -> Manifold {
    // Both ends of the edge go by the index 0.
    let feature = Feature { first: i1 as u8, second: 0, cut: false };
    let incident = [edge.from, edge.to].map(|at| Clipped { at, feature });
    let i2 = polygon.after(i1);
    let side = Side {
        ends: [corners[i1], corners[i2]],
        indices: [i1 as u8, i2 as u8],
        normal: normals[i1],
    };
    let points = clip(&incident, &side, false);
    let (normal, point) = (polygon.normals()[i1], polygon.corners()[i1]);
    manifold(Reference::Polygon, normal, point, &side, points, |point| {
        ManifoldPoint::new(point.at, point.feature)
    })
}

fn manifold(
    reference: Reference,
    normal: Vec2,
    point: Vec2,
    side: &Side,
    points: Option<[Clipped; 2]>,
    make: impl Fn(Clipped) -> ManifoldPoint,
) -> Manifold {
    let mut manifold = Manifold { reference, normal, point, ..Manifold::NONE };
    for point in points.into_iter().flatten() {
        if side.normal.dot(point.at - side.ends[0]) <= REACH {
            manifold.points[manifold.n] = make(point);
            manifold.n += 1;
        }
    }
    manifold
}

/// Cuts `incident` off beyond both ends of `side` (Sutherland & Hodgman 1974); `None` if nothing
/// is left. `edge_clips`: the side is the edge's.
fn clip(incident: &[Clipped; 2], side: &Side, edge_clips: bool) -> Option<[Clipped; 2]> {
    let along = side.normal.right();
    let first = clip_half(incident, along, along.dot(side.ends[0]), side.indices[0], edge_clips)?;
    let back = -along;
    clip_half(&first, back, back.dot(side.ends[1]), side.indices[1], edge_clips)
}

/// Keeps what is at most `offset` along `normal`.
fn clip_half(
    points: &[Clipped; 2],
    normal: Vec2,
    offset: f32,
    corner: u8,
    edge_clips: bool,
) -> Option<[Clipped; 2]> {
    let [p, q] = *points;
    let (beyond_p, beyond_q) = (normal.dot(p.at) - offset, normal.dot(q.at) - offset);
    let mut kept = [p; 2];
    let mut n = 0;
    if beyond_p <= 0.0 {
        n += 1;
    }
    if beyond_q <= 0.0 {
        kept[n] = q;
        n += 1;
    }
    if beyond_p * beyond_q < 0.0 {
        let share = beyond_p / (beyond_p - beyond_q);
        let feature = if edge_clips {
            Feature { first: corner, second: p.feature.second, cut: true }
        } else {
            Feature { first: p.feature.first, second: corner, cut: false }
        };
        kept[n] = Clipped { at: p.at + share * (q.at - p.at), feature };
        n += 1;
    }
    (n == 2).then_some(kept)
}
