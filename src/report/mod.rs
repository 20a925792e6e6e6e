//! What a study looks like from outside: summaries, tables and plots of results.
//!
//! - [`results`]: the results folder and every file derived from its units
//! - [`stored`]: a results folder read back, without writing to it
//! - [`claims`]: what a study expects of its results
//! - [`manifest`] writes `study.json`
//! - [`summary`]: per-variant statistics, as in `summary.json`
//! - [`compare`]: variants against the baseline
//! - [`curves`]: learning curves as SVG; [`curve_text`]: in the terminal
//! - [`table`]: tables in the terminal; [`closing`]: the one that closes a study
//! - [`picture`]: a table of action values over two of the state's fields; [`frame`]: which ones
//! - [`heat_map`], [`value_map`]: pictures in the terminal; [`picture_svg`]: as SVG
//! - [`onnx`]: a network as an ONNX model; [`tensorboard`]: training for TensorBoard
//! - `columns`: those of `episodes.csv` and `summary.csv`
//! - `colours`: a perceptually uniform scale, and colours for actions
//! - `legend`: the legend of the curves
//! - `runs`: a variant's units, gathered for tables and plots
//! - `svg`: scales, ticks and escaping for hand-written SVG

pub mod audit;
pub mod claims;
pub mod closing;
mod colours;
mod columns;
pub mod compare;
pub mod curve_text;
pub mod curves;
pub mod frame;
pub mod heat_map;
mod legend;
pub mod manifest;
pub mod onnx;
pub mod picture;
pub mod picture_svg;
pub mod results;
mod runs;
pub mod score;
pub mod stored;
pub mod summary;
mod svg;
pub mod table;
pub mod tensorboard;
pub mod value_map;
