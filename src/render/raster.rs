//! Scenes as pixels, by tiny-skia without its vector instructions, which round differently from
//! machine to machine.

use tiny_skia::{
    Color, FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, Rect, Stroke, Transform,
};

use super::font;
use crate::env::scene::palette::{INK, MIST, PAPER};
use crate::env::scene::{Colour, Point, Scene, Shape};

/// The width of an edge that is drawn alone, in pixels: more than half a pixel is in ink even if
/// it lies between two of them.
const EDGE: f32 = 1.1;

/// A rectangle of opaque pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    pixels: Pixmap,
}

/// How shapes are painted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Style {
    /// Filled with their colours.
    Painted,
    /// Their edges only, in ink on paper: what is behind a shape is hidden all the same.
    Outlined,
}

impl Image {
    /// An image of one colour. Both sides are at least 1 and at most 2^14.
    ///
    /// # Panics
    /// If there is no memory for it.
    pub fn new(width: u32, height: u32, colour: Colour) -> Self {
        let side = |length: u32| length.clamp(1, 1 << 14);
        let mut pixels = Pixmap::new(side(width), side(height)).expect("a GB of memory");
        pixels.fill(skia(colour));
        Self { pixels }
    }

    /// Its width, in pixels.
    pub fn width(&self) -> u32 {
        self.pixels.width()
    }

    /// Its height, in pixels.
    pub fn height(&self) -> u32 {
        self.pixels.height()
    }

    /// The colour of a pixel; `x` counts from the left, `y` from the top.
    ///
    /// # Panics
    /// If there is no such pixel.
    pub fn at(&self, x: u32, y: u32) -> Colour {
        let pixel = self.pixels.pixel(x, y).expect("the pixel is inside the image");
        Colour(pixel.red(), pixel.green(), pixel.blue())
    }

    /// All pixels in reading order, four bytes each: red, green, blue, 255.
    pub fn bytes(&self) -> &[u8] {
        self.pixels.data()
    }

    /// Paints a scene over the image's upper part, as wide as the image.
    pub fn paint(&mut self, scene: &Scene) {
        self.draw(scene, Style::Painted);
    }

    /// Draws the edges of a scene's shapes in ink on paper.
    pub fn outline(&mut self, scene: &Scene) {
        self.draw(scene, Style::Outlined);
    }

    fn draw(&mut self, scene: &Scene, style: Style) {
        let view = View::new(scene, self.width());
        let height = view.height.min(self.height()) as f32;
        let back = if style == Style::Painted { scene.background } else { PAPER };
        if let Some(all) = Rect::from_xywh(0.0, 0.0, self.width() as f32, height) {
            self.pixels.fill_rect(all, &paint(back), Transform::identity(), None);
        }
        for shape in scene.shapes() {
            self.shape(&shape, &view, style);
        }
    }

    fn shape(&mut self, shape: &Shape, view: &View, style: Style) {
        let outlined = style == Style::Outlined;
        let surface = |colour: Colour| if outlined { PAPER } else { colour };
        match shape {
            Shape::Polygon { points, fill } => {
                let Some(path) = view.path(points, true) else { return };
                self.fill(&path, surface(*fill));
                if outlined {
                    self.stroke(&path, EDGE, INK);
                }
            }
            Shape::Line { points, width, colour } => {
                // Without its colour, a faint line would look as important as the others.
                let Some(path) = view.path(points, false).filter(|_| !outlined || *colour != MIST)
                else {
                    return;
                };
                let (width, colour) = if outlined {
                    (EDGE, INK)
                } else {
                    // A line stays visible, however small the picture.
                    (view.length(*width).max(0.7), *colour)
                };
                self.stroke(&path, width, colour);
            }
            // A ring needs a hole.
            Shape::Disc { radius, .. } if outlined && view.length(*radius) < 1.6 => {}
            Shape::Disc { centre, radius, fill } => {
                let [x, y] = view.at(*centre);
                let Some(path) = PathBuilder::from_circle(x, y, view.length(*radius)) else {
                    return;
                };
                self.fill(&path, surface(*fill));
                if outlined {
                    self.stroke(&path, EDGE, INK);
                }
            }
            Shape::Text { centre, height, colour, text } => {
                let [x, y] = view.at(*centre);
                let face = font::Face::fitting(view.length(*height));
                let left = x - face.width(text) as f32 / 2.0;
                let top = y - face.height() as f32 / 2.0;
                let colour = if outlined { INK } else { *colour };
                self.text(left.round() as i32, top.round() as i32, face, colour, text);
            }
        }
    }

