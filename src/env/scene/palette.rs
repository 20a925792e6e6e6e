//! The colours of all scenes: few, so that a GIF's 256 suffice for them and their blends.

/// A colour of the screen: red, green, blue (sRGB).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Colour(pub u8, pub u8, pub u8);

impl Colour {
    /// The colour at `share` (0 to 1) of the way to `other`.
    #[must_use]
    pub fn mixed(self, other: Self, share: f64) -> Self {
        let mix = |a: u8, b: u8| {
            (f64::from(a) + (f64::from(b) - f64::from(a)) * share).round().clamp(0.0, 255.0) as u8
        };
        Self(mix(self.0, other.0), mix(self.1, other.1), mix(self.2, other.2))
    }
}

/// Behind everything.
pub const PAPER: Colour = Colour(0xfa, 0xf9, 0xf6);
/// What must be seen first; text.
pub const INK: Colour = Colour(0x26, 0x32, 0x46);
/// Secondary lines and words.
pub const SLATE: Colour = Colour(0x7a, 0x86, 0x99);
/// Faint lines and planes.
pub const MIST: Colour = Colour(0xdd, 0xe2, 0xe9);
/// Highlights on dark things.
pub const WHITE: Colour = Colour(0xff, 0xff, 0xff);
/// The one who acts.
pub const BLUE: Colour = Colour(0x2b, 0x6c, 0xb0);
/// Moving parts that are not the agent's body.
pub const ORANGE: Colour = Colour(0xe0, 0x7b, 0x2a);
/// Danger and force.
pub const RED: Colour = Colour(0xc9, 0x3a, 0x3e);
/// Goals.
pub const GREEN: Colour = Colour(0x2f, 0x8f, 0x5b);
/// Taxis, flames, marks.
pub const YELLOW: Colour = Colour(0xf4, 0xb9, 0x3e);
/// Earth.
pub const EARTH: Colour = Colour(0x9c, 0x7a, 0x58);
/// Frozen water.
pub const ICE: Colour = Colour(0xd3, 0xe8, 0xf4);
/// Open water.
pub const WATER: Colour = Colour(0x1e, 0x4d, 0x7b);
/// The sky of a world without air.
pub const NIGHT: Colour = Colour(0x14, 0x1b, 0x2d);
/// The cloth of a card table.
pub const FELT: Colour = Colour(0x2a, 0x66, 0x4e);
