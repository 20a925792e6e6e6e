//! Writing to the terminal: results to stdout, words to stderr, colours only where they are wanted.

use std::io::{self, Write};

use super::Failure;
use crate::report::heat_map::Ink;
use crate::script::Diagnostic;

/// Writes to stdout.
pub(super) fn out(text: &str) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    stdout.write_all(text.as_bytes())?;
    stdout.flush()
}

/// What stdout can show: colours if it is a terminal that has them and `NO_COLOR` is not set.
pub(super) fn ink() -> Ink {
    if anstream::AutoStream::choice(&io::stdout()) == anstream::ColorChoice::Never {
        return Ink::Plain;
    }
    let depth = std::env::var("COLORTERM").unwrap_or_default();
    if matches!(depth.as_str(), "truecolor" | "24bit") { Ink::True } else { Ink::Indexed }
}

/// Writes a line for humans to stderr. If even that is impossible there is nobody to tell.
pub(super) fn note(text: &str) {
    let _ = writeln!(anstream::stderr().lock(), "{text}");
}

/// Shows a diagnostic.
pub(super) fn diagnostic(d: &Diagnostic) {
    // anstream drops the colours where stderr is no terminal or NO_COLOR is set.
    note(&d.render(true));
}

/// Shows why a command failed.
pub(super) fn failure(failure: &Failure) {
    match failure {
        Failure::Script(d) => diagnostic(d),
        Failure::Message(message, hint) => {
            let d = Diagnostic::error(message.clone());
            diagnostic(&match hint {
                Some(hint) => d.hint(hint.clone()),
                None => d,
            });
        }
        Failure::BrokenPipe => {}
    }
}
