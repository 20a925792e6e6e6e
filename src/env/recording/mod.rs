//! Recorded Gymnasium trajectories, replayed: is this environment the same, bit for bit?
//!
//! - [`replay`], [`replay_file`]: play a recording's actions and compare everything
//! - [`ParityReport`], [`Mismatch`]: what came of it
//! - [`Tolerance`], [`tolerance`]: how exact each environment has to be
//! - [`RecordingError`]: why a file is no recording
//!
//! A recording is JSON lines, gzipped or not: a header, then one line per episode. The episodes of
//! one seed run in order in one instance: a `reset_seed` seeds it, null continues its stream.
//! Box observations are float32 in the shortest decimal; rewards are exact float64.

mod format;
mod parity;

use std::fmt;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use flate2::bufread::MultiGzDecoder;

pub use parity::{Mismatch, ParityReport, Tolerance, replay, tolerance};

/// Why a recording cannot be replayed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordingError {
    /// The line of the (decompressed) file, from 1; 0 if the file could not be opened.
    pub line: usize,
    /// What is wrong there.
    pub message: String,
}

impl RecordingError {
    fn new(line: usize, message: impl fmt::Display) -> Self {
        Self { line, message: message.to_string() }
    }
}

impl fmt::Display for RecordingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            0 => f.write_str(&self.message),
            line => write!(f, "line {line}: {}", self.message),
        }
    }
}

impl std::error::Error for RecordingError {}

/// Replays the recording at `path`, which is decompressed if it is gzipped (whatever its name).
///
/// # Errors
/// If the file cannot be read, or as [`replay`].
pub fn replay_file(path: &Path) -> Result<ParityReport, RecordingError> {
    let unreadable =
        |error| RecordingError::new(0, format!("cannot read {}: {error}", path.display()));
    let mut reader = BufReader::new(File::open(path).map_err(unreadable)?);
    let magic = reader.fill_buf().map_err(unreadable)?;
    if magic.starts_with(&[0x1f, 0x8b]) {
        replay(BufReader::new(MultiGzDecoder::new(reader)))
    } else {
        replay(reader)
    }
}
