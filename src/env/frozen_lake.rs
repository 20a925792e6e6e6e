//! `FrozenLake-v1` and `FrozenLake8x8-v1`: cross slippery ice without falling into a hole. The
//! transition table is Gymnasium 1.4.0's, in its order, so that a seed gives the same trajectory.
//!
//! # Action Space
//! `Discrete(4)`: 0 left, 1 down, 2 right, 3 up. A move against the border stays where it is.
//!
//! # Observation Space
//! `Discrete(rows * cols)`: `row * cols + col`. Scripts see the fields `row`, `col`, `index`,
//! `tile` (a one-letter string), and the facts `rows`, `cols` and, if the map has a goal,
//! `goal_row`, `goal_col` (of the first goal in reading order).
//!
//! # Rewards
//! By the tile that is entered: `reward_schedule[0]` for a goal `G`, `[1]` for a hole `H`, `[2]`
//! for anything else; by default 1, 0, 0.
//!
//! # Starting State
//! A tile `S`, each with the same probability.
//!
//! # Episode End
//! Terminated on entering `G` or `H`. Truncated after 100 steps (`FrozenLake8x8-v1`: 200).
//!
//! # Arguments
//! - `desc` (null): the map, one string per row; goes before `map_name`. [`generate_random_map`]
//!   draws one
//! - `map_name` ("4x4"): "4x4" or "8x8"
//! - `is_slippery` (true): whether a move may go astray to either side, at right angles
//! - `success_rate` (1/3): the probability of the intended direction, if slippery; each side has
//!   half of the rest
//! - `reward_schedule` ([1, 0, 0])
//!
//! # Exactness
//! Exact: the table's probabilities, rewards, order and the one draw per reset and step.
//!
//! Deviations (each one an error here):
//! 1. `desc` and `map_name` both null: Gymnasium draws a map that no seed can repeat.
//! 2. A map without an `S`: Gymnasium divides 0 by 0 and starts in state 0.
//! 3. A tile other than a capital letter: Gymnasium takes any character for ice, a mistyped `g`
//!    included. Capital letters other than S, G and H are ice here as well.
//! 4. A `success_rate` outside [0, 1]: Gymnasium samples from what are no probabilities.
//! 5. A `reward_schedule` that is not three finite numbers: Gymnasium ignores a fourth.

mod draw;
mod random_map;

use std::sync::Arc;

pub use random_map::{MAX_TILES, generate_random_map, random_map_within};

use super::error::EnvError;
use super::kwargs::{KwargKind, KwargSpec, Kwargs};
use super::registered::{Example, Registered};
use crate::mdp::numpy::NumpyRng;
use crate::mdp::{
    Action, Env, Field, FieldKind, FiniteEnv, FiniteMdp, FiniteState, Grid, Outcome, Schema, Step,
};

/// The maps that have names.
const MAPS: [(&str, &[&str]); 2] = [
    ("4x4", &["SFFF", "FHFH", "FFFH", "HFFG"]),
    (
        "8x8",
        &[
            "SFFFFFFF", "FFFFFFFF", "FFFHFFFF", "FFFFFHFF", "FFFHFFFF", "FHHFFFHF", "FHFFHFHF",
            "FFFHFFFG",
        ],
    ),
];
const LEFT: usize = 0;
const DOWN: usize = 1;
const RIGHT: usize = 2;
const UP: usize = 3;
const N_ACTIONS: usize = 4;

/// What a move on the ice does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ice {
    /// Whether a move may go astray at all.
    pub is_slippery: bool,
    /// The probability of the intended direction, in [0, 1].
    pub success_rate: f64,
    /// The rewards of entering a goal, a hole, anything else.
    pub reward_schedule: [f64; 3],
}

impl Default for Ice {
    fn default() -> Self {
        Self { is_slippery: true, success_rate: 1.0 / 3.0, reward_schedule: [1.0, 0.0, 0.0] }
    }
}

/// The lake. Clones share the map and the model.
#[derive(Debug, Clone)]
pub struct FrozenLake {
    env: FiniteEnv,
    map: Arc<Map>,
}

