//! The greedy policy of a stored unit at play: no exploration, no learning, the native rewards.
//!
//! An episode is played in a [`Session`], under the variant's time limit. Its states go through
//! the variant's discretiser, and the action is the first within the tie tolerance of the best
//! among those that the shield allows ([`argmax_allowed`]). Where nothing was learned all values are the initial one, so that the first
//! action is played, which is what greedy choice did in training too. An action is repeated for as
//! many steps as the variant's `frame_skip` says.

use super::landscape::{Locate, Lookup};
use super::store::Model;
use crate::env::rollout::{Event, Length, RolloutError, drive};
use crate::env::{EnvError, PlayedAction, Session};
use crate::learn::{LinearQ, QTable, argmax_allowed};
use crate::mdp::numpy::Seed;
use crate::mdp::{Action, Ending};
use crate::script::{Host, Variant};
use crate::shaping::{ActionSet, Fault, ShieldFn, Shielded};

/// A greedy policy.
pub struct Policy {
    values: Lookup,
    shield: Option<ShieldFn>,
    /// For how many steps an action is played.
    frame_skip: u32,
    /// The action that is played now.
    held: Action,
}

impl Policy {
    /// The policy of `variant` that is greedy with respect to `q`, the table (or the weights) of
    /// one of its units.
    pub fn new(host: &Host, variant: &Variant, session: &Session, q: QTable) -> Self {
        let values = Lookup::new(host, variant, session.schema(), q);
        Self::shielded(host, variant, session, values)
    }

    /// The policy of `variant` that is greedy with respect to a network of one of its units.
    pub fn of_network(host: &Host, variant: &Variant, session: &Session, model: Model) -> Self {
        let values = Lookup::network(model.net, model.inputs);
        Self::shielded(host, variant, session, values)
    }

    fn shielded(host: &Host, variant: &Variant, session: &Session, values: Lookup) -> Self {
        let (schema, frame_skip) = (session.schema(), variant.frame_skip);
        let shield = |allowed| host.callbacks().shield(allowed, schema.actions.len(), schema);
        Self { values, shield: variant.allowed.as_ref().map(shield), frame_skip, held: 0 }
    }

    /// The policy of a table that has one row per state of a finite environment.
    pub fn of_states(q: QTable) -> Self {
        let values = Lookup::Table(Locate::Index, q);
        Self { values, shield: None, frame_skip: 1, held: 0 }
    }

    /// The policy of values that are linear in features; an action is played for `frame_skip` steps.
    pub fn of_weights(q: LinearQ, frame_skip: u32) -> Self {
        Self { values: Lookup::linear(q), shield: None, frame_skip, held: 0 }
    }

    /// The policy of a network that fits the session.
    pub fn of_model(model: Model) -> Self {
        let Model { net, inputs, frame_skip, .. } = model;
        Self { values: Lookup::network(net, inputs), shield: None, frame_skip, held: 0 }
    }

    /// The action for the session's present state.
    ///
    /// # Errors
    /// If a scripted discretiser or shield fails.
    pub fn action(&mut self, session: &Session) -> Result<PlayedAction, RolloutError> {
        if session.elapsed().is_multiple_of(self.frame_skip) {
            let failed = |f: Fault| RolloutError::Policy(f.0);
            let allowed = match &mut self.shield {
                Some(shield) => shield.at(session.fields()).map_err(failed)?,
                None => ActionSet::ALL,
            };
            let row = self.values.present(session).map_err(failed)?;
            self.held = argmax_allowed(row, Shielded { cell: 0, allowed });
        }
        Ok(session.action(self.held))
    }
}

/// The environment of `variant` under its time limit.
///
/// # Errors
/// If it cannot be made (it could when the plan was resolved).
pub fn session(variant: &Variant) -> Result<Session, EnvError> {
    let limit = variant.max_steps.map_or(-1, i64::from);
    Session::of(variant.env, &variant.config)?.with_max_episode_steps(limit)
}

/// One episode that was played.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlayedEpisode {
    /// The environment's steps.
    pub steps: u64,
    /// Its native return, undiscounted.
    pub native: f64,
    /// How it ended; `None` if play stopped before it did.
    pub ending: Option<Ending>,
}

/// Plays `policy` from a reset with `seed`; further episodes go on with the same random stream, as
/// in training. `each` hears of every reset and step, with the session as it then is.
///
/// # Errors
/// If a scripted discretiser fails, and what `each` reports.
///
/// # Panics
/// Never: a step follows a reset.
pub fn play(
    session: &mut Session,
    policy: &mut Policy,
    seed: &Seed,
    length: Length,
    mut each: impl FnMut(&Session, Event<'_>) -> Result<(), RolloutError>,
) -> Result<Vec<PlayedEpisode>, RolloutError> {
    let mut episodes: Vec<PlayedEpisode> = Vec::new();
    let policy = |session: &Session, _: &_| policy.action(session);
    drive(session, seed, length, policy, |session, event| {
        match event {
            Event::Reset { .. } => {
                episodes.push(PlayedEpisode { steps: 0, native: 0.0, ending: None });
            }
            Event::Step { step, .. } => {
                let episode = episodes.last_mut().expect("a step follows a reset");
                episode.steps += 1;
                episode.native += step.reward;
                // Where the time limit is reached by a terminating step, termination counts, as in
                // training.
                episode.ending = match (step.terminated, step.truncated) {
                    (true, _) => Some(Ending::Terminated),
                    (false, true) => Some(Ending::Truncated),
                    (false, false) => None,
                };
            }
        }
        each(session, event)
    })?;
    Ok(episodes)
}
