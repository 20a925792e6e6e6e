//! Images as an animated GIF.
//!
//! All frames share one palette. Each holds the smallest rectangle that has changed, in which what
//! has not changed is transparent, so that the compressor finds long runs. A GIF counts time in
//! hundredths of a second; the delays are rounded so that the sum never drifts, and none is below
//! two hundredths, which browsers would take for ten.

use std::collections::HashMap;

use gif::{Encoder, EncodingError, Frame, Repeat};

use super::palette;
use super::raster::Image;
use crate::env::scene::Colour;

/// The most colours of a GIF, but one for what is transparent.
const MOST_COLOURS: usize = 255;
/// In a [`Patch`]: as before.
const UNCHANGED: u16 = u16::MAX;
/// The shortest delay, in hundredths of a second.
const SHORTEST: u64 = 2;

/// An animation in the making.
#[derive(Debug, Clone, Default)]
pub struct Animation {
    /// The last image and what it was.
    last: Option<Image>,
    patches: Vec<Patch>,
    /// All colours in the order of their appearance, with the number of pixels painted in each.
    colours: Vec<(Colour, u64)>,
    known: HashMap<Colour, u16>,
    /// Where the frames end, in hundredths of a second: as asked for, and as rounded.
    asked: f64,
    end: u64,
}

/// What a frame changes.
#[derive(Debug, Clone)]
struct Patch {
    left: u32,
    top: u32,
    width: u32,
    /// Row by row: an index into [`Animation::colours`], or [`UNCHANGED`].
    pixels: Vec<u16>,
    /// Hundredths of a second.
    delay: u64,
}

impl Animation {
    /// An animation without frames.
    pub fn new() -> Self {
        Self::default()
    }

    /// Number of frames so far; equal images in a row are one frame.
    pub fn frames(&self) -> usize {
        self.patches.len()
    }

    /// How long it lasts so far, in seconds.
    pub fn seconds(&self) -> f64 {
        self.end as f64 / 100.0
    }

    /// Shows `image` for so many seconds. All images have the size of the first.
    ///
    /// # Panics
    /// If this one has not.
    pub fn frame(&mut self, image: Image, seconds: f64) {
        let patch = match &self.last {
            None => Some([0, 0, image.width(), image.height()]),
            Some(last) => changed(last, &image),
        };
        if let Some([left, top, right, bottom]) = patch {
            let pixels = self.indices(&image, [left, top, right, bottom]);
            self.patches.push(Patch { left, top, width: right - left, pixels, delay: 0 });
            self.last = Some(image);
        }
        self.hold(seconds);
    }

    /// Shows the last image for so many seconds more.
    pub fn hold(&mut self, seconds: f64) {
        let Some(patch) = self.patches.last_mut() else { return };
        self.asked += seconds * 100.0;
        let delay = (self.asked.round() as u64).saturating_sub(self.end);
        // Only a new image needs its shortest delay.
        let delay = if patch.delay == 0 { delay.max(SHORTEST) } else { delay };
        patch.delay += delay;
        self.end += delay;
    }

    fn indices(&mut self, image: &Image, [left, top, right, bottom]: [u32; 4]) -> Vec<u16> {
        // The new image takes its place.
        let last = self.last.take();
        let mut pixels = Vec::with_capacity(((right - left) * (bottom - top)) as usize);
        for y in top..bottom {
            let range = row(image, y, left, right);
            let now = image.bytes()[range.clone()].chunks_exact(4);
            let mut before = last.as_ref().map(|last| last.bytes()[range].chunks_exact(4));
            for pixel in now {
                if before.as_mut().and_then(Iterator::next) == Some(pixel) {
                    pixels.push(UNCHANGED);
                } else {
                    pixels.push(self.index(Colour(pixel[0], pixel[1], pixel[2])));
                }
            }
        }
        pixels
    }

    fn index(&mut self, colour: Colour) -> u16 {
        let index = match self.known.get(&colour) {
            Some(&index) => index,
            None if self.colours.len() < usize::from(UNCHANGED) => {
                self.colours.push((colour, 0));
                self.known.insert(colour, self.colours.len() as u16 - 1);
                self.colours.len() as u16 - 1
            }
            // Of no scene here; then the finest shades are left out.
            None => {
                let Colour(r, g, b) = colour;
                let coarse = Colour(r & 0xe0, g & 0xe0, b & 0xe0);
                self.known.get(&coarse).copied().unwrap_or(0)
            }
        };
        self.colours[usize::from(index)].1 += 1;
        index
    }

    /// The file: it plays for ever. Empty if there are no frames.
    ///
    /// # Panics
    /// If the images are wider or higher than 65535 pixels.
    pub fn finish(self) -> Vec<u8> {
        let Some(last) = &self.last else { return Vec::new() };
        let side = |length: u32| u16::try_from(length).expect("a GIF's sides fit into 16 bits");
        let (width, height) = (side(last.width()), side(last.height()));
        self.encode(width, height).expect("a vector takes all bytes, and the palette is small")
    }

