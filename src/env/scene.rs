//! Pictures of states, as lists of shapes: what an environment says about its looks.
//!
//! A [`Scene`] knows neither pixels nor characters; the `render` floor turns it into either. Worlds
//! that characters show best add a [`TextPicture`].
//!
//! Coordinates are the environment's own (metres, cells), y upwards.

pub mod palette;
pub mod pieces;
mod text;

pub use palette::Colour;
pub use text::{Span, TextPicture};

use super::actions::{ActionTable, PlayedAction};
use crate::mdp::{Env, math};

/// A point of the world: x to the right, y upwards.
pub type Point = [f64; 2];

/// An environment that can be seen.
pub trait Draw: Env {
    /// Steps per second at which it is shown: Gymnasium's `render_fps`, if one can follow that.
    const FPS: u32;

    /// The present state. `last` is the action that led to it: none after a reset.
    fn scene(&self, last: Option<&PlayedAction>) -> Scene;

    /// The present state in characters, for worlds that are made of few things in rows and
    /// columns. For other worlds, a picture of characters is made from the scene.
    fn text(&self, _last: Option<&PlayedAction>) -> Option<TextPicture> {
        None
    }
}

/// One thing to paint.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A filled polygon; it closes itself.
    Polygon {
        /// Its corners in order.
        points: Vec<Point>,
        /// What it is filled with.
        fill: Colour,
    },
    /// A line through points, with round joints and ends.
    Line {
        /// Where it leads.
        points: Vec<Point>,
        /// Its width, in the world's unit.
        width: f64,
        /// Its colour.
        colour: Colour,
    },
    /// A filled circle.
    Disc {
        /// Its centre.
        centre: Point,
        /// Its radius.
        radius: f64,
        /// What it is filled with.
        fill: Colour,
    },
    /// A line of text, centred on a point. Its size is among the few that the font has, at most
    /// the one asked for if there is such a one.
    Text {
        /// The middle of the text.
        centre: Point,
        /// The height of a line, in the world's unit.
        height: f64,
        /// Its colour.
        colour: Colour,
        /// What it says: printable ASCII.
        text: String,
    },
}

/// Shapes that move together: drawn around the origin and carried to `at`.
///
/// A step from cell to cell is shown as a movement: between two scenes, a sprite of the same name
/// glides from one place to the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Sprite {
    /// What it is, the same in every scene.
    pub name: &'static str,
    /// Which of several it is.
    pub number: usize,
    /// Where it stands.
    pub at: Point,
    /// Where it comes from if it was not there before; it just appears if there is no such place.
    pub from: Option<Point>,
    /// Its shapes, relative to `at`, from the back to the front.
    pub shapes: Vec<Shape>,
}

/// What a scene paints next.
#[derive(Debug, Clone, PartialEq)]
pub enum Item {
    /// A shape that stays where it is.
    Shape(Shape),
    /// Shapes that may glide.
    Sprite(Sprite),
}

/// A picture of a state: items on a background, from the back to the front.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// The left and the bottom edge.
    pub origin: Point,
    /// Width and height, both positive.
    pub size: [f64; 2],
    /// The colour behind everything.
    pub background: Colour,
    /// What is painted on it.
    pub items: Vec<Item>,
    /// The longest way that a sprite glides; beyond it, it jumps (0: nothing ever glides).
    pub stride: f64,
}

impl Scene {
    /// An empty scene that reaches from `low` (left, bottom) to `high` (right, top).
    pub fn new(low: Point, high: Point, background: Colour) -> Self {
        let size = [high[0] - low[0], high[1] - low[1]];
        Self { origin: low, size, background, items: Vec::new(), stride: 0.0 }
    }

    /// A grid world of `rows` × `cols` cells of size 1, with a margin around it. The centre of a
    /// cell is [`cell`]. Sprites glide to neighbouring cells.
    pub fn grid(rows: usize, cols: usize, background: Colour) -> Self {
        const MARGIN: f64 = 0.15;
        let high = [cols as f64 + MARGIN, MARGIN];
        let scene = Self::new([-MARGIN, -(rows as f64) - MARGIN], high, background);
        Self { stride: 1.1, ..scene }
    }

    /// Adds a sprite, the only one of its name.
    pub fn sprite(&mut self, name: &'static str, at: Point, shapes: Vec<Shape>) {
        self.items.push(Item::Sprite(Sprite { name, number: 0, at, from: None, shapes }));
    }

    /// Adds a shape.
    pub fn add(&mut self, shape: Shape) {
        self.items.push(Item::Shape(shape));
    }

