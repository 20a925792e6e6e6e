//! Going on as if training had never stopped.

use super::agent::{Counts, Dqn};
use super::log::LogRow;
use super::snapshot::Snapshot;

/// Numbers in an entry of the log.
const LOG: usize = 11;

impl Dqn {
    /// Writes down everything that its future depends on. Only between episodes.
    pub fn save(&self, to: &mut Snapshot) {
        let (m, v, powers) = self.adam.state();
        let (rows, replay) = self.replay.state();
        for (name, values) in [
            ("network", self.q.params()),
            ("target", self.target.params()),
            ("adam.m", m),
            ("adam.v", v),
            ("replay", rows),
        ] {
            to.singles.insert(name.into(), values.to_vec());
        }
        to.put("adam", &powers);
        to.put("replay", &replay);
        to.put("sampling", &self.sampling);
        to.put("behaviour", &self.behaviour.state());
        to.put("learning_rate", &self.learning_rate.state());
        to.put("counts", &self.counts);
        to.put("sums", &self.sums);
        if let Some((tree, beta)) = &self.tree {
            let (priorities, largest) = tree.state(self.replay.len());
            to.doubles.insert("priorities".into(), priorities.to_vec());
            to.put("largest_priority", &largest);
            to.put("beta", &beta.state());
        }
        let log = self.log.iter().flat_map(numbers);
        to.doubles.insert("log".into(), log.collect());
    }

    /// As it was when it was saved; `None` if that was another agent, and then it is good for
    /// nothing.
    pub fn restore(mut self, from: &Snapshot) -> Option<Self> {
        from.copy("network", self.q.params_mut())?;
        from.copy("target", self.target.params_mut())?;
        let (m, v) = (from.singles.get("adam.m")?, from.singles.get("adam.v")?);
        let n = self.q.params().len();
        if m.len() != n || v.len() != n {
            return None;
        }
        self.adam.restore(m, v, from.get("adam")?);
        self.replay.restore(from.singles.get("replay")?, from.get("replay")?)?;
        self.sampling = from.get("sampling")?;
        self.behaviour.restore(from.get("behaviour")?);
        self.learning_rate.restore(from.get("learning_rate")?);
        self.counts = from.get::<Counts>("counts")?;
        self.sums = from.get("sums")?;
        if let Some((tree, beta)) = &mut self.tree {
            let priorities = from.doubles.get("priorities")?;
            if priorities.len() != self.replay.len() {
                return None;
            }
            tree.restore(priorities, from.get("largest_priority")?)?;
            beta.restore(from.get("beta")?);
        }
        let log = from.doubles.get("log")?;
        if !log.len().is_multiple_of(LOG) {
            return None;
        }
        self.log = log.chunks_exact(LOG).map(row).collect();
        Some(self)
    }
}

/// An entry of the log as numbers, NaN for what is not there.
fn numbers(row: &LogRow) -> [f64; LOG] {
    let number = |x: Option<f64>| x.unwrap_or(f64::NAN);
    [
        row.step as f64,
        f64::from(row.episode),
        row.updates as f64,
        number(row.loss),
        number(row.q),
        number(row.td_error),
        row.epsilon,
        row.learning_rate,
        row.buffer as f64,
        number(row.start_value),
        number(row.start_return),
    ]
}

/// The entry that [`numbers`] wrote.
fn row(numbers: &[f64]) -> LogRow {
    let maybe = |i: usize| Some(numbers[i]).filter(|x| !x.is_nan());
    LogRow {
        step: numbers[0] as u64,
        episode: numbers[1] as u32,
        updates: numbers[2] as u64,
        loss: maybe(3),
        q: maybe(4),
        td_error: maybe(5),
        epsilon: numbers[6],
        learning_rate: numbers[7],
        buffer: numbers[8] as u64,
        start_value: maybe(9),
        start_return: maybe(10),
    }
}
