//! What the parameters of a network's learner say together.

use super::diagnostic::Diagnostic;
use crate::learn::{AgentConfig, ParamKind, ParamValue, Schedule, Unit};

/// The keys that give ε as a straight line.
pub(super) const EXPLORATION: [&str; 3] =
    ["exploration_initial_eps", "exploration_final_eps", "exploration_fraction"];

/// What they are where only some are given: those of Stable-Baselines3.
const DEFAULTS: [f64; 3] = [1.0, 0.05, 0.1];

/// Puts the line into `epsilon`, so that one schedule says how `config` explores in `episodes`
/// episodes.
///
/// # Errors
/// If parameters contradict each other.
pub(super) fn resolve(config: &mut AgentConfig, episodes: u32) -> Result<(), Diagnostic> {
    let (batch, buffer) = (config.int("batch_size"), config.int("buffer_size"));
    if batch > buffer {
        return Err(Diagnostic::error(format!(
            "a minibatch of {batch} transitions does not fit into a buffer of {buffer}"
        ))
        .hint("`batch_size` is at most `buffer_size`"));
    }
    if buffer > MAX_BUFFER {
        return Err(Diagnostic::error(format!(
            "a buffer of {buffer} transitions is more than the {MAX_BUFFER} that are supported"
        )));
    }
    let given = EXPLORATION.map(|name| match config.params[name] {
        ParamValue::Float(x) => Some(x),
        _ => None,
    });
    if given.iter().all(Option::is_none) {
        return Ok(());
    }
    let [start, end, fraction] = [0, 1, 2].map(|i| given[i].unwrap_or(DEFAULTS[i]));
    let over = (fraction * f64::from(episodes)).round().max(1.0) as u64;
    let line = Schedule::Linear { start, end, over, unit: Unit::Episode };
    config.params.insert("epsilon", ParamValue::Schedule(line));
    for name in EXPLORATION {
        config.params.insert(name, ParamValue::Word(ParamKind::NONE));
    }
    Ok(())
}

/// Transitions of the largest buffer: what memory has room for, with some to spare.
const MAX_BUFFER: u64 = 100_000_000;
