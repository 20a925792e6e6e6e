//! Finite Markov decision processes: one transition table for planning and for stepping.

/// One possible result of an action: Gymnasium's `(prob, next_state, reward, terminated)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// Its probability.
    pub probability: f64,
    /// The state it leads to.
    pub next_state: u32,
    /// The native reward on the way.
    pub reward: f64,
    /// Whether the episode ends there. Terminality belongs to the transition, not to the state.
    pub terminated: bool,
}

/// A finite MDP, stored as one flat list of outcomes.
///
/// Shapes: `offsets` has `n_states * n_actions + 1` entries; the outcomes of (s, a) are
/// `outcomes[offsets[s * n_actions + a]..offsets[s * n_actions + a + 1]]`, in the order in which
/// they are sampled (which matters for seed-exactness).
#[derive(Debug, Clone, PartialEq)]
pub struct FiniteMdp {
    n_states: usize,
    n_actions: usize,
    offsets: Vec<u32>,
    outcomes: Vec<Outcome>,
    initial: Vec<f64>,
}

/// Why a table is not a [`FiniteMdp`].
#[derive(Debug, Clone, PartialEq)]
pub struct FiniteMdpError(pub String);

impl std::fmt::Display for FiniteMdpError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for FiniteMdpError {}

impl FiniteMdp {
    /// Builds the table. `table[s][a]` lists the outcomes of action `a` in state `s`; `initial`
    /// holds one probability per state (not normalised: it is sampled as NumPy would).
    ///
    /// # Errors
    /// If there are no states or actions, rows differ in length, a list of outcomes is empty, or
    /// a next state is out of range.
    pub fn new(table: &[Vec<Vec<Outcome>>], initial: Vec<f64>) -> Result<Self, FiniteMdpError> {
        let n_actions = table.first().map_or(0, Vec::len);
        let mut offsets = Vec::with_capacity(table.len() * n_actions + 1);
        let mut outcomes = Vec::new();
        offsets.push(0);
        for (s, row) in table.iter().enumerate() {
            if row.len() != n_actions {
                return Err(FiniteMdpError(format!(
                    "state {s} has {} actions, state 0 has {n_actions}",
                    row.len()
                )));
            }
            for list in row {
                outcomes.extend_from_slice(list);
                offsets.push(outcomes.len() as u32);
            }
        }
        Self::from_parts(n_actions, offsets, outcomes, initial)
    }

    /// The same from flat parts, which a model of millions of outcomes is collected in: `offsets`
    /// and `outcomes` as [described above](Self), one state per entry of `initial`.
    ///
    /// # Errors
    /// If there are no states or actions, the offsets are not `n_states * n_actions + 1` numbers
    /// that rise from 0 to the number of outcomes (each (s, a) has at least one), or a next state
    /// is out of range.
    pub fn from_parts(
        n_actions: usize,
        offsets: Vec<u32>,
        outcomes: Vec<Outcome>,
        initial: Vec<f64>,
    ) -> Result<Self, FiniteMdpError> {
        let wrong = |what: String| Err(FiniteMdpError(what));
        let pairs = offsets.len().saturating_sub(1);
        if n_actions == 0 || pairs == 0 {
            return wrong("a model needs at least one state and one action".into());
        }
        if !pairs.is_multiple_of(n_actions) {
            return wrong(format!("{pairs} lists of outcomes for {n_actions} actions per state"));
        }
        let n_states = pairs / n_actions;
        if initial.len() != n_states {
            return wrong(format!("{} initial probabilities for {n_states} states", initial.len()));
        }
        if offsets[0] != 0 || offsets[pairs] as usize != outcomes.len() {
            return wrong(format!(
                "the offsets go from {} to {}, there are {} outcomes",
                offsets[0],
                offsets[pairs],
                outcomes.len()
            ));
        }
        for (i, ends) in offsets.windows(2).enumerate() {
            let (s, a) = (i / n_actions, i % n_actions);
            if ends[0] >= ends[1] {
                return wrong(format!("no outcome for action {a} in state {s}"));
            }
            let list = outcomes.get(ends[0] as usize..ends[1] as usize).unwrap_or_default();
            if let Some(bad) = list.iter().find(|o| o.next_state as usize >= n_states) {
                return wrong(format!(
                    "action {a} in state {s} leads to state {}, but there are {n_states}",
                    bad.next_state
                ));
            }
        }
        Ok(Self { n_states, n_actions, offsets, outcomes, initial })
    }

