//! The town from above: streets, walls, the four places, the taxi, the passenger, and a flag where
//! the passenger wants to go.

use super::{COLS, LOCATIONS, ROWS, Taxi, TaxiState, is_walled_to_the_east};
use crate::env::actions::PlayedAction;
use crate::env::scene::palette::{
    BLUE, Colour, GREEN, ICE, INK, MIST, ORANGE, PAPER, RED, SLATE, WHITE, YELLOW,
};
use crate::env::scene::{Draw, Point, Scene, Shape, Span, TextPicture, cell, of_action};

/// What the places are called, and their colours.
const PLACES: [(char, Colour); 4] = [('R', RED), ('G', GREEN), ('Y', YELLOW), ('B', BLUE)];
/// The sine and cosine by which the taxi, drawn on its way east, is turned for the moves.
const TURNS: [(f64, f64); 4] = [(-1.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.0, -1.0)];

impl Draw for Taxi {
    const FPS: u32 = 4;

    fn scene(&self, last: Option<&PlayedAction>) -> Scene {
        let now = self.now();
        let mut scene = Scene::grid(ROWS, COLS, PAPER);
        for (row, col) in (0..ROWS).flat_map(|row| (0..COLS).map(move |col| (row, col))) {
            scene.add_at(cell(row, col), &[Shape::square(0.96, MIST)]);
        }
        for (&(row, col), (letter, colour)) in LOCATIONS.iter().zip(PLACES) {
            let place = [
                Shape::square(0.96, colour.mixed(PAPER, 0.35)),
                Shape::text([-0.3, 0.28], 0.3, INK, letter),
            ];
            scene.add_at(cell(row, col), &place);
        }
        for (row, col) in (0..ROWS).flat_map(|row| (0..COLS).map(move |col| (row, col))) {
            if col + 1 < COLS && is_walled_to_the_east(row, col) {
                let [x, y] = cell(row, col);
                let wall = [[x + 0.5, y + 0.45], [x + 0.5, y - 0.45]];
                scene.add(Shape::line(wall, 0.09, INK));
            }
        }
        let frame = [[0.0, 0.0], [5.0, 0.0], [5.0, -5.0], [0.0, -5.0], [0.0, 0.0]];
        scene.add(Shape::line(frame, 0.09, INK));
        let (row, col) = LOCATIONS[now.destination];
        scene.add_at(cell(row, col), &flag());
        let riding = now.passenger == TaxiState::IN_TAXI;
        if !riding {
            let (row, col) = LOCATIONS[now.passenger];
            scene.add_at(cell(row, col), &person([-0.24, -0.22]));
        }
        let turn = of_action(last, &TURNS).unwrap_or((0.0, 1.0));
        let taxi = car(riding).iter().map(|shape| shape.placed(turn, [0.0, 0.0])).collect();
        scene.sprite("taxi", cell(now.row, now.col), taxi);
        scene
    }

    fn text(&self, _last: Option<&PlayedAction>) -> Option<TextPicture> {
        let now = self.now();
        let street = MIST;
        let row = |row: usize| {
            let mut spans = Vec::new();
            for col in 0..COLS {
                spans.push(span(now, (row, col)));
                if col + 1 < COLS {
                    let wall = is_walled_to_the_east(row, col);
                    spans.push(Span::of(if wall { "│" } else { " " }, INK).on(street));
                }
            }
            spans
        };
        let mut picture = TextPicture::framed((0..ROWS).map(row).collect(), SLATE);
        let destination = PLACES[now.destination].0;
        let passenger = match PLACES.get(now.passenger) {
            Some((place, _)) => format!("passenger at {place}, "),
            None => "passenger in the taxi, ".into(),
        };
        picture.lines.push(vec![Span::plain(format!("{passenger}destination {destination}"))]);
        Some(picture)
    }
}

/// A taxi on its way east, seen from above; its passenger, if there is one, through the roof.
fn car(riding: bool) -> Vec<Shape> {
    let mut shapes = vec![
        Shape::card(0.66, 0.42, 0.1, INK),
        Shape::card(0.6, 0.36, 0.08, YELLOW),
        Shape::rect([0.1, -0.13], [0.18, 0.13], ICE),
        Shape::rect([-0.24, -0.12], [-0.19, 0.12], ICE),
    ];
    // Headlights.
    for y in [-0.13, 0.13] {
        shapes.push(Shape::disc([0.27, y], 0.03, WHITE));
    }
    if riding {
        shapes.push(Shape::disc([-0.04, 0.0], 0.12, INK));
        shapes.push(Shape::disc([-0.04, 0.0], 0.085, ORANGE));
    }
    shapes
}

/// Someone who waits.
fn person(at: Point) -> [Shape; 4] {
    let shapes = [
        Shape::card(0.24, 0.26, 0.08, INK),
        Shape::card(0.19, 0.21, 0.06, ORANGE),
        Shape::disc([0.0, 0.17], 0.1, INK),
        Shape::disc([0.0, 0.17], 0.075, ORANGE),
    ];
    shapes.map(|shape| shape.moved(at))
}

/// The flag at the destination.
fn flag() -> [Shape; 2] {
    [
        Shape::line([[0.2, -0.36], [0.2, 0.36]], 0.045, INK),
        Shape::polygon([[0.2, 0.38], [0.44, 0.26], [0.2, 0.14]], INK),
    ]
}

/// A cell as three characters.
fn span(now: TaxiState, place: (usize, usize)) -> Span {
    let found = LOCATIONS.iter().position(|&location| location == place);
    let (letter, colour) = found.map_or(('·', SLATE), |i| PLACES[i]);
    let waits = found == Some(now.passenger);
    if (now.row, now.col) == place {
        // Full with a passenger, empty without.
        let back = if now.passenger == TaxiState::IN_TAXI { ORANGE } else { YELLOW };
        return Span::of(format!("[{letter}]"), INK).on(back).bold();
    }
    let cell = format!(" {letter} ");
    if waits {
        Span::of(cell, WHITE).on(ORANGE).bold()
    } else if found == Some(now.destination) {
        Span::of(cell, WHITE).on(INK).bold()
    } else {
        Span::of(cell, colour).on(MIST)
    }
}
