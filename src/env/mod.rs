//! The environments: one file each, one line each in the registry.
//!
//! - [`registry`]: [`specs`], [`find`], [`make`]: from an id and arguments to an [`AnyEnv`], and by
//!   an [`EnvVisitor`] to static dispatch
//! - [`cart_pole`], [`mountain_car`], [`mountain_car_continuous`], [`acrobot`], [`pendulum`],
//!   [`lunar_lander`], [`frozen_lake`], [`cliff_walking`], [`taxi`], [`blackjack`]: the dynamics,
//!   documented under Gymnasium's headings
//! - [`Registered`]: what an environment provides beyond its dynamics; [`KwargSpec`], [`Kwargs`]:
//!   its constructor's arguments; [`EnvError`]: what can be wrong with them
//! - [`ActionTable`]: real-valued actions for agents that choose among a few; [`PlayedAction`]: an
//!   action of either kind
//! - [`EnvConfig`]: everything that may be said about an instance
//! - [`Session`]: an environment as `gymnasium.make` returns it, dynamic, with its time limit
//! - [`scene`]: what an environment looks like
//! - [`rollout`]: an episode as JSON lines; [`recording`]: replaying recorded trajectories

pub mod acrobot;
mod actions;
mod any;
pub mod blackjack;
mod bounds;
pub mod cart_pole;
pub mod cliff_walking;
mod config;
mod error;
pub mod frozen_lake;
mod kwargs;
pub mod lunar_lander;
pub mod mountain_car;
pub mod mountain_car_continuous;
pub mod pendulum;
pub mod recording;
mod registered;
pub mod registry;
pub mod rollout;
pub mod scene;
mod session;
pub mod taxi;

pub use actions::{ActionTable, MAX_ACTIONS, PlayedAction};
pub use config::EnvConfig;
pub use error::EnvError;
pub use kwargs::{KwargKind, KwargSpec, Kwargs};
pub use registered::{ActionMask, Example, Observation, Registered};
pub use registry::{AnyEnv, EnvSpec, EnvVisitor, find, find_with_note, make, specs};
pub use session::{Session, SessionStep, time_limit};
