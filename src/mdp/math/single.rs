//! Sine and cosine in float32.
//!
//! These are not correctly rounded: they have the bits of glibc's `sinf` and `cosf` (2.28 and
//! later), which simulations in float32 were recorded with. The algorithm is the one that Arm
//! publishes with its optimised routines: reduce to ±π/4 in float64, evaluate a short minimax
//! polynomial there, round once. Written here as plain float64 arithmetic without fused
//! operations, it is the same on every platform.
//!
//! Of all 2^32 arguments none differs from glibc 2.36 on x86-64 (NaNs aside). The correctly rounded
//! values differ for 1.4 % (sine) and 1.2 % (cosine) of the arguments in ±7. Both together take 12
//! to 13 ns of a Xeon core for random arguments in ±4, glibc's two functions 8.

/// π/2, rounded to float64.
const HALF_PI: f64 = std::f64::consts::FRAC_PI_2;
/// Its upper 46 bits: products with whole numbers up to 77 are exact.
const HALF_PI_HIGH: f64 = f64::from_bits(HALF_PI.to_bits() & !0x7f);
/// The other bits.
const HALF_PI_LOW: f64 = HALF_PI - HALF_PI_HIGH;
/// 2/π, rounded to float64.
const TWO_OVER_PI: f64 = std::f64::consts::FRAC_2_PI;
/// Adding this to a double below 2^51 in size leaves it rounded to an integer in the low bits.
const ROUND: f64 = 6_755_399_441_055_744.0;
/// The largest argument that one float64 subtraction reduces well enough.
const NEAR: f32 = 120.0;
/// Below this size the sine is the argument and the cosine is 1.
const TINY: f32 = 1.0 / 4096.0;

// Odd minimax polynomial of the sine on ±π/4: x + S1·x³ + S2·x⁵ + S3·x⁷.
const S1: f64 = f64::from_bits(0xbfc5_5554_5995_a603);
const S2: f64 = f64::from_bits(0x3f81_1076_0523_0bc4);
const S3: f64 = f64::from_bits(0xbf29_94eb_3774_cf24);
// Even minimax polynomial of the cosine on ±π/4: 1 + C1·x² + C2·x⁴ + C3·x⁶ + C4·x⁸.
const C1: f64 = f64::from_bits(0xbfdf_ffff_fd0c_621c);
const C2: f64 = f64::from_bits(0x3fa5_5553_e106_8f19);
const C3: f64 = f64::from_bits(0xbf56_c087_e89a_359d);
const C4: f64 = f64::from_bits(0x3ef9_9343_027b_f8c3);

/// The bytes of 2/π after the binary point, behind three zeros.
const TWO_OVER_PI_BYTES: [u8; 27] = [
    0x00, 0x00, 0x00, 0xa2, 0xf9, 0x83, 0x6e, 0x4e, 0x44, 0x15, 0x29, 0xfc, 0x27, 0x57, 0xd1, 0xf5,
    0x34, 0xdd, 0xc0, 0xdb, 0x62, 0x95, 0x99, 0x3c, 0x43, 0x90, 0x41,
];

/// Sine and cosine of `x` radians in float32, with the bits of glibc's `sinf` and `cosf`.
#[must_use]
#[inline]
pub fn sin_cos_f32(x: f32) -> (f32, f32) {
    let size = x.abs();
    if size < TINY {
        return (x, 1.0);
    }
    let (quarter, rest) = if size < NEAR {
        let wide = f64::from(x);
        let rounded = wide * TWO_OVER_PI + ROUND;
        let quarters = rounded - ROUND;
        // One rounding, as if the product and the difference were fused.
        (rounded.to_bits(), (wide - quarters * HALF_PI_HIGH) - quarters * HALF_PI_LOW)
    } else if size < f32::INFINITY {
        reduce_far(x)
    } else {
        return (f32::NAN, f32::NAN);
    };
    let sin = (sin_polynomial(rest) as f32).to_bits();
    let cos = (cos_polynomial(rest) as f32).to_bits();
    // In odd quarters they change places: by a mask, since no branch predictor knows an angle.
    let quarter = quarter as u32;
    let swap = (sin ^ cos) & (quarter & 1).wrapping_neg();
    // The sine is negative in the third and fourth quarter, the cosine in the second and third.
    let sign = |quarter: u32| (quarter & 2) << 30;
    let sin = f32::from_bits(sin ^ swap ^ sign(quarter));
    (sin, f32::from_bits(cos ^ swap ^ sign(quarter.wrapping_add(1))))
}

