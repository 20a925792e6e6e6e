//! Learning curves as SVG: one panel, all variants, a band for what the seeds leave open.
//!
//! Per variant a thick line for the interquartile mean over seeds, a thin dashed one for the mean
//! and a translucent band for the pointwise 95 % interval of the former. Written by hand: the
//! bytes depend on the numbers alone, and the file opens in any browser.

use std::fmt::Write as _;

use super::legend::Legend;
use super::svg::{Scale, coordinate, escape, number, text, text_width};
use super::table::shorten;
use crate::stats::{CurveBand, spread};

/// The colours of Okabe & Ito (2008), told apart by colour-blind readers too. Their yellow is
/// left out (invisible on white); black comes last, being the colour of axes.
const COLOURS: [&str; 7] =
    ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"];

/// Marker shapes of about unit radius around (0, 0). Eight shapes on seven colours: 56 variants
/// look different, and the first eight do so in grey print.
const MARKERS: [&str; 8] = [
    "M-1,0A1,1 0 1 1 1,0A1,1 0 1 1 -1,0Z",
    "M-0.9,-0.9H0.9V0.9H-0.9Z",
    "M0,-1.2L1.15,0.8H-1.15Z",
    "M0,-1.3L1.3,0L0,1.3L-1.3,0Z",
    "M0,1.2L1.15,-0.8H-1.15Z",
    "M-0.45,-1.2H0.45V-0.45H1.2V0.45H0.45V1.2H-0.45V0.45H-1.2V-0.45H-0.45Z",
    "M-1.4,-0.55H1.4V0.55H-1.4Z",
    "M-0.55,-1.4H0.55V1.4H-0.55Z",
];

/// The size of the panel, in pixels.
const PANEL_WIDTH: f64 = 640.0;
const PANEL_HEIGHT: f64 = 380.0;

/// How many points all curves together may have, which keeps a file below 300 kB.
const ALL_POINTS: usize = 5000;

/// What curves show: the native return.
pub const NATIVE_RETURN: &str = "native return";
/// What curves show: the error of a predictor's values.
pub const VALUE_ERROR: &str = "value error (RMS)";
/// What curves show: what a network believes the first state to be worth, and what it is.
pub const START_VALUE: &str = "discounted return from the start";

/// What is drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct CurvesPlot {
    /// The study's name.
    pub title: String,
    /// What is drawn over episodes: the title of the value axis.
    pub quantity: &'static str,
    /// The window of the rolling means, in episodes: named in the subtitle. `None` if the curves
    /// have windows of their own.
    pub window: Option<usize>,
    /// The return that counts as solved: a dashed line, if given.
    pub threshold: Option<f64>,
    /// One per variant, in the order of the legend.
    pub curves: Vec<Curve>,
}

/// One variant's learning curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// The variant's name.
    pub name: String,
    /// The number of its colour and its marker: the variant's.
    pub look: usize,
    /// Whether its line is dashed.
    pub dashed: bool,
    /// What it reached over episodes, as [`curve_band`](crate::stats::curve_band) makes it.
    pub band: CurveBand,
}

impl Curve {
    /// How its line is drawn, as attributes.
    pub(super) fn stroke(&self) -> String {
        let dashes = if self.dashed { " stroke-dasharray=\"7 4\"" } else { "" };
        format!("stroke=\"{}\" stroke-width=\"2.2\"{dashes}", colour(self.look))
    }
}

