//! The taxi's map, states and transition table.

use crate::mdp::Outcome;

/// Rows of the map.
pub const ROWS: usize = 5;
/// Columns of the map.
pub const COLS: usize = 5;
/// Where passengers are fetched and set down: row and column of R, G, Y, B.
pub const LOCATIONS: [(usize, usize); 4] = [(0, 0), (0, 4), (4, 0), (4, 3)];

pub(super) const N_STATES: usize = ROWS * COLS * 5 * 4;

pub(super) const N_ACTIONS: usize = 6;
const SOUTH: usize = 0;
const NORTH: usize = 1;
const EAST: usize = 2;
const WEST: usize = 3;
const PICKUP: usize = 4;

/// A state of the taxi.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TaxiState {
    /// The taxi's row, from 0 at the top.
    pub row: usize,
    /// The taxi's column, from 0 at the left.
    pub col: usize,
    /// Where the passenger is: an index into [`LOCATIONS`], or [`TaxiState::IN_TAXI`].
    pub passenger: usize,
    /// Where the passenger wants to go: an index into [`LOCATIONS`].
    pub destination: usize,
}

impl TaxiState {
    /// The value of `passenger` in the taxi.
    pub const IN_TAXI: usize = 4;

    /// The state with this index.
    #[inline]
    pub fn decode(index: usize) -> Self {
        let (rest, destination) = (index / 4, index % 4);
        let (cell, passenger) = (rest / 5, rest % 5);
        Self { row: cell / COLS, col: cell % COLS, passenger, destination }
    }

    /// Its index: Gymnasium's observation.
    #[inline]
    pub fn encode(self) -> usize {
        ((self.row * COLS + self.col) * 5 + self.passenger) * 4 + self.destination
    }

    /// Row and column of the passenger, who may be in the taxi.
    #[inline]
    pub fn passenger_place(self) -> (usize, usize) {
        LOCATIONS.get(self.passenger).copied().unwrap_or((self.row, self.col))
    }

    /// Which actions can do anything here, in the order of the actions: Gymnasium's
    /// `action_mask`.
    pub fn action_mask(self) -> [bool; N_ACTIONS] {
        let open = |direction| self.moved(direction).is_some();
        let can_drop = self.passenger == Self::IN_TAXI && self.location().is_some();
        [open(SOUTH), open(NORTH), open(EAST), open(WEST), self.can_pick_up(), can_drop]
    }

    /// The location at which the taxi is.
    fn location(self) -> Option<usize> {
        LOCATIONS.iter().position(|&place| place == (self.row, self.col))
    }

    /// Whether the passenger waits where the taxi is.
    fn can_pick_up(self) -> bool {
        self.passenger != Self::IN_TAXI && self.passenger_place() == (self.row, self.col)
    }

    /// After a move in `direction` (an action), unless a wall or the border is in the way.
    fn moved(self, direction: usize) -> Option<Self> {
        let Self { row, col, .. } = self;
        match direction {
            SOUTH => (row + 1 < ROWS).then(|| Self { row: row + 1, ..self }),
            NORTH => (row > 0).then(|| Self { row: row - 1, ..self }),
            EAST => (!is_walled_to_the_east(row, col)).then(|| Self { col: col + 1, ..self }),
            _ => (col > 0 && !is_walled_to_the_east(row, col - 1))
                .then(|| Self { col: col - 1, ..self }),
        }
    }
}

/// Whether a wall or the border is to the east of a cell.
pub fn is_walled_to_the_east(row: usize, col: usize) -> bool {
    matches!((row, col), (0 | 1, 1) | (3 | 4, 0 | 2)) || col + 1 == COLS
}

/// The probability of each initial state: the passenger waits at one location and wants to another.
pub(super) fn initial() -> Vec<f64> {
    let starts = |state: TaxiState| {
        state.passenger != TaxiState::IN_TAXI && state.passenger != state.destination
    };
    let n = (0..N_STATES).filter(|&s| starts(TaxiState::decode(s))).count() as f64;
    (0..N_STATES).map(|s| if starts(TaxiState::decode(s)) { 1.0 / n } else { 0.0 }).collect()
}

/// The outcomes of every action in every state, those that cannot be reached included:
/// `[state][action][outcome]`. In the rain moves go forward with the probability `rainy`.
pub(super) fn table(rainy: Option<f64>) -> Vec<Vec<Vec<Outcome>>> {
    let outcomes = |state: TaxiState, action: usize| match (action, rainy) {
        (SOUTH..=WEST, None) => vec![drive(1.0, state, action)],
        (SOUTH..=WEST, Some(forward)) => in_the_rain(forward, state, action),
        (PICKUP, _) => vec![pick_up(state)],
        _ => vec![drop_off(state)],
    };
    let row = |s| (0..N_ACTIONS).map(|a| outcomes(TaxiState::decode(s), a)).collect();
    (0..N_STATES).map(row).collect()
}

fn outcome(probability: f64, next: TaxiState, reward: f64, terminated: bool) -> Outcome {
    Outcome { probability, next_state: next.encode() as u32, reward, terminated }
}

fn drive(probability: f64, state: TaxiState, direction: usize) -> Outcome {
    outcome(probability, state.moved(direction).unwrap_or(state), -1.0, false)
}

/// Forward, to the left and to the right, in this order; nowhere at all if the way forward is
/// blocked.
fn in_the_rain(forward: f64, state: TaxiState, direction: usize) -> Vec<Outcome> {
    let aside = (1.0 - forward) / 2.0;
    if state.moved(direction).is_none() {
        return [forward, aside, aside].map(|p| outcome(p, state, -1.0, false)).to_vec();
    }
    let (left, right) = match direction {
        SOUTH => (EAST, WEST),
        NORTH => (WEST, EAST),
        EAST => (NORTH, SOUTH),
        _ => (SOUTH, NORTH),
    };
    vec![drive(forward, state, direction), drive(aside, state, left), drive(aside, state, right)]
}

fn pick_up(state: TaxiState) -> Outcome {
    if state.can_pick_up() {
        outcome(1.0, TaxiState { passenger: TaxiState::IN_TAXI, ..state }, -1.0, false)
    } else {
        outcome(1.0, state, -10.0, false)
    }
}

fn drop_off(state: TaxiState) -> Outcome {
    match state.location().filter(|_| state.passenger == TaxiState::IN_TAXI) {
        Some(here) => {
            let arrived = here == state.destination;
            let reward = if arrived { 20.0 } else { -1.0 };
            outcome(1.0, TaxiState { passenger: here, ..state }, reward, arrived)
        }
        None => outcome(1.0, state, -10.0, false),
    }
}
