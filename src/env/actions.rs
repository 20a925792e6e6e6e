//! Actions whose type is known at run time only, and the table that turns real-valued actions into
//! a choice among a few.
//!
//! Value-based agents choose among `0..n`. An environment whose actions are real numbers
//! (Gymnasium's `Box`) therefore plays the entries of an [`ActionTable`]: action 2 is the third
//! entry. A session plays either: an index, or the numbers themselves.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::error::EnvError;
use crate::mdp::ActionSpace;

/// An action as recordings and rollouts write it: an integer, or a list of numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "an action must be an integer or a list of numbers")]
pub enum PlayedAction {
    /// An index into `Discrete(n)`.
    Index(i64),
    /// One number per component of a `Box`, rounded to float32 when it is played.
    Box(Vec<f64>),
}

impl From<i64> for PlayedAction {
    fn from(index: i64) -> Self {
        Self::Index(index)
    }
}

impl std::fmt::Display for PlayedAction {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Index(index) => index.fmt(f),
            Self::Box(list) => write!(f, "{list:?}"),
        }
    }
}

/// The real-valued actions that a value-based agent chooses among. Clones share the numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct ActionTable {
    /// Numbers per action.
    components: usize,
    /// `[action][component]`, row-major.
    values: Arc<[f32]>,
}

/// The most actions a table may have.
pub const MAX_ACTIONS: usize = 10_000;

impl ActionTable {
    /// A table of `rows` for the box `low..=high` (one bound per component).
    ///
    /// # Errors
    /// If there are no rows or more than [`MAX_ACTIONS`], a row has not one number per component,
    /// or a number is outside its bounds: the environment would clip it, so that two actions were
    /// the same.
    pub fn new(rows: &[Vec<f64>], low: &[f32], high: &[f32]) -> Result<Self, EnvError> {
        let error = |message: String| EnvError::about("actions", message);
        if rows.is_empty() || rows.len() > MAX_ACTIONS {
            let message =
                format!("`actions` must hold 1 to {MAX_ACTIONS} actions, not {}", rows.len());
            return Err(error(message));
        }
        let mut values = Vec::with_capacity(rows.len() * low.len());
        for (i, row) in rows.iter().enumerate() {
            if row.len() != low.len() {
                return Err(error(format!(
                    "an action has {}, but number {i} of `actions` has {}",
                    numbers(low.len()),
                    row.len()
                )));
            }
            for (&x, (&low, &high)) in row.iter().zip(low.iter().zip(high)) {
                // A float32 bound may be written as the decimal that rounds to it.
                let value = x as f32;
                if !(low <= value && value <= high) {
                    return Err(error(format!(
                        "the numbers of an action are between {low} and {high}, but number {i} of \
                         `actions` has {x}"
                    )));
                }
                // The sign of a zero is no difference between actions.
                values.push(value + 0.0);
            }
        }
        let table = Self { components: low.len(), values: values.into() };
        for i in 0..table.len() {
            if let Some(j) = (0..i).find(|&j| table.get(i) == table.get(j)) {
                return Err(error(format!("numbers {j} and {i} of `actions` are the same action")));
            }
        }
        Ok(table)
    }

    /// The table of an environment's own, whose rows are right.
    pub(super) fn of<const N: usize>(rows: &[[f32; N]]) -> Self {
        Self { components: N, values: rows.as_flattened().into() }
    }

    /// Number of actions.
    #[expect(clippy::len_without_is_empty, reason = "a table is never empty")]
    pub fn len(&self) -> usize {
        self.values.len() / self.components
    }

    /// The numbers of action `index` (below [`Self::len`]).
    #[inline]
    pub fn get(&self, index: usize) -> &[f32] {
        &self.values[index * self.components..][..self.components]
    }

    /// The only number of action `index`, where actions have one.
    #[inline]
    pub(super) fn scalar(&self, index: usize) -> f32 {
        self.values[index]
    }

