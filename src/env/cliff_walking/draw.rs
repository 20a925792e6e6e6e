//! The edge of the cliff from above: firm ground, the abyss, the goal and the walker.

use super::{COLS, CliffWalking, MAP, ROWS};
use crate::env::actions::PlayedAction;
use crate::env::scene::palette::{
    BLUE, EARTH, GREEN, NIGHT, ORANGE, PAPER, RED, SLATE, WHITE, YELLOW,
};
use crate::env::scene::{Draw, Point, Scene, Shape, Span, TextPicture, cell, of_action, pieces};

/// The directions of the actions.
const WAYS: [Point; 4] = [[0.0, 1.0], [1.0, 0.0], [0.0, -1.0], [-1.0, 0.0]];

impl Draw for CliffWalking {
    const FPS: u32 = 4;

    fn scene(&self, last: Option<&PlayedAction>) -> Scene {
        let mut scene = Scene::grid(ROWS, COLS, PAPER);
        let ground = EARTH.mixed(PAPER, 0.7);
        for (row, tiles) in MAP.iter().enumerate() {
            for (col, tile) in tiles.bytes().enumerate() {
                let shapes = match tile {
                    b'C' => abyss(),
                    b'G' => [vec![Shape::square(0.96, ground)], pieces::goal()].concat(),
                    b'S' => pieces::start(BLUE.mixed(ground, 0.45), ground),
                    _ => vec![Shape::square(0.96, ground)],
                };
                scene.add_at(cell(row, col), &shapes);
            }
        }
        let (row, col) = self.position();
        let walker = pieces::walker(ORANGE, of_action(last, &WAYS));
        scene.sprite("walker", cell(row, col), walker);
        scene
    }

    fn text(&self, _last: Option<&PlayedAction>) -> Option<TextPicture> {
        let here = self.position();
        let row = |(row, tiles): (usize, &&str)| {
            tiles.bytes().enumerate().map(|(col, tile)| span(tile, here == (row, col))).collect()
        };
        Some(TextPicture::framed(MAP.iter().enumerate().map(row).collect(), SLATE))
    }
}

/// A fall without a bottom, with a jagged edge.
fn abyss() -> Vec<Shape> {
    let edge = [
        [-0.51, 0.48],
        [0.51, 0.48],
        [0.51, 0.3],
        [0.3, 0.38],
        [0.1, 0.26],
        [-0.12, 0.36],
        [-0.32, 0.24],
        [-0.51, 0.3],
    ];
    let depth = Shape::rect([-0.51, -0.5], [0.51, 0.48], NIGHT);
    vec![depth, Shape::polygon(edge, EARTH)]
}

/// A tile as three characters.
fn span(tile: u8, here: bool) -> Span {
    let ground = EARTH.mixed(WHITE, 0.75);
    let (letter, fore, back) = match tile {
        b'C' => ('x', RED.mixed(YELLOW, 0.3), NIGHT),
        b'G' => ('G', WHITE, GREEN),
        b'S' => ('S', BLUE, ground),
        _ => ('·', SLATE, ground),
    };
    if here {
        Span::of(format!("[{letter}]"), WHITE).on(ORANGE).bold()
    } else {
        Span::of(format!(" {letter} "), fore).on(back)
    }
}
