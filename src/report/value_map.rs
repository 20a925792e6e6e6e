//! Grid worlds in the terminal: each place with its letter, the arrows of its greedy actions and
//! its value.

use std::fmt::Write as _;

use super::colours;
use super::heat_map::{escape, legend, value_text};
use super::picture::{Picture, Place, Quantity, Tiles};
use crate::render::Palette;

/// The map, two lines per row: letters with arrows, and values.
pub(super) fn render(picture: &Picture, tiles: &Tiles, ink: Palette) -> String {
    let texts: Vec<[String; 2]> = (0..picture.places.len())
        .map(|k| {
            let value = match picture.places[k] {
                Place::Known(v) if picture.quantity != Quantity::Policy => value_text(v),
                Place::Unknown => "·".into(),
                Place::Known(_) | Place::Nothing => String::new(),
            };
            [format!("{}{}", tiles.letters[k], tiles.arrows[k]), value]
        })
        .collect();
    let wide = texts.iter().flatten().map(|t| t.chars().count()).max().unwrap_or(1);
    let mut out = String::new();
    for (j, row) in texts.chunks(picture.x.n).enumerate() {
        let lines = if picture.quantity == Quantity::Policy { 0..1 } else { 0..2 };
        for line in lines {
            out.push_str("  ");
            for (i, text) in row.iter().enumerate() {
                let (ground, over) = match (picture.place(i, j), picture.quantity) {
                    (_, Quantity::Policy) | (Place::Unknown, _) => (String::new(), String::new()),
                    // What ends an episode, or is never reached.
                    (Place::Nothing, _) => (escape(ink, 48, [0x55; 3]), escape(ink, 38, [255; 3])),
                    (Place::Known(v), _) => {
                        let rgb = colours::viridis(picture.share(v));
                        let dark = colours::is_light(rgb);
                        let over = if dark { [0; 3] } else { [255; 3] };
                        (escape(ink, 48, rgb), escape(ink, 38, over))
                    }
                };
                let reset = if ground.is_empty() { "" } else { "\u{1b}[0m" };
                let _ = write!(out, "{ground}{over}{:<wide$} {reset}", text[line]);
            }
            out.truncate(out.trim_end().len());
            out.push('\n');
        }
    }
    if picture.quantity != Quantity::Policy {
        out.push_str(&legend(picture, ink).replace("0 to 9: ", "values: "));
    }
    out
}
