//! The rigid-body dynamics under the lander: three polygons, two motorised hinges, and a ground of
//! straight edges.
//!
//! The algorithm is Erin Catto's, of his engine `Box2D` at version 2.3.0: sequential impulses with
//! warm starting (Catto 2005, *Iterative Dynamics with Temporal Coherence*; 2009, *Modeling and
//! Solving Constraints*), non-linear projection of positions, conservative advancement for
//! continuous collisions over GJK distances (Catto 2010, 2013), and sleeping. Only what a lander
//! can reach is here, written for it. The arithmetic is that engine's, operation by operation in
//! float32 and never fused, so that a trajectory has the same bits.
//!
//! - [`vector`]: vectors, rotations, frames, sweeps
//! - [`polygon`]: hulls and masses; [`body`]: one rigid body
//! - [`hinge`]: the revolute joint with its motor and limits
//! - [`manifold`]: where a polygon touches an edge; [`contact`]: such a pair over time
//! - [`friction`]: the contact constraints' impulses
//! - [`island`]: one step of velocities and positions, and sleep
//! - [`distance`], [`impact`]: GJK, and when a moving polygon hits an edge
//! - [`world`]: a step of everything

mod body;
mod contact;
mod distance;
mod friction;
mod hinge;
mod impact;
mod island;
mod manifold;
mod polygon;
mod vector;
mod world;

#[cfg(test)]
mod tests;

pub(crate) use body::Body;
pub(crate) use hinge::Hinge;
pub(crate) use manifold::Edge;
pub(crate) use polygon::Polygon;
pub(crate) use vector::vec2;
pub(crate) use world::{EDGES, HULL, LEGS, Part, World};

use std::f32::consts::PI;

/// How far shapes may overlap, and joints part, at rest; m.
const LINEAR_SLOP: f32 = 0.005;
/// The same for angles, rad.
const ANGULAR_SLOP: f32 = 2.0 / 180.0 * PI;
/// A skin around every polygon and edge, m.
const SKIN: f32 = 2.0 * LINEAR_SLOP;
/// The largest correction of a position in one iteration, m.
const MAX_CORRECTION: f32 = 0.2;
/// The largest correction of an angle in one iteration, rad.
const MAX_ANGULAR_CORRECTION: f32 = 8.0 / 180.0 * PI;
/// The largest movement in a step, m.
const MAX_TRANSLATION: f32 = 2.0;
/// The largest turn in a step, rad.
const MAX_ROTATION: f32 = 0.5 * PI;
