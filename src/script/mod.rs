//! The Rhai host: a script's top level builds a plan; its functions are called while training.
//!
//! - [`load`] → [`Plan`]: compile, run the top level, resolve every variant
//! - [`Host`]: one thread's engine, in which callbacks are called
//! - [`Diagnostic`]: a mistake, with its file, line, column and a suggestion
//! - [`Value`]: what callbacks may capture; plain data that can cross threads and be hashed
//! - [`Tier`]: a callback is run as machine code, or by the interpreter
//!
//! All contact with Rhai's syntax tree is in `syntax` and `lower`, limits are in `engine` and
//! `watch`, every function that scripts can call is listed in [`functions`], every key of an
//! experiment in [`keys`].

mod builders;
mod callback;
pub mod definitions;
mod diagnostic;
mod draft;
mod engine;
mod errors;
mod features;
mod freeze;
pub mod functions;
mod host;
pub mod keys;
mod lower;
mod memory;
mod native;
mod network;
mod numeric;
mod params;
mod plan;
mod prepared;
mod record;
mod resolve;
mod sandbox;
mod setting;
mod shaping;
mod sorting;
mod source;
mod state;
mod syntax;
mod value;
mod watch;
mod world;

pub use callback::Callbacks;
pub(crate) use diagnostic::suggest;
pub use diagnostic::{Diagnostic, Place, Severity};
pub use host::{Host, load};
pub use memory::CountingAllocator;
pub use native::{Reason, Tier, Tiered};
pub use plan::{
    Callback, DiscretiserSpec, Expectation, GoldenBudget, PhiOn, Plan, SeedList, StartFile,
    StartModel, Variant,
};
pub use shaping::{AdviceOn, Shaping};
pub use source::{Snapshot, Source, SourceSet, snapshot};
pub use value::Value;
pub use watch::{read_ledger, start as start_watching};
