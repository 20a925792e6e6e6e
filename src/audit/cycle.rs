//! The loops that a policy stays in.

use serde::Serialize;

use crate::learn::planning::{Dynamics, PlanError, Policy};
use crate::mdp::Action;

/// A set of states that a policy never leaves.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cycle {
    /// The states: in the order in which they are visited if each leads to the next for sure (and
    /// the last to the first), else in rising order.
    pub states: Vec<usize>,
    /// What is played in each.
    pub actions: Vec<Action>,
    /// Whether each state leads to the next for sure.
    pub deterministic: bool,
    /// The learned reward, native and added, per turn if deterministic, else per step on average.
    pub gain: f64,
    /// The native reward alone, likewise.
    pub native: f64,
}

impl Cycle {
    /// The loop of `policy` (by place) on the places of one of its recurrent sets, for `learned`
    /// and `native` rewards per pair.
    ///
    /// # Errors
    /// If the averages cannot be computed.
    pub(super) fn new(
        dynamics: &Dynamics,
        [learned, native]: [&[f64]; 2],
        policy: &[Action],
        recurrent: &[usize],
    ) -> Result<Self, PlanError> {
        let pair = |place: usize| place * dynamics.n_actions() + policy[place];
        let next = |place: usize| dynamics.next(pair(place)).0;
        let deterministic = recurrent.iter().all(|&place| next(place).len() == 1);
        let (mut places, mut totals) = (recurrent.to_vec(), [0.0; 2]);
        if deterministic {
            for i in 1..places.len() {
                places[i] = next(places[i - 1])[0] as usize;
            }
            totals =
                [learned, native].map(|rewards| places.iter().map(|&p| rewards[pair(p)]).sum());
        } else {
            for (total, rewards) in totals.iter_mut().zip([learned, native]) {
                let policy = Policy::Deterministic(policy);
                *total = dynamics.average(rewards, policy, recurrent)?;
            }
        }
        Ok(Self {
            states: places.iter().map(|&place| dynamics.state(place)).collect(),
            actions: places.iter().map(|&place| policy[place]).collect(),
            deterministic,
            gain: totals[0],
            native: totals[1],
        })
    }
}
