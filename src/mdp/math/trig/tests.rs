use super::*;
use crate::mdp::math::tests::{Arguments, assert_same};

/// x in fixed point; digits beyond it are dropped.
fn fixed(x: f64) -> i128 {
    (x * pow2(FRACTION as i32)) as i128
}

/// sin x and cos x by their series at x / 2^17 and 17 doublings, a way that shares no more than
/// the product with the code under test. Good to 2^-80 for |x| < 2^17, to 2^-100 for |x| < 8.
fn reference(x: f64) -> (i128, i128) {
    let doublings = if x.abs() < 8.0 { 3 } else { 17 };
    let t = fixed(x * pow2(-doublings));
    let (mut sin, mut cos, mut term, mut n) = (0, 0, ONE, 0);
    while term.abs() > 1 {
        match n % 4 {
            0 => cos += term,
            1 => sin += term,
            2 => cos -= term,
            _ => sin -= term,
        }
        n += 1;
        term = mul(term, t) / n;
    }
    for _ in 0..doublings {
        (sin, cos) = (2 * mul(sin, cos), ONE - 2 * mul(sin, sin));
    }
    (sin, cos)
}

/// How far `value` is off, as a part of its bound.
fn part_of_bound(value: Value, exact: i128) -> f64 {
    let off = (exact - fixed(value.hi) - fixed(value.lo)).abs();
    off as f64 / (value.error * pow2(FRACTION as i32))
}

/// The parts of the bounds that the fast evaluation uses up at |x|, sine and cosine.
fn parts_of_bounds(x: f64) -> (f64, f64) {
    let (sin, cos) = reference(x.abs());
    if is_direct(x) {
        let near = direct(x);
        return (part_of_bound(near.sin(), sin), part_of_bound(near.cos(), cos));
    }
    let Reduced { quadrant, y, near } = Reduced::new(x.abs());
    let (sin, cos) = match quadrant % 4 {
        0 => (sin, cos),
        1 => (-cos, sin),
        2 => (-sin, -cos),
        _ => (cos, -sin),
    };
    let sin = if y < 0.0 { -sin } else { sin };
    // As good as the reference.
    let reduced = |value: Value| Value { error: value.error + pow2(-80), ..value };
    (part_of_bound(reduced(near.sin()), sin), part_of_bound(reduced(near.cos()), cos))
}

#[test]
fn the_error_bounds_hold() {
    let mut worst = (0.0_f64, 0.0_f64);
    let mut look_at = |x: f64| {
        let (sin, cos) = parts_of_bounds(x);
        // The analysis is a worst case; in fact a third of the bound is used at most.
        assert!(sin < 0.5 && cos < 0.5, "{x:e}: {sin} and {cos} of the bounds");
        worst = (worst.0.max(sin), worst.1.max(cos));
    };
    // Every point of the table, at both ends of its reach and inside.
    let mut arguments = Arguments::new(1);
    for k in 0..POINTS - 1 {
        let a = k as f64 / GRID as f64;
        for r in [-1.0, -0.999, -0.5, -1e-4, 0.0, 1e-9, 0.5, 0.999, 1.0] {
            let x = a + r / (2 * GRID) as f64;
            if x > 0.0 {
                look_at(x);
                look_at(x.next_up());
                look_at(x.next_down());
            }
        }
        for _ in 0..8 {
            look_at((a + arguments.within(0.5 / GRID as f64)).abs());
        }
    }
    // Where the sine's bound is tightest: relative, next to 0; and beyond a reduction.
    for range in [1e-9, 1e-6, 1e-3, 0.01, 0.1, 20.0, 1000.0, 130_000.0] {
        for _ in 0..1000 {
            look_at(arguments.within(range));
        }
    }
    // The bounds are not idle either: something comes near to them.
    assert!(worst.0 > 0.1 && worst.1 > 0.1, "{worst:?}");
}

