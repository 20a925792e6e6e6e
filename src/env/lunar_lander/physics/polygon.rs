//! Convex polygons: hull, centroid, mass.

use super::vector::{Transform, Vec2, vec2};

/// The most corners a polygon of the lander has.
pub(crate) const MAX_CORNERS: usize = 6;

/// A convex polygon, counter-clockwise.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Polygon {
    corners: [Vec2; MAX_CORNERS],
    /// `normals[i]` belongs to the side from corner `i` to the next one.
    normals: [Vec2; MAX_CORNERS],
    n: usize,
    pub(crate) centroid: Vec2,
}

/// What a body's shape makes of its density.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Inertial {
    /// kg.
    pub(crate) mass: f32,
    /// In the body's frame.
    pub(crate) center: Vec2,
    /// About the origin of the body's frame, kg·m².
    pub(crate) inertia: f32,
}

impl Polygon {
    /// The convex hull of at least three points that are not on one line.
    ///
    /// The hull starts at the right-most point (the lowest of several): the order of the corners
    /// decides ties in collisions, and names contact points.
    pub(crate) fn hull(points: &[Vec2]) -> Self {
        assert!((3..=MAX_CORNERS).contains(&points.len()), "a polygon of {} points", points.len());
        let mut first = 0;
        for (i, p) in points.iter().enumerate() {
            let best = points[first];
            if p.x > best.x || (p.x == best.x && p.y < best.y) {
                first = i;
            }
        }
        let mut corners = [Vec2::ZERO; MAX_CORNERS];
        let mut n = 0;
        let mut last = first;
        // Gift wrapping: the next corner is the one that leaves all points on the left.
        loop {
            corners[n] = points[last];
            n += 1;
            let mut next = 0;
            for (j, &candidate) in points.iter().enumerate().skip(1) {
                if next == last {
                    next = j;
                    continue;
                }
                let (to_next, to_candidate) =
                    (points[next] - points[last], candidate - points[last]);
                let turn = to_next.cross(to_candidate);
                let farther = to_candidate.length_squared() > to_next.length_squared();
                if turn < 0.0 || (turn == 0.0 && farther) {
                    next = j;
                }
            }
            last = next;
            if last == first {
                break;
            }
        }
        let mut normals = [Vec2::ZERO; MAX_CORNERS];
        for i in 0..n {
            normals[i] = (corners[(i + 1) % n] - corners[i]).right().normalized().0;
        }
        let mut polygon = Self { corners, normals, n, centroid: Vec2::ZERO };
        polygon.centroid = polygon.mean_point();
        polygon
    }

    /// The rectangle of these half extents about the origin.
    pub(crate) fn rectangle(half_width: f32, half_height: f32) -> Self {
        let (w, h) = (half_width, half_height);
        let mut corners = [Vec2::ZERO; MAX_CORNERS];
        let mut normals = corners;
        corners[..4].copy_from_slice(&[vec2(-w, -h), vec2(w, -h), vec2(w, h), vec2(-w, h)]);
        normals[..4].copy_from_slice(&[
            vec2(0.0, -1.0),
            vec2(1.0, 0.0),
            vec2(0.0, 1.0),
            vec2(-1.0, 0.0),
        ]);
        Self { corners, normals, n: 4, centroid: Vec2::ZERO }
    }

    #[inline]
    pub(crate) fn corners(&self) -> &[Vec2] {
        &self.corners[..self.n]
    }

    #[inline]
    pub(crate) fn normals(&self) -> &[Vec2] {
        &self.normals[..self.n]
    }

    /// The corner after corner `i`.
    #[inline]
    pub(crate) fn after(&self, i: usize) -> usize {
        if i + 1 < self.n { i + 1 } else { 0 }
    }

    fn sides(&self) -> impl Iterator<Item = (Vec2, Vec2)> {
        (0..self.n).map(|i| (self.corners[i], self.corners[self.after(i)]))
    }

    /// The centroid, from the triangles between the sides and the origin.
    fn mean_point(&self) -> Vec2 {
        let (mut sum, mut area) = (Vec2::ZERO, 0.0);
        for (a, b) in self.sides() {
            let triangle = 0.5 * a.cross(b);
            area += triangle;
            sum += triangle * THIRD * (Vec2::ZERO + a + b);
        }
        (1.0 / area) * sum
    }

