//! `runner`: a scriptable reinforcement-learning experiment runner.
//!
//! A Rust host runs fast environments and learners; reward functions, potentials Φ(s) and
//! discretisers are Rhai scripts loaded at run time. The floors of the crate, each importing only
//! from those below it:
//!
//! | floor | what it is |
//! |---|---|
//! | [`cli`] | one file a subcommand: parse, call the library, print |
//! | [`report`] | csv, json, svg, terminal: views of results |
//! | [`experiment`] | units, threads, the store, resuming, golden files |
//! | [`script`] | the Rhai host: plans, callbacks, diagnostics, sandbox |
//! | [`audit`] | exact shaping checks on models |
//! | [`stats`] | IQM, intervals, rolling means |
//! | [`learn`] | agents and planners |
//! | [`nn`] | small networks and what trains them |
//! | [`shaping`] | rewards, potentials, discretisers |
//! | [`jit`] | callbacks as programs of an intermediate form, and as machine code |
//! | [`render`] | scenes as pixels, GIFs, characters |
//! | [`mod@env`] | the environments and their registry |
//! | [`mdp`] | actions, steps, models, random streams, pinned mathematics |

pub mod audit;
pub mod cli;
pub mod env;
pub mod experiment;
pub mod jit;
pub mod learn;
pub mod mdp;
pub mod nn;
pub mod render;
pub mod report;
pub mod script;
pub mod shaping;
pub mod stats;
