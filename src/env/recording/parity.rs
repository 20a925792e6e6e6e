//! Replaying a recording's actions and comparing what they bring.

use std::io::BufRead;

use super::RecordingError;
use super::format::{Episode, Header, RecordedObs};
use crate::env::{ActionMask, Observation, Session};

/// How exact an environment has to be at some step of an episode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tolerance {
    /// Every bit.
    Exact,
    /// Numbers may differ by this much; flags may not.
    Within(f64),
    /// Anything goes: the recorded actions, played without feedback, amplify every rounding.
    Unchecked,
}

/// The tolerance of environment `id` after `step` steps of an episode (0: its reset).
///
/// Sines, cosines and squares are correctly rounded here and nearly so in the C library of the
/// recordings, and an upright pole multiplies a difference by ten every 35 steps or so. The
/// pendulum's reward shows such a difference at once, its observation hardly ever.
pub fn tolerance(id: &str, step: usize) -> Tolerance {
    match (id.split("-v").next().unwrap_or(id), step) {
        ("CartPole", 301..) => Tolerance::Unchecked,
        ("CartPole", 101..) | ("Acrobot", ..=150) | ("Pendulum", 81..) => Tolerance::Within(1e-6),
        ("Acrobot", _) => Tolerance::Within(5e-3),
        ("Pendulum", _) => Tolerance::Within(1e-9),
        _ => Tolerance::Exact,
    }
}

/// The first thing that differed.
#[derive(Debug, Clone, PartialEq)]
pub struct Mismatch {
    /// The line of the recording, from 1.
    pub line: usize,
    /// The recording's own number of the instance.
    pub seed: u64,
    /// Its number of the episode, from 0.
    pub episode: u64,
    /// How many steps into the episode, from 1; 0 is the reset.
    pub step: usize,
    /// `obs[i]` (`obs` for an index), `reward`, `terminated`, `truncated`, `prob` or `mask[i]`.
    pub field: String,
    /// The recorded value.
    pub expected: f64,
    /// The value here. Flags are 0 and 1.
    pub got: f64,
}

/// What came of a replay.
#[derive(Debug, Clone, PartialEq)]
pub struct ParityReport {
    /// The name of the recorded configuration.
    pub config: String,
    /// The environment's id.
    pub env_id: String,
    /// Episodes replayed.
    pub episodes: u64,
    /// Steps replayed.
    pub steps: u64,
    /// Numbers and flags compared.
    pub compared: u64,
    /// Those that differed in any bit.
    pub mismatches: u64,
    /// Those that differed by more than [`tolerance`] admits.
    pub violations: u64,
    /// Those in the part of long episodes that no tolerance covers (they are compared, and count
    /// as mismatches if they differ, but are never violations).
    pub unchecked: u64,
    /// The largest absolute difference of a number, flags aside.
    pub largest_difference: f64,
    /// The first mismatch.
    pub first_mismatch: Option<Mismatch>,
    /// The first violation.
    pub first_violation: Option<Mismatch>,
}

impl ParityReport {
    /// Whether everything is the same, bit for bit.
    pub fn is_exact(&self) -> bool {
        self.mismatches == 0
    }

    /// Whether everything is as close as the documented tolerance asks.
    pub fn is_within_tolerance(&self) -> bool {
        self.violations == 0
    }

    fn new(header: &Header) -> Self {
        Self {
            config: header.config.clone(),
            env_id: header.env_id.clone(),
            episodes: 0,
            steps: 0,
            compared: 0,
            mismatches: 0,
            violations: 0,
            unchecked: 0,
            largest_difference: 0.0,
            first_mismatch: None,
            first_violation: None,
        }
    }
}

/// Replays a recording.
///
/// # Errors
/// If a line is malformed, the environment is unknown, or it refuses an argument, an option or an
/// action; differences are no errors. The error carries the line's number.
pub fn replay(reader: impl BufRead) -> Result<ParityReport, RecordingError> {
    let mut lines = reader.lines().enumerate().map(|(i, line)| {
        let text = line.map_err(|e| RecordingError::new(i + 1, format!("cannot be read: {e}")))?;
        Ok((i + 1, text))
    });
    let Some(first) = lines.next() else {
        return Err(RecordingError::new(1, "the recording is empty"));
    };
    let header = Header::parse(&first?.1)?;
    let mut session = header.session()?;
    let mut report = ParityReport::new(&header);
    let mut instance = None;
    for line in lines {
        let (line, text) = line?;
        let episode = Episode::parse(line, &text)?;
        if instance != Some(episode.seed) {
            instance = Some(episode.seed);
            session = header.session()?;
        }
        Comparison { line, episode: &episode, step: 0, report: &mut report }.run(&mut session)?;
        report.episodes += 1;
    }
    if report.episodes == 0 {
        return Err(RecordingError::new(2, "the recording has no episodes"));
    }
    Ok(report)
}

