//! Pictures as SVG, written by hand: the bytes depend on the numbers alone.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::colours::{self, hex};
use super::frame::Axis;
use super::heat_map::{colour, value_text};
use super::picture::{Picture, Place, Quantity, Tiles};
use super::svg::{Scale, coordinate, escape, text, text_width};
use super::table::shorten;

/// The size of a panel over continuous fields, in pixels.
const PANEL: (f64, f64) = (460.0, 340.0);
/// The largest and the smallest side of a whole number's square.
const SQUARE: (f64, f64) = (64.0, 18.0);
/// A panel of squares is about so large.
const SQUARES: f64 = 480.0;
const TOP: f64 = 60.0;
/// The colour bar.
const BAR: (f64, f64) = (16.0, 220.0);
/// Shares that are told apart by colour: a quarter of a level each would not be seen.
const SHADES: f64 = 128.0;

/// The picture as a complete SVG document. Deterministic.
pub fn picture_svg(picture: &Picture) -> String {
    let (x, y) = (&picture.x, &picture.y);
    let (wide, tall) = size(x, y);
    let (low, high) = y.edges();
    let (from, to) = if y.down { (TOP, TOP + tall) } else { (TOP + tall, TOP) };
    let y_scale = Scale { low, high, from, to };
    let y_ticks = ticks(y, y_scale, 6);
    let widest = y_ticks.iter().map(|(_, l)| text_width(l, 12.0)).fold(0.0, f64::max);
    let left = if y.name.is_empty() { 24.0 } else { (widest + 46.0).ceil() };
    let (low, high) = x.edges();
    let x_scale = Scale { low, high, from: left, to: left + wide };

    let title = format!("{}: {}", picture.variant, picture.label);
    let subtitle = format!("{}{}", picture.seeds, picture.slice());
    let headline = shorten(&title, 84);
    let right = left + wide + 22.0;
    let width = f64::max(right + legend_width(picture), left + text_width(&headline, 15.0) * 1.08);
    let width = coordinate((width + 16.0).ceil());
    let height = f64::max(TOP + tall + 54.0, TOP + legend_height(picture) + 16.0);
    let height = coordinate(height.ceil());

    let mut svg = String::new();
    let _ = writeln!(
        svg,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{0}\" \
         font-family=\"Helvetica, Arial, 'DejaVu Sans', sans-serif\" font-size=\"12\" \
         fill=\"#222\">\n<title>{0}</title>\n<desc>{1}</desc>\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>",
        escape(&title),
        escape(&description(picture, &subtitle)),
    );
    text(&mut svg, left, 24.0, "font-size=\"15\" font-weight=\"bold\"", &headline);
    text(&mut svg, left, 44.0, "fill=\"#555\"", &subtitle);
    places(&mut svg, picture, (left, TOP), (wide, tall));
    if let Some(tiles) = &picture.tiles {
        draw_tiles(&mut svg, picture, tiles, (left, TOP), wide / x.n as f64);
    }
    axes(&mut svg, picture, (x_scale, y_scale), (left, TOP, wide, tall), &y_ticks);
    legend(&mut svg, picture, right);
    svg.push_str("</svg>\n");
    svg
}

/// The panel's size: squares where both fields are whole numbers.
fn size(x: &Axis, y: &Axis) -> (f64, f64) {
    if x.whole && y.whole {
        let side = (SQUARES / x.n.max(y.n) as f64).clamp(SQUARE.1, SQUARE.0).floor();
        (side * x.n as f64, side * y.n as f64)
    } else if y.name.is_empty() {
        (PANEL.0, 40.0)
    } else {
        PANEL
    }
}

/// The picture in words, for those who cannot see it.
fn description(picture: &Picture, subtitle: &str) -> String {
    let over = match picture.y.name.as_str() {
        "" => picture.x.name.clone(),
        y => format!("{} and {y}", picture.x.name),
    };
    let mut words = format!("{} over {over}; {subtitle}.", picture.label);
    if let (Some((low, high)), true) = (picture.range(), picture.quantity != Quantity::Policy) {
        let _ = write!(words, " From {} to {}.", value_text(low), value_text(high));
    }
    words
}

/// Where an axis is labelled: every whole number if there are few, else at round values.
fn ticks(axis: &Axis, scale: Scale, most: usize) -> Vec<(f64, String)> {
    if axis.name.is_empty() {
        return Vec::new();
    }
    if axis.whole && axis.n <= 22 {
        return (0..axis.n).map(|i| (axis.value(i), coordinate(axis.value(i)))).collect();
    }
    scale.ticks(most, if axis.whole { 1.0 } else { 0.0 })
}

