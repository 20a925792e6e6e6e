//! `tensorboard/<variant>/seed-<n>/`: what happened in training, for TensorBoard.
//!
//! The tags are those of Stable-Baselines3, so that curves of both lie in one plot, by the number of
//! the agent's steps:
//!
//! | tag | what it is |
//! |---|---|
//! | `rollout/ep_rew_mean`, `rollout/ep_len_mean` | native return and steps, means of the last 100 episodes |
//! | `rollout/exploration_rate` | ε at the start of the episode |
//! | `train/loss`, `train/learning_rate`, `train/n_updates` | of networks: what `learning.csv` says |
//! | `train/q`, `train/td_error`, `train/buffer`, `train/start_value`, `train/start_return` | what Stable-Baselines3 does not log |
//!
//! Up to 2000 episodes all are there, of more every second, third, … and the last; lines of
//! `learning.csv` the same. The time of an event is its step, in seconds: a clock would make two equal
//! runs differ, and so TensorBoard's relative time shows steps.

use std::collections::VecDeque;

use crc::{CRC_32_ISCSI, Crc};
use prost::Message;

use super::results::Results;
use crate::experiment::{EpisodeRow, StoreError, Unit, write_atomically};
use crate::learn::dqn::LogRow;
use crate::script::Plan;

/// The folder, in the results.
pub const FOLDER: &str = "tensorboard";

/// The name of every file: TensorBoard knows its own by the middle of it; a time and a machine
/// follow elsewhere.
const FILE: &str = "events.out.tfevents.0000000000.runner";

/// Episodes of a rolling mean: Stable-Baselines3's `stats_window_size`.
const WINDOW: usize = 100;

/// About how many points of a curve are kept at most.
const POINTS: usize = 2000;

/// CRC-32C (Castagnoli).
const CRC_32C: Crc<u32> = Crc::<u32>::new(&CRC_32_ISCSI);

/// `tensorflow.Event`, as far as it is used.
#[derive(Clone, PartialEq, Message)]
struct Event {
    #[prost(double, tag = "1")]
    wall_time: f64,
    #[prost(int64, tag = "2")]
    step: i64,
    #[prost(string, optional, tag = "3")]
    file_version: Option<String>,
    #[prost(message, optional, tag = "5")]
    summary: Option<Summary>,
}

/// `tensorflow.Summary`.
#[derive(Clone, PartialEq, Message)]
struct Summary {
    #[prost(message, repeated, tag = "1")]
    value: Vec<Scalar>,
}

/// `tensorflow.Summary.Value`.
#[derive(Clone, PartialEq, Message)]
struct Scalar {
    #[prost(string, tag = "1")]
    tag: String,
    #[prost(float, optional, tag = "2")]
    simple_value: Option<f32>,
}

/// Appends a record: its length, the length's checksum, the bytes, their checksum.
fn record(bytes: &[u8], to: &mut Vec<u8>) {
    let length = (bytes.len() as u64).to_le_bytes();
    for part in [&length, bytes] {
        to.extend(part);
        // Masked: the checksum of data that holds checksums would not find as much.
        let masked = CRC_32C.checksum(part).rotate_right(15).wrapping_add(0xa282_ead8);
        to.extend(masked.to_le_bytes());
    }
}

/// Which of `n` points are kept: all, or every `k`-th and the last.
fn kept(n: usize) -> impl Fn(usize) -> bool {
    let spacing = n.div_ceil(POINTS).max(1);
    move |i| (i + 1).is_multiple_of(spacing) || i + 1 == n
}

