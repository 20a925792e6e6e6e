//! Moving pictures in the terminal; one after another where stdout is none.

use std::fmt::Write as _;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::env::scene::{Scene, TextPicture};
use crate::render::{Palette, lines};

/// What fits into a terminal of 80 × 24 with a caption and a line for the cursor.
const SIZE: [u32; 2] = [79, 22];
/// How long the end of an episode stands.
const LAST: Duration = Duration::from_secs(1);

/// Whether the user has pressed Ctrl-C.
static STOP: AtomicBool = AtomicBool::new(false);

/// Where pictures are shown. Dropping it brings the cursor back.
pub(super) struct Screen {
    palette: Palette,
    /// Whether pictures replace each other, and for how long each one stands.
    moving: Option<Duration>,
    /// When the next picture is due.
    due: Option<Instant>,
    /// Lines of the picture that is on the screen.
    height: usize,
    /// Whether something has been shown.
    begun: bool,
}

impl Screen {
    /// A screen on stdout that shows `fps` pictures a second if it is a terminal.
    pub(super) fn open(is_terminal: bool, fps: f64) -> Self {
        let escapes = anstyle_query::windows::enable_ansi_colors() != Some(false)
            && anstyle_query::term_supports_ansi_color();
        let palette = super::output::palette();
        let moving = (is_terminal && escapes).then(|| Duration::from_secs_f64(1.0 / fps));
        if moving.is_some() {
            // Without a handler Ctrl-C still ends it, only the cursor stays away.
            let _ = ctrlc::set_handler(|| STOP.store(true, Ordering::Relaxed));
        }
        Self { palette, moving, due: None, height: 0, begun: false }
    }

    /// Shows a picture with a caption above it; `last` says that an episode ends here. An error of
    /// the kind `Interrupted` says that the user has pressed Ctrl-C.
    pub(super) fn show(
        &mut self,
        scene: &Scene,
        text: Option<&TextPicture>,
        caption: &str,
        last: bool,
    ) -> io::Result<()> {
        let picture = lines(scene, text, self.palette, SIZE);
        let mut out = String::new();
        let Some(frame) = self.moving else {
            // A blank line between the pictures.
            let _ = writeln!(out, "{}{caption}", if self.begun { "\n" } else { "" });
            for line in &picture {
                let _ = writeln!(out, "{line}");
            }
            self.begun = true;
            return print(&out);
        };
        out.push_str(if self.begun { "\r" } else { "\x1b[?25l" });
        if self.height > 0 {
            let _ = write!(out, "\x1b[{}A", self.height);
        }
        let shown: String = caption.chars().take(SIZE[0] as usize).collect();
        for line in std::iter::once(&shown).chain(&picture) {
            let _ = writeln!(out, "{line}\x1b[K");
        }
        // The rest of a higher picture.
        out.push_str("\x1b[J");
        self.begun = true;
        self.height = picture.len() + 1;
        print(&out)?;
        self.wait(if last { frame.max(LAST) } else { frame })
    }

    /// Waits until `time` after the end of the last wait, or from now on if that is long past: late
    /// pictures do not make the next ones hurry.
    fn wait(&mut self, time: Duration) -> io::Result<()> {
        let now = Instant::now();
        let due = self.due.unwrap_or(now) + time;
        let due = due.max(now);
        self.due = Some(due);
        loop {
            if STOP.load(Ordering::Relaxed) {
                return Err(io::ErrorKind::Interrupted.into());
            }
            let left = due.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(());
            }
            std::thread::sleep(left.min(Duration::from_millis(50)));
        }
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        if self.moving.is_some() && self.begun {
            // If that is impossible there is no terminal any more.
            let _ = print("\x1b[?25h");
        }
    }
}

fn print(text: &str) -> io::Result<()> {
    super::output::out(text)
}
