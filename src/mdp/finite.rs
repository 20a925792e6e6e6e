//! Finite Markov decision processes: one transition table for planning and for stepping.

use std::sync::Arc;

use super::numpy::NumpyRng;

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

/// A state of a finite environment, and the outcome that led to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FiniteState {
    /// The state index: Gymnasium's observation.
    pub index: u32,
    /// Index into [`FiniteMdp::outcomes`] of the transition just taken; [`FiniteState::START`]
    /// after a reset. Rewards tabulated per transition are looked up by it.
    pub outcome: u32,
}

impl FiniteState {
    /// The value of `outcome` right after a reset.
    pub const START: u32 = u32::MAX;
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
    starts: Starts,
    /// One per (s, a).
    draws: Vec<Draw>,
}

/// What it takes to draw an initial state: the states at which the largest running sum of the
/// probabilities rises, with that sum. The first sum above a draw is at one of them.
#[derive(Debug, Clone, PartialEq)]
struct Starts {
    /// Increasing, all above 0.
    ceilings: Vec<f64>,
    states: Vec<u32>,
}

impl Starts {
    fn new(initial: &[f64]) -> Self {
        let (mut ceilings, mut states) = (Vec::new(), Vec::new());
        let (mut sum, mut ceiling) = (0.0, 0.0);
        for (state, &probability) in initial.iter().enumerate() {
            sum += probability;
            // A sum that is no number is above nothing, and so are those after it.
            if sum > ceiling {
                ceiling = sum;
                ceilings.push(ceiling);
                states.push(state as u32);
            }
        }
        Self { ceilings, states }
    }

    /// Draws a state, as [`categorical`] does over the probabilities.
    #[inline]
    fn draw(&self, rng: &mut NumpyRng) -> u32 {
        let u = rng.random();
        let passed = self.ceilings.partition_point(|&ceiling| ceiling <= u);
        self.states.get(passed).copied().unwrap_or(0)
    }
}

/// What it takes to draw an outcome of (s, a): half a cache line.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Draw {
    first: u32,
    len: u32,
    /// The largest running sum of the probabilities up to each outcome; infinite beyond the last.
    /// Empty slots all of them if there are more outcomes than slots.
    ceilings: [f64; 3],
}

