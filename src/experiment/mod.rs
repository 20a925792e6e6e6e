//! From a plan to results: units, threads, the unit store, resuming, golden files.
//!
//! - [`train`]: the training loop, the same for every environment, agent and shaping
//! - [`run_unit`]: one variant under one seed
//! - [`execute`]: all units of a plan on threads, skipping those already stored
//! - [`start_from`]: networks that are trained further
//! - [`Store`]: one immutable folder per unit, committed by an atomic rename
//! - [`check`]: calls every callback on sampled states before anything is run
//! - [`audit_variant`]: what can be said about a variant's shaping
//! - [`play`]: the greedy policy of a stored unit at play; [`Landscape`]: what it says of states
//! - [`golden`]: a small text that pins down what a script learns

mod assemble;
mod audit;
mod check;
mod endless;
mod execute;
mod further;
pub mod golden;
mod interrupted;
mod landscape;
pub mod play;
mod predict;
mod record;
mod score;
mod shaped;
mod shielded;
mod starts;
mod store;
mod tiers;
mod train;
mod unit;

/// Bytes in hexadecimal.
fn hex(bytes: &[u8]) -> String {
    use std::fmt::Write;
    bytes.iter().fold(String::with_capacity(2 * bytes.len()), |mut text, b| {
        write!(text, "{b:02x}").expect("writing to a string does not fail");
        text
    })
}

pub use audit::{
    Audit, AuditVerdict, Continuous, Exact, Naming, SampledModel, Thorough, TrueReturn,
    audit_variant,
};
pub use check::{Checked, check};
pub use execute::{ExecuteError, Execution, Finished, Progress, execute};
pub use further::start_from;
pub use interrupted::Resumable;
pub use landscape::{Landscape, ListedState};
pub use predict::has_exact_values;
pub use record::{EpisodeRow, Learned, StartValue, StateValues, UnitRecord, Values};
pub use score::{Scored, score_variant};
pub use store::{
    Checkpoint, Model, Store, StoreError, StoredUnit, holds_model, holds_weights, read_model,
    read_table, read_weights, write_atomically, write_atomically_with,
};
pub use tiers::{CallbackTier, tiers};
pub use train::{Limits, Solved, TrainError, World, train};
pub use unit::{SEMANTICS, Unit, UnitError, resume_unit, run_unit, units};
