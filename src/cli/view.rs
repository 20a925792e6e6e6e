//! Showing an environment at play: as lines of JSON, in the terminal, as a GIF. Shared by the
//! commands that play.

use std::io::{self, BufWriter, IsTerminal, Write};
use std::path::{Path, PathBuf};

use clap::{Args as ClapArgs, ValueEnum};

use super::Failure;
use super::output::note;
use super::screen::Screen;
use crate::env::rollout::{Event, RolloutError};
use crate::env::{PlayedAction, Session, SessionStep};
use crate::experiment::write_atomically;
use crate::mdp::Ending;
use crate::render::recorder::{Recorder, describe, number};

#[derive(Debug, ClapArgs)]
pub(super) struct ViewArgs {
    /// How it is printed [default: jsonl; nothing if --gif is given]
    #[arg(long, value_enum)]
    format: Option<Format>,
    /// Record it as an animated GIF
    #[arg(long, value_name = "FILE")]
    gif: Option<PathBuf>,
    /// Steps per second of --gif and of the terminal [default: the environment's own]
    #[arg(long, value_name = "N", value_parser = parse_fps)]
    fps: Option<f64>,
    /// Width of the GIF, in pixels [default: what fits on a slide]
    #[arg(long, value_name = "PIXELS", requires = "gif",
          value_parser = clap::value_parser!(u32).range(200..=2000))]
    width: Option<u32>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Format {
    /// One JSON object a line
    Jsonl,
    /// Pictures of characters, moving if stdout is a terminal
    Ansi,
}

/// A GIF has at most 50 images a second.
fn parse_fps(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(fps) if (0.1..=50.0).contains(&fps) => Ok(fps),
        _ => Err("it is a number between 0.1 and 50".into()),
    }
}

/// Where the events of a rollout go.
pub(super) struct View {
    jsonl: Option<BufWriter<io::StdoutLock<'static>>>,
    screen: Option<Screen>,
    gif: Option<(PathBuf, Recorder)>,
    names: Vec<String>,
    /// Of the episode that is on.
    steps: u64,
    total: f64,
}

impl View {
    /// Opens everything that `args` ask for, so that what cannot be written is known before any
    /// work is done.
    pub(super) fn open(args: &ViewArgs, session: &Session) -> Result<Self, Failure> {
        let spec = session.spec();
        let fps = args.fps.unwrap_or_else(|| spec.fps.into());
        let gif = match &args.gif {
            Some(path) => {
                writable(path)?;
                Some((path.clone(), Recorder::new(spec.id, args.width, fps)))
            }
            None => None,
        };
        let format = match (args.format, &gif) {
            (None, Some(_)) => None,
            (format, _) => Some(format.unwrap_or(Format::Jsonl)),
        };
        let (mut jsonl, mut screen) = (None, None);
        match format {
            Some(Format::Jsonl) => jsonl = Some(BufWriter::new(io::stdout().lock())),
            Some(Format::Ansi) => screen = Some(Screen::open(io::stdout().is_terminal(), fps)),
            None => {}
        }
        let names = session.schema().actions.clone();
        Ok(Self { jsonl, screen, gif, names, steps: 0, total: 0.0 })
    }

    /// Shows what happened. An error of the kind `Interrupted` says that the user has seen enough.
    pub(super) fn event(
        &mut self,
        session: &Session,
        event: Event<'_>,
    ) -> Result<(), RolloutError> {
        if let Some(out) = &mut self.jsonl {
            event.write(out)?;
        }
        match event {
            Event::Reset { .. } => self.reset(session)?,
            Event::Step { action, step } => self.step(session, action, step)?,
        }
        Ok(())
    }

    fn reset(&mut self, session: &Session) -> io::Result<()> {
        (self.steps, self.total) = (0, 0.0);
        if let Some((_, recorder)) = &mut self.gif {
            recorder.reset(session.scene(None));
        }
        if let Some(screen) = &mut self.screen {
            screen.show(&session.scene(None), session.text(None).as_ref(), "reset", false)?;
        }
        Ok(())
    }

    fn step(
        &mut self,
        session: &Session,
        action: &PlayedAction,
        step: &SessionStep,
    ) -> io::Result<()> {
        self.steps += 1;
        self.total += step.reward;
        let ending = match (step.terminated, step.truncated) {
            (true, _) => Some(Ending::Terminated),
            (false, true) => Some(Ending::Truncated),
            (false, false) => None,
        };
        let played = describe(action, &self.names);
        if let Some((_, recorder)) = &mut self.gif {
            recorder.step(session.scene(Some(action)), &played, step.reward, ending);
        }
        if let Some(screen) = &mut self.screen {
            let (reward, total) = (number(step.reward), number(self.total));
            let ended = ending.map_or(String::new(), |e| format!("  {}", e.as_str()));
            let caption =
                format!("step {}  {played}  reward {reward}  return {total}{ended}", self.steps);
            let text = session.text(Some(action));
            screen.show(&session.scene(Some(action)), text.as_ref(), &caption, ending.is_some())?;
        }
        Ok(())
    }

    /// After the last event: `played` is what came of the rollout. Writes the GIF; if the user has
    /// seen enough, that is no error.
    pub(super) fn finish<T>(
        mut self,
        played: Result<T, RolloutError>,
    ) -> Result<Option<T>, Failure> {
        // The cursor comes back before anything else is printed.
        drop(self.screen.take());
        let flushed = self.jsonl.take().map_or(Ok(()), |mut out| out.flush());
        let value = match played {
            Ok(value) => Some(value),
            Err(RolloutError::Io(e)) if e.kind() == io::ErrorKind::Interrupted => None,
            Err(error) => return Err(error.into()),
        };
        flushed?;
        if let Some((path, recorder)) = self.gif {
            let bytes = recorder.finish();
            write_atomically(&path, &bytes)?;
            note(&format!("{} ({} kB)", path.display(), bytes.len().div_ceil(1000)));
        }
        Ok(value)
    }
}

/// Whether a file can be written, found out by writing another one beside it.
fn writable(path: &Path) -> Result<(), Failure> {
    let fail = |why: &str| {
        let message = format!("--gif: `{}` cannot be written: {why}", path.display());
        Err(Failure::Message(message, None))
    };
    if path.is_dir() {
        return fail("it is a folder");
    }
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        return fail(&format!("there is no folder `{}`", folder.display()));
    }
    match tempfile::tempfile_in(folder) {
        Ok(_) => Ok(()),
        Err(e) => fail(&e.to_string()),
    }
}
