//! The machine code of callbacks, to be looked at:
//! `cargo test --lib jit::tests::listing -- --nocapture`.
#![cfg(feature = "jit")]
#![allow(clippy::print_stderr)]
use super::programs::{cells, height, one_line, quadratic, reward};
#[test]
fn looks() {
    for p in [one_line(), quadratic(), reward(), height(), cells()] {
        eprintln!("{}", crate::jit::machine::listing(&p));
    }
}