impl Draw {
    fn new(first: usize, outcomes: &[Outcome]) -> Self {
        let mut ceilings = [f64::INFINITY; 3];
        if outcomes.len() <= ceilings.len() {
            let (mut sum, mut ceiling) = (0.0f64, f64::NEG_INFINITY);
            for (slot, outcome) in ceilings.iter_mut().zip(outcomes) {
                sum += outcome.probability;
                // The first sum above u is where the largest so far first is above u; the latter
                // never falls, and can be counted up to without a look at each in turn.
                ceiling = ceiling.max(sum);
                *slot = ceiling;
            }
        }
        Self { first: first as u32, len: outcomes.len() as u32, ceilings }
    }
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
        let n_states = table.len();
        let n_actions = table.first().map_or(0, Vec::len);
        if n_states == 0 || n_actions == 0 {
            return Err(FiniteMdpError("a model needs at least one state and one action".into()));
        }
        if initial.len() != n_states {
            return Err(FiniteMdpError(format!(
                "{} initial probabilities for {n_states} states",
                initial.len()
            )));
        }
        let mut offsets = Vec::with_capacity(n_states * n_actions + 1);
        let mut outcomes = Vec::new();
        let mut draws = Vec::with_capacity(n_states * n_actions);
        offsets.push(0);
        for (s, row) in table.iter().enumerate() {
            if row.len() != n_actions {
                return Err(FiniteMdpError(format!(
                    "state {s} has {} actions, state 0 has {n_actions}",
                    row.len()
                )));
            }
            for (a, list) in row.iter().enumerate() {
                if list.is_empty() {
                    return Err(FiniteMdpError(format!("no outcome for action {a} in state {s}")));
                }
                if let Some(bad) = list.iter().find(|o| o.next_state as usize >= n_states) {
                    return Err(FiniteMdpError(format!(
                        "action {a} in state {s} leads to state {}, but there are {n_states}",
                        bad.next_state
                    )));
                }
                draws.push(Draw::new(outcomes.len(), list));
                outcomes.extend_from_slice(list);
                offsets.push(outcomes.len() as u32);
            }
        }
        let starts = Starts::new(&initial);
        Ok(Self { n_states, n_actions, offsets, outcomes, initial, starts, draws })
    }

    /// Number of states.
    pub fn n_states(&self) -> usize {
        self.n_states
    }

    /// Number of actions.
    pub fn n_actions(&self) -> usize {
        self.n_actions
    }

    /// Initial-state probabilities, one per state.
    pub fn initial(&self) -> &[f64] {
        &self.initial
    }

    /// Every outcome of the model.
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

    /// Draws an outcome of (s, a), as [`categorical`] does; an index into [`Self::outcomes`].
    #[inline]
    fn draw(&self, s: usize, a: usize, rng: &mut NumpyRng) -> usize {
        let draw = &self.draws[s * self.n_actions + a];
        let i = if draw.len as usize <= draw.ceilings.len() {
            // No branch on the draw itself: nobody can predict it.
            let u = rng.random();
            let passed = draw.ceilings.iter().map(|&ceiling| u32::from(ceiling <= u)).sum();
            if passed == draw.len { 0 } else { passed }
        } else {
            categorical(self.of(s, a).iter().map(|o| o.probability), rng) as u32
        };
        (draw.first + i) as usize
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

/// Samples an index as Gymnasium's `categorical_sample`: one uniform draw, always; the first
/// index whose running float64 sum exceeds it; 0 if none does.
#[inline]
fn categorical(probabilities: impl Iterator<Item = f64>, rng: &mut NumpyRng) -> usize {
    let u = rng.random();
    let mut sum = 0.0;
    for (i, p) in probabilities.enumerate() {
        sum += p;
        if sum > u {
            return i;
        }
    }
    0
}

/// Steps a [`FiniteMdp`]: the simulator and the model are the same table.
#[derive(Debug, Clone)]
pub struct FiniteEnv {
    mdp: Arc<FiniteMdp>,
    state: u32,
}

impl FiniteEnv {
    /// A simulator of `mdp`, in state 0 until the first reset.
    pub fn new(mdp: Arc<FiniteMdp>) -> Self {
        Self { mdp, state: 0 }
    }

    /// The model.
    pub fn mdp(&self) -> &Arc<FiniteMdp> {
        &self.mdp
    }

    /// Starts an episode: samples the initial distribution.
    #[inline]
    pub fn reset(&mut self, rng: &mut NumpyRng) -> FiniteState {
        self.state = self.mdp.starts.draw(rng);
        FiniteState { index: self.state, outcome: FiniteState::START }
    }

    /// Moves to state `index` without an outcome, for dynamics that the table does not hold.
    #[inline]
    pub fn move_to(&mut self, index: u32) {
        self.state = index;
    }

    /// The state it is in.
    #[inline]
    pub fn state(&self) -> u32 {
        self.state
    }

    /// Samples an outcome of `action` and moves there. Returns it with the new state.
    #[inline(always)]
    #[expect(
        clippy::inline_always,
        reason = "with so many loops to put it into, the compiler prefers a call, which costs a third of the step"
    )]
    pub fn step(&mut self, action: usize, rng: &mut NumpyRng) -> (FiniteState, &Outcome) {
        let mdp = &*self.mdp;
        let i = mdp.draw(self.state as usize, action, rng);
        let outcome = &mdp.outcomes[i];
        self.state = outcome.next_state;
        (FiniteState { index: self.state, outcome: i as u32 }, outcome)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the fast draws must be equal to, on probabilities that are none as well.
    const ODD: [&[f64]; 8] = [
        &[1.0],
        &[0.0, 0.25, 0.0, 0.5, 0.25],
        &[0.3, -0.2, 0.4, 0.5],
        &[0.1, 0.1],
        &[0.2, f64::NAN, 0.8],
        &[f64::NAN; 3],
        &[0.0, 0.0],
        &[0.9, 0.9, 0.9, 0.9],
    ];

    #[test]
    fn initial_states_are_drawn_as_by_running_sums() {
        let thirds = vec![1.0 / 300.0; 300];
        for initial in ODD.into_iter().chain([&*thirds]) {
            let starts = Starts::new(initial);
            let (mut fast, mut plain) = (NumpyRng::from_u64(7), NumpyRng::from_u64(7));
            for _ in 0..2_000 {
                let expected = categorical(initial.iter().copied(), &mut plain);
                assert_eq!(starts.draw(&mut fast) as usize, expected, "{initial:?}");
            }
            assert_eq!(fast, plain);
        }
    }

    #[test]
    fn outcomes_are_drawn_as_by_running_sums() {
        let to = |(i, &probability): (usize, &f64)| Outcome {
            probability,
            next_state: i as u32,
            reward: 0.0,
            terminated: false,
        };
        for probabilities in ODD {
            let outcomes: Vec<Outcome> = probabilities.iter().enumerate().map(to).collect();
            let table = vec![vec![outcomes]; probabilities.len()];
            let mdp = FiniteMdp::new(&table, vec![1.0; probabilities.len()]).unwrap();
            let (mut fast, mut plain) = (NumpyRng::from_u64(7), NumpyRng::from_u64(7));
            for _ in 0..2_000 {
                let expected = categorical(probabilities.iter().copied(), &mut plain);
                assert_eq!(mdp.draw(0, 0, &mut fast), expected, "{probabilities:?}");
            }
        }
    }
}
