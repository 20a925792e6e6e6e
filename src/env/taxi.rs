//! `Taxi-v4`: fetch a passenger and set them down where they want to go (Dietterich 2000). The
//! transition table is Gymnasium 1.4.0's, in its order, so that a seed gives the same trajectory.
//!
//! ```text
//! +---------+
//! |R: | : :G|     R (0, 0), G (0, 4), Y (4, 0), B (4, 3): row and column.
//! | : | : : |     | is a wall.
//! | : : : : |
//! | | : | : |
//! |Y| : |B: |
//! +---------+
//! ```
//!
//! # Action Space
//! `Discrete(6)`: 0 south, 1 north, 2 east, 3 west, 4 pickup, 5 dropoff. A move against a wall or
//! the border stays where it is. [`TaxiState::action_mask`] says which actions can do anything, and
//! rollouts print it.
//!
//! # Observation Space
//! `Discrete(500)`: `((row * 5 + col) * 5 + passenger) * 4 + destination`. Scripts see the fields
//!
//! | # | field | values |
//! |---|---|---|
//! | 0, 1 | `row`, `col` | of the taxi, 0 to 4 |
//! | 2 | `passenger` | 0 R, 1 G, 2 Y, 3 B, 4 in the taxi |
//! | 3 | `destination` | 0 R, 1 G, 2 Y, 3 B |
//! | 4 | `index` | the state index |
//! | 5 | `in_taxi` | 1 if the passenger is in the taxi, else 0 |
//! | 6, 7 | `passenger_row`, `passenger_col` | where the passenger is (the taxi's, inside it) |
//! | 8, 9 | `destination_row`, `destination_col` | where the passenger wants to go |
//!
//! and the facts `rows`, `cols`.
//!
//! # Rewards
//! 20 for setting the passenger down at the destination, -10 for a pickup or dropoff that is not
//! possible, -1 for everything else.
//!
//! # Starting State
//! Any place of the taxi, any two different locations of passenger and destination, all with the
//! same probability.
//!
//! # Episode End
//! Terminated when the passenger is set down at the destination. Truncated after 200 steps.
//!
//! # Arguments
//! - `is_rainy` (false): whether a move may go astray to either side
//! - `fickle_passenger` (false): whether a passenger may change the destination, once per episode
//! - `rainy_probability` (0.8): the probability of the intended direction in the rain; each side has
//!   half of the rest
//! - `fickle_probability` (0.3): the probability that the passenger of an episode is one to do so:
//!   with the first move away from where they got in
//!
//! With a fickle passenger there is no model: what a step may do depends on whether the passenger
//! still intends to change the destination, which the state does not show.
//!
//! # Exactness
//! Exact: the table's probabilities, rewards, order, every draw, and the action masks.
//!
//! Deviations (an error here):
//! 1. A `rainy_probability` or `fickle_probability` outside [0, 1]: Gymnasium samples from what are
//!    no probabilities.

mod draw;
mod table;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use table::N_ACTIONS;
pub use table::{COLS, LOCATIONS, ROWS, TaxiState, is_walled_to_the_east};

use super::error::EnvError;
use super::kwargs::{KwargKind, KwargSpec, Kwargs};
use super::registered::{ActionMask, Example, Registered};
use crate::mdp::numpy::NumpyRng;
use crate::mdp::{Action, Env, Field, FieldKind, FiniteEnv, FiniteMdp, FiniteState, Schema, Step};

/// What may go otherwise than intended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Whims {
    /// The probability of the intended direction in the rain, in [0, 1]; `None` if it is dry.
    pub rainy: Option<f64>,
    /// The probability of an episode with a fickle passenger, in [0, 1]; `None` if there are none.
    pub fickle: Option<f64>,
}

/// The taxi. Clones share the model.
#[derive(Debug, Clone)]
pub struct Taxi {
    env: FiniteEnv,
    fickle: Option<f64>,
    /// Whether the passenger is still to change the destination in this episode.
    will_change: bool,
}

impl Taxi {
    /// A taxi to be reset first.
    ///
    /// # Errors
    /// If a probability is outside [0, 1].
    pub fn new(whims: &Whims) -> Result<Self, EnvError> {
        let probabilities =
            [("rainy_probability", whims.rainy), ("fickle_probability", whims.fickle)];
        for (name, probability) in probabilities {
            check_probability(name, probability.unwrap_or(0.0))?;
        }
        let mdp = FiniteMdp::new(&table::table(whims.rainy), table::initial())?;
        let env = FiniteEnv::new(Arc::new(mdp));
        Ok(Self { env, fickle: whims.fickle, will_change: false })
    }

    /// The state it is in.
    pub fn now(&self) -> TaxiState {
        TaxiState::decode(self.env.state() as usize)
    }

    /// After a step from state `before`: changes the destination if this is the moment to do so.
    #[cold]
    fn change_destination(&mut self, before: TaxiState, rng: &mut NumpyRng) {
        let after = self.now();
        let moved = (before.row, before.col) != (after.row, after.col);
        if before.passenger == TaxiState::IN_TAXI && moved {
            self.will_change = false;
            // One of the three others, in order.
            let choice = rng.choice_index(LOCATIONS.len() - 1);
            let destination = choice + usize::from(choice >= before.destination);
            self.env.move_to(TaxiState { destination, ..after }.encode() as u32);
        }
    }
}

fn check_probability(name: &str, probability: f64) -> Result<(), EnvError> {
    if (0.0..=1.0).contains(&probability) {
        return Ok(());
    }
    let message = format!("`{name}` must be between 0 and 1, not {probability}");
    Err(EnvError::about(name, message))
}

