//! `learning.csv`: how a network came to what it is.
//!
//! ```text
//! step,episode,updates,loss,q,td_error,epsilon,learning_rate,buffer,start_value,start_return
//! 1000,49,937,0.0625,1.5,0.25,0.61,0.001,1000,1.25,1.75
//! ```
//!
//! Empty is what there was nothing of.

use super::format::{NEVER, csv_bytes, float};
use crate::learn::dqn::LogRow;

const HEADER: [&str; 11] = [
    "step",
    "episode",
    "updates",
    "loss",
    "q",
    "td_error",
    "epsilon",
    "learning_rate",
    "buffer",
    "start_value",
    "start_return",
];

/// The file of a log.
pub(super) fn learning(log: &[LogRow]) -> Vec<u8> {
    let mut csv = csv::Writer::from_writer(Vec::new());
    csv.write_record(HEADER).expect(NEVER);
    let maybe = |x: Option<f64>| x.map_or_else(String::new, float);
    for row in log {
        let line = [
            row.step.to_string(),
            row.episode.to_string(),
            row.updates.to_string(),
            maybe(row.loss),
            maybe(row.q),
            maybe(row.td_error),
            float(row.epsilon),
            float(row.learning_rate),
            row.buffer.to_string(),
            maybe(row.start_value),
            maybe(row.start_return),
        ];
        csv.write_record(line).expect(NEVER);
    }
    csv_bytes(csv)
}

/// Reads what [`learning`] writes.
pub(super) fn read_learning(bytes: &[u8]) -> Result<Vec<LogRow>, String> {
    let mut reader = csv::Reader::from_reader(bytes);
    if *reader.headers().map_err(|e| e.to_string())? != HEADER[..] {
        return Err(format!("is no log of learning: its header is not `{}`", HEADER.join(",")));
    }
    let mut log = Vec::new();
    for (i, line) in reader.records().enumerate() {
        let line = line.map_err(|e| e.to_string())?;
        let row = row(&line).ok_or_else(|| format!("line {}: cannot be read", i + 2))?;
        log.push(row);
    }
    Ok(log)
}

fn row(line: &csv::StringRecord) -> Option<LogRow> {
    let float = |k: usize| line[k].parse::<f64>().ok();
    // Nothing, or a number: the outer `None` is neither.
    let maybe = |k: usize| if line[k].is_empty() { Some(None) } else { Some(Some(float(k)?)) };
    Some(LogRow {
        step: line[0].parse().ok()?,
        episode: line[1].parse().ok()?,
        updates: line[2].parse().ok()?,
        loss: maybe(3)?,
        q: maybe(4)?,
        td_error: maybe(5)?,
        epsilon: float(6)?,
        learning_rate: float(7)?,
        buffer: line[8].parse().ok()?,
        start_value: maybe(9)?,
        start_return: maybe(10)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_comes_back() {
        let first = LogRow {
            step: 1000,
            episode: 49,
            updates: 937,
            loss: Some(0.1),
            q: Some(1.5),
            td_error: Some(0.25),
            epsilon: 0.61,
            learning_rate: 0.001,
            buffer: 1000,
            start_value: Some(-1.25),
            start_return: Some(1.75),
        };
        let second = LogRow {
            step: 2000,
            loss: None,
            q: None,
            td_error: None,
            start_value: None,
            start_return: None,
            ..first
        };
        let bytes = learning(&[first, second]);
        let text = std::str::from_utf8(&bytes).unwrap();
        assert_eq!(
            text.lines().nth(1),
            Some("1000,49,937,0.1,1.5,0.25,0.61,0.001,1000,-1.25,1.75")
        );
        assert_eq!(text.lines().nth(2), Some("2000,49,937,,,,0.61,0.001,1000,,"));
        assert_eq!(read_learning(&bytes).unwrap(), [first, second]);
        let bad = text.replace("937,0.1", "937,x");
        assert_eq!(read_learning(bad.as_bytes()).unwrap_err(), "line 2: cannot be read");
        assert!(read_learning(b"step,loss\n").unwrap_err().starts_with("is no log of learning"));
    }
}