    fn fill(&mut self, path: &Path, colour: Colour) {
        let (paint, rule) = (paint(colour), FillRule::Winding);
        self.pixels.fill_path(path, &paint, rule, Transform::identity(), None);
    }

    fn stroke(&mut self, path: &Path, width: f32, colour: Colour) {
        let stroke = Stroke {
            width,
            line_cap: LineCap::Round,
            line_join: LineJoin::Round,
            ..Stroke::default()
        };
        self.pixels.stroke_path(path, &paint(colour), &stroke, Transform::identity(), None);
    }

    /// Fills everything below `top` with a colour.
    pub(super) fn bar(&mut self, top: i32, colour: Colour) {
        let (width, height) = (self.width() as f32, self.height() as f32);
        if let Some(bar) = Rect::from_ltrb(0.0, top as f32, width, height) {
            self.pixels.fill_rect(bar, &paint(colour), Transform::identity(), None);
        }
    }

    /// Sets a pixel.
    #[cfg(test)]
    pub(super) fn dot(&mut self, x: i32, y: i32, Colour(r, g, b): Colour) {
        let at = 4 * (y * self.width() as i32 + x) as usize;
        self.pixels.data_mut()[at..at + 3].copy_from_slice(&[r, g, b]);
    }

    /// Writes a line of text whose upper left corner is at a pixel. What does not fit is cut off.
    pub(super) fn text(&mut self, left: i32, top: i32, face: font::Face, ink: Colour, text: &str) {
        let (width, height) = (self.width() as i32, self.height() as i32);
        let inside = |x: i32, y: i32| (0..width).contains(&x) && (0..height).contains(&y);
        let data = self.pixels.data_mut();
        face.each_pixel(text, |x, y, coverage| {
            let (x, y) = (left + x, top + y);
            if coverage > 0 && inside(x, y) {
                let at = 4 * (y * width + x) as usize;
                let under = Colour(data[at], data[at + 1], data[at + 2]);
                let Colour(r, g, b) = under.mixed(ink, f64::from(coverage) / 255.0);
                data[at..at + 3].copy_from_slice(&[r, g, b]);
            }
        });
    }
}

/// From the world to pixels.
struct View {
    left: f64,
    top: f64,
    scale: f64,
    height: u32,
}

impl View {
    fn new(scene: &Scene, width: u32) -> Self {
        let [left, bottom] = scene.origin;
        let scale = f64::from(width) / scene.size[0];
        Self { left, top: bottom + scene.size[1], scale, height: height(scene, width) }
    }

    fn at(&self, [x, y]: Point) -> [f32; 2] {
        [((x - self.left) * self.scale) as f32, ((self.top - y) * self.scale) as f32]
    }

    fn length(&self, length: f64) -> f32 {
        (length * self.scale) as f32
    }

    /// None if there is nothing to see: fewer than two points, or numbers that are not finite.
    fn path(&self, points: &[Point], closed: bool) -> Option<Path> {
        let mut builder = PathBuilder::new();
        for (i, point) in points.iter().enumerate() {
            let [x, y] = self.at(*point);
            if i == 0 { builder.move_to(x, y) } else { builder.line_to(x, y) }
        }
        if closed {
            builder.close();
        }
        builder.finish()
    }
}

/// The height of a scene's picture that is `width` pixels wide.
pub fn height(scene: &Scene, width: u32) -> u32 {
    ((scene.size[1] / scene.size[0] * f64::from(width)).round() as u32).max(1)
}

fn skia(Colour(r, g, b): Colour) -> Color {
    Color::from_rgba8(r, g, b, 255)
}

fn paint(colour: Colour) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color(skia(colour));
    paint
}
