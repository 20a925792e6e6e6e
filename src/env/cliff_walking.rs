//! `CliffWalking-v1` and `CliffWalkingSlippery-v1`: walk along the edge of a cliff (Sutton & Barto
//! 2018, example 6.6). The transition table is Gymnasium 1.4.0's, in its order, so that a seed gives
//! the same trajectory.
//!
//! # Action Space
//! `Discrete(4)`: 0 up, 1 right, 2 down, 3 left. A move against the border stays where it is.
//!
//! # Observation Space
//! `Discrete(48)`: `row * 12 + col`. Scripts see the fields `row`, `col`, `index`, `tile` (S start,
//! F free, C cliff, G goal), and the facts `rows`, `cols`, `start_row`, `start_col`, `goal_row`,
//! `goal_col`.
//!
//! # Rewards
//! -1 for every step; -100 for one over the edge, which leads back to the start.
//!
//! # Starting State
//! The lower left corner.
//!
//! # Episode End
//! Terminated on reaching the goal in the lower right corner. Falling does not end the episode, and
//! there is no time limit.
//!
//! # Arguments
//! `is_slippery` (false; `CliffWalkingSlippery-v1`: true): whether a move goes astray to either
//! side, at right angles, each with the probability 1/3.
//!
//! # Exactness
//! Exact: the table's probabilities, rewards, order and the one draw per reset and step.
//!
//! Deviations: none.

mod draw;

use std::sync::Arc;

use super::error::EnvError;
use super::kwargs::{KwargKind, KwargSpec, Kwargs};
use super::registered::{Example, Registered};
use crate::mdp::numpy::NumpyRng;
use crate::mdp::{
    Action, Env, Field, FieldKind, FiniteEnv, FiniteMdp, FiniteState, Grid, Outcome, Schema, Step,
};

const MAP: [&str; 4] = ["FFFFFFFFFFFF", "FFFFFFFFFFFF", "FFFFFFFFFFFF", "SCCCCCCCCCCG"];
const ROWS: usize = 4;
const COLS: usize = 12;
const START: usize = 36;
const GOAL: usize = 47;
const N_ACTIONS: usize = 4;

/// The walker. Clones share the model.
#[derive(Debug, Clone)]
pub struct CliffWalking {
    env: FiniteEnv,
}

impl CliffWalking {
    /// A walker on firm or slippery ground, to be reset first.
    ///
    /// # Panics
    /// Never: the table is sound.
    pub fn new(is_slippery: bool) -> Self {
        let mut initial = vec![0.0; ROWS * COLS];
        initial[START] = 1.0;
        let mdp = FiniteMdp::new(&table(is_slippery), initial).expect("the table is sound");
        Self { env: FiniteEnv::new(Arc::new(mdp)) }
    }

    /// Where the walker is: row and column, from 0 in the upper left corner.
    pub fn position(&self) -> (usize, usize) {
        let index = self.env.state() as usize;
        (index / COLS, index % COLS)
    }
}

/// The tile of state `index`.
fn tile(index: usize) -> u8 {
    MAP[index / COLS].as_bytes()[index % COLS]
}

/// The outcomes of every action in every state, the cliff and the goal included:
/// `[state][action][outcome]`.
fn table(is_slippery: bool) -> Vec<Vec<Vec<Outcome>>> {
    let outcomes = |s, a| {
        if is_slippery {
            // They are sampled in this order.
            let directions = [(a + N_ACTIONS - 1) % N_ACTIONS, a, (a + 1) % N_ACTIONS];
            directions.map(|direction| walk(1.0 / 3.0, s, direction)).to_vec()
        } else {
            vec![walk(1.0, s, a)]
        }
    };
    (0..ROWS * COLS).map(|s| (0..N_ACTIONS).map(|a| outcomes(s, a)).collect()).collect()
}

/// A step from state `s` in `direction` (an action).
fn walk(probability: f64, s: usize, direction: usize) -> Outcome {
    let (row, col) = (s / COLS, s % COLS);
    let next = match direction {
        0 => row.saturating_sub(1) * COLS + col,
        1 => row * COLS + (col + 1).min(COLS - 1),
        2 => (row + 1).min(ROWS - 1) * COLS + col,
        _ => row * COLS + col.saturating_sub(1),
    };
    if tile(next) == b'C' {
        let next_state = START as u32;
        return Outcome { probability, next_state, reward: -100.0, terminated: false };
    }
    Outcome { probability, next_state: next as u32, reward: -1.0, terminated: next == GOAL }
}

impl Env for CliffWalking {
    type Obs = FiniteState;

    const INDEXED: bool = true;

    fn n_actions(&self) -> usize {
        N_ACTIONS
    }

    #[inline]
    fn reset(&mut self, rng: &mut NumpyRng) -> FiniteState {
        self.env.reset(rng)
    }

    #[inline]
    fn step(&mut self, action: Action, rng: &mut NumpyRng) -> Step<FiniteState> {
        let (obs, outcome) = self.env.step(action, rng);
        Step { obs, reward: outcome.reward, terminated: outcome.terminated }
    }