impl Env for Taxi {
    type Obs = FiniteState;

    const INDEXED: bool = true;

    fn n_actions(&self) -> usize {
        N_ACTIONS
    }

    #[inline]
    fn reset(&mut self, rng: &mut NumpyRng) -> FiniteState {
        let obs = self.env.reset(rng);
        if let Some(probability) = self.fickle {
            self.will_change = rng.random() < probability;
        }
        obs
    }

    #[inline]
    fn step(&mut self, action: Action, rng: &mut NumpyRng) -> Step<FiniteState> {
        let before = self.env.state();
        let (mut obs, outcome) = self.env.step(action, rng);
        let (reward, terminated) = (outcome.reward, outcome.terminated);
        if self.will_change {
            self.change_destination(TaxiState::decode(before as usize), rng);
            obs.index = self.env.state();
        }
        Step { obs, reward, terminated }
    }

    fn finite(&self) -> Option<&Arc<FiniteMdp>> {
        self.fickle.is_none().then(|| self.env.mdp())
    }

    fn n_states(&self) -> Option<usize> {
        Some(self.env.mdp().n_states())
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
        let known = self.fickle.is_none() && obs.outcome != FiniteState::START;
        known.then_some(obs.outcome as usize)
    }

    fn schema(&self) -> Schema {
        Schema {
            fields: vec![
                Field::int("row", "row of the taxi, from 0 at the top", 0, ROWS - 1),
                Field::int("col", "column of the taxi, from 0 at the left", 0, COLS - 1),
                Field::int("passenger", "0 R, 1 G, 2 Y, 3 B, 4 in the taxi", 0, 4),
                Field::int("destination", "0 R, 1 G, 2 Y, 3 B", 0, 3),
                Field::int(
                    "index",
                    "state index: ((row * 5 + col) * 5 + passenger) * 4 + destination",
                    0,
                    table::N_STATES - 1,
                ),
                Field::int("in_taxi", "1 if the passenger is in the taxi, else 0", 0, 1),
                Field::int("passenger_row", "row of the passenger", 0, ROWS - 1),
                Field::int("passenger_col", "column of the passenger", 0, COLS - 1),
                Field::int("destination_row", "row of the destination", 0, ROWS - 1),
                Field::int("destination_col", "column of the destination", 0, COLS - 1),
            ],
            facts: vec![
                ("rows", FieldKind::Int, ROWS as f64),
                ("cols", FieldKind::Int, COLS as f64),
            ],
            actions: ["south", "north", "east", "west", "pickup", "dropoff"].map(Into::into).into(),
            grid: None,
        }
    }

    #[inline]
    fn fields(&self, obs: &FiniteState, out: &mut [f64]) {
        let index = obs.index as usize;
        let state = TaxiState::decode(index);
        let TaxiState { row, col, passenger, destination } = state;
        let (passenger_row, passenger_col) = state.passenger_place();
        let (destination_row, destination_col) = LOCATIONS[destination];
        let values = [
            row,
            col,
            passenger,
            destination,
            index,
            usize::from(passenger == TaxiState::IN_TAXI),
            passenger_row,
            passenger_col,
            destination_row,
            destination_col,
        ];
        for (out, value) in out.iter_mut().zip(values) {
            *out = value as f64;
        }
    }
}

impl Registered for Taxi {
    const SUMMARY: &'static str = "fetch a passenger and set them down at their destination";

    const EXAMPLE: Example = Example {
        potential: "0.0 - abs(s.row - s.passenger_row) - abs(s.col - s.passenger_col) \
                    - abs(s.passenger_row - s.destination_row) \
                    - abs(s.passenger_col - s.destination_col)",
        bins: "",
    };

    const KWARGS: &'static [KwargSpec] = &[
        KwargSpec {
            name: "is_rainy",
            kind: KwargKind::Bool,
            default: "false",
            doc: "whether a move may go astray to either side",
        },
        KwargSpec {
            name: "fickle_passenger",
            kind: KwargKind::Bool,
            default: "false",
            doc: "whether a passenger may change the destination on the way",
        },
        KwargSpec {
            name: "rainy_probability",
            kind: KwargKind::Float,
            default: "0.8",
            doc: "probability of the intended direction in the rain, in [0, 1]",
        },
        KwargSpec {
            name: "fickle_probability",
            kind: KwargKind::Float,
            default: "0.3",
            doc: "probability that a passenger changes the destination, in [0, 1]",
        },
    ];

    fn from_kwargs(kwargs: &Kwargs) -> Result<Self, EnvError> {
        let probability = |name| {
            let probability = kwargs.float(name);
            // Also where it has no effect: a mistake is one all the same.
            check_probability(name, probability).map(|()| probability)
        };
        let rainy = probability("rainy_probability")?;
        let fickle = probability("fickle_probability")?;
        Self::new(&Whims {
            rainy: kwargs.bool("is_rainy").then_some(rainy),
            fickle: kwargs.bool("fickle_passenger").then_some(fickle),
        })
    }

    fn probability(&self, obs: &FiniteState) -> Option<f64> {
        // Gymnasium gives the table's, also where a fickle passenger interferes.
        self.env.mdp().outcomes().get(obs.outcome as usize).map(|outcome| outcome.probability)
    }

    fn action_mask(&self, obs: &FiniteState) -> Option<ActionMask> {
        Some(ActionMask(TaxiState::decode(obs.index as usize).action_mask().to_vec()))
    }
}
