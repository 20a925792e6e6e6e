//! Integration tests: one binary, one module a subject.

mod env;
mod language;
mod numbers;
mod parity;
mod scripts;
mod unreadable;
