//! The steps of an episode, kept until its returns are known.

/// Which visits of an entry within an episode are averaged (Sutton & Barto 2018, section 5.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Visits {
    /// The first of each episode.
    First,
    /// All.
    Every,
}

impl Visits {
    /// The words that [`Self::of_word`] reads.
    pub const WORDS: &'static [&'static str] = &["first", "every"];

    /// `"first"`, else every visit.
    pub fn of_word(word: &str) -> Self {
        if word == "first" { Self::First } else { Self::Every }
    }
}

#[derive(Debug, Clone, Copy)]
struct Visit {
    entry: u32,
    first: bool,
    reward: f64,
}

/// An episode, as the entries of a table that it visits and the rewards that follow.
#[derive(Debug, Clone)]
pub(super) struct Episode {
    visits: Vec<Visit>,
    /// The number of the last episode that visited each entry; episodes count from 1.
    last_seen: Vec<u32>,
    number: u32,
}

impl Episode {
    /// Over a table of `n_entries`.
    pub(super) fn new(n_entries: usize) -> Self {
        Self { visits: Vec::new(), last_seen: vec![0; n_entries], number: 0 }
    }

    /// Starts another one.
    pub(super) fn begin(&mut self) {
        self.visits.clear();
        self.number += 1;
    }

    /// `entry` is visited.
    #[inline]
    pub(super) fn visit(&mut self, entry: usize) {
        let seen = std::mem::replace(&mut self.last_seen[entry], self.number);
        self.visits.push(Visit { entry: entry as u32, first: seen != self.number, reward: 0.0 });
    }

    /// The reward that follows the last visit.
    #[inline]
    pub(super) fn reward(&mut self, reward: f64) {
        if let Some(visit) = self.visits.last_mut() {
            visit.reward = reward;
        }
    }

    /// Calls `each(entry, return)` for the visits that count, the last first.
    pub(super) fn returns(&self, gamma: f64, visits: Visits, mut each: impl FnMut(usize, f64)) {
        let mut g = 0.0;
        for visit in self.visits.iter().rev() {
            g = visit.reward + gamma * g;
            if visit.first || visits == Visits::Every {
                each(visit.entry as usize, g);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn returns_by_hand() {
        let mut episode = Episode::new(3);
        for _ in 0..2 {
            episode.begin();
            for (entry, reward) in [(2, 1.0), (0, 2.0), (2, 4.0)] {
                episode.visit(entry);
                episode.reward(reward);
            }
            let of = |visits| {
                let mut all = Vec::new();
                episode.returns(0.5, visits, |entry, g| all.push((entry, g)));
                all
            };
            assert_eq!(of(Visits::Every), [(2, 4.0), (0, 4.0), (2, 3.0)]);
            assert_eq!(of(Visits::First), [(0, 4.0), (2, 3.0)]);
        }
    }
}
