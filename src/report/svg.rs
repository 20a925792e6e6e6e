//! The small parts of hand-written SVG: numbers, escaping, scales and ticks.

use std::fmt::Write as _;

use crate::mdp::math::{log10, pow};

/// A coordinate: two decimals, without trailing zeros. Short and the same everywhere.
pub(super) fn coordinate(v: f64) -> String {
    let text = format!("{v:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

/// Text for element content and attributes. Characters that XML forbids become U+FFFD.
pub(super) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\u{0}'..='\u{8}'
            | '\u{b}'
            | '\u{c}'
            | '\u{e}'..='\u{1f}'
            | '\u{fffe}'..='\u{ffff}' => {
                out.push('\u{fffd}');
            }
            _ => out.push(c),
        }
    }
    out
}

/// About how wide a sans-serif text of a given font size is, in pixels.
pub(super) fn text_width(text: &str, size: f64) -> f64 {
    super::table::width(text) as f64 * 0.56 * size
}

/// Appends a text element at a pixel, with further attributes. The content is escaped here.
pub(super) fn text(svg: &mut String, x: f64, y: f64, attributes: &str, content: &str) {
    let space = if attributes.is_empty() { "" } else { " " };
    let (x, y, content) = (coordinate(x), coordinate(y), escape(content));
    let _ = writeln!(svg, "<text x=\"{x}\" y=\"{y}\"{space}{attributes}>{content}</text>");
}

/// A linear map from data to pixels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scale {
    /// The data range, `low < high`.
    pub(super) low: f64,
    pub(super) high: f64,
    /// The pixels of `low` and of `high`.
    pub(super) from: f64,
    pub(super) to: f64,
}

impl Scale {
    /// The pixel of a value.
    pub(super) fn at(&self, value: f64) -> f64 {
        // Shares first: high − low may overflow where each is near the largest double.
        let share = (value / 2.0 - self.low / 2.0) / (self.high / 2.0 - self.low / 2.0);
        self.from + share * (self.to - self.from)
    }

    /// Whether a value lies in the data range.
    pub(super) fn holds(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }

    /// Round values in the range, about `most` of them, with their labels; at least `finest` apart
    /// (1 for whole numbers).
    pub(super) fn ticks(&self, most: usize, finest: f64) -> Vec<(f64, String)> {
        let step = round_step((self.high / 2.0 - self.low / 2.0) / most as f64 * 2.0).max(finest);
        let first = (self.low / step).ceil();
        let last = (self.high / step).floor();
        if !(step.is_normal() && first.is_finite() && last.is_finite()) {
            return Vec::new();
        }
        let values = (0..=(last - first) as usize).map(|i| (first + i as f64) * step + 0.0);
        let largest = self.low.abs().max(self.high.abs());
        values.map(|v| (v, label(v, step, largest))).collect()
    }
}

/// The smallest of 1, 2, 2.5 and 5 times a power of ten that is at least `rough`.
fn round_step(rough: f64) -> f64 {
    let power = pow(10.0, log10(rough).floor());
    let mantissa = rough / power;
    // A hair of slack: 0.2 / 0.1 must not count as more than 2.
    let factor = [1.0, 2.0, 2.5, 5.0].into_iter().find(|f| mantissa <= f * (1.0 + 1e-9));
    factor.unwrap_or(10.0) * power
}

/// A tick's label, in the format that suits all ticks of its axis.
fn label(value: f64, step: f64, largest: f64) -> String {
    let (unit, suffix) = match largest {
        l if l < 1e5 => (1.0, ""),
        l if l < 1e6 => (1e3, "k"),
        l if l < 1e9 => (1e6, "M"),
        _ => (0.0, ""),
    };
    let step = step / unit;
    if value == 0.0 && (unit != 1.0 || step < 1e-6) {
        return "0".into();
    }
    if unit == 0.0 || step < 1e-6 {
        let text = format!("{value:.2e}");
        let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        let mantissa = mantissa.trim_end_matches('0').trim_end_matches('.');
        return minus(&format!("{mantissa}e{exponent}"));
    }
    let decimals = (0..7).find(|&d| {
        let scaled = step * pow(10.0, f64::from(d));
        (scaled - scaled.round()).abs() < 1e-6 * scaled
    });
    let text = format!("{:.*}", decimals.unwrap_or(6) as usize, value / unit);
    minus(&text) + suffix
}

/// A number with a typographic minus sign.
pub(super) fn minus(number: &str) -> String {
    number.replace('-', "\u{2212}")
}

/// A data value in running text: at most two decimals, none from 1000 on.
pub(super) fn number(value: f64) -> String {
    minus(&match value.abs() {
        v if v >= 1e9 => format!("{value:.2e}"),
        v if v >= 1e3 => format!("{value:.0}"),
        _ => coordinate(value),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(low: f64, high: f64, most: usize) -> Vec<String> {
        let scale = Scale { low, high, from: 0.0, to: 1.0 };
        scale.ticks(most, 0.0).into_iter().map(|(_, label)| label).collect()
    }

    #[test]
    fn ticks_are_round_and_few() {
        assert_eq!(labels(0.0, 500.0, 6), ["0", "100", "200", "300", "400", "500"]);
        assert_eq!(labels(-203.0, -106.0, 6), ["−200", "−180", "−160", "−140", "−120"]);
        assert_eq!(labels(-0.1, 0.4, 6), ["−0.1", "0.0", "0.1", "0.2", "0.3", "0.4"]);
        assert_eq!(labels(0.0, 1e6, 4), ["0", "0.25M", "0.50M", "0.75M", "1.00M"]);
        assert_eq!(labels(-4e5, 0.0, 4), ["−400k", "−300k", "−200k", "−100k", "0"]);
        assert_eq!(labels(0.0, 3e12, 3), ["0", "1e12", "2e12", "3e12"]);
        assert!(labels(f64::MIN, f64::MAX, 6).len() < 10);
    }

    #[test]
    fn coordinates_are_short() {
        assert_eq!(coordinate(1.0), "1");
        assert_eq!(coordinate(-0.001), "0");
        assert_eq!(coordinate(12.345), "12.35");
        assert_eq!(coordinate(100.5), "100.5");
    }

    #[test]
    fn xml_is_escaped() {
        assert_eq!(escape("a<b & \"c\"\u{1}"), "a&lt;b &amp; &quot;c&quot;\u{fffd}");
    }

    #[test]
    fn scales_map_their_ends() {
        let scale = Scale { low: -200.0, high: -100.0, from: 400.0, to: 40.0 };
        assert_eq!((scale.at(-200.0), scale.at(-150.0), scale.at(-100.0)), (400.0, 220.0, 40.0));
        assert!(scale.holds(-100.0) && !scale.holds(0.0));
    }
}