impl FrozenLake {
    /// Builds the model of a map with rows `desc`.
    ///
    /// # Errors
    /// If `desc` is no map (see the deviations above), or a number of `ice` is out of its range.
    pub fn new(desc: &[String], ice: &Ice) -> Result<Self, EnvError> {
        let map = Map::parse(desc)?;
        let rate = ice.success_rate;
        if !(0.0..=1.0).contains(&rate) {
            let message = format!("`success_rate` must be between 0 and 1, not {rate}");
            return Err(EnvError::about("success_rate", message));
        }
        if let Some(bad) = ice.reward_schedule.iter().find(|reward| !reward.is_finite()) {
            let message = format!("`reward_schedule` must hold finite numbers, not {bad}");
            return Err(EnvError::about("reward_schedule", message));
        }
        let mdp = FiniteMdp::new(&map.table(ice), map.initial())?;
        Ok(Self { env: FiniteEnv::new(Arc::new(mdp)), map: Arc::new(map) })
    }
}

/// A rectangle of tiles.
#[derive(Debug)]
struct Map {
    rows: usize,
    cols: usize,
    /// ASCII capitals, in reading order: one per state.
    tiles: Vec<u8>,
}

impl Map {
    fn parse(desc: &[String]) -> Result<Self, EnvError> {
        let error = |message: String| EnvError::about("desc", message);
        let cols = desc.first().map_or(0, |row| row.chars().count());
        if cols < 2 {
            let given = if desc.is_empty() { "no rows" } else { "a first row that is shorter" };
            return Err(error(format!(
                "`desc` must have at least one row of at least two tiles, not {given}"
            )));
        }
        for (i, row) in desc.iter().enumerate() {
            let width = row.chars().count();
            if width != cols {
                return Err(error(format!(
                    "the rows of `desc` must be equally long: row {i} (`{row}`) has {width} tiles, \
                     row 0 has {cols}"
                )));
            }
            if let Some(bad) = row.chars().find(|tile| !tile.is_ascii_uppercase()) {
                let error = error(format!(
                    "a tile of `desc` must be a capital letter (S start, G goal, H hole, F ice), \
                     not `{bad}` in row {i} (`{row}`)"
                ));
                return Err(if bad.is_ascii_lowercase() {
                    error.hint(format!("did you mean `{}`?", bad.to_ascii_uppercase()))
                } else {
                    error
                });
            }
        }
        let tiles: Vec<u8> = desc.iter().flat_map(|row| row.bytes()).collect();
        if !tiles.contains(&b'S') {
            return Err(error("`desc` must have a start tile `S`".into()));
        }
        Ok(Self { rows: desc.len(), cols, tiles })
    }

    /// Where a move in `direction` from state `s` ends: a state.
    fn neighbour(&self, s: usize, direction: usize) -> usize {
        let (row, col) = (s / self.cols, s % self.cols);
        let (row, col) = match direction {
            LEFT => (row, col.saturating_sub(1)),
            DOWN => ((row + 1).min(self.rows - 1), col),
            RIGHT => (row, (col + 1).min(self.cols - 1)),
            UP => (row.saturating_sub(1), col),
            _ => unreachable!("there are four directions"),
        };
        row * self.cols + col
    }

    /// The outcomes of every action in every state: `[state][action][outcome]`.
    fn table(&self, ice: &Ice) -> Vec<Vec<Vec<Outcome>>> {
        let [goal, hole, frozen] = ice.reward_schedule;
        let slide = (1.0 - ice.success_rate) / 2.0;
        let enter = |probability: f64, s: usize, direction: usize| {
            let next = self.neighbour(s, direction);
            let (reward, terminated) = match self.tiles[next] {
                b'G' => (goal, true),
                b'H' => (hole, true),
                _ => (frozen, false),
            };
            Outcome { probability, next_state: next as u32, reward, terminated }
        };
        let outcomes = |s: usize, a: usize| {
            if matches!(self.tiles[s], b'G' | b'H') {
                // The end of the episode leads to itself, and its reward is not the schedule's.
                let next_state = s as u32;
                return vec![Outcome {
                    probability: 1.0,
                    next_state,
                    reward: 0.0,
                    terminated: true,
                }];
            }
            if !ice.is_slippery {
                return vec![enter(1.0, s, a)];
            }
            // Outcomes are sampled in this order, and those of probability 0 stay in the list.
            vec![
                enter(slide, s, (a + N_ACTIONS - 1) % N_ACTIONS),
                enter(ice.success_rate, s, a),
                enter(slide, s, (a + 1) % N_ACTIONS),
            ]
        };
        (0..self.tiles.len()).map(|s| (0..N_ACTIONS).map(|a| outcomes(s, a)).collect()).collect()
    }

