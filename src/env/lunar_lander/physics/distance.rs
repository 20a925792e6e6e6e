//! The distance between two convex sets of points (Gilbert, Johnson & Keerthi 1988; van den
//! Bergen 2003; Catto 2010): here an edge at rest and a polygon.

use super::polygon::{Polygon, support};
use super::vector::{Transform, Vec2};

const MAX_ITERATIONS: u32 = 20;

/// A point of the Minkowski difference: a point of the polygon less one of the edge.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Corner {
    on_edge: Vec2,
    on_polygon: Vec2,
    difference: Vec2,
    /// Barycentric coordinate of the point nearest to the origin.
    weight: f32,
    edge: u8,
    polygon: u8,
}

impl Corner {
    fn new(edge: &[Vec2; 2], polygon: &Polygon, frame: Transform, (i, j): (u8, u8)) -> Self {
        let on_edge = edge[usize::from(i)];
        let on_polygon = frame.apply(polygon.corners()[usize::from(j)]);
        let difference = on_polygon - on_edge;
        Self { on_edge, on_polygon, difference, weight: 0.0, edge: i, polygon: j }
    }
}

/// The simplex of the last query: a good start for the next one nearby.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Cache {
    metric: f32,
    /// Pairs of corners: of the edge, of the polygon.
    pairs: [(u8, u8); 3],
    n: usize,
}

impl Cache {
    pub(crate) fn pairs(&self) -> &[(u8, u8)] {
        &self.pairs[..self.n]
    }
}

/// A point, segment or triangle of the Minkowski difference.
struct Simplex {
    corners: [Corner; 3],
    n: usize,
}

impl Simplex {
    fn start(cache: &Cache, edge: &[Vec2; 2], polygon: &Polygon, frame: Transform) -> Self {
        let mut simplex = Self { corners: [Corner::default(); 3], n: cache.n };
        for (corner, &pair) in simplex.corners.iter_mut().zip(cache.pairs()) {
            *corner = Corner::new(edge, polygon, frame, pair);
        }
        if simplex.n > 1 {
            // A simplex that has changed much would be a bad start.
            let (old, new) = (cache.metric, simplex.metric());
            if new < 0.5 * old || 2.0 * old < new || new < f32::EPSILON {
                simplex.n = 0;
            }
        }
        if simplex.n == 0 {
            simplex.corners[0] = Corner::new(edge, polygon, frame, (0, 0));
            simplex.n = 1;
        }
        simplex
    }

    fn store(&self, cache: &mut Cache) {
        cache.metric = self.metric();
        cache.n = self.n;
        for (pair, corner) in cache.pairs.iter_mut().zip(&self.corners[..self.n]) {
            *pair = (corner.edge, corner.polygon);
        }
    }

    /// Its length or its area (twice).
    fn metric(&self) -> f32 {
        let [a, b, c] = self.corners.map(|corner| corner.difference);
        match self.n {
            2 => (a - b).length(),
            3 => (b - a).cross(c - a),
            _ => 0.0,
        }
    }

    /// From the simplex towards the origin.
    fn direction(&self) -> Vec2 {
        let [a, b, _] = self.corners.map(|corner| corner.difference);
        if self.n == 1 {
            return -a;
        }
        let side = b - a;
        if side.cross(-a) > 0.0 { side.spun(1.0) } else { side.right() }
    }

    /// The nearest points to each other, on the edge and on the polygon.
    fn nearest(&self) -> (Vec2, Vec2) {
        let [a, b, c] = &self.corners;
        match self.n {
            1 => (a.on_edge, a.on_polygon),
            2 => (
                a.weight * a.on_edge + b.weight * b.on_edge,
                a.weight * a.on_polygon + b.weight * b.on_polygon,
            ),
            _ => {
                let p = a.weight * a.on_edge + b.weight * b.on_edge + c.weight * c.on_edge;
                (p, p)
            }
        }
    }

    /// Reduces it to the part that is nearest to the origin.
    fn reduce(&mut self) {
        match self.n {
            2 => self.reduce_segment(),
            3 => self.reduce_triangle(),
            _ => {}
        }
    }