/// The plot as a complete SVG document. Deterministic.
pub fn curves_svg(plot: &CurvesPlot) -> String {
    let (low, high, remark) = value_range(plot);
    let last = plot.curves.iter().filter_map(|c| c.band.episode.last()).max();
    let top = if remark.is_some() { 78.0 } else { 62.0 };
    let y = Scale { low, high, from: top + PANEL_HEIGHT, to: top };
    let widest = y.ticks(7, 0.0).iter().map(|(_, l)| text_width(l, 12.0)).fold(20.0, f64::max);
    let left = (widest + 42.0).ceil();
    let right = left + PANEL_WIDTH;
    let x = Scale { low: 0.0, high: last.map_or(1.0, |&n| n as f64), from: left, to: right };

    let legend = Legend::new(plot, plot.threshold.filter(|&t| !y.holds(t)).map(|t| t > high));
    let (title, subtitle) = (escape(&plot.title), subtitle(plot));
    let headline = shorten(&plot.title, 72);
    // The headline may reach over the legend, and beyond a narrow one.
    let content = f64::max(right + 18.0 + legend.width, left + text_width(&headline, 17.0) * 1.06);
    let width = coordinate((content + 12.0).ceil());
    let height = coordinate((top + PANEL_HEIGHT + 54.0).max(top + legend.height + 12.0).ceil());

    let mut svg = String::new();
    let _ = writeln!(
        svg,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"Learning curves: {title}\" \
         font-family=\"Helvetica, Arial, 'DejaVu Sans', sans-serif\" font-size=\"12\" \
         fill=\"#222\">\n<title>{title}</title>\n<desc>{}</desc>\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>",
        escape(&description(plot, &subtitle)),
    );
    text(&mut svg, left, 26.0, "font-size=\"17\" font-weight=\"bold\"", &headline);
    text(&mut svg, left, 46.0, "fill=\"#555\"", &subtitle);
    if let Some(remark) = remark {
        text(&mut svg, left, 63.0, "fill=\"#555\"", &remark);
    }
    axes(&mut svg, plot.quantity, x, y);
    // A nested frame clips the data to the panel without needing an id.
    let _ = writeln!(
        svg,
        "<svg x=\"{left}\" y=\"{top}\" width=\"{PANEL_WIDTH}\" height=\"{PANEL_HEIGHT}\" \
         fill=\"none\" stroke-linejoin=\"round\">",
    );
    let x = Scale { from: 0.0, to: PANEL_WIDTH, ..x };
    let y = Scale { from: PANEL_HEIGHT, to: 0.0, ..y };
    panel(&mut svg, plot, x, y);
    svg.push_str("</svg>\n");
    legend.draw(&mut svg, plot, right + 18.0, top);
    svg.push_str("</svg>\n");
    svg
}

/// "20 seeds, rolling mean over 20 episodes, band: 95 % interval of the IQM".
fn subtitle(plot: &CurvesPlot) -> String {
    let seeds = || plot.curves.iter().map(|c| c.band.seeds);
    let (fewest, most) = (seeds().min().unwrap_or(0), seeds().max().unwrap_or(0));
    if most == 0 {
        return "no runs yet".into();
    }
    let mut subtitle = match (fewest, most) {
        (1, 1) => "1 seed".into(),
        _ if fewest == most => format!("{most} seeds"),
        _ => format!("{fewest} to {most} seeds"),
    };
    match plot.window {
        None => subtitle.push_str(", rolling means with windows of their own"),
        Some(1) => subtitle.push_str(", every episode"),
        Some(n) => {
            let _ = write!(subtitle, ", rolling mean over {n} episodes");
        }
    }
    let banded = plot.curves.iter().any(|c| c.band.method.is_some());
    subtitle.push_str(if banded {
        ", band: 95 % interval of the IQM"
    } else {
        ", no band: one run shows no spread"
    });
    if plot.curves.iter().any(|c| c.band.carried > 0) {
        subtitle.push_str(", stopped seeds carried forward");
    }
    subtitle
}

/// The plot in words, for those who cannot see it.
fn description(plot: &CurvesPlot, subtitle: &str) -> String {
    let quantity = plot.quantity;
    let mut words =
        format!("{}{} over episodes; {subtitle}.", quantity[..1].to_uppercase(), &quantity[1..]);
    for Curve { name, band, .. } in &plot.curves {
        if let (Some(episode), Some(&end)) = (band.episode.last(), band.iqm.last()) {
            let _ = write!(words, " {name}: {} after {episode} episodes", number(end));
            if band.carried > 0 {
                let _ = write!(
                    words,
                    ", {} of {} seeds stopped before and carried forward",
                    band.carried, band.seeds
                );
            }
            words.push('.');
        }
    }
    words
}

/// The range of the value axis, and a remark if it does not show all curves whole.
pub(super) fn value_range(plot: &CurvesPlot) -> (f64, f64, Option<String>) {
    let (lowest, highest) = lines_range(plot, 0);
    if lowest > highest {
        return (0.0, 1.0, None); // No finite point at all.
    }
    let (mut low, mut high, mut remark) = (lowest, highest, None);
    // An early plunge (falling off the cliff while exploring) would press all that follows into
    // a line: leave it out, and say so. It stays in the rolling means for a window.
    let last = plot.curves.iter().filter_map(|c| c.band.episode.last()).max().map_or(0, |&n| n);
    let start = (last / 10).max(2 * plot.window.unwrap_or(1)).min(last / 4);
    let (later_low, later_high) = lines_range(plot, start);
    let later = later_high - later_low;
    if later > 0.0 && later < 0.2 * (highest - lowest) {
        low = lowest.max(later_low - 0.1 * later);
        high = highest.min(later_high + 0.1 * later);
        remark = Some(format!(
            "value axis cut: within the first {start} episodes the lines reach from {} to {}",
            number(lowest),
            number(highest)
        ));
    }
    // The bands of few seeds may be far wider than the curves: they get as much room again.
    let room = if high > low { high - low } else { f64::MAX };
    let (floor, ceiling) = (low - 0.5 * room, high + 0.5 * room);
    for Curve { band, .. } in plot.curves.iter().filter(|_| remark.is_none()) {
        for limit in band.low.iter().chain(&band.high).filter(|v| v.is_finite()) {
            low = low.min(limit.max(floor));
            high = high.max(limit.min(ceiling));
        }
    }
    // A threshold far off would do the same to the curves; the legend tells where it is.
    if let Some(threshold) = plot.threshold
        && (low - 1.5 * (high - low)..=high + 1.5 * (high - low)).contains(&threshold)
    {
        (low, high) = (low.min(threshold), high.max(threshold));
    }
    let margin = if high > low { 0.04 * (high - low) } else { (0.1 * high.abs()).max(1.0) };
    ((low - margin).max(f64::MIN), (high + margin).min(f64::MAX), remark)
}

