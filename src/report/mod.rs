//! What a study looks like from outside: summaries, tables and plots of results.
//!
//! - [`results`]: the results folder and every file derived from its units
//! - [`stored`]: a results folder read back, without writing to it
//! - [`claims`]: what a study expects of its results
//! - [`manifest`] writes `study.json`
//! - [`summary`]: per-variant statistics, as in `summary.json`
//! - [`compare`]: variants against the baseline
//! - [`curves`]: learning curves as SVG
//! - [`table`]: tables in the terminal; [`closing`]: the one that closes a study
//! - `legend`: the legend of the curves
//! - `svg`: scales, ticks and escaping for hand-written SVG

pub mod claims;
pub mod closing;
pub mod compare;
pub mod curves;
mod legend;
pub mod manifest;
pub mod results;
pub mod stored;
pub mod summary;
mod svg;
pub mod table;