#[test]
fn the_table_is_accurate() {
    for (k, point) in TABLE.iter().enumerate() {
        let (sin, cos) = reference(k as f64 / GRID as f64);
        for (exact, head, tail) in [(sin, point.s1, point.s2), (cos, point.c1, point.c2)] {
            assert_eq!((head * pow2(27)).fract(), 0.0);
            let off = (exact - fixed(head) - fixed(tail)).abs();
            assert!(off < 1 << (FRACTION - 81), "point {k}: off by {off} units");
            assert!(head.abs() > 0.0009 || k == 0, "point {k}: {head} is too small");
        }
    }
    let near: f64 =
        "1.570796326794896619231321691639751442098584699687552910487472".parse().unwrap();
    assert_eq!(HALF_PI.iter().rev().sum::<f64>(), near);
    // sin(2 * (π/2 in parts)) = 0 needs more digits than the table: sin is steep at π.
    let (mut sin, mut cos) = (0, ONE);
    for part in HALF_PI {
        let (s, c) = reference(part);
        (sin, cos) = (mul(sin, c) + mul(cos, s), mul(cos, c) - mul(sin, s));
    }
    assert!(cos.abs() < 1 << (FRACTION - 112), "π/2 is off by {cos} units");
}

#[test]
fn few_arguments_need_core_math() {
    let mut arguments = Arguments::new(2);
    for range in [0.01, 0.5, 4.0, 7.9, 100.0, 1e5] {
        let (mut sines, mut cosines) = (0, 0);
        for _ in 0..20_000 {
            let x = arguments.within(range);
            let (sin, cos) = if is_direct(x) {
                let near = direct(x);
                (near.sin().round(), near.cos().round())
            } else {
                let reduced = Reduced::new(x);
                (reduced.sin(), reduced.cos())
            };
            sines += usize::from(sin.is_none());
            cosines += usize::from(cos.is_none());
        }
        // About 12 to 15 are to be expected.
        assert!(sines < 40 && cosines < 40, "±{range}: {sines}, {cosines} of 20000");
    }
}

fn check(x: f64) {
    let (s, c) = (core_math::sin(x), core_math::cos(x));
    assert_same(sin(x), s, "sin", x);
    assert_same(cos(x), c, "cos", x);
    let both = sin_cos(x);
    assert_same(both.0, s, "sin of sin_cos", x);
    assert_same(both.1, c, "cos of sin_cos", x);
}

#[test]
fn every_bit_is_core_maths() {
    let mut arguments = Arguments::new(3);
    for range in [1e-300, 1e-15, 1e-7, 1e-3, 0.3, 4.0, 8.0, 100.0, 1e5, 2e5, 1e9, 1e300] {
        for _ in 0..12_000 {
            check(arguments.within(range));
        }
    }
    for _ in 0..20_000 {
        check(arguments.of_any_size());
    }
}

#[test]
fn every_bit_is_core_maths_near_the_seams() {
    let around = |x: f64| {
        let (mut up, mut down) = (x, x);
        for _ in 0..3 {
            (up, down) = (up.next_up(), down.next_down());
            for x in [x, up, down] {
                check(x);
                check(-x);
            }
        }
    };
    for k in 0..=2 * POINTS {
        around(k as f64 / (2 * GRID) as f64);
    }
    for n in (0..2000).chain((2000..90_000).step_by(23)) {
        around(n as f64 * std::f64::consts::FRAC_PI_2);
    }
    for seam in [TINY, DIRECT, REDUCIBLE, 1.0, f64::MIN_POSITIVE, f64::MAX, 5e-324] {
        around(seam);
    }
    for special in [f64::INFINITY, f64::NEG_INFINITY, f64::NAN] {
        assert!(sin(special).is_nan() && cos(special).is_nan());
        assert!(sin_cos(special).0.is_nan() && sin_cos(special).1.is_nan());
    }
    assert_eq!(sin(0.0).to_bits(), 0.0_f64.to_bits());
    assert_eq!(sin(-0.0).to_bits(), (-0.0_f64).to_bits());
    assert_eq!(cos(-0.0), 1.0);
}
