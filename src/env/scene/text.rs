//! Pictures made of characters.

use std::fmt::Write as _;

use super::palette::Colour;

/// Characters of one look.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Span {
    /// The characters, each one column wide.
    pub text: String,
    /// Their colour; the terminal's own if there is none.
    pub fore: Option<Colour>,
    /// The colour behind them; the terminal's own if there is none.
    pub back: Option<Colour>,
    /// Whether they are printed bold.
    pub bold: bool,
}

/// Lines of characters. It must be readable without its colours.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct TextPicture {
    /// From the top down.
    pub lines: Vec<Vec<Span>>,
}

impl Span {
    /// Characters in the terminal's own colours.
    pub fn plain(text: impl Into<String>) -> Self {
        Self { text: text.into(), fore: None, back: None, bold: false }
    }

    /// Characters in a colour.
    pub fn of(text: impl Into<String>, fore: Colour) -> Self {
        Self { fore: Some(fore), ..Self::plain(text) }
    }

    /// The same, on a colour.
    #[must_use]
    pub fn on(self, back: Colour) -> Self {
        Self { back: Some(back), ..self }
    }

    /// The same, bold.
    #[must_use]
    pub fn bold(self) -> Self {
        Self { bold: true, ..self }
    }
}

impl TextPicture {
    /// `rows` of equal width in a frame.
    pub fn framed(rows: Vec<Vec<Span>>, frame: Colour) -> Self {
        let width = rows.first().map_or(0, |row| columns(row));
        let edge = |left: char, right: char| {
            vec![Span::of(format!("{left}{}{right}", "─".repeat(width)), frame)]
        };
        let mut lines = vec![edge('┌', '┐')];
        lines.extend(rows.into_iter().map(|mut row| {
            row.insert(0, Span::of("│", frame));
            row.push(Span::of("│", frame));
            row
        }));
        lines.push(edge('└', '┘'));
        Self { lines }
    }

    /// The characters without their colours, a line break after every line.
    pub fn characters(&self) -> String {
        self.lines.iter().fold(String::new(), |mut out, line| {
            for span in line {
                out.push_str(&span.text);
            }
            let _ = writeln!(out);
            out
        })
    }
}

fn columns(line: &[Span]) -> usize {
    line.iter().map(|span| span.text.chars().count()).sum()
}
