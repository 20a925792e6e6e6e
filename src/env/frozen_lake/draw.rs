//! The lake from above: ice, holes, the goal, and the elf who crosses it.

use super::FrozenLake;
use crate::env::actions::PlayedAction;
use crate::env::scene::palette::{
    BLUE, Colour, GREEN, ICE, INK, ORANGE, PAPER, SLATE, WATER, WHITE,
};
use crate::env::scene::{Draw, Point, Scene, Shape, Span, TextPicture, cell, of_action, pieces};

/// The directions of the actions.
const WAYS: [Point; 4] = [[-1.0, 0.0], [0.0, -1.0], [1.0, 0.0], [0.0, 1.0]];

impl Draw for FrozenLake {
    const FPS: u32 = 4;

    fn scene(&self, last: Option<&PlayedAction>) -> Scene {
        let map = &*self.map;
        let mut scene = Scene::grid(map.rows, map.cols, PAPER);
        for (s, &tile) in map.tiles.iter().enumerate() {
            scene.add_at(cell(s / map.cols, s % map.cols), &tile_shapes(tile));
        }
        let at = self.env.state() as usize;
        // The chevron says where it meant to go: the ice may have had it otherwise.
        let elf = pieces::walker(ORANGE, of_action(last, &WAYS));
        scene.sprite("elf", cell(at / map.cols, at % map.cols), elf);
        scene
    }

    fn text(&self, _last: Option<&PlayedAction>) -> Option<TextPicture> {
        let map = &*self.map;
        let at = self.env.state() as usize;
        let row = |row: usize| (0..map.cols).map(move |col| row * map.cols + col);
        let rows = (0..map.rows).map(|r| row(r).map(|s| span(map.tiles[s], s == at)).collect());
        Some(TextPicture::framed(rows.collect(), SLATE))
    }
}

/// A tile around the origin.
fn tile_shapes(tile: u8) -> Vec<Shape> {
    let plain = |fill: Colour| Shape::square(0.96, fill);
    match tile {
        b'H' => vec![
            plain(ICE),
            Shape::disc([0.0, 0.0], 0.38, WHITE),
            Shape::disc([0.0, 0.0], 0.34, WATER),
            Shape::disc([0.03, -0.04], 0.26, WATER.mixed(INK, 0.5)),
        ],
        b'G' => [vec![plain(ICE)], pieces::goal()].concat(),
        b'S' => pieces::start(BLUE.mixed(ICE, 0.45), ICE),
        _ => vec![
            plain(ICE),
            Shape::line([[-0.3, 0.12], [-0.12, 0.3]], 0.03, WHITE),
            Shape::line([[-0.22, 0.0], [0.0, 0.22]], 0.03, WHITE),
        ],
    }
}

/// A tile as three characters.
fn span(tile: u8, here: bool) -> Span {
    let (letter, fore, back) = match tile {
        b'H' => ('O', WHITE, WATER),
        b'G' => ('G', WHITE, GREEN),
        b'S' => ('S', BLUE, ICE),
        _ => ('·', SLATE, ICE),
    };
    if here {
        Span::of(format!("[{letter}]"), WHITE).on(ORANGE).bold()
    } else {
        Span::of(format!(" {letter} "), fore).on(back)
    }
}
