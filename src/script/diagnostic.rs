//! A mistake and how it is shown: file, line, column, the source line with a caret, a suggestion.

use std::sync::Arc;

use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};

/// Characters of a message that are shown: a script may have long names.
const MAX_MESSAGE: usize = 2_000;
/// Characters of a source line that are shown behind the place.
const MAX_BEHIND: usize = 200;

/// A place in a script; line and column count from 1, columns in characters.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Place {
    /// The file, as it is shown.
    pub file: Arc<str>,
    /// Line.
    pub line: usize,
    /// Column.
    pub column: usize,
}

/// How bad it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Severity {
    /// Nothing can be run.
    Error,
    /// It runs, but the user should know.
    Warning,
}

/// A message to the script's author.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnostic {
    /// Error or warning.
    pub severity: Severity,
    /// What is wrong, in one line, without the place.
    pub message: String,
    /// Where, if it has a place.
    pub place: Option<Place>,
    /// The source line at `place`.
    pub source_line: Option<Box<str>>,
    /// What to do about it.
    pub hint: Option<Box<str>>,
    /// Further facts, for example the state on which a callback failed.
    pub notes: Vec<String>,
}

impl Diagnostic {
    /// An error without a place.
    pub fn error(message: impl Into<String>) -> Self {
        Self {
            severity: Severity::Error,
            message: message.into(),
            place: None,
            source_line: None,
            hint: None,
            notes: Vec::new(),
        }
    }

    /// A warning without a place.
    pub fn warning(message: impl Into<String>) -> Self {
        Self { severity: Severity::Warning, ..Self::error(message) }
    }

    /// Sets the place, unless it is already known.
    #[must_use]
    pub fn at(mut self, place: Option<Place>) -> Self {
        if self.place.is_none() {
            self.place = place;
        }
        self
    }

    /// Adds what to do about it.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into().into());
        self
    }

    /// Adds the hint if there is one.
    #[must_use]
    pub fn maybe_hint(mut self, hint: Option<String>) -> Self {
        if hint.is_some() {
            self.hint = hint.map(Into::into);
        }
        self
    }

    /// Adds a fact.
    #[must_use]
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.notes.push(note.into());
        self
    }

    /// The diagnostic as a block of text, like the compiler's; with colours if `colour`.
    pub fn render(&self, colour: bool) -> String {
        let level = match self.severity {
            Severity::Error => Level::ERROR,
            Severity::Warning => Level::WARNING,
        };
        let end = self.message.char_indices().nth(MAX_MESSAGE).map(|(end, _)| end);
        let message = end.map_or(self.message.clone(), |end| format!("{}…", &self.message[..end]));
        let title = level.primary_title(message);
        let source = self.source_line.as_deref().unwrap_or_default();
        // What lies far behind the place is of no use.
        let end = self.place.as_ref().map_or(0, |place| place.column.saturating_add(MAX_BEHIND));
        let end = source.char_indices().nth(end).map_or(source.len(), |(end, _)| end);
        let source = &source[..end];
        let mut group = match &self.place {
            Some(place) => title.element(
                Snippet::source(source)
                    .line_start(place.line)
                    .path(&*place.file)
                    .annotation(AnnotationKind::Primary.span(caret(source, place.column))),
            ),
            None => annotate_snippets::Group::with_title(title),
        };
        for note in &self.notes {
            group = group.element(Level::NOTE.message(note.as_str()));
        }
        if let Some(hint) = &self.hint {
            group = group.element(Level::HELP.message(&**hint));
        }
        let renderer = if colour { Renderer::styled() } else { Renderer::plain() };
        renderer.render(&[group])
    }
}

impl std::fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.render(false))
    }
}

impl std::error::Error for Diagnostic {}

/// The bytes to underline: the word, number or sign that starts at `column` of `line`.
fn caret(line: &str, column: usize) -> std::ops::Range<usize> {
    let rest = |from: usize| line[from..].char_indices();
    let start = line.char_indices().nth(column.saturating_sub(1)).map_or(line.len(), |(i, _)| i);
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let mut end = rest(start).find(|&(_, c)| !is_word(c)).map_or(line.len(), |(i, _)| start + i);
    if end == start {
        end = rest(start).nth(1).map_or(line.len(), |(i, _)| start + i);
    }
    start..end
}

/// The candidate nearest to `name`, if it is near enough to be what was meant.
pub(crate) fn nearest<'a>(
    name: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Option<&'a str> {
    let lower = name.to_lowercase();
    // `column` for `col`, `eps` for `epsilon`: not near by letters, but what was meant.
    let begins =
        |c: &str| name.len().min(c.len()) >= 3 && (lower.starts_with(c) || c.starts_with(&lower));
    candidates
        .into_iter()
        .map(|c| (strsim::damerau_levenshtein(&lower, &c.to_lowercase()), c))
        .filter(|(distance, c)| *distance <= (name.len().max(c.len()) / 3).max(1) || begins(c))
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, c)| c)
}

/// ``did you mean `x`?``, or the list of all candidates when none is near.
pub(crate) fn suggest<'a>(
    name: &str,
    candidates: impl IntoIterator<Item = &'a str> + Clone,
) -> Option<String> {
    if let Some(best) = nearest(name, candidates.clone()) {
        return Some(format!("did you mean `{best}`?"));
    }
    let all: Vec<&str> = candidates.into_iter().collect();
    (!all.is_empty()).then(|| format!("one of: {}", all.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_caret_underlines_the_word_at_the_column() {
        assert_eq!(caret("    episods: 2", 5), 4..11);
        assert_eq!(caret("a + b", 3), 2..3);
        assert_eq!(caret("é = ω", 5), 5..7, "columns count characters, spans bytes");
        assert_eq!(caret("x", 9), 1..1, "past the end");
    }

    #[test]
    fn suggestions_are_near_or_complete() {
        let keys = ["episodes", "epsilon", "env"];
        assert_eq!(suggest("episods", keys).unwrap(), "did you mean `episodes`?");
        assert_eq!(suggest("eps", ["alpha", "epsilon"]).unwrap(), "did you mean `epsilon`?");
        assert_eq!(suggest("column", ["row", "col"]).unwrap(), "did you mean `col`?");
        assert_eq!(suggest("whatever", keys).unwrap(), "one of: episodes, epsilon, env");
    }
}
