//! Writing to the terminal: results to stdout, words to stderr, colours only where they are wanted.

use std::io::{self, Write};

use super::Failure;
use crate::render::Palette;
use crate::script::Diagnostic;

/// Writes to stdout.
pub(super) fn out(text: &str) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    stdout.write_all(text.as_bytes())?;
    stdout.flush()
}

/// The colours that stdout shows: none if it is no terminal or `NO_COLOR` is set.
pub(super) fn palette() -> Palette {
    match anstream::AutoStream::choice(&io::stdout()) {
        anstream::ColorChoice::Never => Palette::Plain,
        _ if anstyle_query::truecolor() => Palette::Full,
        _ => Palette::Indexed,
    }
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