    /// One probability per state.
    fn initial(&self) -> Vec<f64> {
        let mut shares: Vec<f64> =
            self.tiles.iter().map(|&tile| f64::from(u8::from(tile == b'S'))).collect();
        let starts: f64 = shares.iter().sum();
        for share in &mut shares {
            *share /= starts;
        }
        shares
    }
}

impl Env for FrozenLake {
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
        let Map { rows, cols, tiles } = &*self.map;
        let (rows, cols) = (*rows, *cols);
        let mut facts =
            vec![("rows", FieldKind::Int, rows as f64), ("cols", FieldKind::Int, cols as f64)];
        if let Some(goal) = tiles.iter().position(|&tile| tile == b'G') {
            facts.push(("goal_row", FieldKind::Int, (goal / cols) as f64));
            facts.push(("goal_col", FieldKind::Int, (goal % cols) as f64));
        }
        let text = |row: &[u8]| row.iter().map(|&tile| char::from(tile)).collect();
        Schema {
            fields: vec![
                Field::int("row", "row, from 0 at the top", 0, rows - 1),
                Field::int("col", "column, from 0 at the left", 0, cols - 1),
                Field::int("index", "state index: row * cols + col", 0, tiles.len() - 1),
                Field {
                    name: "tile",
                    kind: FieldKind::Letter,
                    doc: "the map's letter: S start, F ice, H hole, G goal",
                    low: f64::from(b'A'),
                    high: f64::from(b'Z'),
                },
            ],
            facts,
            actions: ["left", "down", "right", "up"].map(Into::into).into(),
            grid: Some(Grid {
                rows: tiles.chunks(cols).map(text).collect(),
                arrows: &['←', '↓', '→', '↑'],
            }),
        }
    }

    #[inline]
    fn fields(&self, obs: &FiniteState, out: &mut [f64]) {
        let index = obs.index as usize;
        let Map { cols, tiles, .. } = &*self.map;
        let values =
            [(index / cols) as f64, (index % cols) as f64, index as f64, f64::from(tiles[index])];
        for (out, value) in out.iter_mut().zip(values) {
            *out = value;
        }
    }
}

impl Registered for FrozenLake {
    const SUMMARY: &'static str = "cross slippery ice to a goal without falling into a hole";

    const EXAMPLE: Example = Example {
        potential: "1.0 - 0.05 * (abs(s.row - s.goal_row) + abs(s.col - s.goal_col))",
        bins: "",
    };

    const KWARGS: &'static [KwargSpec] = &[
        KwargSpec {
            name: "desc",
            kind: KwargKind::Rows,
            default: "null",
            doc: "the map, one string per row (S start, F ice, H hole, G goal); before map_name",
        },
        KwargSpec {
            name: "map_name",
            kind: KwargKind::Name(&["4x4", "8x8"]),
            default: "\"4x4\"",
            doc: "a map that has a name",
        },
        KwargSpec {
            name: "is_slippery",
            kind: KwargKind::Bool,
            default: "true",
            doc: "whether a move may go astray to either side",
        },
        KwargSpec {
            name: "success_rate",
            kind: KwargKind::Float,
            // The double nearest to one third, as Python prints it.
            default: "0.3333333333333333",
            doc: "probability of the intended direction on slippery ice, in [0, 1]",
        },
        KwargSpec {
            name: "reward_schedule",
            kind: KwargKind::Floats(3),
            default: "[1, 0, 0]",
            doc: "rewards of entering a goal, a hole, anything else",
        },
    ];

    fn from_kwargs(kwargs: &Kwargs) -> Result<Self, EnvError> {
        let named = |name: &str| {
            let (_, rows) = MAPS.iter().find(|(known, _)| *known == name)?;
            Some(rows.iter().map(|&row| row.to_owned()).collect())
        };
        let desc = kwargs.rows("desc").or_else(|| kwargs.name("map_name").and_then(named));
        let Some(desc) = desc else {
            let message = "`desc` and `map_name` must not both be null: there is no map";
            return Err(EnvError::about("map_name", message)
                .hint("Gymnasium would draw a map that no seed can repeat; give one as `desc`"));
        };
        let mut reward_schedule = [0.0; 3];
        reward_schedule.copy_from_slice(&kwargs.floats("reward_schedule"));
        let ice = Ice {
            is_slippery: kwargs.bool("is_slippery"),
            success_rate: kwargs.float("success_rate"),
            reward_schedule,
        };
        Self::new(&desc, &ice)
    }
}

#[cfg(test)]
mod tests;