/// The replay of one episode.
struct Comparison<'a> {
    line: usize,
    episode: &'a Episode,
    step: usize,
    report: &'a mut ParityReport,
}

impl Comparison<'_> {
    fn run(mut self, session: &mut Session) -> Result<(), RecordingError> {
        let episode = self.episode;
        let seed = episode.reset_seed(self.line)?;
        let obs = session
            .reset(seed.as_ref(), episode.reset_options.as_ref())
            .map_err(|e| RecordingError::new(self.line, e))?;
        self.obs(&episode.reset_obs, &obs)?;
        self.mask(episode.reset_info.action_mask.as_deref(), session.action_mask())?;
        for recorded in &episode.steps {
            self.step += 1;
            let step = session.step(&recorded.action).map_err(|e| {
                RecordingError::new(self.line, format!("at step {}: {e}", self.step))
            })?;
            self.obs(&recorded.obs, &step.obs)?;
            self.number("reward", recorded.reward, step.reward);
            self.flag("terminated", recorded.terminated, step.terminated);
            self.flag("truncated", recorded.truncated, step.truncated);
            if let (Some(expected), Some(got)) = (recorded.prob, step.probability) {
                self.number("prob", expected, got);
            }
            self.mask(recorded.mask.as_deref(), step.mask.as_ref())?;
            self.report.steps += 1;
        }
        Ok(())
    }

    fn obs(&mut self, recorded: &RecordedObs, obs: &Observation) -> Result<(), RecordingError> {
        if !recorded.fits(obs) {
            let message = format!(
                "the observation at step {} has not the shape of {}'s, which is {}",
                self.step,
                self.report.env_id,
                match obs {
                    Observation::Index(_) => "an integer".to_owned(),
                    Observation::Box(list) => format!("a list of {} numbers", list.len()),
                    Observation::Tuple(list) => format!("a list of {} integers", list.len()),
                }
            );
            return Err(RecordingError::new(self.line, message));
        }
        let expected = recorded.numbers();
        match obs {
            Observation::Index(index) => self.number("obs", expected[0], *index as f64),
            Observation::Box(list) => {
                for (i, (&got, &expected)) in list.iter().zip(&expected).enumerate() {
                    self.number(&format!("obs[{i}]"), expected, f64::from(got));
                }
            }
            Observation::Tuple(list) => {
                for (i, (&got, &expected)) in list.iter().zip(&expected).enumerate() {
                    self.number(&format!("obs[{i}]"), expected, got as f64);
                }
            }
        }
        Ok(())
    }

    /// Compares an action mask, if one was recorded.
    fn mask(
        &mut self,
        recorded: Option<&str>,
        mask: Option<&ActionMask>,
    ) -> Result<(), RecordingError> {
        let Some(recorded) = recorded else { return Ok(()) };
        let mask = mask.map_or(&[][..], |mask| &mask.0);
        if recorded.len() != mask.len() || !recorded.bytes().all(|c| matches!(c, b'0' | b'1')) {
            let message = format!(
                "the mask at step {} must be {} characters 0 or 1, not `{recorded}`",
                self.step,
                mask.len()
            );
            return Err(RecordingError::new(self.line, message));
        }
        for (i, (expected, &got)) in recorded.bytes().zip(mask).enumerate() {
            self.flag(&format!("mask[{i}]"), expected == b'1', got);
        }
        Ok(())
    }

    fn flag(&mut self, field: &str, expected: bool, got: bool) {
        let close = expected == got;
        self.count(field, close, close, f64::from(u8::from(expected)), f64::from(u8::from(got)));
    }

    fn number(&mut self, field: &str, expected: f64, got: f64) {
        let difference = (expected - got).abs();
        // A NaN is as far away as anything can be.
        let difference = if difference.is_nan() { f64::INFINITY } else { difference };
        let same = expected.to_bits() == got.to_bits();
        if !same && difference > self.report.largest_difference {
            self.report.largest_difference = difference;
        }
        let close = match tolerance(&self.report.env_id, self.step) {
            Tolerance::Within(bound) => same || difference <= bound,
            Tolerance::Exact | Tolerance::Unchecked => same,
        };
        self.count(field, same, close, expected, got);
    }

    fn count(&mut self, field: &str, same: bool, close: bool, expected: f64, got: f64) {
        let unchecked = tolerance(&self.report.env_id, self.step) == Tolerance::Unchecked;
        self.report.compared += 1;
        self.report.unchecked += u64::from(unchecked);
        if same {
            return;
        }
        let mismatch = Mismatch {
            line: self.line,
            seed: self.episode.seed,
            episode: self.episode.number,
            step: self.step,
            field: field.to_owned(),
            expected,
            got,
        };
        self.report.mismatches += 1;
        if !close && !unchecked {
            self.report.violations += 1;
            self.report.first_violation.get_or_insert_with(|| mismatch.clone());
        }
        self.report.first_mismatch.get_or_insert(mismatch);
    }
}