    /// Adds shapes that were drawn around the origin, around `at` instead.
    pub fn add_at(&mut self, at: Point, shapes: &[Shape]) {
        self.items.extend(shapes.iter().map(|shape| Item::Shape(shape.moved(at))));
    }

    /// A sprite, by its name and number.
    pub fn find(&self, name: &str, number: usize) -> Option<&Sprite> {
        self.items.iter().find_map(|item| match item {
            Item::Sprite(sprite) if sprite.name == name && sprite.number == number => Some(sprite),
            _ => None,
        })
    }

    /// Every shape where it stands, from the back to the front.
    pub fn shapes(&self) -> impl Iterator<Item = Shape> {
        self.items.iter().flat_map(|item| match item {
            Item::Shape(shape) => vec![shape.clone()],
            Item::Sprite(sprite) => sprite.shapes.iter().map(|s| s.moved(sprite.at)).collect(),
        })
    }

    /// The scene on the way from `before` to this one, at `share` (0 to 1) of the way: sprites
    /// glide, the rest is this scene's.
    #[must_use]
    pub fn between(&self, before: &Self, share: f64) -> Self {
        let mut scene = self.clone();
        for item in &mut scene.items {
            let Item::Sprite(sprite) = item else { continue };
            let near = |old: &Point| distance(*old, sprite.at) <= self.stride;
            let start = match before.find(sprite.name, sprite.number) {
                Some(old) => Some(old.at).filter(near),
                None => sprite.from,
            };
            sprite.at = start.map_or(sprite.at, |start| mix(start, sprite.at, share));
        }
        scene
    }

    /// Whether a sprite glides on the way from `before` to this scene.
    pub fn moves(&self, before: &Self) -> bool {
        self.between(before, 0.0) != *self
    }
}

/// The centre of a cell of a [`Scene::grid`]; rows count downwards.
pub fn cell(row: usize, col: usize) -> Point {
    [col as f64 + 0.5, -(row as f64) - 0.5]
}

/// The point at `share` of the way from `a` to `b`.
pub fn mix(a: Point, b: Point, share: f64) -> Point {
    [a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share]
}

/// `point`, turned around the origin by the angle whose sine and cosine are given
/// (counterclockwise), then moved to `to`.
pub fn placed(point: Point, (sin, cos): (f64, f64), to: Point) -> Point {
    let [x, y] = point;
    [to[0] + x * cos - y * sin, to[1] + x * sin + y * cos]
}

/// The entry of `table` that belongs to a discrete action; none for further actions.
pub fn of_action<T: Copy>(last: Option<&PlayedAction>, table: &[T]) -> Option<T> {
    match last? {
        PlayedAction::Index(index) => {
            usize::try_from(*index).ok().and_then(|i| table.get(i)).copied()
        }
        PlayedAction::Box(_) => None,
    }
}

/// The force of an action that is one real number, or stands for one of `table`; 0 if there is none.
pub(super) fn force(last: Option<&PlayedAction>, table: &ActionTable) -> f64 {
    match last {
        Some(PlayedAction::Box(numbers)) => numbers.first().copied().unwrap_or(0.0),
        Some(PlayedAction::Index(index)) => usize::try_from(*index)
            .ok()
            .filter(|&i| i < table.len())
            .map_or(0.0, |i| table.scalar(i).into()),
        None => 0.0,
    }
}

/// `pieces + 1` points of a circle, from the angle `start` on, by `sweep` (degrees,
/// counterclockwise, 0 points to the right).
pub fn arc(centre: Point, radius: f64, start: f64, sweep: f64, pieces: u32) -> Vec<Point> {
    let angle = |i: u32| radians(start + sweep * f64::from(i) / f64::from(pieces));
    (0..=pieces).map(|i| placed([radius, 0.0], math::sin_cos(angle(i)), centre)).collect()
}

fn radians(degrees: f64) -> f64 {
    degrees * (std::f64::consts::PI / 180.0)
}

fn distance(a: Point, b: Point) -> f64 {
    let (x, y) = (b[0] - a[0], b[1] - a[1]);
    (x * x + y * y).sqrt()
}

impl Shape {
    /// A filled polygon.
    pub fn polygon(points: impl Into<Vec<Point>>, fill: Colour) -> Self {
        Self::Polygon { points: points.into(), fill }
    }

    /// A filled rectangle from `low` (left, bottom) to `high` (right, top).
    pub fn rect(low: Point, high: Point, fill: Colour) -> Self {
        Self::polygon([low, [high[0], low[1]], high, [low[0], high[1]]], fill)
    }

