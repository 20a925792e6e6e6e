//! Callbacks at the speed of compiled code: a typed intermediate form, its evaluator, and machine
//! code made from it while the program runs.
//!
//! - [`Program`]: a pure function of floats, in the intermediate form ([`ir`])
//! - [`math`]: the mathematical functions that programs call

pub mod ir;
pub mod math;

pub use ir::Program;
