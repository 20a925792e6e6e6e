//! Text in pictures: the bitmaps of Noto Sans Mono that a crate carries.

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

/// The font in one of its sizes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Face {
    size: RasterHeight,
    /// Each of its pixels becomes a square of this side.
    zoom: i32,
}

impl Face {
    /// The largest face whose lines are at most `height` pixels high; the smallest if none is.
    pub(super) fn fitting(height: f32) -> Self {
        let sizes = [RasterHeight::Size32, RasterHeight::Size24, RasterHeight::Size20];
        let size = sizes.into_iter().find(|size| size.val() as f32 <= height);
        let zoom = ((height / 32.0) as i32).max(1);
        Self { size: size.unwrap_or(RasterHeight::Size16), zoom }
    }

    /// The height of a line, in pixels.
    pub(super) fn height(self) -> i32 {
        self.size.val() as i32 * self.zoom
    }

    /// The width of a text, in pixels.
    pub(super) fn width(self, text: &str) -> i32 {
        let letter = get_raster_width(FontWeight::Regular, self.size) as i32;
        letter * self.zoom * text.chars().count() as i32
    }

    /// Calls `pixel` with x, y and the coverage (0 to 255) of the pixels of a line of text.
    /// Characters beyond ASCII are shown as question marks.
    pub(super) fn each_pixel(self, text: &str, mut pixel: impl FnMut(i32, i32, u8)) {
        let mut left = 0;
        for c in text.chars() {
            let raster = |c| get_raster(c, FontWeight::Regular, self.size);
            let Some(glyph) = raster(c).or_else(|| raster('?')) else { continue };
            for (y, row) in (0..).zip(glyph.rows()) {
                for (x, &coverage) in (0..).zip(row) {
                    for (dx, dy) in
                        (0..self.zoom).flat_map(|dy| (0..self.zoom).map(move |dx| (dx, dy)))
                    {
                        pixel(left + x * self.zoom + dx, y * self.zoom + dy, coverage);
                    }
                }
            }
            left += glyph.width() as i32 * self.zoom;
        }
    }
}
