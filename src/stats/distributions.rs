//! Student's t and the normal distribution: distribution functions and their inverses.

// These two are as correctly rounded as `mdp::math`, which lists what environments and scripts
// may call; nobody but this file needs them.
use core_math::{erfc, lgamma};

use crate::mdp::math::{exp, ln, ln_1p};

/// The standard normal distribution function, Φ(z) = ½ erfc(−z / √2). The relative error grows
/// with z², from 10⁻¹⁶ in the middle to 10⁻¹³ at |z| = 30.
pub fn normal_cdf(z: f64) -> f64 {
    0.5 * erfc(-z * std::f64::consts::FRAC_1_SQRT_2)
}

/// The inverse of [`normal_cdf`] for `p` in [0, 1] (±∞ at the ends, NaN outside).
///
/// Wichura's algorithm AS 241, PPND16 (1988): relative error about 10⁻¹⁶.
pub fn normal_quantile(p: f64) -> f64 {
    let q = p - 0.5;
    if q.abs() <= 0.425 {
        let r = 0.180_625 - q * q;
        return q * polynomial(&A, r) / polynomial(&B, r);
    }
    if !(0.0..=1.0).contains(&p) {
        return f64::NAN;
    }
    let tail = if q < 0.0 { p } else { 1.0 - p };
    if tail == 0.0 {
        return if q < 0.0 { f64::NEG_INFINITY } else { f64::INFINITY };
    }
    let r = (-ln(tail)).sqrt();
    let z = if r <= 5.0 {
        polynomial(&C, r - 1.6) / polynomial(&D, r - 1.6)
    } else {
        polynomial(&E, r - 5.0) / polynomial(&F, r - 5.0)
    };
    if q < 0.0 { -z } else { z }
}

/// The distribution function of Student's t with `df` > 0 degrees of freedom (not necessarily
/// whole): P(T ≤ t) = 1 − ½ I(df / (df + t²); df/2, ½) for t ≥ 0. Accurate to about 10⁻¹³.
pub fn t_cdf(t: f64, df: f64) -> f64 {
    let tail = t_upper_tail(t.abs(), df);
    if t < 0.0 { tail } else { 1.0 - tail }
}

/// The inverse of [`t_cdf`]: the value below which a share `p` of Student's t lies. ±∞ at 0 and 1,
/// NaN for other values outside (0, 1) and for `df` that is not positive.
///
/// Bisection on the tail probability until the bracket cannot shrink: within a relative 10⁻¹² of
/// SciPy's `t.ppf` for 0.0005 ≤ p ≤ 0.9995 and 1 ≤ df ≤ 1000 (tested).
pub fn t_quantile(p: f64, df: f64) -> f64 {
    if !(0.0..=1.0).contains(&p) || df.is_nan() || df <= 0.0 {
        return f64::NAN;
    }
    let tail = p.min(1.0 - p);
    if tail == 0.0 {
        return if p < 0.5 { f64::NEG_INFINITY } else { f64::INFINITY };
    }
    let (mut low, mut high) = (0.0, 1.0);
    while high < f64::MAX / 2.0 && t_upper_tail(high, df) > tail {
        low = high;
        high *= 2.0;
    }
    loop {
        let middle = f64::midpoint(low, high);
        if middle <= low || middle >= high {
            break;
        }
        if t_upper_tail(middle, df) > tail { low = middle } else { high = middle }
    }
    // At the median the bracket closes on the smallest positive number: call it by its name.
    let t = if tail == 0.5 { 0.0 } else { high };
    if p < 0.5 { -t } else { t }
}

/// P(T > t) for t ≥ 0.
fn t_upper_tail(t: f64, df: f64) -> f64 {
    let squared = t * t;
    if squared.is_infinite() {
        return 0.0;
    }
    // Both arguments are formed by division: 1 − x would lose the digits of a small t.
    0.5 * beta_regularised(df / 2.0, 0.5, df / (df + squared), squared / (df + squared))
}

/// The regularised incomplete beta function Iₓ(a, b), `y` being 1 − x.
///
/// The continued fraction 26.5.8 of Abramowitz & Stegun on the side where it converges fast,
/// by Lentz's method (Numerical Recipes §6.4).
fn beta_regularised(a: f64, b: f64, x: f64, y: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    if y <= 0.0 {
        return 1.0;
    }
    // ln x from y where x is near 1, and the other way round.
    let ln_x = if y < 0.5 { ln_1p(-y) } else { ln(x) };
    let ln_y = if x < 0.5 { ln_1p(-x) } else { ln(y) };
    let front = exp(lgamma(a + b) - lgamma(a) - lgamma(b) + a * ln_x + b * ln_y);
    if x < (a + 1.0) / (a + b + 2.0) {
        front * beta_fraction(a, b, x) / a
    } else {
        1.0 - front * beta_fraction(b, a, y) / b
    }
}

