//! Stepping a finite Markov decision process.

use std::sync::Arc;

use super::numpy::NumpyRng;
use super::{FiniteMdp, Outcome};

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
    /// One per (s, a) of `mdp`.
    fn all(mdp: &FiniteMdp) -> Arc<[Self]> {
        let (states, actions) = (0..mdp.n_states(), mdp.n_actions());
        let pairs = states.flat_map(|s| (0..actions).map(move |a| (s, a)));
        pairs.map(|(s, a)| Self::new(mdp.range(s, a).start, mdp.of(s, a))).collect()
    }

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
    starts: Arc<Starts>,
    /// One per (s, a). A copy of the environment shares them.
    draws: Arc<[Draw]>,
    state: u32,
}

impl FiniteEnv {
    /// A simulator of `mdp`, in state 0 until the first reset.
    pub fn new(mdp: Arc<FiniteMdp>) -> Self {
        let starts = Arc::new(Starts::new(mdp.initial()));
        let draws = Draw::all(&mdp);
        Self { mdp, starts, draws, state: 0 }
    }

    /// The model.
    pub fn mdp(&self) -> &Arc<FiniteMdp> {
        &self.mdp
    }

    /// Starts an episode: samples the initial distribution.
    #[inline]
    pub fn reset(&mut self, rng: &mut NumpyRng) -> FiniteState {
        self.state = self.starts.draw(rng);
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

    /// Draws an outcome of (s, a), as [`categorical`] does; an index into
    /// [`FiniteMdp::outcomes`].
    #[inline]
    fn draw(&self, s: usize, a: usize, rng: &mut NumpyRng) -> usize {
        let draw = &self.draws[s * self.mdp.n_actions() + a];
        let i = if draw.len as usize <= draw.ceilings.len() {
            // No branch on the draw itself: nobody can predict it.
            let u = rng.random();
            let passed = draw.ceilings.iter().map(|&ceiling| u32::from(ceiling <= u)).sum();
            if passed == draw.len { 0 } else { passed }
        } else {
            categorical(self.mdp.of(s, a).iter().map(|o| o.probability), rng) as u32
        };
        (draw.first + i) as usize
    }

    /// Samples an outcome of `action` and moves there. Returns it with the new state.
    #[inline(always)]
    #[expect(
        clippy::inline_always,
        reason = "with so many loops to put it into, the compiler prefers a call, which costs a third of the step"
    )]
    pub fn step(&mut self, action: usize, rng: &mut NumpyRng) -> (FiniteState, &Outcome) {
        let i = self.draw(self.state as usize, action, rng);
        let outcome = &self.mdp.outcomes()[i];
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
            let env = FiniteEnv::new(Arc::new(mdp));
            let (mut fast, mut plain) = (NumpyRng::from_u64(7), NumpyRng::from_u64(7));
            for _ in 0..2_000 {
                let expected = categorical(probabilities.iter().copied(), &mut plain);
                assert_eq!(env.draw(0, 0, &mut fast), expected, "{probabilities:?}");
            }
        }
    }
}