    /// Its mass properties at `density` (kg/m²), from the triangles between the sides and the mean
    /// of the corners.
    pub(crate) fn mass(&self, density: f32) -> Inertial {
        let mut middle = Vec2::ZERO;
        for &corner in self.corners() {
            middle += corner;
        }
        middle = (1.0 / self.n as f32) * middle;
        let (mut area, mut sum, mut inertia) = (0.0, Vec2::ZERO, 0.0);
        for (a, b) in self.sides() {
            let (a, b) = (a - middle, b - middle);
            let twice = a.cross(b);
            let triangle = 0.5 * twice;
            area += triangle;
            sum += triangle * THIRD * (a + b);
            let xx = a.x * a.x + b.x * a.x + b.x * b.x;
            let yy = a.y * a.y + b.y * a.y + b.y * b.y;
            inertia += (0.25 * THIRD * twice) * (xx + yy);
        }
        let mass = density * area;
        let from_middle = (1.0 / area) * sum;
        let center = from_middle + middle;
        // The parallel-axis theorem twice: from the middle to the centre of mass, to the origin.
        let shift = center.dot(center) - from_middle.dot(from_middle);
        Inertial { mass, center, inertia: density * inertia + mass * shift }
    }

    /// The corner that is farthest in `direction`; the first one of several.
    #[inline]
    pub(crate) fn support(&self, direction: Vec2) -> usize {
        support(self.corners(), direction)
    }

    /// The smallest box around it, where `frame` puts it.
    #[inline]
    pub(crate) fn bounds(&self, frame: Transform) -> (Vec2, Vec2) {
        let first = frame.apply(self.corners[0]);
        let (mut low, mut high) = (first, first);
        for &corner in &self.corners()[1..] {
            let corner = frame.apply(corner);
            low = low.min(corner);
            high = high.max(corner);
        }
        (low, high)
    }
}

const THIRD: f32 = 1.0 / 3.0;

/// The point that is farthest in `direction`; the first one of several.
#[inline]
pub(crate) fn support(points: &[Vec2], direction: Vec2) -> usize {
    let mut best = 0;
    let mut farthest = f32::NEG_INFINITY;
    for (i, point) in points.iter().enumerate() {
        let reach = point.dot(direction);
        if reach > farthest {
            (best, farthest) = (i, reach);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rectangles_mass_is_the_textbooks() {
        // 2 m by 6 m at 3 kg/m²: 36 kg; m(w² + h²)/12 = 36·40/12 = 120 kg·m² about the centre.
        let mass = Polygon::rectangle(1.0, 3.0).mass(3.0);
        assert!((mass.mass - 36.0).abs() < 1e-5 && (mass.inertia - 120.0).abs() < 1e-4);
        assert_eq!(mass.center, Vec2::ZERO);
        // Moved by (3, 4), the parallel axis adds m·5² = 900.
        let shifted = [vec2(2.0, 1.0), vec2(4.0, 1.0), vec2(4.0, 7.0), vec2(2.0, 7.0)];
        let polygon = Polygon::hull(&shifted);
        let mass = polygon.mass(3.0);
        assert!((mass.inertia - 1020.0).abs() < 1e-3, "{}", mass.inertia);
        assert!((mass.center - vec2(3.0, 4.0)).length() < 1e-6);
        assert!((polygon.centroid - vec2(3.0, 4.0)).length() < 1e-6);
    }

    #[test]
    fn a_regular_hexagons_mass_is_the_textbooks() {
        // Side 1: area 3√3/2, inertia about the centre 5√3/16 per unit density.
        let h = 0.75_f32.sqrt();
        let points = [
            vec2(1.0, 0.0),
            vec2(0.5, h),
            vec2(-0.5, h),
            vec2(-1.0, 0.0),
            vec2(-0.5, -h),
            vec2(0.5, -h),
        ];
        let mass = Polygon::hull(&points).mass(1.0);
        assert!((mass.mass - 2.598_076).abs() < 1e-5);
        // The polar second moment is twice the planar one.
        assert!((mass.inertia - 2.0 * 0.541_265_9).abs() < 1e-5, "{}", mass.inertia);
    }

    #[test]
    fn a_hull_runs_counter_clockwise_from_the_lowest_of_the_right_most() {
        let points = [
            vec2(0.0, 0.0),
            vec2(2.0, 1.0),
            vec2(0.0, 2.0),
            vec2(1.0, 1.0), // inside
            vec2(2.0, -1.0),
        ];
        let polygon = Polygon::hull(&points);
        let expected = [vec2(2.0, -1.0), vec2(2.0, 1.0), vec2(0.0, 2.0), vec2(0.0, 0.0)];
        assert_eq!(polygon.corners(), expected);
        assert_eq!(polygon.normals()[0], vec2(1.0, 0.0));
        assert_eq!(polygon.support(vec2(-1.0, 0.1)), 2);
        // Equally far: the first one.
        assert_eq!(polygon.support(vec2(1.0, 0.0)), 0);
    }

    #[test]
    fn points_on_a_side_are_no_corners() {
        let points =
            [vec2(0.0, 0.0), vec2(1.0, 0.0), vec2(2.0, 0.0), vec2(2.0, 2.0), vec2(0.0, 2.0)];
        let polygon = Polygon::hull(&points);
        assert_eq!(polygon.corners().len(), 4);
        assert!(!polygon.corners().contains(&vec2(1.0, 0.0)));
    }
}
