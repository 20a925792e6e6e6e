//! NumPy's float32 sine and cosine, which are polynomials of its own on processors with fused
//! multiply-add: within one unit in the last place, but not correctly rounded.

use crate::mdp::math;

/// Beyond this NumPy calls the C library.
const LIMIT: f32 = 71_476.06;

/// Adding and taking away 1.5 * 2^23 rounds to an integer.
const ROUND: f32 = 12_582_912.0;

/// π/2 as a sum of three float32, for a reduction in fused steps.
const HALF_PI: [f32; 3] =
    [f32::from_bits(0x3fc9_0fd8), f32::from_bits(0x34a8_885a), f32::from_bits(0x27c2_34c4)];

/// 2/π.
const TWO_OVER_PI: f32 = f32::from_bits(0x3f22_f983);

/// `(np.sin(x), np.cos(x))` of a float32 `x` in radians, bit for bit as NumPy 2.4 computes them on
/// x86-64 with AVX2 and newer; beyond 71 476 the float64 functions, rounded.
pub fn sin_cos_f32(x: f32) -> (f32, f32) {
    if x.is_nan() || x.abs() > LIMIT {
        let (sin, cos) = math::sin_cos(x.into());
        return (sin as f32, cos as f32);
    }
    // A fused multiply-add is correctly rounded, so it has the same bits in hardware and software.
    let quadrant = x.mul_add(TWO_OVER_PI, ROUND) - ROUND;
    let r = HALF_PI.iter().fold(x, |r, &part| quadrant.mul_add(-part, r));
    let r2 = r * r;
    let sin =
        polynomial(r2, &[0x363e_9dde, 0xb950_35dd, 0x3c08_88cd, 0xbe2a_aaab, 0]).mul_add(r, r);
    let cos = polynomial(r2, &[0x37cc_730b, 0xbab6_036e, 0x3d2a_aa9e, 0xbf00_0000, 0x3f80_0000]);
    let of = |k: i32| {
        let value = if k & 1 == 0 { sin } else { cos };
        if k & 2 == 0 { value } else { -value }
    };
    let k = quadrant as i32;
    (of(k), of(k + 1))
}

/// Horner's rule in fused steps; coefficients as bits, from the highest power down.
fn polynomial(x: f32, coefficients: &[u32; 5]) -> f32 {
    let [first, rest @ ..] = coefficients;
    rest.iter().fold(f32::from_bits(*first), |sum, &c| sum.mul_add(x, f32::from_bits(c)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mdp::numpy::NumpyRng;

    /// NumPy: `x = default_rng(5).uniform(-hi, hi, 20000).astype(np.float32)` for each `hi` in turn,
    /// and the sums of `i * bits(sin(x[i - 1]))` and of the cosine's, modulo 2^64.
    #[test]
    fn twenty_thousand_arguments_each_as_numpy() {
        let mut rng = NumpyRng::from_u64(5);
        for (hi, sines, cosines) in [
            (0.2, 0x5db_f1df_0470_03a9, 0x2f4_efb6_4f71_aec8),
            (4.0, 0x5e3_70df_3a92_965c, 0x68a_7888_48ad_6cde),
            (1000.0, 0x5e7_af37_c5c1_a44a, 0x5dd_8642_9e2b_fe73),
            (71_000.0, 0x5e4_d5ea_d586_39e4, 0x5f0_6634_305e_eb1b),
        ] {
            let mut sums = (0u64, 0u64);
            for i in 1..=20_000u64 {
                let (sin, cos) = sin_cos_f32(rng.uniform(-hi, hi) as f32);
                sums.0 = sums.0.wrapping_add(i * u64::from(sin.to_bits()));
                sums.1 = sums.1.wrapping_add(i * u64::from(cos.to_bits()));
            }
            assert_eq!(sums, (sines, cosines), "{hi}");
        }
    }
}