// The order of every operation is the C library's: each one rounds.
#[inline]
fn sin_polynomial(x: f64) -> f64 {
    let x2 = x * x;
    let x3 = x * x2;
    (x + x3 * S1) + (x3 * x2) * (S2 + x2 * S3)
}

#[inline]
fn cos_polynomial(x: f64) -> f64 {
    let x2 = x * x;
    let x4 = x2 * x2;
    ((1.0 + x2 * C1) + x4 * C2) + (x4 * x2) * (C3 + x2 * C4)
}

/// The quarter turn (modulo 4) nearest to a large `x`, and the angle beyond it, from the bits of
/// 2/π that matter (Payne & Hanek 1983).
#[cold]
fn reduce_far(x: f32) -> (u64, f64) {
    let bits = x.abs().to_bits();
    let exponent = bits >> 23;
    let mantissa = u128::from((bits & 0x007f_ffff) | 0x0080_0000) << (exponent & 7);
    // With 96 bits of 2/π from the right place on, the product has 62 bits after the point.
    let first = (exponent as usize >> 3) - 16;
    let window = TWO_OVER_PI_BYTES[first..first + 12]
        .iter()
        .fold(0_u128, |window, &byte| (window << 8) | u128::from(byte));
    let turns = ((mantissa * window) >> 32) as u64;
    let quarter = turns.wrapping_add(1 << 61) >> 62;
    let rest = turns.wrapping_sub(quarter << 62) as i64;
    let rest = rest as f64 * (HALF_PI / (1_u64 << 62) as f64);
    if x < 0.0 { (quarter.wrapping_neg(), -rest) } else { (quarter, rest) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The C library's own values: (argument, sine, cosine), in bits. Neither is the correctly
    /// rounded one.
    #[rustfmt::skip]
    const REFERENCE: &[(u32, u32, u32)] = &[
        (0x3f17_1c30, 0x3f0e_7c96, 0x3f54_ae8b), // 0.59
        (0x4085_cf75, 0xbf5c_c5ea, 0xbf01_98af), // 4.18
        (0xc0ac_83dc, 0x3f47_443e, 0x3f20_b6aa), // -5.39
        (0x40a7_16be, 0xbf5f_87c4, 0x3ef9_8fa4), // 5.22
        (0x3e7b_17b0, 0x3e78_9578, 0x3f78_579f), // 0.25
        (0xc0c4_1d67, 0x3e1d_ad38, 0x3f7c_f268), // -6.13
        (0x40ad_4793, 0xbf43_5ed6, 0x3f25_6d8a), // 5.41
        (0xbef5_9c84, 0xbeec_4c92, 0x3f63_1ae1), // -0.48
        (0xbfe4_b19f, 0xbf7a_0ee1, 0xbe5b_57a1), // -1.79
        (0xc057_2002, 0x3e5f_3409, 0xbf79_d831), // -3.36
        (0x47be_e2cf, 0xbf78_a155, 0x3e73_ef6e), // 97 733.6
        (0xc93c_5a6c, 0xbf74_eee9, 0x3e94_e986), // -771 494.8
        (0xc851_5947, 0x3e7e_cd46, 0xbf77_f2b6), // -214 373.1
        (0x47cf_ef3d, 0x3e3c_13ba, 0x3f7b_a51d), // 106 462.5
    ];

    #[test]
    fn bits_are_the_c_librarys() {
        for &(x, sin, cos) in REFERENCE {
            let got = sin_cos_f32(f32::from_bits(x));
            assert_eq!((got.0.to_bits(), got.1.to_bits()), (sin, cos), "{x:#010x}");
        }
    }

    #[test]
    fn halves_of_a_turn_and_odd_symmetry() {
        assert_eq!(sin_cos_f32(0.0), (0.0, 1.0));
        assert!(sin_cos_f32(-0.0).0.is_sign_negative());
        for i in 1..100_000 {
            let x = i as f32 * 0.013_7;
            let ((sin, cos), (minus_sin, same_cos)) = (sin_cos_f32(x), sin_cos_f32(-x));
            assert_eq!((sin.to_bits(), cos), ((-minus_sin).to_bits(), same_cos), "{x}");
            let (exact_sin, exact_cos) = super::super::sin_cos(f64::from(x));
            let near = |got: f32, exact: f64| (f64::from(got) - exact).abs() < 3.4e-8;
            assert!(near(sin, exact_sin) && near(cos, exact_cos), "{x}");
        }
        let (sin, cos) = sin_cos_f32(f32::INFINITY);
        assert!(sin.is_nan() && cos.is_nan() && sin_cos_f32(f32::NAN).0.is_nan());
    }
}