/// The coloured places: one path per colour, runs of equal places in a row as one bar.
fn places(svg: &mut String, picture: &Picture, at: (f64, f64), size: (f64, f64)) {
    let (nx, ny) = (picture.x.n, picture.y.n);
    let shade = |place: Place| match place {
        Place::Known(v) if picture.quantity != Quantity::Policy => {
            colours::viridis((picture.share(v) * SHADES).round() / SHADES)
        }
        // On a map arrows say it all.
        Place::Known(_) if picture.tiles.is_some() => [0xff; 3],
        Place::Nothing if picture.tiles.is_some() => [0x8c; 3],
        place => colour(picture, place),
    };
    let mut paths: BTreeMap<String, String> = BTreeMap::new();
    for row in 0..ny {
        let j = if picture.y.down { row } else { ny - 1 - row };
        let mut i = 0;
        while i < nx {
            let rgb = shade(picture.place(i, j));
            let end = (i..nx).find(|&k| shade(picture.place(k, j)) != rgb).unwrap_or(nx);
            let run = end - i;
            let d = paths.entry(hex(rgb)).or_default();
            let _ = write!(d, "M{i},{row}h{run}v1h-{run}z");
            i = end;
        }
    }
    let _ = writeln!(
        svg,
        "<svg x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" viewBox=\"0 0 {nx} {ny}\" \
         preserveAspectRatio=\"none\" shape-rendering=\"crispEdges\">",
        coordinate(at.0),
        coordinate(at.1),
        coordinate(size.0),
        coordinate(size.1)
    );
    for (fill, d) in paths {
        let _ = writeln!(svg, "<path fill=\"{fill}\" d=\"{d}\"/>");
    }
    svg.push_str("</svg>\n");
}

/// A map's letters, arrows and values.
fn draw_tiles(svg: &mut String, picture: &Picture, tiles: &Tiles, at: (f64, f64), side: f64) {
    let mut lines = String::new();
    let (wide, tall) = (picture.x.n as f64 * side, picture.y.n as f64 * side);
    for i in 1..picture.x.n {
        let x = coordinate(at.0 + i as f64 * side);
        let _ = write!(lines, "M{x},{}v{}", coordinate(at.1), coordinate(tall));
    }
    for j in 1..picture.y.n {
        let y = coordinate(at.1 + j as f64 * side);
        let _ = write!(lines, "M{},{y}h{}", coordinate(at.0), coordinate(wide));
    }
    let _ = writeln!(svg, "<path d=\"{lines}\" stroke=\"#fff\" stroke-opacity=\"0.6\"/>");
    for (k, letter) in tiles.letters.iter().enumerate() {
        let (i, j) = (k % picture.x.n, k / picture.x.n);
        let (left, top) = (at.0 + i as f64 * side, at.1 + j as f64 * side);
        let place = picture.places[k];
        let ground = match (place, picture.quantity) {
            (_, Quantity::Policy) => [0xff; 3],
            (Place::Nothing, _) => [0x8c; 3],
            _ => colour(picture, place),
        };
        let ink = if colours::is_light(ground) { "#111" } else { "#fff" };
        if place == Place::Nothing {
            let goal = *letter == 'G';
            if goal {
                let _ = writeln!(
                    svg,
                    "<rect x=\"{}\" y=\"{}\" width=\"{s}\" height=\"{s}\" fill=\"#fff\" \
                     stroke=\"#d55e00\" stroke-width=\"3\"/>",
                    coordinate(left + 2.0),
                    coordinate(top + 2.0),
                    s = coordinate(side - 4.0)
                );
            }
            let style = format!(
                "text-anchor=\"middle\" font-weight=\"bold\" font-size=\"{}\" fill=\"{}\"",
                coordinate(side * 0.36),
                if goal { "#d55e00" } else { "#fff" }
            );
            let (x, y) = (left + side / 2.0, top + side * 0.62);
            text(svg, x, y, &style, &letter.to_string());
            continue;
        }
        let small =
            |share: f64| format!("font-size=\"{}\" fill=\"{ink}\"", coordinate(side * share));
        text(svg, left + side * 0.07, top + side * 0.24, &small(0.2), &letter.to_string());
        arrows(svg, &tiles.arrows[k], (left + side / 2.0, top + side * 0.45), side * 0.25, ink);
        if let (Place::Known(v), true) = (place, picture.quantity != Quantity::Policy) {
            let style = format!("text-anchor=\"middle\" {}", small(0.19));
            text(svg, left + side / 2.0, top + side * 0.91, &style, &value_text(v));
        }
    }
}

/// Arrows from a centre; letters that are no arrows are written.
fn arrows(svg: &mut String, arrows: &str, (x, y): (f64, f64), length: f64, ink: &str) {
    for arrow in arrows.chars() {
        let angle = match arrow {
            '→' => 0,
            '↓' => 90,
            '←' => 180,
            '↑' => 270,
            other => {
                let style = format!("text-anchor=\"middle\" fill=\"{ink}\"");
                text(svg, x, y + 4.0, &style, &other.to_string());
                continue;
            }
        };
        let head = length * 0.36;
        let _ = writeln!(
            svg,
            "<path transform=\"translate({} {}) rotate({angle})\" fill=\"none\" stroke=\"{ink}\" \
             stroke-width=\"{}\" d=\"M{},0H{l}m-{h},-{h}l{h},{h}l-{h},{h}\"/>",
            coordinate(x),
            coordinate(y),
            coordinate((length * 0.14).max(1.0)),
            // A lone arrow goes through the centre; several start there.
            coordinate(if arrows.chars().count() == 1 { -length } else { length * 0.15 }),
            l = coordinate(length),
            h = coordinate(head),
        );
    }
}

