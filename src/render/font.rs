//! Text in pictures: the bitmaps of Noto Sans Mono that a crate carries.

use noto_sans_mono_bitmap::{
    FontWeight, RasterHeight, RasterizedChar, get_raster, get_raster_width,
};

/// The font in one of its sizes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Face {
    size: RasterHeight,
    /// The largest size is enlarged to this height, in pixels.
    height: i32,
}

impl Face {
    /// The largest face whose lines are at most `height` pixels high; the smallest if none is.
    pub(super) fn fitting(height: f32) -> Self {
        let sizes = [RasterHeight::Size32, RasterHeight::Size24, RasterHeight::Size20];
        let size = sizes.into_iter().find(|size| size.val() as f32 <= height);
        let size = size.unwrap_or(RasterHeight::Size16);
        let enlarged = if size == RasterHeight::Size32 { height as i32 } else { 0 };
        Self { size, height: enlarged.max(size.val() as i32) }
    }

    /// The height of a line, in pixels.
    pub(super) fn height(self) -> i32 {
        self.height
    }

    /// The width of a text, in pixels.
    pub(super) fn width(self, text: &str) -> i32 {
        self.letter() * text.chars().count() as i32
    }

    /// The width of a letter, in pixels.
    fn letter(self) -> i32 {
        let width = get_raster_width(FontWeight::Regular, self.size) as i32;
        width * self.height / self.size.val() as i32
    }

    /// Calls `pixel` with x, y and the coverage (0 to 255) of the pixels of a line of text.
    /// Characters beyond ASCII are shown as question marks.
    pub(super) fn each_pixel(self, text: &str, mut pixel: impl FnMut(i32, i32, u8)) {
        for (i, c) in (0..).zip(text.chars()) {
            let raster = |c| get_raster(c, FontWeight::Regular, self.size);
            let Some(glyph) = raster(c).or_else(|| raster('?')) else { continue };
            for y in 0..self.height {
                for x in 0..self.letter() {
                    pixel(i * self.letter() + x, y, self.sample(&glyph, x, y));
                }
            }
        }
    }

    /// The coverage of a pixel of an enlarged glyph: between those of the glyph's own pixels.
    fn sample(self, glyph: &RasterizedChar, x: i32, y: i32) -> u8 {
        let own = self.size.val() as i32;
        // The place of the pixel's centre among the centres of the glyph's, in 1/256 pixels.
        let place = |at: i32| 128 * (2 * at + 1) * own / self.height - 128;
        let at = |x: i32, y: i32| {
            let inside = usize::try_from(x).ok().zip(usize::try_from(y).ok());
            i32::from(inside.and_then(|(x, y)| glyph.pixel(x, y)).unwrap_or(0))
        };
        let (x, y) = (place(x), place(y));
        let (left, top, right, low) = (x >> 8, y >> 8, x & 255, y & 255);
        let row = |y: i32| at(left, y) * (256 - right) + at(left + 1, y) * right;
        ((row(top) * (256 - low) + row(top + 1) * low + (1 << 15)) >> 16) as u8
    }
}
