//! Scenes as lines for a terminal.
//!
//! A world that has a [`TextPicture`] is shown as that. Any other is painted: with colours, every
//! character shows two of them, in quarters; without, the edges of the shapes are drawn in braille
//! dots, eight to a character.

use std::fmt::Write as _;

use super::raster::{Image, height};
use crate::env::scene::palette::PAPER;
use crate::env::scene::{Colour, Scene, Span, TextPicture};

/// What colours a terminal shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Palette {
    /// None, or none are wanted.
    Plain,
    /// The 256 that have numbers.
    Indexed,
    /// All of 24 bits.
    Full,
}

/// A character is taken to be twice as high as wide; in pixels of a painted picture:
const CELL: [u32; 2] = [4, 8];
/// In dots of braille:
const DOTS: [u32; 2] = [2, 4];
/// The quarters that are in the foreground, as bits (1 upper left, 2 upper right, 4 lower left,
/// 8 lower right), by character. The complements are the same with the colours exchanged.
const QUARTERS: [(char, usize); 8] =
    [('█', 15), ('▀', 3), ('▌', 5), ('▚', 9), ('▘', 1), ('▝', 2), ('▖', 4), ('▗', 8)];

/// The lines of a picture, without line breaks, in at most `columns` × `rows` characters (a text
/// picture has the size it has).
pub fn lines(
    scene: &Scene,
    text: Option<&TextPicture>,
    palette: Palette,
    [columns, rows]: [u32; 2],
) -> Vec<String> {
    if let Some(text) = text {
        return text.lines.iter().map(|line| encode(line, palette)).collect();
    }
    // As wide as fits, and as high.
    let (columns, rows) = (columns.max(1), rows.max(1));
    let fitting = scene.size[0] / scene.size[1] * f64::from(2 * rows);
    let columns = columns.min(fitting.floor().max(1.0) as u32);
    // What is less than a row at the bottom is cut off.
    let cells = |[width, high]: [u32; 2]| {
        (columns * width, (height(scene, columns * width) / high).clamp(1, rows))
    };
    if palette == Palette::Plain {
        let (width, rows) = cells(DOTS);
        let mut image = Image::new(width, rows * DOTS[1], PAPER);
        image.outline(scene);
        return (0..rows).map(|row| braille(&image, row, columns)).collect();
    }
    let (width, rows) = cells(CELL);
    let mut image = Image::new(width, rows * CELL[1], scene.background);
    image.paint(scene);
    let row = |row| (0..columns).map(|col| quarters(&image, row, col)).collect::<Vec<_>>();
    (0..rows).map(|r| encode(&row(r), palette)).collect()
}

/// A row of braille characters, without blanks at its end.
fn braille(image: &Image, row: u32, columns: u32) -> String {
    // Unicode numbers the dots down the left column, then the right one, then the lowest two.
    const BITS: [[u32; 2]; 4] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];
    let character = |col: u32| {
        let mut bits = 0;
        for (y, pair) in (0..).zip(BITS) {
            for (x, bit) in (0..).zip(pair) {
                let Colour(r, g, b) = image.at(col * DOTS[0] + x, row * DOTS[1] + y);
                let dark = u32::from(r) + u32::from(g) + u32::from(b) < 3 * 150;
                bits |= if dark { bit } else { 0 };
            }
        }
        if bits == 0 { ' ' } else { char::from_u32(0x2800 + bits).unwrap_or(' ') }
    };
    let line: String = (0..columns).map(character).collect();
    line.trim_end().into()
}

