use super::*;

/// Pseudo-random arguments (`SplitMix64`).
pub(super) struct Arguments(u64);

impl Arguments {
    pub(super) fn new(seed: u64) -> Self {
        Arguments(seed)
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// From -range to range.
    pub(super) fn within(&mut self, range: f64) -> f64 {
        range * ((self.bits() >> 10) as f64 / (1_u64 << 53) as f64 - 1.0)
    }

    /// Any number, infinity or NaN, all bit patterns alike.
    pub(super) fn of_any_size(&mut self) -> f64 {
        f64::from_bits(self.bits())
    }
}

/// The same bits, or both NaN.
#[track_caller]
pub(super) fn assert_same(ours: f64, theirs: f64, what: &str, x: f64) {
    assert!(
        ours.to_bits() == theirs.to_bits() || (ours.is_nan() && theirs.is_nan()),
        "{what} at {x:e} ({:#018x}): {ours:e} instead of {theirs:e}",
        x.to_bits()
    );
}

#[test]
fn known_digits() {
    // (function, argument, value to more digits than matter)
    type Row = (fn(f64) -> f64, f64, &'static str);
    let rows: &[Row] = &[
        (sin, 0.5, "0.479425538604203000273287935215571388"),
        (cos, 0.5, "0.877582561890372716116281582603829652"),
        (sin, 1.0, "0.841470984807896506652502321630298999"),
        (cos, 1.0, "0.540302305868139717400936607442976604"),
        (sin, 355.0, "-0.0000301443533594884492143302800086501"),
        (sin, 1e22, "-0.8522008497671888017727058937530294"),
        (cos, 1e22, "0.523214785395138945497594473384709492"),
        (sin, std::f64::consts::PI, "1.22464679914735317722606593227499799708305e-16"),
        (cos, std::f64::consts::FRAC_PI_2, "6.123233995736765886130329661375001464e-17"),
        (tan, 1.0, "1.557407724654902230506974807458360173"),
        (asin, 1.0, "1.570796326794896619231321691639751442"),
        (acos, -1.0, "3.141592653589793238462643383279502884"),
        (atan, 1.0, "0.785398163397448309615660845819875721"),
        (sinh, 1.0, "1.175201193643801456882381850595600815"),
        (cosh, 1.0, "1.543080634815243778477905620757061683"),
        (tanh, 1.0, "0.761594155955764888119458282604793590"),
        (asinh, 1.0, "0.881373587019543025232609324979792309"),
        (acosh, 2.0, "1.316957896924816708625046347307968444"),
        (atanh, 0.5, "0.549306144334054845697622618461262852"),
        (exp, 1.0, "2.718281828459045235360287471352662498"),
        (exp2, 0.5, "1.414213562373095048801688724209698079"),
        (exp_m1, 1.0, "1.718281828459045235360287471352662498"),
        (ln, 2.0, "0.693147180559945309417232121458176568"),
        (ln_1p, 1.0, "0.693147180559945309417232121458176568"),
        (log2, 10.0, "3.321928094887362347870319429489390176"),
        (log10, 2.0, "0.301029995663981195213738894724493027"),
        (cbrt, 2.0, "1.259921049894873164767210607278228351"),
    ];
    for (row, &(f, x, digits)) in rows.iter().enumerate() {
        assert_eq!(f(x), digits.parse::<f64>().unwrap(), "row {row}: {digits} of {x}");
    }
    assert_eq!(atan2(-1.0, -1.0), -3.0 * std::f64::consts::FRAC_PI_4);
    assert_eq!(atan2(0.0, -1.0), std::f64::consts::PI);
    assert_eq!(hypot(3e300, 4e300), 5e300);
    assert_eq!(pow(10.0, 22.0), 1e22);
    assert_eq!(pow(0.1, 3.0), 1e-3_f64.next_up());
    assert_eq!(pow_int(-2.0, -3), -0.125);
    assert_eq!(log(8.0, 2.0), 3.0);
}

#[test]
fn every_power_is_core_maths() {
    let mut arguments = Arguments::new(4);
    let special = [0.0, 1.0, 5e-324, f64::MIN_POSITIVE, 1e-160, 1e160, f64::MAX, f64::INFINITY];
    let special = special.map(|x| [x, -x]).concat();
    let exponents = [0.0, -0.0, 1.0, 2.0, -1.0, 0.5, 3.0, -2.0, -0.5, 1.0_f64.next_up(), f64::NAN];
    for y in exponents {
        for &x in special.iter().chain(&[f64::NAN]) {
            assert_same(pow(x, y), core_math::pow(x, y), &format!("power {y:e}"), x);
        }
        for _ in 0..2000 {
            for x in [arguments.within(10.0), arguments.of_any_size()] {
                assert_same(pow(x, y), core_math::pow(x, y), &format!("power {y:e}"), x);
            }
        }
    }
    for n in [-3, -1, 0, 1, 2, 3, 17] {
        let x = arguments.within(3.0);
        assert_same(pow_int(x, n), core_math::pow(x, n as f64), &format!("power {n}"), x);
    }
}
