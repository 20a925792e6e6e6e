//! What a study looks like from outside: summaries, tables and plots of results.
//!
//! - [`results`]: the results folder and every file derived from its units
//! - [`claims`]: what a study expects of its results
//! - [`manifest`] writes `study.json`
//! - [`summary`]: per-variant statistics, as in `summary.json`
//! - [`compare`]: variants against the baseline
//! - [`curves`]: learning curves as SVG
//! - [`table`]: the closing table in the terminal
//! - `legend`: the legend of the curves
//! - `svg`: scales, ticks and escaping for hand-written SVG

pub mod claims;
pub mod compare;
pub mod curves;
mod legend;
pub mod manifest;
pub mod results;
pub mod summary;
mod svg;
pub mod table;