    fn finite(&self) -> Option<&Arc<FiniteMdp>> {
        Some(self.env.mdp())
    }

    #[inline]
    fn state_index(&self, obs: &FiniteState) -> Option<usize> {
        Some(obs.index as usize)
    }

    #[inline]
    fn state(&self, index: usize) -> Option<FiniteState> {
        Some(FiniteState { index: index as u32, outcome: FiniteState::START })
    }

    fn set_index(&mut self, index: usize) -> Option<FiniteState> {
        let obs = self.state(index).filter(|_| index < self.env.mdp().n_states())?;
        self.env.move_to(obs.index);
        Some(obs)
    }

    fn outcome_index(&self, obs: &FiniteState) -> Option<usize> {
        (obs.outcome != FiniteState::START).then_some(obs.outcome as usize)
    }

    fn schema(&self) -> Schema {
        let fact = |name, value: usize| (name, FieldKind::Int, value as f64);
        Schema {
            fields: vec![
                Field::int("row", "row, from 0 at the top", 0, ROWS - 1),
                Field::int("col", "column, from 0 at the left", 0, COLS - 1),
                Field::int("index", "state index: row * cols + col", 0, ROWS * COLS - 1),
                Field {
                    name: "tile",
                    kind: FieldKind::Letter,
                    doc: "what is there: S start, F free, C cliff, G goal",
                    low: f64::from(b'A'),
                    high: f64::from(b'Z'),
                },
            ],
            facts: vec![
                fact("rows", ROWS),
                fact("cols", COLS),
                fact("start_row", START / COLS),
                fact("start_col", START % COLS),
                fact("goal_row", GOAL / COLS),
                fact("goal_col", GOAL % COLS),
            ],
            actions: ["up", "right", "down", "left"].map(Into::into).into(),
            grid: Some(Grid {
                rows: MAP.map(String::from).to_vec(),
                arrows: &['↑', '→', '↓', '←'],
            }),
        }
    }

    #[inline]
    fn fields(&self, obs: &FiniteState, out: &mut [f64]) {
        let index = obs.index as usize;
        let (row, col) = (index / COLS, index % COLS);
        let values = [row as f64, col as f64, index as f64, f64::from(tile(index))];
        for (out, value) in out.iter_mut().zip(values) {
            *out = value;
        }
    }
}

impl Registered for CliffWalking {
    const SUMMARY: &'static str = "walk along a cliff to a goal: -1 per step, -100 for a fall";

    const EXAMPLE: Example =
        Example { potential: "0.0 - abs(s.row - s.goal_row) - abs(s.col - s.goal_col)", bins: "" };

    const KWARGS: &'static [KwargSpec] = &[KwargSpec {
        name: "is_slippery",
        kind: KwargKind::Bool,
        default: "false",
        doc: "whether a move may go astray to either side",
    }];

    fn from_kwargs(kwargs: &Kwargs) -> Result<Self, EnvError> {
        Ok(Self::new(kwargs.bool("is_slippery")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_edge_by_hand() {
        let firm = CliffWalking::new(false);
        let mdp = firm.finite().unwrap();
        let outcome = |next_state, reward, terminated| Outcome {
            probability: 1.0,
            next_state,
            reward,
            terminated,
        };
        // From the start: up, over the edge, against both borders; then the last step.
        assert_eq!(mdp.of(36, 0), [outcome(24, -1.0, false)]);
        assert_eq!(mdp.of(36, 1), [outcome(36, -100.0, false)]);
        assert_eq!(mdp.of(36, 2), [outcome(36, -1.0, false)]);
        assert_eq!(mdp.of(36, 3), [outcome(36, -1.0, false)]);
        assert_eq!(mdp.of(35, 2), [outcome(47, -1.0, true)]);

        let slippery = CliffWalking::new(true);
        let next: Vec<_> =
            slippery.finite().unwrap().of(25, 2).iter().map(|o| (o.next_state, o.reward)).collect();
        assert_eq!(next, [(26, -1.0), (36, -100.0), (24, -1.0)]);
    }

    #[test]
    fn a_walker_is_where_its_moves_lead() {
        let mut env = CliffWalking::new(false);
        let mut rng = NumpyRng::from_u64(0);
        env.reset(&mut rng);
        assert_eq!(env.position(), (3, 0));
        for action in [0, 1, 1] {
            env.step(action, &mut rng);
        }
        assert_eq!(env.position(), (2, 2));
    }

    #[test]
    fn scripts_see_the_map() {
        let env = CliffWalking::new(false);
        let mut out = [0.0; 4];
        for (index, letter) in [(0, 'F'), (36, 'S'), (37, 'C'), (46, 'C'), (47, 'G')] {
            env.fields(&env.state(index).unwrap(), &mut out);
            let (row, col) = (index / 12, index % 12);
            let expected = [row as f64, col as f64, index as f64, f64::from(u32::from(letter))];
            assert_eq!(out, expected);
        }
    }
}