/// The character and the two colours that come nearest to a cell of a painted image.
fn quarters(image: &Image, row: u32, col: u32) -> Span {
    let [wide, high] = CELL.map(|side| side / 2);
    let quarter = |i: u32| {
        let (left, top) = (col * CELL[0] + i % 2 * wide, row * CELL[1] + i / 2 * high);
        mean(
            (0..high)
                .flat_map(|y| (0..wide).map(move |x| (x, y)))
                .map(|(x, y)| image.at(left + x, top + y)),
        )
    };
    let colours = [0, 1, 2, 3].map(quarter);
    let split = |bits: usize| {
        let side = |fore: bool| {
            let of = move |i: &usize| (bits >> i & 1 == 1) == fore;
            (0..4).filter(of).map(|i| colours[i])
        };
        let (fore, back) = (mean(side(true)), mean(side(false)));
        let error: u32 = side(true).map(|c| difference(c, fore)).sum::<u32>()
            + side(false).map(|c| difference(c, back)).sum::<u32>();
        (error, fore, back)
    };
    let best = QUARTERS.iter().map(|&(c, bits)| (c, bits, split(bits))).min_by_key(|(.., s)| s.0);
    match best {
        None | Some((_, 15, _)) => Span::plain(" ").on(mean(colours.into_iter())),
        Some((c, _, (_, fore, back))) => Span::of(c, fore).on(back),
    }
}

fn mean(colours: impl Iterator<Item = Colour>) -> Colour {
    let (mut sum, mut n) = ([0u32; 3], 0);
    for Colour(r, g, b) in colours {
        sum = [sum[0] + u32::from(r), sum[1] + u32::from(g), sum[2] + u32::from(b)];
        n += 1;
    }
    let [r, g, b] = sum.map(|s| (s + n / 2).checked_div(n).unwrap_or(0) as u8);
    Colour(r, g, b)
}

fn difference(a: Colour, b: Colour) -> u32 {
    let square = |a: u8, b: u8| u32::from(a.abs_diff(b)) * u32::from(a.abs_diff(b));
    square(a.0, b.0) + square(a.1, b.1) + square(a.2, b.2)
}

/// A line with its escape sequences. At its end everything is as before it.
fn encode(line: &[Span], palette: Palette) -> String {
    let mut out = String::new();
    let mut look = (None, None, false);
    for span in line {
        let wanted = (span.fore, span.back, span.bold);
        if palette != Palette::Plain && wanted != look {
            out.push_str("\x1b[0");
            if span.bold {
                out.push_str(";1");
            }
            for (ground, colour) in [(38, span.fore), (48, span.back)] {
                let Some(Colour(r, g, b)) = colour else { continue };
                let _ = match palette {
                    Palette::Full => write!(out, ";{ground};2;{r};{g};{b}"),
                    _ => write!(out, ";{ground};5;{}", indexed(Colour(r, g, b))),
                };
            }
            out.push('m');
            look = wanted;
        }
        out.push_str(&span.text);
    }
    if look != (None, None, false) {
        out.push_str("\x1b[0m");
    }
    out
}

