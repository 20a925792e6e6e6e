//! Colours of numbers and of actions.

/// An sRGB colour.
pub(super) type Rgb = [u8; 3];

/// Nine equidistant colours of viridis (Smith, van der Walt & Firing 2015; public domain): from
/// dark to light in steps that look equal, also to colour-blind readers and in grey print.
const VIRIDIS: [Rgb; 9] = [
    [0x44, 0x01, 0x54],
    [0x47, 0x2d, 0x7b],
    [0x3b, 0x52, 0x8b],
    [0x2c, 0x72, 0x8e],
    [0x21, 0x90, 0x8c],
    [0x27, 0xad, 0x81],
    [0x5d, 0xc8, 0x63],
    [0xaa, 0xdc, 0x32],
    [0xfd, 0xe7, 0x25],
];

/// The colour of a share from 0 to 1, linear between the table's.
pub(super) fn viridis(share: f64) -> Rgb {
    let at = share.clamp(0.0, 1.0) * (VIRIDIS.len() - 1) as f64;
    let i = (at as usize).min(VIRIDIS.len() - 2);
    let part = at - i as f64;
    let mix = |k: usize| {
        let (a, b) = (f64::from(VIRIDIS[i][k]), f64::from(VIRIDIS[i + 1][k]));
        (a + part * (b - a)).round() as u8
    };
    [mix(0), mix(1), mix(2)]
}

/// Where an episode cannot be and act.
pub(super) const NOTHING: Rgb = [0xff, 0xff, 0xff];
/// Where nothing was learned.
pub(super) const UNKNOWN: Rgb = [0xdd, 0xdd, 0xdd];

/// `#rrggbb`.
pub(super) fn hex([r, g, b]: Rgb) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// What [`hex`] writes, read back.
pub(super) fn parse(text: &str) -> Rgb {
    let digits = |i: usize| u8::from_str_radix(text.get(i..i + 2).unwrap_or("0"), 16).unwrap_or(0);
    [digits(1), digits(3), digits(5)]
}

/// The colour of an action.
pub(super) fn action(a: usize) -> Rgb {
    parse(super::curves::colour(a))
}

/// Whether dark text is readable on a colour (by its luma of Rec. 601).
pub(super) fn is_light([r, g, b]: Rgb) -> bool {
    299 * u32::from(r) + 587 * u32::from(g) + 114 * u32::from(b) > 140_000
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_meets_its_table_and_grows_lighter() {
        assert_eq!(hex(viridis(0.0)), "#440154");
        assert_eq!(hex(viridis(0.5)), "#21908c");
        assert_eq!(hex(viridis(1.0)), "#fde725");
        assert_eq!(viridis(f64::NAN), viridis(0.0), "no number is no panic");
        let luma = |share: f64| {
            let [r, g, b] = viridis(share).map(f64::from);
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        for i in 0..100 {
            assert!(luma(f64::from(i + 1) / 100.0) > luma(f64::from(i) / 100.0), "{i}");
        }
    }

    #[test]
    fn colours_read_back() {
        assert_eq!(parse("#0072B2"), [0x00, 0x72, 0xb2]);
        assert_eq!(hex(parse("#d55e00")), "#d55e00");
    }
}