    fn encode(&self, width: u16, height: u16) -> Result<Vec<u8>, EncodingError> {
        let (chosen, stand_ins) = palette::choose(&self.colours, MOST_COLOURS);
        let transparent = chosen.len() as u8;
        let mut table: Vec<u8> = chosen.iter().flat_map(|&Colour(r, g, b)| [r, g, b]).collect();
        table.extend([0, 0, 0]);
        let mut encoder = Encoder::new(Vec::new(), width, height, &table)?;
        encoder.set_repeat(Repeat::Infinite)?;
        for patch in &self.patches {
            let buffer: Vec<u8> = patch
                .pixels
                .iter()
                .map(|&pixel| match pixel {
                    UNCHANGED => transparent,
                    index => stand_ins[usize::from(index)] as u8,
                })
                .collect();
            // What lies inside the canvas fits into 16 bits as the canvas does.
            encoder.write_frame(&Frame {
                delay: u16::try_from(patch.delay).unwrap_or(u16::MAX),
                transparent: Some(transparent),
                left: patch.left as u16,
                top: patch.top as u16,
                width: patch.width as u16,
                height: (buffer.len() / patch.width as usize) as u16,
                buffer: buffer.into(),
                ..Frame::default()
            })?;
        }
        encoder.into_inner()
    }
}

/// The smallest rectangle (left, top, right, bottom) outside of which two images agree; none if
/// they are equal.
fn changed(a: &Image, b: &Image) -> Option<[u32; 4]> {
    assert_eq!((a.width(), a.height()), (b.width(), b.height()), "images of one size");
    let width = a.width();
    let differ = |y: u32| {
        let range = row(a, y, 0, width);
        (&a.bytes()[range.clone()], &b.bytes()[range])
    };
    let rows = |y: &u32| differ(*y).0 != differ(*y).1;
    let top = (0..a.height()).find(rows)?;
    let bottom = (top..a.height()).rev().find(rows)? + 1;
    let (mut left, mut right) = (width, 0);
    for y in top..bottom {
        let (a, b) = differ(y);
        let mut pairs = a.chunks_exact(4).zip(b.chunks_exact(4));
        if let Some(first) = pairs.position(|(a, b)| a != b) {
            let last = a.chunks_exact(4).zip(b.chunks_exact(4)).rposition(|(a, b)| a != b);
            left = left.min(first as u32);
            right = right.max(last.unwrap_or(first) as u32 + 1);
        }
    }
    Some([left, top, right, bottom])
}

/// Where the pixels of a piece of a row are in [`Image::bytes`].
fn row(image: &Image, y: u32, left: u32, right: u32) -> std::ops::Range<usize> {
    let at = |x: u32| 4 * (y as usize * image.width() as usize + x as usize);
    at(left)..at(right)
}

#[cfg(test)]
mod tests {
    use gif::{ColorOutput, DecodeOptions};

    use super::*;

    const RED: Colour = Colour(200, 0, 0);
    const BLUE: Colour = Colour(0, 0, 200);

    /// The frames as they are in the file: left, top, width, height, delay, pixels (RGBA).
    fn decode(bytes: &[u8]) -> Vec<([u16; 4], u16, Vec<u8>)> {
        let mut options = DecodeOptions::new();
        options.set_color_output(ColorOutput::RGBA);
        let mut decoder = options.read_info(bytes).unwrap();
        let mut frames = Vec::new();
        while let Some(f) = decoder.read_next_frame().unwrap() {
            frames.push(([f.left, f.top, f.width, f.height], f.delay, f.buffer.to_vec()));
        }
        frames
    }

    /// An image of 6 × 4 red pixels, some of them blue.
    fn image(blue: &[[i32; 2]]) -> Image {
        let mut image = Image::new(6, 4, RED);
        for &[x, y] in blue {
            image.dot(x, y, BLUE);
        }
        image
    }

    #[test]
    fn frames_hold_what_has_changed() {
        let mut animation = Animation::new();
        animation.frame(image(&[]), 0.1);
        animation.frame(image(&[[2, 1], [4, 2]]), 0.1);
        animation.frame(image(&[[2, 1], [4, 2]]), 0.1);
        animation.frame(image(&[[4, 2]]), 0.1);
        assert_eq!((animation.frames(), animation.seconds()), (3, 0.4));
        let frames = decode(&animation.finish());
        let (red, blue, none) = ([200, 0, 0, 255], [0, 0, 200, 255], [0, 0, 0, 0]);
        assert_eq!(frames.len(), 3);
        assert_eq!(frames[0], ([0, 0, 6, 4], 10, red.repeat(24)));
        // Equal images are one frame; what is between the two pixels is transparent.
        let change = [blue, none, none, none, none, blue].concat();
        assert_eq!(frames[1], ([2, 1, 3, 2], 20, change));
        assert_eq!(frames[2], ([2, 1, 1, 1], 10, red.to_vec()));
    }

    #[test]
    fn delays_do_not_drift() {
        let mut animation = Animation::new();
        for i in 0..30 {
            animation.frame(image(&[[i % 6, i / 6 % 4]]), 1.0 / 30.0);
        }
        let delays: Vec<u16> = decode(&animation.finish()).iter().map(|f| f.1).collect();
        assert_eq!(delays.iter().sum::<u16>(), 100);
        assert!(delays.iter().all(|delay| (3..=4).contains(delay)), "{delays:?}");

        // Faster than a browser shows.
        let mut animation = Animation::new();
        for i in 0..3 {
            animation.frame(image(&[[i, 0]]), 0.001);
        }
        animation.hold(1.0);
        let delays: Vec<u16> = decode(&animation.finish()).iter().map(|f| f.1).collect();
        assert_eq!(delays, [2, 2, 100 - 4]);
    }

    #[test]
    fn nothing_is_an_empty_file() {
        assert!(Animation::new().finish().is_empty());
    }
}
