//! The hills and the landing pad.

use super::physics::{EDGES, Edge, vec2};
use super::{HEIGHT, WIDTH};
use crate::mdp::numpy::NumpyRng;

/// The corners of the hills' outline.
pub(super) const POINTS: usize = 11;
/// The first and the last of the corners that the landing pad lies between.
const PAD: [usize; 2] = [POINTS / 2 - 1, POINTS / 2 + 1];
/// Between the floor and a body, and between a hill and a body (before mixing).
const FLOOR_FRICTION: f32 = 0.2;
const HILL_FRICTION: f32 = 0.1;
/// The height of the landing pad, m.
pub(super) const PAD_Y: f64 = HEIGHT / 4.0;

/// The outline of the ground, in metres.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Terrain {
    /// From left to right, `[x, y]`.
    pub(super) points: [[f64; 2]; POINTS],
}

impl Terrain {
    /// A plain at the height of the landing pad.
    pub(super) fn flat() -> Self {
        Self::smoothed([PAD_Y; POINTS + 1])
    }

    /// New hills, with the landing pad between them.
    pub(super) fn draw(rng: &mut NumpyRng) -> Self {
        let mut heights = std::array::from_fn(|_| rng.uniform(0.0, HEIGHT / 2.0));
        let middle = POINTS / 2;
        heights[middle - 2..=middle + 2].fill(PAD_Y);
        Self::smoothed(heights)
    }

    fn smoothed(heights: [f64; POINTS + 1]) -> Self {
        let points = std::array::from_fn(|i| {
            // The first corner's neighbour on the left is the last height (a negative index).
            let left = if i == 0 { heights[POINTS] } else { heights[i - 1] };
            let x = WIDTH / (POINTS - 1) as f64 * i as f64;
            [x, 0.33 * (left + heights[i] + heights[i + 1])]
        });
        Self { points }
    }

    /// Where the landing pad begins and ends, m.
    pub(super) fn pad_x(&self) -> [f64; 2] {
        PAD.map(|i| self.points[i][0])
    }

    /// The floor, then the hills from left to right, each with its friction.
    pub(super) fn edges(&self) -> [(Edge, f32); EDGES] {
        let corner = |i: usize| vec2(self.points[i][0] as f32, self.points[i][1] as f32);
        std::array::from_fn(|i| match i {
            0 => {
                let floor = Edge { from: vec2(0.0, 0.0), to: vec2(WIDTH as f32, 0.0) };
                (floor, FLOOR_FRICTION)
            }
            _ => (Edge { from: corner(i - 1), to: corner(i) }, HILL_FRICTION),
        })
    }
}