    fn keep_corner(&mut self, i: usize) {
        self.corners[0] = self.corners[i];
        self.corners[0].weight = 1.0;
        self.n = 1;
    }

    /// Keeps the corners `i` and `j`, in this order, with these weights before normalisation.
    fn keep_side(&mut self, (i, wi): (usize, f32), (j, wj): (usize, f32)) {
        let inverse = 1.0 / (wi + wj);
        let (mut a, mut b) = (self.corners[i], self.corners[j]);
        a.weight = wi * inverse;
        b.weight = wj * inverse;
        (self.corners[0], self.corners[1]) = (a, b);
        self.n = 2;
    }

    fn reduce_segment(&mut self) {
        let [a, b, _] = self.corners.map(|corner| corner.difference);
        let side = b - a;
        let weight_b = -a.dot(side);
        if weight_b <= 0.0 {
            self.keep_corner(0);
            return;
        }
        let weight_a = b.dot(side);
        if weight_a <= 0.0 {
            self.keep_corner(1);
            return;
        }
        self.keep_side((0, weight_a), (1, weight_b));
    }

    fn reduce_triangle(&mut self) {
        let [a, b, c] = self.corners.map(|corner| corner.difference);
        // Barycentric coordinates on the three sides and in the triangle, before normalisation.
        let (ab, ac, bc) = (b - a, c - a, c - b);
        let (ab_a, ab_b) = (b.dot(ab), -a.dot(ab));
        let (ac_a, ac_c) = (c.dot(ac), -a.dot(ac));
        let (bc_b, bc_c) = (c.dot(bc), -b.dot(bc));
        let area = ab.cross(ac);
        let (in_a, in_b, in_c) = (area * b.cross(c), area * c.cross(a), area * a.cross(b));
        if ab_b <= 0.0 && ac_c <= 0.0 {
            self.keep_corner(0);
        } else if ab_a > 0.0 && ab_b > 0.0 && in_c <= 0.0 {
            self.keep_side((0, ab_a), (1, ab_b));
        } else if ac_a > 0.0 && ac_c > 0.0 && in_b <= 0.0 {
            self.keep_side((0, ac_a), (2, ac_c));
        } else if ab_a <= 0.0 && bc_c <= 0.0 {
            self.keep_corner(1);
        } else if ac_a <= 0.0 && bc_b <= 0.0 {
            self.keep_corner(2);
        } else if bc_b > 0.0 && bc_c > 0.0 && in_a <= 0.0 {
            // The third corner takes the first one's place.
            self.keep_side((2, bc_c), (1, bc_b));
        } else {
            let inverse = 1.0 / (in_a + in_b + in_c);
            for (corner, weight) in self.corners.iter_mut().zip([in_a, in_b, in_c]) {
                corner.weight = weight * inverse;
            }
        }
    }
}

/// The distance between `edge` and `polygon`, placed by `frame`, without their skins; 0 if they
/// overlap.
pub(crate) fn distance(
    edge: &[Vec2; 2],
    polygon: &Polygon,
    frame: Transform,
    cache: &mut Cache,
) -> f32 {
    let mut simplex = Simplex::start(cache, edge, polygon, frame);
    for _ in 0..MAX_ITERATIONS {
        let before = simplex.n;
        let seen = simplex.corners.map(|corner| (corner.edge, corner.polygon));
        simplex.reduce();
        if simplex.n == 3 {
            // The origin is inside: they overlap.
            break;
        }
        let direction = simplex.direction();
        if direction.length_squared() < f32::EPSILON * f32::EPSILON {
            break;
        }
        let i = support(edge, -direction) as u8;
        let j = polygon.support(frame.rotation.apply_inverse(direction)) as u8;
        simplex.corners[simplex.n] = Corner::new(edge, polygon, frame, (i, j));
        if seen[..before].contains(&(i, j)) {
            break;
        }
        simplex.n += 1;
    }
    let (a, b) = simplex.nearest();
    simplex.store(cache);
    (a - b).length()
}