    /// Each action as a name: `-1`, or `1 -0.5`.
    pub fn names(&self) -> Vec<String> {
        (0..self.len())
            .map(|i| self.get(i).iter().map(ToString::to_string).collect::<Vec<_>>().join(" "))
            .collect()
    }
}

fn numbers(n: usize) -> String {
    if n == 1 { "one number".into() } else { format!("{n} numbers") }
}

/// The float32 numbers of a real-valued action, checked.
///
/// # Errors
/// If their count is wrong, or one is not finite: `id` would go on with a state of NaN. Numbers
/// beyond the bounds are played: the environment clips them, as Gymnasium's does.
pub(super) fn checked_box(
    id: &str,
    space: &ActionSpace,
    action: &PlayedAction,
) -> Result<Vec<f32>, EnvError> {
    let ActionSpace::Box { low, high } = space else {
        return Err(EnvError::new(format!(
            "an action of {id} is an integer, not the list {action}"
        )));
    };
    let list = match action {
        PlayedAction::Box(list) if list.len() == low.len() => list,
        _ => {
            let bounds: Vec<_> =
                low.iter().zip(*high).map(|(low, high)| format!("[{low}, {high}]")).collect();
            return Err(EnvError::new(format!(
                "an action of {id} is a list of {} in {}, not {action}",
                numbers(low.len()),
                bounds.join(" × ")
            )));
        }
    };
    let values: Vec<f32> = list.iter().map(|&x| x as f32).collect();
    match values.iter().position(|x| !x.is_finite()) {
        None => Ok(values),
        Some(i) => Err(EnvError::new(format!(
            "the numbers of an action are finite float32, but number {i} of {action} is not"
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_checked() {
        let make = |rows: &[&[f64]]| {
            let rows: Vec<_> = rows.iter().map(|row| row.to_vec()).collect();
            ActionTable::new(&rows, &[-1.0, 0.0], &[1.0, 2.0]).map_err(|e| e.message)
        };
        let table = make(&[&[-1.0, 0.5], &[0.1, -0.0]]).unwrap();
        assert_eq!(
            (table.len(), table.get(0), table.get(1)),
            (2, &[-1.0, 0.5][..], &[0.1, 0.0][..])
        );
        assert_eq!(table.names(), ["-1 0.5", "0.1 0"]);
        for (rows, message) in [
            (&[][..], "`actions` must hold 1 to 10000 actions, not 0"),
            (&[&[0.0][..]], "an action has 2 numbers, but number 0 of `actions` has 1"),
            (
                &[&[0.0, 0.0], &[0.0, 2.5]],
                "the numbers of an action are between 0 and 2, but number 1 of `actions` has 2.5",
            ),
            (
                &[&[f64::NAN, 0.0]],
                "the numbers of an action are between -1 and 1, but number 0 of `actions` has NaN",
            ),
            (
                &[&[0.0, 1.0], &[1.0, 1.0], &[-0.0, 1.0]],
                "numbers 0 and 2 of `actions` are the same action",
            ),
        ] {
            assert_eq!(make(rows).unwrap_err(), message);
        }
    }

    #[test]
    fn played_actions_are_checked() {
        let space = ActionSpace::Box { low: &[-2.0], high: &[2.0] };
        let check = |action: PlayedAction| {
            checked_box("Pendulum-v1", &space, &action).map_err(|e| e.message)
        };
        assert_eq!(check(PlayedAction::Box(vec![3.5])), Ok(vec![3.5]));
        for (action, message) in [
            (
                PlayedAction::Index(1),
                "an action of Pendulum-v1 is a list of one number in [-2, 2], not 1",
            ),
            (
                PlayedAction::Box(vec![0.0, 1.0]),
                "an action of Pendulum-v1 is a list of one number in [-2, 2], not [0.0, 1.0]",
            ),
            (
                PlayedAction::Box(vec![1e300]),
                "the numbers of an action are finite float32, but number 0 of [1e300] is not",
            ),
        ] {
            assert_eq!(check(action).unwrap_err(), message);
        }
    }
}