    /// A filled square of a width around the origin.
    pub fn square(width: f64, fill: Colour) -> Self {
        let half = width / 2.0;
        Self::rect([-half, -half], [half, half], fill)
    }

    /// A filled rectangle of a width and height around the origin, with round corners.
    pub fn card(width: f64, height: f64, radius: f64, fill: Colour) -> Self {
        let (x, y) = (width / 2.0 - radius, height / 2.0 - radius);
        let corners = [[x, y], [-x, y], [-x, -y], [x, -y]];
        let points: Vec<Point> =
            (0..4).flat_map(|i| arc(corners[i], radius, 90.0 * i as f64, 90.0, 6)).collect();
        Self::polygon(points, fill)
    }

    /// A line.
    pub fn line(points: impl Into<Vec<Point>>, width: f64, colour: Colour) -> Self {
        Self::Line { points: points.into(), width, colour }
    }

    /// A filled circle.
    pub fn disc(centre: Point, radius: f64, fill: Colour) -> Self {
        Self::Disc { centre, radius, fill }
    }

    /// A line of text.
    pub fn text(centre: Point, height: f64, colour: Colour, text: impl Into<String>) -> Self {
        Self::Text { centre, height, colour, text: text.into() }
    }

    /// An arrow from `from` to `to` of a width, with a head; nothing if it has no length.
    pub fn arrow(from: Point, to: Point, width: f64, colour: Colour) -> Vec<Self> {
        let length = distance(from, to);
        if length == 0.0 {
            return Vec::new();
        }
        let along = [(to[0] - from[0]) / length, (to[1] - from[1]) / length];
        let head = (2.4 * width).min(length);
        let (neck, half) = (mix(from, to, (length - head) / length), 0.8 * head);
        let side = |sign: f64| [neck[0] - sign * along[1] * half, neck[1] + sign * along[0] * half];
        vec![
            Self::line([from, neck], width, colour),
            Self::polygon([to, side(1.0), side(-1.0)], colour),
        ]
    }

    /// An arrow along a circle around `centre`, from the angle `start` on, by `sweep` (degrees,
    /// counterclockwise, 0 points to the right); nothing if the sweep is 0.
    pub fn turn(
        centre: Point,
        radius: f64,
        [start, sweep]: [f64; 2],
        width: f64,
        colour: Colour,
    ) -> Vec<Self> {
        if sweep == 0.0 {
            return Vec::new();
        }
        let points = arc(centre, radius, start, sweep, 24);
        let end = points[points.len() - 1];
        let (sin, cos) = math::sin_cos(radians(start + sweep));
        let head = 2.4 * width * sweep.signum();
        let ahead = [end[0] - sin * head, end[1] + cos * head];
        let side = |sign: f64| [end[0] + sign * cos * head * 0.8, end[1] + sign * sin * head * 0.8];
        vec![
            Self::line(points, width, colour),
            Self::polygon([ahead, side(1.0), side(-1.0)], colour),
        ]
    }

    /// A chevron around the origin that points along the unit vector `along`.
    pub fn chevron(along: Point, size: f64, width: f64, colour: Colour) -> Self {
        let turn = (along[1], along[0]);
        let points = [[-0.5 * size, size], [0.5 * size, 0.0], [-0.5 * size, -size]];
        Self::line(points.map(|point| placed(point, turn, [0.0, 0.0])), width, colour)
    }

    /// The shape, moved by `by`.
    #[must_use]
    pub fn moved(&self, by: Point) -> Self {
        let mut shape = self.clone();
        let shift = |point: &mut Point| *point = [point[0] + by[0], point[1] + by[1]];
        match &mut shape {
            Self::Polygon { points, .. } | Self::Line { points, .. } => {
                points.iter_mut().for_each(shift);
            }
            Self::Disc { centre, .. } | Self::Text { centre, .. } => shift(centre),
        }
        shape
    }

    /// The shape, turned around the origin by the angle whose sine and cosine are given
    /// (counterclockwise), then moved to `to`. Text stays upright.
    #[must_use]
    pub fn placed(&self, turn: (f64, f64), to: Point) -> Self {
        let mut shape = self.clone();
        let place = |point: &mut Point| *point = placed(*point, turn, to);
        match &mut shape {
            Self::Polygon { points, .. } | Self::Line { points, .. } => {
                points.iter_mut().for_each(place);
            }
            Self::Disc { centre, .. } | Self::Text { centre, .. } => place(centre),
        }
        shape
    }
}

#[cfg(test)]
mod tests;
