//! Pictures in the terminal: a character per place, or two places per character where there are
//! colours.

use std::fmt::Write as _;

use super::colours::{self, Rgb};
use super::picture::{Picture, Place, Quantity};
use super::svg::{minus, number};
use super::value_map;
use crate::env::scene::Colour;
use crate::render::{Palette, indexed};

/// Places that are shown across and along; of more every second, third, … is left out.
const WIDE: usize = 80;
const TALL: usize = 80;
/// Up to so many places along the page get a line each, and two columns.
const ROOMY: usize = 24;

/// The picture as text, each line ended by a newline.
pub fn render(picture: &Picture, ink: Palette) -> String {
    let mut out =
        format!("{}, {}: {}{}\n", picture.variant, picture.seeds, picture.label, picture.slice());
    if let Some(tiles) = &picture.tiles {
        out.push_str(&value_map::render(picture, tiles, ink));
    } else {
        out.push_str(&panel(picture, ink));
        out.push_str(&legend(picture, ink));
    }
    out
}

/// Every `n`-th of `count` places, so that at most `most` remain.
fn thinned(count: usize, most: usize) -> Vec<usize> {
    (0..count).step_by(count.div_ceil(most)).collect()
}

fn panel(picture: &Picture, ink: Palette) -> String {
    let (x, y) = (&picture.x, &picture.y);
    let columns = thinned(x.n, WIDE);
    let mut rows = thinned(y.n, TALL);
    if !y.down {
        rows.reverse();
    }
    let roomy = y.n <= ROOMY && x.n <= WIDE / 2;
    let lines: Vec<&[usize]> =
        rows.chunks(if roomy || ink == Palette::Plain { 1 } else { 2 }).collect();
    let wide = if roomy { 2 } else { 1 };
    let (low, high) = y.edges();
    let (top, bottom) = if y.down { (low, high) } else { (high, low) };
    let labels: Vec<String> = (0..lines.len())
        .map(|i| match i {
            _ if y.whole && roomy => number(y.value(lines[i][0])),
            _ if y.name.is_empty() => String::new(),
            0 => number(top),
            _ if i + 1 == lines.len() => number(bottom),
            _ if i == lines.len() / 2 => y.name.clone(),
            _ => String::new(),
        })
        .collect();
    let margin = labels.iter().map(|l| l.chars().count()).max().unwrap_or(0);
    let mut out = String::new();
    if y.whole && roomy && !y.name.is_empty() {
        let _ = writeln!(out, "  {}", y.name);
    }
    for (line, label) in lines.iter().zip(&labels) {
        let _ = write!(out, "  {label:>margin$} ");
        for &i in &columns {
            let upper = picture.place(i, line[0]);
            match (ink, roomy) {
                (Palette::Plain, _) => {
                    out.push(character(picture, upper));
                    out.extend(std::iter::repeat_n(' ', wide - 1));
                }
                (_, true) => out.push_str(&roomy_place(picture, upper, ink)),
                _ => {
                    let lower = line.get(1).map(|&j| picture.place(i, j));
                    let over = escape(ink, 38, colour(picture, upper));
                    match lower {
                        Some(place) => {
                            let under = escape(ink, 48, colour(picture, place));
                            let _ = write!(out, "{over}{under}▀");
                        }
                        None => {
                            let _ = write!(out, "\u{1b}[49m{over}▀");
                        }
                    }
                }
            }
        }
        out.truncate(out.trim_end_matches(' ').len());
        out.push_str(if ink == Palette::Plain { "\n" } else { "\u{1b}[0m\n" });
    }
    let (low, high) = x.edges();
    let (low, high) =
        if x.whole { (number(x.low), number(x.high)) } else { (number(low), number(high)) };
    let room = columns.len() * wide;
    let between = room.saturating_sub(low.chars().count() + high.chars().count());
    let _ = writeln!(out, "  {:margin$} {low}{:^between$}{high}", "", x.name);
    out
}

