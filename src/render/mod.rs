//! Scenes as pixels and characters.
//!
//! - [`raster`]: a scene as an [`Image`], anti-aliased
//! - [`gif`]: images as an animated GIF
//! - [`recorder`]: an episode as an animation, step by step
//! - [`ansi`]: a scene as lines for a terminal
//!
//! The same scenes give the same bytes on every machine: the rasteriser uses no more than IEEE 754's
//! exactly rounded operations, the palette is chosen from counts with ties broken by colour, and
//! the compressor has no state of its own.

pub mod ansi;
mod font;
pub mod gif;
mod palette;
pub mod raster;
pub mod recorder;

pub(crate) use ansi::indexed;
pub use ansi::{Palette, lines};
pub use gif::Animation;
pub use raster::Image;
pub use recorder::Recorder;