/// The number of the nearest of the 256 colours of xterm, the first 16 aside, which users change:
/// a cube of 6 × 6 × 6 from 16 on, then 24 greys.
pub(crate) fn indexed(colour: Colour) -> u32 {
    const LEVELS: [u8; 6] = [0, 95, 135, 175, 215, 255];
    let level = |x: u8| (0..6).min_by_key(|&i| LEVELS[i].abs_diff(x)).unwrap_or(0);
    let [r, g, b] = [colour.0, colour.1, colour.2].map(level);
    let cube = Colour(LEVELS[r], LEVELS[g], LEVELS[b]);
    let average = (u32::from(colour.0) + u32::from(colour.1) + u32::from(colour.2)) / 3;
    let step = (average.saturating_sub(3) / 10).min(23);
    let shade = (8 + 10 * step) as u8;
    if difference(colour, Colour(shade, shade, shade)) < difference(colour, cube) {
        232 + step
    } else {
        (16 + 36 * r + 6 * g + b) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::env::scene::Shape;

    const RED: Colour = Colour(200, 0, 0);
    const BLUE: Colour = Colour(0, 0, 200);

    /// 4 × 2 characters, red on the left of `x` (in characters), blue on the right.
    fn halves(x: f64) -> Scene {
        let mut scene = Scene::new([0.0, 0.0], [4.0, 4.0], RED);
        scene.add(Shape::rect([x, 0.0], [4.0, 4.0], BLUE));
        scene
    }

    #[test]
    fn a_cell_shows_two_colours_in_quarters() {
        let lines = |x, palette| lines(&halves(x), None, palette, [80, 2]);
        let (red, blue) = ("48;2;200;0;0", "48;2;0;0;200");
        assert_eq!(
            lines(2.0, Palette::Full),
            vec![format!("\x1b[0;{red}m  \x1b[0;{blue}m  \x1b[0m"); 2]
        );
        assert_eq!(
            lines(1.5, Palette::Full),
            vec![format!("\x1b[0;{red}m \x1b[0;38;2;200;0;0;{blue}m▌\x1b[0;{blue}m  \x1b[0m"); 2]
        );
        // (200, 0, 0) is nearest to (215, 0, 0), number 16 + 36 · 4.
        assert_eq!(lines(4.0, Palette::Indexed), ["\x1b[0;48;5;160m    \x1b[0m"; 2]);
    }

    #[test]
    fn a_corner_is_a_quarter() {
        let mut scene = Scene::new([0.0, 0.0], [1.0, 2.0], RED);
        scene.add(Shape::rect([0.5, 0.0], [1.0, 1.0], BLUE));
        let expected = "\x1b[0;38;2;0;0;200;48;2;200;0;0m▗\x1b[0m";
        assert_eq!(lines(&scene, None, Palette::Full, [1, 1]), [expected]);
    }

    #[test]
    fn without_colours_edges_are_dots() {
        let mut scene = Scene::new([0.0, 0.0], [4.0, 4.0], RED);
        // Through the middle of the left dots of the third character.
        scene.add(Shape::line([[2.25, -1.0], [2.25, 5.0]], 0.1, BLUE));
        assert_eq!(lines(&scene, None, Palette::Plain, [4, 2]), ["  ⡇", "  ⡇"]);
        // A plane in front of it hides it, its edges are seen.
        scene.add(Shape::rect([-9.0, 2.25], [9.0, 9.0], BLUE));
        let shown = lines(&scene, None, Palette::Plain, [4, 2]);
        assert_eq!(shown, ["⣀⣀⣀⣀", "  ⡇"]);
    }

    #[test]
    fn pictures_fit() {
        for (size, columns, rows) in
            [([3.0, 1.0], 60, 10), ([1.0, 3.0], 13, 19), ([1.0, 0.001], 60, 1)]
        {
            let scene = Scene::new([0.0, 0.0], size, RED);
            let shown = lines(&scene, None, Palette::Full, [60, 20]);
            assert_eq!(shown.len(), rows, "{size:?}");
            let blanks = shown[0].chars().filter(|&c| c == ' ').count();
            assert_eq!(blanks, columns, "{size:?}");
        }
    }

    #[test]
    fn text_pictures_keep_their_characters() {
        let picture = TextPicture {
            lines: vec![vec![
                Span::plain("a"),
                Span::of("b", RED).on(BLUE).bold(),
                Span::plain("c"),
            ]],
        };
        let show = |palette| lines(&halves(0.0), Some(&picture), palette, [1, 1]);
        assert_eq!(show(Palette::Plain), ["abc"]);
        assert_eq!(show(Palette::Full), ["a\x1b[0;1;38;2;200;0;0;48;2;0;0;200mb\x1b[0mc"]);
    }

    #[test]
    fn numbered_colours_are_the_nearest() {
        let numbers =
            [(0, 0, 0), (255, 255, 255), (255, 0, 0), (8, 8, 8), (128, 128, 128), (95, 135, 175)]
                .map(|(r, g, b)| indexed(Colour(r, g, b)));
        assert_eq!(numbers, [16, 231, 196, 232, 244, 67]);
    }
}