/// The least and the greatest finite value of all lines after an episode; (∞, −∞) if there is
/// none.
fn lines_range(plot: &CurvesPlot, after: usize) -> (f64, f64) {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for Curve { band, .. } in &plot.curves {
        let from = band.episode.partition_point(|&episode| episode <= after);
        for &v in band.iqm[from..].iter().chain(&band.mean[from..]).filter(|v| v.is_finite()) {
            (low, high) = (low.min(v), high.max(v));
        }
    }
    (low, high)
}

/// Grid lines, ticks and axis titles.
fn axes(svg: &mut String, quantity: &str, x: Scale, y: Scale) {
    let (left, right, bottom, top) = (x.from, x.to, y.from, y.to);
    let mut grid = String::new();
    for (value, label) in y.ticks(7, 0.0) {
        let at = y.at(value);
        let _ = write!(grid, "M{left},{}H{right}", coordinate(at));
        text(svg, left - 8.0, at + 4.0, "text-anchor=\"end\"", &label);
    }
    for (value, label) in x.ticks(8, 1.0) {
        let at = x.at(value);
        let _ = write!(grid, "M{},{bottom}V{top}", coordinate(at));
        text(svg, at, bottom + 18.0, "text-anchor=\"middle\"", &label);
    }
    let _ = writeln!(
        svg,
        "<path d=\"{grid}\" stroke=\"#e4e4e4\" fill=\"none\"/>\n\
         <path d=\"M{left},{top}V{bottom}H{right}\" stroke=\"#222\" fill=\"none\"/>"
    );
    let middle = f64::midpoint(left, right);
    let style = "font-size=\"13\" text-anchor=\"middle\"";
    text(svg, middle, bottom + 42.0, style, "episode");
    let at = format!("{style} transform=\"rotate(-90 16 {})\"", f64::midpoint(top, bottom));
    text(svg, 16.0, f64::midpoint(top, bottom), &at, quantity);
}

/// What lies inside the axes: bands under thin lines under thick ones, the threshold on top.
fn panel(svg: &mut String, plot: &CurvesPlot, x: Scale, y: Scale) {
    let n = plot.curves.len();
    let opacity = [0.22, 0.16, 0.1][usize::from(n > 3) + usize::from(n > 6)];
    let points = |band: &CurveBand| -> Vec<usize> {
        spread(band.episode.len(), (ALL_POINTS / n).max(2)).iter().map(|i| i - 1).collect()
    };
    let path = |svg: &mut String, d: &str, style: &str| {
        if !d.is_empty() {
            let _ = writeln!(svg, "<path d=\"{d}\" {style}/>");
        }
    };
    for Curve { look, band, .. } in &plot.curves {
        if band.method.is_some() {
            let style = format!("fill=\"{}\" fill-opacity=\"{opacity}\"", colour(*look));
            path(svg, &area(band, &points(band), x, y), &style);
        }
    }
    for Curve { look, band, .. } in &plot.curves {
        if band.mean != band.iqm {
            let style =
                format!("stroke=\"{}\" stroke-width=\"1\" stroke-dasharray=\"4 3\"", colour(*look));
            path(svg, &line(band, &band.mean, &points(band), x, y), &style);
        }
    }
    for (i, curve) in plot.curves.iter().enumerate() {
        let (style, band) = (curve.stroke(), &curve.band);
        path(svg, &line(band, &band.iqm, &points(band), x, y), &style);
        if n > 1 || band.episode.len() == 1 {
            // Staggered, so that the markers of coinciding curves stand side by side.
            let places = spread(band.episode.len(), 6 * n);
            let first = i % places.len().max(1);
            for &place in places.iter().skip(first).step_by(n) {
                marker(
                    svg,
                    curve.look,
                    x.at(band.episode[place - 1] as f64),
                    y.at(band.iqm[place - 1]),
                );
            }
        }
    }
    if let Some(threshold) = plot.threshold.filter(|&t| y.holds(t)) {
        let at = y.at(threshold);
        let _ = writeln!(
            svg,
            "<path d=\"M0,{}H{PANEL_WIDTH}\" stroke=\"#444\" stroke-width=\"1.2\" \
             stroke-dasharray=\"8 4\"/>",
            coordinate(at)
        );
        let (left, baseline, anchor) = label_place(plot, at, x, y);
        // A white edge keeps it readable on top of curves: a text of its own, because some
        // renderers ignore `paint-order`.
        let label = format!("solved at {}", number(threshold));
        let edge = "fill=\"#fff\" stroke=\"#fff\" stroke-width=\"3\" aria-hidden=\"true\"";
        for style in [edge, "fill=\"#222\""] {
            text(svg, left, baseline, &format!("text-anchor=\"{anchor}\" {style}"), &label);
        }
    }
}