/// A place of two columns: its colour, and the number of its action.
fn roomy_place(picture: &Picture, place: Place, ink: Palette) -> String {
    if place == Place::Nothing {
        return "\u{1b}[0m  ".into();
    }
    let rgb = colour(picture, place);
    let text = match (picture.quantity, place) {
        (Quantity::Policy, Place::Known(_)) => format!("{} ", character(picture, place)),
        _ => "  ".into(),
    };
    let over = if colours::is_light(rgb) { [0, 0, 0] } else { [255, 255, 255] };
    format!("{}{}{text}", escape(ink, 48, rgb), escape(ink, 38, over))
}

/// A place in one character.
fn character(picture: &Picture, place: Place) -> char {
    match (place, picture.quantity) {
        (Place::Nothing, _) => ' ',
        (Place::Unknown, _) => '·',
        (Place::Known(a), Quantity::Policy) => char::from_digit(a as u32, 36).unwrap_or('?'),
        (Place::Known(v), _) => {
            let tenth = (picture.share(v) * 10.0) as u32;
            char::from_digit(tenth.min(9), 10).unwrap_or('?')
        }
    }
}

/// A place's colour.
pub(super) fn colour(picture: &Picture, place: Place) -> Rgb {
    match (place, picture.quantity) {
        (Place::Nothing, _) => colours::NOTHING,
        (Place::Unknown, _) => colours::UNKNOWN,
        (Place::Known(a), Quantity::Policy) => colours::action(a as usize),
        (Place::Known(v), _) => colours::viridis(picture.share(v)),
    }
}

/// The escape sequence that makes a colour that of the text (38) or the ground (48).
pub(super) fn escape(ink: Palette, what: u8, [r, g, b]: Rgb) -> String {
    match ink {
        Palette::Plain => String::new(),
        Palette::Full => format!("\u{1b}[{what};2;{r};{g};{b}m"),
        Palette::Indexed => {
            format!("\u{1b}[{what};5;{}m", indexed(Colour(r, g, b)))
        }
    }
}

/// What characters and colours mean.
pub(super) fn legend(picture: &Picture, ink: Palette) -> String {
    let mut parts: Vec<String> = Vec::new();
    let reset = if ink == Palette::Plain { "" } else { "\u{1b}[0m" };
    match (picture.quantity, picture.range()) {
        (_, None) => parts.push("nothing was learned here".into()),
        (Quantity::Policy, Some(_)) => {
            for (a, name) in picture.actions.iter().enumerate() {
                let ground = escape(ink, 48, colours::action(a));
                let over = if colours::is_light(colours::action(a)) { [0; 3] } else { [255; 3] };
                let digit = char::from_digit(a as u32, 36).unwrap_or('?');
                parts.push(format!("{ground}{}{digit}{reset} {name}", escape(ink, 38, over)));
            }
        }
        (_, Some((low, high))) => {
            let (low, high) = (value_text(low), value_text(high));
            parts.push(if ink == Palette::Plain {
                format!("0 to 9: {low} to {high}")
            } else {
                let step = |i: i32| escape(ink, 48, colours::viridis(f64::from(i) / 19.0)) + " ";
                let bar: String = (0..20).map(step).collect();
                format!("{low} {bar}{reset} {high}")
            });
        }
    }
    if picture.has_unknown() {
        let sample = if ink == Palette::Plain {
            "·".to_string()
        } else {
            format!("{} {reset}", escape(ink, 48, colours::UNKNOWN))
        };
        parts.push(format!("{sample} nothing learned"));
    }
    format!("  {}\n", parts.join("   "))
}

/// A value with four significant digits or so.
pub(super) fn value_text(v: f64) -> String {
    minus(&match v.abs() {
        0.0 => "0".into(),
        m if m < 1e-3 => format!("{v:.2e}"),
        m if m < 10.0 => format!("{v:.3}"),
        m if m < 100.0 => format!("{v:.2}"),
        m if m < 1e5 => format!("{v:.1}"),
        _ => format!("{v:.3e}"),
    })
}
