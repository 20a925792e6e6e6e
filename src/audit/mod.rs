//! Exact statements about shaping, on finite models.
//!
//! - [`preservation`]: does the shaped model have the same optimal policies as the plain one, and
//!   is it shaped by a potential alone?

mod preservation;

pub use preservation::{Preservation, Verdict, preservation};
