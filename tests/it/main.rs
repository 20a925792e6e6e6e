//! Integration tests: one binary, one module a subject.

mod env;
mod parity;
mod scripts;
