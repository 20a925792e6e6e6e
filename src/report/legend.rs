//! The legend beside the learning curves: the variants, then what the line styles mean.

use std::fmt::Write as _;

use super::curves::{CurvesPlot, marker};
use super::svg::{coordinate, number, text, text_width};
use super::table::shorten;

/// A line holds this many characters; a name gets two lines.
const CHARS: usize = 28;
const LINE: f64 = 16.0;
/// The width of the samples of lines, and where the text beside them starts.
const SAMPLE: f64 = 26.0;
const INDENT: f64 = 34.0;

/// The legend's texts and its size in pixels.
pub(super) struct Legend {
    /// Per variant one or two lines.
    names: Vec<Vec<String>>,
    /// What the line styles mean.
    keys: Vec<(Key, String)>,
    pub(super) width: f64,
    pub(super) height: f64,
}

#[derive(Clone, Copy)]
enum Key {
    Iqm,
    Mean,
    Band,
    Threshold,
}

impl Legend {
    /// Lays the legend out. `off` says that the threshold lies outside the panel: above it (true)
    /// or below.
    pub(super) fn new(plot: &CurvesPlot, off: Option<bool>) -> Self {
        let names: Vec<Vec<String>> = plot.curves.iter().map(|c| wrap(&c.name)).collect();
        let mut keys = Vec::new();
        let several = plot.curves.iter().any(|c| c.band.seeds > 1);
        if several {
            keys.push((Key::Iqm, "IQM over seeds".to_owned()));
        }
        if plot.curves.iter().any(|c| c.band.mean != c.band.iqm) {
            keys.push((Key::Mean, "mean over seeds".to_owned()));
        }
        if plot.curves.iter().any(|c| c.band.method.is_some()) {
            keys.push((Key::Band, "95 % interval of the IQM".to_owned()));
        }
        if let (Some(threshold), Some(above)) = (plot.threshold, off) {
            let side = if above { "above" } else { "below" };
            keys.push((Key::Threshold, format!("solved at {}: {side}", number(threshold))));
        }
        let lines = names.iter().flatten().chain(keys.iter().map(|(_, label)| label));
        let width = INDENT + lines.map(|l| text_width(l, 12.0)).fold(0.0, f64::max);
        let rows = names.iter().map(|lines| lines.len() as f64 * LINE + 5.0).sum::<f64>();
        let height = rows + 18.0 + keys.len() as f64 * (LINE + 4.0);
        Self { names, keys, width, height }
    }

    /// Draws it with its upper left corner at (`left`, `top`).
    pub(super) fn draw(&self, svg: &mut String, plot: &CurvesPlot, left: f64, top: f64) {
        let mut y = top + 8.0;
        for (curve, lines) in plot.curves.iter().zip(&self.names) {
            let end = coordinate(left + SAMPLE);
            let _ = writeln!(
                svg,
                "<path d=\"M{},{}H{end}\" {}/>",
                coordinate(left),
                coordinate(y),
                curve.stroke()
            );
            if plot.curves.len() > 1 {
                marker(svg, curve.look, left + SAMPLE / 2.0, y);
            }
            for line in lines {
                text(svg, left + INDENT, y + 4.0, "", line);
                y += LINE;
            }
            y += 5.0;
        }
        y += 8.0;
        for (key, label) in &self.keys {
            let (x, at) = (coordinate(left), coordinate(y));
            let sample = match key {
                Key::Iqm => {
                    format!("<path d=\"M{x},{at}h{SAMPLE}\" stroke=\"#666\" stroke-width=\"2.2\"/>")
                }
                Key::Mean => format!(
                    "<path d=\"M{x},{at}h{SAMPLE}\" stroke=\"#666\" stroke-dasharray=\"4 3\"/>"
                ),
                Key::Band => format!(
                    "<rect x=\"{x}\" y=\"{}\" width=\"{SAMPLE}\" height=\"10\" fill=\"#666\" \
                     fill-opacity=\"0.22\"/>",
                    coordinate(y - 5.0)
                ),
                Key::Threshold => format!(
                    "<path d=\"M{x},{at}h{SAMPLE}\" stroke=\"#444\" stroke-width=\"1.2\" \
                     stroke-dasharray=\"8 4\"/>"
                ),
            };
            svg.push_str(&sample);
            svg.push('\n');
            text(svg, left + INDENT, y + 4.0, "fill=\"#555\"", label);
            y += LINE + 4.0;
        }
    }
}

/// A name on one or two lines, broken at a space or a dash if it can be; what is still too long
/// loses its middle, for the names of a sweep differ at their ends.
fn wrap(name: &str) -> Vec<String> {
    if super::table::width(name) <= CHARS {
        return vec![name.to_owned()];
    }
    let name: Vec<char> = shorten(name, 2 * CHARS - 2).chars().collect();
    let limit = CHARS.min(name.len());
    let at = (limit / 3..limit)
        .rev()
        .find(|&i| matches!(name[i], ' ' | '-' | '_' | ',' | '/') && name.len() - i - 1 <= CHARS)
        .map_or(limit, |i| i + 1);
    let (first, second) = name.split_at(at);
    let lines = [first, second].map(|l| l.iter().collect::<String>().trim().to_owned());
    lines.into_iter().filter(|l| !l.is_empty()).collect()
}
