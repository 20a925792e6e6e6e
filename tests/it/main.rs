//! Integration tests: one binary, one module a subject.

mod cli;
mod crash;
mod env;
mod floors;
mod frozen_lake;
mod golden;
mod parity;
mod readme;
mod shaping;
mod support;
mod wiewiora;
