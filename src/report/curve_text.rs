//! Learning curves in the terminal: a line of Braille dots per variant, the mean over its seeds.

use std::fmt::Write as _;

use super::curves::{Curve, CurvesPlot, value_range};
use super::svg::{Scale, number};
use super::table::{shorten, width};
use crate::render::Palette;

/// Characters across and along.
const WIDE: usize = 52;
const TALL: usize = 10;
/// A character's dots across and along.
const DOTS: [usize; 2] = [2, 4];
/// How wide a variant's name may be.
const NAME: usize = 18;

/// The bits of a Braille character, `[across][along]` from the top.
const BITS: [[u8; 4]; 2] = [[0x01, 0x02, 0x04, 0x40], [0x08, 0x10, 0x20, 0x80]];

/// The colours of the curves' picture (Okabe & Ito 2008) among a terminal's 256; black is the
/// terminal's own, which may be white.
const COLOURS: [&str; 7] =
    ["38;5;32", "38;5;166", "38;5;36", "38;5;175", "38;5;214", "38;5;74", "39"];

/// A character of the panel: its dots, and whose they are.
#[derive(Clone, Copy, Default)]
struct Cell {
    dots: u8,
    curve: Option<usize>,
}

/// The plot as text, each line ended by a newline. Deterministic.
pub fn curves_text(plot: &CurvesPlot, ink: Palette) -> String {
    let (low, high, _) = value_range(&without_bands(plot));
    let last = plot.curves.iter().filter_map(|c| c.band.episode.last()).max().map_or(1, |&n| n);
    let y = Scale { low, high, from: (TALL * DOTS[1] - 1) as f64, to: 0.0 };
    let mut panel = vec![[Cell::default(); WIDE]; TALL];
    let mut names: Vec<Option<usize>> = vec![None; TALL];
    for (i, curve) in plot.curves.iter().enumerate() {
        if let Some(end) = draw(&mut panel, i, curve, last, y) {
            name(&mut names, end, i);
        }
    }
    let row_of = |value: f64| (y.at(value).round() as usize / DOTS[1]).min(TALL - 1);
    let solved = plot.threshold.filter(|&t| y.holds(t)).map(|t| (row_of(t), t));
    let label = |row: usize| match solved {
        Some((at, threshold)) if at == row => number(threshold),
        _ if row == 0 => number(high),
        _ if row == TALL - 1 => number(low),
        _ => String::new(),
    };
    let margin = (0..TALL).map(|row| width(&label(row))).max().unwrap_or(0);
    let window = match plot.window {
        Some(1) => String::new(),
        Some(n) => format!(", rolling mean over {n} episodes"),
        None => ", rolling mean over each variant's own window".into(),
    };
    let off = match plot.threshold.filter(|&t| !y.holds(t)) {
        Some(threshold) if threshold > high => format!("; solved at {}, above", number(threshold)),
        Some(threshold) => format!("; solved at {}, below", number(threshold)),
        None => String::new(),
    };
    let mut out = format!("{}{window}, mean over seeds{off}\n", plot.quantity);
    for (row, cells) in panel.iter().enumerate() {
        let solved = solved.is_some_and(|(at, _)| at == row);
        let label = label(row);
        let blank = " ".repeat(margin - width(&label));
        let _ = write!(out, "{blank}{label} {}", if label.is_empty() { '│' } else { '┤' });
        line(&mut out, cells, solved, plot, ink);
        let mut end = String::new();
        if let Some(i) = names[row] {
            let curve = &plot.curves[i];
            end.push(' ');
            end.push_str(&coloured(&shorten(&curve.name, NAME), curve.look, ink));
        }
        if solved {
            end.push_str(" (solved)");
        }
        out.push_str(&end);
        while out.ends_with(' ') {
            out.pop();
        }
        out.push('\n');
    }
    let (first, last) = ("1", format!("{last} episodes"));
    let gap = WIDE.saturating_sub(first.len() + last.len());
    let _ = writeln!(out, "{} └{}", " ".repeat(margin), "─".repeat(WIDE));
    let _ = writeln!(out, "{}  {first}{}{last}", " ".repeat(margin), " ".repeat(gap));
    out
}

/// The plot as it is drawn here: the means alone, so that wide bands take no room.
fn without_bands(plot: &CurvesPlot) -> CurvesPlot {
    let mut plot = plot.clone();
    for Curve { band, .. } in &mut plot.curves {
        for line in [&mut band.iqm, &mut band.low, &mut band.high] {
            line.clone_from(&band.mean);
        }
    }
    plot
}

