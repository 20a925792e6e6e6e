//! Pieces that several worlds are made of, around the origin of a cell of size 1.

use super::palette::{Colour, GREEN, INK, WHITE, YELLOW};
use super::{Point, Shape};

/// The one who walks from cell to cell, with a chevron along `way` if there is one.
pub fn walker(body: Colour, way: Option<Point>) -> Vec<Shape> {
    let mut shapes = vec![Shape::disc([0.0, 0.0], 0.27, INK), Shape::disc([0.0, 0.0], 0.22, body)];
    shapes.extend(way.map(|way| Shape::chevron(way, 0.1, 0.06, WHITE)));
    shapes
}

/// A flag on a green.
pub fn goal() -> Vec<Shape> {
    vec![
        Shape::disc([0.0, -0.24], 0.2, GREEN),
        Shape::line([[-0.06, -0.24], [-0.06, 0.34]], 0.05, INK),
        Shape::polygon([[-0.06, 0.36], [0.3, 0.22], [-0.06, 0.08]], YELLOW),
    ]
}

/// A marked tile.
pub fn start(mark: Colour, ground: Colour) -> Vec<Shape> {
    vec![Shape::square(0.96, ground), Shape::square(0.78, mark), Shape::square(0.7, ground)]
}
