//! Lines of a report.

use std::fmt::Write;

const MEMORY: &str = "writing to a string does not fail";
/// States, steps and runs of actions that are listed one by one.
pub(super) const LISTED: usize = 12;
/// Characters of a line, without what it is about.
const WIDTH: usize = 84;

/// Lines of a report, indented.
#[derive(Default)]
pub(super) struct Lines(pub(super) String);

impl Lines {
    /// A line that begins with what it is about.
    pub(super) fn item(&mut self, what: &str, text: &str) {
        let mut label = what;
        for line in wrapped(text) {
            writeln!(self.0, "  {label:<12} {line}").expect(MEMORY);
            label = "";
        }
    }

    /// A line that belongs to the item before.
    pub(super) fn more(&mut self, text: &str) {
        for (i, line) in wrapped(text).iter().enumerate() {
            let indent = if i == 0 { "" } else { "    " };
            writeln!(self.0, "  {:<12} {indent}{line}", "").expect(MEMORY);
        }
    }

    /// A line that must not be broken, of a drawing.
    pub(super) fn drawn(&mut self, text: &str) {
        writeln!(self.0, "  {:<12} {text}", "").expect(MEMORY);
    }
}

/// `text` in lines of [`WIDTH`] characters, broken at blanks.
fn wrapped(text: &str) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        let line = lines.last_mut().expect("there is one at least");
        if !line.is_empty() && line.chars().count() + 1 + word.chars().count() > WIDTH {
            lines.push(word.to_string());
        } else {
            if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(word);
        }
    }
    lines
}

/// A number with four significant digits at most, without the noise of rounding errors.
pub(in crate::report) fn short(x: f64) -> String {
    if x == 0.0 || x.abs() < 1e-12 {
        return "0".into();
    }
    let magnitude = crate::mdp::math::log10(x.abs()).floor();
    if !(-4.0..6.0).contains(&magnitude) {
        return format!("{x:.3e}");
    }
    let decimals = (3.0 - magnitude).clamp(0.0, 8.0) as usize;
    let text = format!("{x:.decimals$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_string()
    } else {
        text
    }
}
