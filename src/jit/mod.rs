//! Callbacks at the speed of compiled code: a typed intermediate form, its evaluator, and machine
//! code made from it while the program runs.
//!
//! - [`Program`]: a pure function of floats, in the intermediate form ([`ir`])
//! - [`Program::check`]: whether it is well formed
//! - [`Program::evaluate`]: runs it as it stands
//! - [`Kernel`]: runs it as fast as this host can, as machine code if there is any
//! - [`math`]: the mathematical functions that programs call

mod check;
mod eval;
pub mod ir;
mod kernel;
#[cfg(feature = "jit")]
mod machine;
pub mod math;

#[cfg(test)]
mod tests;

pub use check::Invalid;
pub use eval::Value;
pub use ir::Program;
pub use kernel::{Kernel, Output};

use std::sync::atomic::{AtomicBool, Ordering};

static DISABLED: AtomicBool = AtomicBool::new(false);

/// Leaves all callbacks of this process to the interpreter from now on.
pub fn disable() {
    DISABLED.store(true, Ordering::Relaxed);
}

/// Whether callbacks may be run as programs: [`disable`] has not been called.
pub fn is_enabled() -> bool {
    !DISABLED.load(Ordering::Relaxed)
}
