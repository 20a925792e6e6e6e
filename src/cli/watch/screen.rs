//! What the watcher shows: on a terminal one screen that is drawn anew, elsewhere one block after
//! another.

use std::fmt::Write as _;
use std::io::{self, IsTerminal};
use std::path::Path;
use std::time::Duration;

use crate::cli::output::{out, palette};
use crate::render::Palette;
use crate::script::Snapshot;

/// What a pass said.
#[derive(Debug)]
pub(super) struct Report {
    /// Whether it came to a result.
    pub(super) good: bool,
    /// Its result, as `exec` prints it.
    pub(super) result: String,
    /// Warnings and remarks, or the mistake that was made.
    pub(super) remarks: String,
    /// How long it took.
    pub(super) seconds: f64,
}

/// Where reports are shown.
pub(super) struct Screen {
    script: String,
    is_terminal: bool,
    /// Passes shown.
    passes: usize,
    /// The last result, and of which pass it is.
    good: Option<(usize, String)>,
    /// Whole seconds that the pass under way is shown to have taken.
    running: Option<u64>,
}

/// How long a pass may take without a word.
const SOON: Duration = Duration::from_millis(500);

impl Screen {
    pub(super) fn open(script: &Path) -> Self {
        let escapes = anstyle_query::windows::enable_ansi_colors() != Some(false)
            && anstyle_query::term_supports_ansi_color();
        Self {
            script: script.display().to_string(),
            is_terminal: io::stdout().is_terminal() && escapes,
            passes: 0,
            good: None,
            running: None,
        }
    }

    /// Whether stdout shows colours.
    pub(super) fn has_colours(&self) -> bool {
        self.is_terminal && palette() != Palette::Plain
    }

    /// Says that a pass is under way, if it takes its time.
    pub(super) fn running(&mut self, since: Duration) -> io::Result<()> {
        let seconds = since.as_secs();
        if !self.is_terminal || since < SOON || self.running == Some(seconds) {
            return Ok(());
        }
        self.running = Some(seconds);
        out(&format!("\r\x1b[K{}: running, {seconds} s (Ctrl-C ends)", self.script))
    }

    /// Shows what a pass came to; below a mistake, the last result that there was.
    pub(super) fn show(&mut self, report: Report, files: &Snapshot) -> io::Result<()> {
        self.passes += 1;
        self.running = None;
        let Report { good, result, remarks, seconds } = report;
        let mut text = String::new();
        let _ = writeln!(text, "pass {}, {seconds:.2} s", self.passes);
        text.push_str(&remarks);
        if good {
            text.push_str(&result);
            self.good = Some((self.passes, result));
        } else if let Some((pass, last)) = &self.good {
            let _ = writeln!(text, "\nthe last result, of pass {pass}:");
            text.push_str(&self.fitting(last, text.lines().count()));
        }
        let imports = match files.len() {
            0 | 1 => String::new(),
            2 => " and a file that it imports".into(),
            n => format!(" and {} files that it imports", n - 1),
        };
        let _ = write!(text, "watching {}{imports}; Ctrl-C ends", self.script);
        if self.is_terminal {
            // The screen and what has scrolled off it; the cursor goes to the top.
            return out(&format!("\x1b[H\x1b[2J\x1b[3J{text}"));
        }
        let rule = if self.passes > 1 { format!("{}\n", "─".repeat(80)) } else { String::new() };
        out(&format!("{rule}{text}\n"))
    }

    /// As much of `text` as fits below `above` lines, so that a mistake does not scroll off.
    fn fitting(&self, text: &str, above: usize) -> String {
        let height = terminal_size::terminal_size().map(|(_, height)| usize::from(height.0));
        let Some(height) = height.filter(|_| self.is_terminal) else { return text.into() };
        // A line each for what follows, and for the cut.
        let room = height.saturating_sub(above + 2);
        if text.lines().count() <= room {
            return text.into();
        }
        // The table comes last, behind a blank line, and says most.
        let text = text.rsplit_once("\n\n").map_or(text, |(_, table)| table);
        if text.lines().count() <= room {
            return text.into();
        }
        let lines: Vec<&str> = text.lines().take(room).chain(["…", ""]).collect();
        lines.join("\n")
    }
}