/// The continued fraction of [`beta_regularised`].
fn beta_fraction(a: f64, b: f64, x: f64) -> f64 {
    /// Stands in for a zero denominator.
    const TINY: f64 = 1e-300;
    let nonzero = |v: f64| if v.abs() < TINY { TINY } else { v };
    let mut c = 1.0;
    let mut d = 1.0 / nonzero(1.0 - (a + b) * x / (a + 1.0));
    let mut fraction = d;
    // About √max(a, b) terms are needed; the bound is never met by a degree of freedom below 10^6.
    for m in 1..10_000 {
        let m = f64::from(m);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        let mut change = 1.0;
        for coefficient in [even, odd] {
            d = 1.0 / nonzero(1.0 + coefficient * d);
            c = nonzero(1.0 + coefficient / c);
            change = c * d;
            fraction *= change;
        }
        if (change - 1.0).abs() <= f64::EPSILON {
            break;
        }
    }
    fraction
}

/// Σ cᵢ xⁱ, by Horner's rule.
fn polynomial(coefficients: &[f64; 8], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

// Numerators and denominators of AS 241, for the centre, the tails and the far tails.
const A: [f64; 8] = [
    3.387_132_872_796_366_5,
    1.331_416_678_917_843_8e2,
    1.971_590_950_306_551_3e3,
    1.373_169_376_550_946e4,
    4.592_195_393_154_987e4,
    6.726_577_092_700_87e4,
    3.343_057_558_358_813e4,
    2.509_080_928_730_122_7e3,
];
const B: [f64; 8] = [
    1.0,
    4.231_333_070_160_091e1,
    6.871_870_074_920_579e2,
    5.394_196_021_424_751e3,
    2.121_379_430_158_659_7e4,
    3.930_789_580_009_271e4,
    2.872_908_573_572_194_3e4,
    5.226_495_278_852_854e3,
];
const C: [f64; 8] = [
    1.423_437_110_749_683_5,
    4.630_337_846_156_546,
    5.769_497_221_460_691,
    3.647_848_324_763_204_5,
    1.270_458_252_452_368_4,
    2.417_807_251_774_506e-1,
    2.272_384_498_926_918_4e-2,
    7.745_450_142_783_414e-4,
];
const D: [f64; 8] = [
    1.0,
    2.053_191_626_637_759,
    1.676_384_830_183_803_8,
    6.897_673_349_851e-1,
    1.481_039_764_274_800_8e-1,
    1.519_866_656_361_645_7e-2,
    5.475_938_084_995_345e-4,
    1.050_750_071_644_416_9e-9,
];
const E: [f64; 8] = [
    6.657_904_643_501_103,
    5.463_784_911_164_114,
    1.784_826_539_917_291_3,
    2.965_605_718_285_048_7e-1,
    2.653_218_952_657_612_4e-2,
    1.242_660_947_388_078_4e-3,
    2.711_555_568_743_487_6e-5,
    2.010_334_399_292_288_1e-7,
];
const F: [f64; 8] = [
    1.0,
    5.998_322_065_558_88e-1,
    1.369_298_809_227_358e-1,
    1.487_536_129_085_061_5e-2,
    7.868_691_311_456_133e-4,
    1.846_318_317_510_054_8e-5,
    1.421_511_758_316_446e-7,
    2.044_263_103_389_939_8e-15,
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::bootstrap::reference;

    fn rows(key: &str) -> Vec<Vec<f64>> {
        serde_json::from_value(reference()[key].clone()).unwrap()
    }

    fn assert_close(what: &str, actual: f64, expected: f64, tolerance: f64) {
        let error = (actual - expected).abs();
        assert!(error <= tolerance * expected.abs(), "{what}: {actual} is not {expected}");
    }

    #[test]
    fn t_quantiles_agree_with_scipy() {
        for row in rows("t_quantile") {
            let what = format!("t({}; {})", row[0], row[1]);
            assert_close(&what, t_quantile(row[0], row[1]), row[2], 1e-12);
        }
    }

    #[test]
    fn t_distribution_function_by_hand() {
        // With one degree of freedom it is Cauchy's: ½ + atan(t) / π.
        assert_close("Cauchy", t_cdf(1.0, 1.0), 0.75, 1e-15);
        // With two: ½ + t / (2√(2 + t²)).
        assert_close("two", t_cdf(-2.0, 2.0), 0.5 - 1.0 / 6.0f64.sqrt(), 1e-14);
        assert_eq!(t_cdf(0.0, 7.0), 0.5);
        assert_eq!((t_cdf(f64::INFINITY, 3.0), t_cdf(f64::NEG_INFINITY, 3.0)), (1.0, 0.0));
        // A small t keeps its digits.
        assert_close("small", t_cdf(1e-9, 2.0) - 0.5, 1e-9 / 8.0f64.sqrt(), 1e-6);
    }

    #[test]
    fn normal_agrees_with_scipy() {
        for row in rows("normal_quantile") {
            assert_close(&format!("z({})", row[0]), normal_quantile(row[0]), row[1], 1e-15);
        }
        for row in rows("normal_cdf") {
            assert_close(&format!("Φ({})", row[0]), normal_cdf(row[0]), row[1], 1e-12);
        }
    }

    #[test]
    fn the_ends() {
        assert_eq!(t_quantile(0.5, 3.0), 0.0);
        assert_eq!(t_quantile(1.0, 3.0), f64::INFINITY);
        assert_eq!(normal_quantile(0.0), f64::NEG_INFINITY);
        assert!(t_quantile(1.5, 3.0).is_nan() && t_quantile(0.9, 0.0).is_nan());
        assert!(normal_quantile(-0.1).is_nan() && normal_quantile(f64::NAN).is_nan());
    }
}