    /// Number of states.
    #[inline]
    pub fn n_states(&self) -> usize {
        self.n_states
    }

    /// Number of actions.
    #[inline]
    pub fn n_actions(&self) -> usize {
        self.n_actions
    }

    /// Initial-state probabilities, one per state.
    pub fn initial(&self) -> &[f64] {
        &self.initial
    }

    /// Every outcome of the model.
    #[inline]
    pub fn outcomes(&self) -> &[Outcome] {
        &self.outcomes
    }

    /// The range of [`Self::outcomes`] that belongs to (s, a).
    #[inline]
    pub fn range(&self, s: usize, a: usize) -> std::ops::Range<usize> {
        let i = s * self.n_actions + a;
        self.offsets[i] as usize..self.offsets[i + 1] as usize
    }

    /// The outcomes of action `a` in state `s`, in sampling order.
    #[inline]
    pub fn of(&self, s: usize, a: usize) -> &[Outcome] {
        &self.outcomes[self.range(s, a)]
    }

    /// Whether an episode can be *in* state `s` and act: reachable from an initial state by
    /// non-terminal transitions of positive probability. Tables hold junk elsewhere.
    ///
    /// Returns one flag per state.
    pub fn reachable(&self) -> Vec<bool> {
        let mut seen = vec![false; self.n_states];
        let mut stack: Vec<usize> = (0..self.n_states)
            .filter(|&s| self.initial[s] > 0.0 || self.initial[s].is_nan())
            .collect();
        if stack.is_empty() || self.initial.iter().any(|p| p.is_nan()) {
            // NumPy's sampling falls back to state 0 when no cumulative sum exceeds the draw.
            stack = vec![0];
        }
        for &s in &stack {
            seen[s] = true;
        }
        while let Some(s) = stack.pop() {
            for a in 0..self.n_actions {
                for o in self.of(s, a) {
                    let next = o.next_state as usize;
                    if o.probability > 0.0 && !o.terminated && !seen[next] {
                        seen[next] = true;
                        stack.push(next);
                    }
                }
            }
        }
        seen
    }

    /// The same dynamics with other rewards: `reward(s, a, outcome)` replaces each.
    #[must_use]
    pub fn with_rewards(&self, mut reward: impl FnMut(usize, usize, &Outcome) -> f64) -> Self {
        let mut shaped = self.clone();
        for s in 0..self.n_states {
            for a in 0..self.n_actions {
                for i in self.range(s, a) {
                    shaped.outcomes[i].reward = reward(s, a, &self.outcomes[i]);
                }
            }
        }
        shaped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flat_parts_are_the_nested_table_and_wrong_ones_are_refused() {
        let go =
            |next_state| Outcome { probability: 0.5, next_state, reward: 1.0, terminated: false };
        let table = [vec![vec![go(0), go(1)], vec![go(1)]], vec![vec![go(1)], vec![go(0)]]];
        let outcomes = vec![go(0), go(1), go(1), go(1), go(0)];
        let flat = |n, offsets: &[u32], outcomes: &[Outcome], initial: &[f64]| {
            FiniteMdp::from_parts(n, offsets.to_vec(), outcomes.to_vec(), initial.to_vec())
        };
        let same = flat(2, &[0, 2, 3, 4, 5], &outcomes, &[1.0, 0.0]).unwrap();
        assert_eq!(same, FiniteMdp::new(&table, vec![1.0, 0.0]).unwrap());
        let far = [go(0), go(1), go(1), go(2), go(0)];
        for (n, offsets, outcomes, initial, expected) in [
            (0, &[0, 5][..], &outcomes[..], &[1.0][..], "at least one state and one action"),
            (2, &[0, 2, 3, 5], &outcomes, &[1.0], "3 lists of outcomes for 2 actions per state"),
            (2, &[0, 2, 3, 4, 5], &outcomes, &[1.0], "1 initial probabilities for 2 states"),
            (2, &[0, 2, 3, 4, 4], &outcomes, &[1.0, 0.0], "from 0 to 4, there are 5 outcomes"),
            (2, &[0, 2, 2, 4, 5], &outcomes, &[1.0, 0.0], "no outcome for action 1 in state 0"),
            (2, &[0, 9, 3, 4, 5], &outcomes, &[1.0, 0.0], "no outcome for action 1 in state 0"),
            (2, &[0, 2, 3, 4, 5], &far, &[1.0, 0.0], "action 0 in state 1 leads to state 2"),
        ] {
            let error = flat(n, offsets, outcomes, initial).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