/// Values at a step.
type Point = (u64, Vec<(&'static str, f64)>);

fn episodes(rows: &[EpisodeRow]) -> Vec<Point> {
    let (mut step, mut window, mut points) = (0, VecDeque::new(), Vec::new());
    let kept = kept(rows.len());
    for (i, row) in rows.iter().enumerate() {
        step += u64::from(row.steps);
        if window.len() == WINDOW {
            window.pop_front();
        }
        window.push_back(row);
        if kept(i) {
            let mean = |of: fn(&EpisodeRow) -> f64| {
                window.iter().map(|row| of(row)).sum::<f64>() / window.len() as f64
            };
            points.push((
                step,
                vec![
                    ("rollout/ep_rew_mean", mean(|row| row.native)),
                    ("rollout/ep_len_mean", mean(|row| f64::from(row.steps))),
                    ("rollout/exploration_rate", row.epsilon),
                ],
            ));
        }
    }
    points
}

fn learning(log: &[LogRow]) -> Vec<Point> {
    let kept = kept(log.len());
    let rows = log.iter().enumerate().filter(|(i, _)| kept(*i));
    let point = |(_, row): (usize, &LogRow)| {
        let values = [
            ("train/loss", row.loss),
            ("train/q", row.q),
            ("train/td_error", row.td_error),
            ("train/learning_rate", Some(row.learning_rate)),
            ("train/n_updates", Some(row.updates as f64)),
            ("train/buffer", Some(row.buffer as f64)),
            ("train/start_value", row.start_value),
            ("train/start_return", row.start_return),
        ];
        let there = values.into_iter().filter_map(|(tag, value)| Some((tag, value?)));
        (row.step, there.collect())
    };
    rows.map(point).collect()
}

/// The file of a unit with these episodes, and of a network with this log.
fn events(rows: &[EpisodeRow], log: &[LogRow]) -> Vec<u8> {
    let mut points = episodes(rows);
    points.extend(learning(log));
    points.sort_by_key(|point| point.0);
    let mut bytes = Vec::new();
    let version = Event { file_version: Some("brain.Event:2".into()), ..Event::default() };
    record(&version.encode_to_vec(), &mut bytes);
    for (step, values) in points {
        let scalar = |(tag, value): (&str, f64)| Scalar {
            tag: tag.into(),
            simple_value: Some(value as f32),
        };
        let event = Event {
            wall_time: step as f64,
            step: step as i64,
            file_version: None,
            summary: Some(Summary { value: values.into_iter().map(scalar).collect() }),
        };
        record(&event.encode_to_vec(), &mut bytes);
    }
    bytes
}

/// Writes the file of every unit.
///
/// # Errors
/// If a unit cannot be read or a file cannot be written.
pub fn write(results: &Results, plan: &Plan, units: &[Unit]) -> Result<(), StoreError> {
    for unit in units {
        let variant = &plan.variants[unit.variant];
        let folder = results.folder.join(FOLDER).join(&variant.name);
        let folder = folder.join(format!("seed-{}", unit.seed));
        std::fs::create_dir_all(&folder).map_err(|e| StoreError {
            message: format!("cannot be made: {e}"),
            path: folder.clone(),
        })?;
        let stored = results.store.load(unit)?;
        let log = results.store.learning(unit)?;
        write_atomically(&folder.join(FILE), &events(&stored.rows, &log))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mdp::Ending;

    fn row(steps: u32, native: f64) -> EpisodeRow {
        EpisodeRow {
            steps,
            native,
            learned: 0.0,
            shaping: 0.0,
            terms: Vec::new(),
            epsilon: 0.5,
            ending: Ending::Terminated,
            value_error: None,
            start: None,
        }
    }

    /// The events of a file, its checksums checked.
    fn read(mut bytes: &[u8]) -> Vec<Event> {
        let mut events = Vec::new();
        while !bytes.is_empty() {
            let length = u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
            let mut again = Vec::new();
            record(&bytes[12..12 + length], &mut again);
            assert_eq!(again, bytes[..length + 16]);
            events.push(Event::decode(&bytes[12..12 + length]).unwrap());
            bytes = &bytes[length + 16..];
        }
        events
    }

    /// The values of a tag by step.
    fn curve(events: &[Event], tag: &str) -> Vec<(i64, f32)> {
        let at = |event: &Event| {
            let values = &event.summary.as_ref()?.value;
            let value = values.iter().find(|v| v.tag == tag)?;
            Some((event.step, value.simple_value.unwrap()))
        };
        events.iter().filter_map(at).collect()
    }

    /// CRC-32C of RFC 3720, appendix B.4; and the beginning of every event file that TensorFlow
    /// writes, whose first record has 24 bytes.
    #[test]
    fn checksums_are_those_of_tensorflow() {
        assert_eq!(CRC_32C.checksum(&[0; 32]), 0x8a91_36aa);
        let mut bytes = Vec::new();
        record(&[0; 24], &mut bytes);
        assert_eq!(bytes[..12], [24, 0, 0, 0, 0, 0, 0, 0, 0xa3, 0x7f, 0x4b, 0x22]);
    }

    #[test]
    fn means_are_taken_over_a_hundred_episodes() {
        let rows: Vec<EpisodeRow> = (0..150).map(|i| row(2, f64::from(i))).collect();
        let events = read(&events(&rows, &[]));
        assert_eq!(events[0].file_version.as_deref(), Some("brain.Event:2"));
        assert_eq!(events.len(), 151);
        let returns = curve(&events, "rollout/ep_rew_mean");
        assert_eq!(returns[..3], [(2, 0.0), (4, 0.5), (6, 1.0)]);
        // The means of 0..=99, 1..=100 and 50..=149.
        assert_eq!(returns[99..101], [(200, 49.5), (202, 50.5)]);
        assert_eq!(returns[149], (300, 99.5));
        assert_eq!(curve(&events, "rollout/ep_len_mean")[149], (300, 2.0));
        assert_eq!(curve(&events, "rollout/exploration_rate")[0], (2, 0.5));
        assert_eq!(events[150].wall_time, 300.0);
    }

    #[test]
    fn long_runs_are_thinned_evenly() {
        let rows: Vec<EpisodeRow> = (0..4001).map(|_| row(1, 0.0)).collect();
        let steps: Vec<i64> =
            read(&events(&rows, &[])).iter().skip(1).map(|event| event.step).collect();
        let mut wanted: Vec<i64> = (1..=1333).map(|i| 3 * i).collect();
        wanted.push(4001);
        assert_eq!(steps, wanted);
        let all = events(&rows[..2000], &[]);
        assert_eq!(read(&all).len(), 2001);
    }

    #[test]
    fn the_log_lies_among_the_episodes() {
        let log = LogRow {
            step: 3,
            episode: 2,
            updates: 1,
            loss: Some(0.25),
            q: None,
            td_error: Some(0.5),
            epsilon: 0.5,
            learning_rate: 0.001,
            buffer: 3,
            start_value: None,
            start_return: None,
        };
        let events = read(&events(&[row(2, 1.0), row(2, 3.0)], &[log]));
        assert_eq!(events.iter().map(|event| event.step).collect::<Vec<_>>(), [0, 2, 3, 4]);
        assert_eq!(curve(&events, "train/loss"), [(3, 0.25)]);
        assert_eq!(curve(&events, "train/n_updates"), [(3, 1.0)]);
        assert_eq!(curve(&events, "train/q"), []);
    }
}