/// Where the threshold's label hides the least of the curves: x, baseline and anchor. At either
/// end of the line, above or below it.
fn label_place(plot: &CurvesPlot, at: f64, x: Scale, y: Scale) -> (f64, f64, &'static str) {
    let clutter = |right: bool, baseline: f64| {
        if !(14.0..=PANEL_HEIGHT - 4.0).contains(&baseline) {
            return usize::MAX; // Outside the panel.
        }
        let bands = plot.curves.iter().map(|c| &c.band);
        let points = bands.flat_map(|band| band.episode.iter().zip(&band.iqm));
        points
            .filter(|&(&episode, &value)| {
                let from_end = x.at(episode as f64);
                let from_end = if right { PANEL_WIDTH - from_end } else { from_end };
                from_end < 130.0 && (baseline - 16.0..baseline + 8.0).contains(&y.at(value))
            })
            .count()
    };
    let places = [(false, at - 6.0), (false, at + 16.0), (true, at - 6.0), (true, at + 16.0)];
    let best = places.into_iter().min_by_key(|&(right, baseline)| clutter(right, baseline));
    let (right, baseline) = best.unwrap_or(places[0]);
    if right { (PANEL_WIDTH - 8.0, baseline, "end") } else { (8.0, baseline, "start") }
}

/// A line through the finite ones of `values`, broken where one is not.
fn line(band: &CurveBand, values: &[f64], points: &[usize], x: Scale, y: Scale) -> String {
    let mut d = String::new();
    for run in points.chunk_by(|&i, &j| values[i].is_finite() == values[j].is_finite()) {
        if values[run[0]].is_finite() {
            trace(&mut d, 'M', run.iter().copied(), band, values, x, y);
        }
    }
    d
}

/// The area between the limits, in pieces where one is not finite.
fn area(band: &CurveBand, points: &[usize], x: Scale, y: Scale) -> String {
    let finite = |i: usize| band.low[i].is_finite() && band.high[i].is_finite();
    let mut d = String::new();
    for run in points.chunk_by(|&i, &j| finite(i) == finite(j)) {
        if finite(run[0]) {
            trace(&mut d, 'M', run.iter().copied(), band, &band.high, x, y);
            trace(&mut d, 'L', run.iter().rev().copied(), band, &band.low, x, y);
            d.push('Z');
        }
    }
    d
}

/// Appends a command and the coordinates of the points.
fn trace(
    d: &mut String,
    command: char,
    points: impl Iterator<Item = usize>,
    band: &CurveBand,
    values: &[f64],
    x: Scale,
    y: Scale,
) {
    let mut separator = command;
    for i in points {
        // Far outside the panel renderers lose precision; the frame clips anyway.
        let at = y.at(values[i]).clamp(-1e4, 1e4);
        let _ =
            write!(d, "{separator}{},{}", coordinate(x.at(band.episode[i] as f64)), coordinate(at));
        separator = ' ';
    }
}

/// The colour of the `i`-th variant.
pub(super) fn colour(i: usize) -> &'static str {
    COLOURS[i % COLOURS.len()]
}

/// The `i`-th variant's marker at a pixel.
pub(super) fn marker(svg: &mut String, i: usize, x: f64, y: f64) {
    // Not where there is no value, nor far outside the panel.
    if y.abs() < 1e4 {
        let _ = writeln!(
            svg,
            "<path d=\"{}\" transform=\"translate({} {}) scale(4)\" fill=\"{}\" stroke=\"#fff\" \
             stroke-width=\"0.25\"/>",
            MARKERS[i % MARKERS.len()],
            coordinate(x),
            coordinate(y),
            colour(i)
        );
    }
}

#[cfg(test)]
#[path = "curves_tests.rs"]
mod tests;