/// Draws a curve; the row in which it ends, if it has a finite point in the panel.
fn draw(
    panel: &mut [[Cell; WIDE]],
    i: usize,
    curve: &Curve,
    last: usize,
    y: Scale,
) -> Option<usize> {
    let (episode, mean) = (&curve.band.episode, &curve.band.mean);
    let mut before: Option<usize> = None;
    let mut end = None;
    let mut j = 0;
    for x in 0..WIDE * DOTS[0] {
        // A single episode is a single column.
        let at = 1.0 + x as f64 / (WIDE * DOTS[0] - 1) as f64 * (last as f64 - 1.0);
        while j + 1 < episode.len() && (episode[j + 1] as f64) < at {
            j += 1;
        }
        let value = match (episode.get(j), episode.get(j + 1)) {
            (Some(&a), Some(&b)) => {
                let share = ((at - a as f64) / (b - a) as f64).clamp(0.0, 1.0);
                mean[j] + share * (mean[j + 1] - mean[j])
            }
            (Some(&a), None) if at <= a as f64 => mean[j],
            _ => break,
        };
        if !y.holds(value) {
            before = None;
            continue;
        }
        let dot = y.at(value).round() as usize;
        // No gaps where it is steep.
        let from = before.unwrap_or(dot);
        for dot in from.min(dot)..=from.max(dot) {
            let cell = &mut panel[dot / DOTS[1]][x / DOTS[0]];
            cell.dots |= BITS[x % DOTS[0]][dot % DOTS[1]];
            cell.curve = Some(i);
        }
        before = Some(dot);
        end = Some(dot / DOTS[1]);
    }
    end
}

/// Puts the name of curve `i` into the free row nearest to `row`.
fn name(names: &mut [Option<usize>], row: usize, i: usize) {
    let free = (0..names.len()).filter(|&r| names[r].is_none());
    if let Some(free) = free.min_by_key(|r| r.abs_diff(row)) {
        names[free] = Some(i);
    }
}

/// A row of the panel; dashed where nothing is drawn if it is that of the solved line.
fn line(out: &mut String, cells: &[Cell], solved: bool, plot: &CurvesPlot, ink: Palette) {
    for run in cells.chunk_by(|a, b| a.curve == b.curve) {
        match run[0].curve {
            None => out.push_str(&if solved { "╌" } else { " " }.repeat(run.len())),
            Some(i) => {
                let dots = run.iter().map(|c| char::from_u32(0x2800 + u32::from(c.dots)));
                let text: String = dots.map(|c| c.unwrap_or(' ')).collect();
                out.push_str(&coloured(&text, plot.curves[i].look, ink));
            }
        }
    }
}

fn coloured(text: &str, look: usize, ink: Palette) -> String {
    match ink {
        Palette::Plain => text.to_string(),
        _ => format!("\x1b[{}m{text}\x1b[0m", COLOURS[look % COLOURS.len()]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::curve_band;

    fn plot(curves: Vec<(&str, Vec<f64>)>, threshold: Option<f64>) -> CurvesPlot {
        let curves = curves.into_iter().enumerate().map(|(look, (name, returns))| {
            let episodes = returns.len();
            let band = curve_band(&[returns], 1, episodes);
            Curve { name: name.into(), look, dashed: false, band }
        });
        CurvesPlot {
            title: "t".into(),
            quantity: "native return",
            window: Some(1),
            threshold,
            curves: curves.collect(),
        }
    }

    /// The rows of the panel, without labels.
    fn rows(text: &str) -> Vec<&str> {
        let rows = text.lines().filter_map(|l| l.split_once(['│', '┤']).map(|(_, row)| row));
        rows.collect()
    }

    #[test]
    fn a_rising_line_rises() {
        let text = curves_text(
            &plot(vec![("up", (0..200).map(f64::from).collect())], None),
            Palette::Plain,
        );
        let rows = rows(&text);
        assert_eq!(rows.len(), TALL);
        let start = |row: &str| row.chars().take_while(|c| *c == ' ').count();
        let starts: Vec<usize> = rows.iter().map(|row| start(row)).collect();
        assert!(starts.windows(2).all(|w| w[0] > w[1]), "{text}");
        assert_eq!(starts[TALL - 1], 0, "{text}");
        assert!(rows[0].ends_with(" up"), "{text}");
        assert!(text.lines().last().unwrap().ends_with("200 episodes"), "{text}");
        assert!(text.lines().all(|l| width(l) <= 80), "{text}");
    }

    #[test]
    fn names_stand_where_curves_end_and_none_is_lost() {
        let flat = |x: f64| vec![x; 10];
        let curves = vec![("a", flat(0.0)), ("b", flat(0.0)), ("c", flat(10.0))];
        let text = curves_text(&plot(curves, None), Palette::Plain);
        let rows = rows(&text);
        let at = |name: &str| rows.iter().position(|r| r.ends_with(&format!(" {name}"))).unwrap();
        assert!(at("c") <= 1 && at("a") >= TALL - 2 && at("b") >= TALL - 3, "{text}");
    }

    #[test]
    fn the_solved_line_is_where_it_should_be() {
        let curves = || vec![("a", vec![0.0, 0.0, 40.0, 100.0])];
        let text = curves_text(&plot(curves(), Some(50.0)), Palette::Plain);
        let solved = text.lines().position(|l| l.ends_with("(solved)")).unwrap() - 1;
        assert!((TALL / 2 - 1..=TALL / 2).contains(&solved), "{text}");
        assert!(text.contains("50 ┤╌"), "{text}");
        let far = curves_text(&plot(curves(), Some(1e6)), Palette::Plain);
        assert!(far.contains("; solved at 1000000, above\n") && !far.contains('╌'), "{far}");
    }

    #[test]
    fn nothing_finite_and_a_single_episode_are_drawn_all_the_same() {
        for returns in [vec![f64::NAN; 5], vec![3.0], vec![]] {
            let text = curves_text(&plot(vec![("a", returns)], Some(1.0)), Palette::Indexed);
            assert_eq!(rows(&text).len(), TALL, "{text}");
        }
    }
}