/// The frame, ticks and names of the fields.
fn axes(
    svg: &mut String,
    picture: &Picture,
    (x, y): (Scale, Scale),
    (left, top, wide, tall): (f64, f64, f64, f64),
    y_ticks: &[(f64, String)],
) {
    let bottom = top + tall;
    let mut marks = String::new();
    for (value, label) in y_ticks {
        let at = y.at(*value);
        let _ = write!(marks, "M{},{}h-5", coordinate(left), coordinate(at));
        text(svg, left - 8.0, at + 4.0, "text-anchor=\"end\"", label);
    }
    for (value, label) in ticks(&picture.x, x, 7) {
        let at = x.at(value);
        let _ = write!(marks, "M{},{}v5", coordinate(at), coordinate(bottom));
        text(svg, at, bottom + 19.0, "text-anchor=\"middle\"", &label);
    }
    let _ = writeln!(
        svg,
        "<path d=\"{marks}\" stroke=\"#222\"/>\n<rect x=\"{}\" y=\"{}\" width=\"{}\" \
         height=\"{}\" fill=\"none\" stroke=\"#222\"/>",
        coordinate(left),
        coordinate(top),
        coordinate(wide),
        coordinate(tall)
    );
    let style = "font-size=\"13\" text-anchor=\"middle\"";
    text(svg, left + wide / 2.0, bottom + 42.0, style, &picture.x.name);
    let middle = top + tall / 2.0;
    let turned = format!("{style} transform=\"rotate(-90 16 {})\"", coordinate(middle));
    text(svg, 16.0, middle, &turned, &picture.y.name);
}

/// Entries of the legend beside the colour bar.
fn entries(picture: &Picture) -> Vec<(String, String)> {
    let mut entries = Vec::new();
    if picture.quantity == Quantity::Policy && picture.tiles.is_none() {
        for (a, name) in picture.actions.iter().enumerate() {
            entries.push((hex(colours::action(a)), format!("{a} {name}")));
        }
    }
    if picture.has_unknown() {
        entries.push((hex(colours::UNKNOWN), "nothing learned".into()));
    }
    entries
}

fn bar(picture: &Picture) -> Option<Scale> {
    let (low, high) = picture.range().filter(|_| picture.quantity != Quantity::Policy)?;
    Some(Scale { low, high, from: TOP + BAR.1, to: TOP }).filter(|s| s.high > s.low)
}

fn bar_ticks(scale: Scale) -> Vec<(f64, String)> {
    scale.ticks(6, 0.0)
}

fn legend_width(picture: &Picture) -> f64 {
    let bar = bar(picture).map_or(0.0, |scale| {
        let labels = bar_ticks(scale).into_iter().map(|(_, l)| text_width(&l, 12.0));
        BAR.0 + 10.0 + labels.fold(0.0, f64::max)
    });
    let entries = entries(picture).into_iter().map(|(_, l)| 22.0 + text_width(&l, 12.0));
    entries.fold(bar, f64::max)
}

fn legend_height(picture: &Picture) -> f64 {
    let bar = if bar(picture).is_some() { BAR.1 + 22.0 } else { 0.0 };
    bar + 20.0 * entries(picture).len() as f64
}

/// The colour bar with its ticks, then what other colours mean.
fn legend(svg: &mut String, picture: &Picture, left: f64) {
    let mut y = TOP;
    if let Some(scale) = bar(picture) {
        const STEPS: u32 = 64;
        let step = BAR.1 / f64::from(STEPS);
        for i in 0..STEPS {
            let rgb = colours::viridis(1.0 - f64::from(i) / f64::from(STEPS - 1));
            let _ = writeln!(
                svg,
                "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"{}\"/>",
                coordinate(left),
                coordinate(TOP + f64::from(i) * step),
                coordinate(BAR.0),
                // A hair more, so that no seam shows.
                coordinate(step + 0.3),
                hex(rgb)
            );
        }
        for (value, label) in bar_ticks(scale) {
            let at = scale.at(value);
            let (x, at_text) = (coordinate(left + BAR.0), coordinate(at));
            let _ = writeln!(svg, "<path d=\"M{x},{at_text}h4\" stroke=\"#222\"/>");
            text(svg, left + BAR.0 + 8.0, at + 4.0, "", &label);
        }
        y += BAR.1 + 22.0;
    }
    for (fill, label) in entries(picture) {
        let _ = writeln!(
            svg,
            "<rect x=\"{}\" y=\"{}\" width=\"14\" height=\"14\" fill=\"{fill}\" stroke=\"#222\" \
             stroke-width=\"0.5\"/>",
            coordinate(left),
            coordinate(y)
        );
        text(svg, left + 20.0, y + 11.0, "", &label);
        y += 20.0;
    }
}
