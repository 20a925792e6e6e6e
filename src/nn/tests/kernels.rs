//! Every kernel of every instruction set, against the loops of [`super::reference`].

use super::{assert_same, random, reference};
use crate::mdp::streams::Stream;
use crate::nn::kernels::{AdamStep, Affine, Gate};
use crate::nn::{Kernels, Real};

/// Numbers at which arithmetic is not ordinary.
const ODD: [f64; 12] = [
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    0.0,
    -0.0,
    // Subnormal and barely normal in float32, then in float64.
    1e-45,
    -3e-40,
    1.2e-38,
    5e-324,
    -1e-310,
    // The largest float32.
    3.4e38,
    -1.7e308,
];

/// `n` numbers, every so many of them odd, beginning `at` numbers into the result.
fn some<T: Real>(stream: &mut Stream, n: usize, odd: bool, at: usize) -> Vec<T> {
    let mut values = random::<T>(stream, at + n);
    if odd {
        for _ in 0..n.div_ceil(16) {
            let place = at + stream.below(n);
            values[place] = T::of(ODD[stream.below(ODD.len())]);
        }
    }
    values
}

/// Sizes of a case: rows, inputs, vectors in a row, and where in memory everything begins.
const CASES: [[usize; 4]; 17] = [
    [1, 1, 1, 0],
    [1, 4, 2, 1],
    [1, 5, 3, 0],
    [1, 3, 5, 3],
    [1, 6, 8, 0],
    [1, 2, 19, 0],
    [2, 4, 1, 0],
    [3, 8, 2, 2],
    [4, 9, 3, 0],
    [5, 13, 4, 0],
    [7, 12, 5, 1],
    [8, 16, 1, 0],
    [9, 17, 2, 0],
    [13, 3, 7, 0],
    [16, 5, 4, 5],
    [17, 7, 1, 0],
    [33, 11, 6, 0],
];

fn affine_and_outer<T: Real>() {
    let mut stream = Stream::new(1, "kernels");
    for ([rows, n_inputs, vectors, at], odd) in
        CASES.into_iter().flat_map(|case| [(case, false), (case, true)])
    {
        let width = vectors * T::LANES;
        let stride = n_inputs + at;
        let mut some = |n: usize| some::<T>(&mut stream, n, odd, at);
        let (x, w, bias, dy) =
            (some(rows * stride), some(n_inputs * width), some(width), some(rows * width));
        let passed = some(rows * width);
        let what = format!("{rows} rows, {n_inputs} inputs, {vectors} vectors, odd: {odd}");
        for (bias, gate) in [
            (Some(&bias[at..]), Gate::Open),
            (Some(&bias[at..]), Gate::Relu),
            (None, Gate::Passed(&passed[at..])),
        ] {
            let a = Affine { x: &x[at..], stride, n_inputs, w: &w[at..], bias, gate };
            let wanted = reference::affine(&a, width, rows);
            for kernels in Kernels::all() {
                let mut y = vec![T::of(7.0); at + rows * width];
                kernels.affine(&a, width, &mut y[at..]);
                assert_same(&format!("{kernels:?} {gate:.5?} {what}"), &y[at..], &wanted);
            }
        }
        let x = (&x[at..], stride, n_inputs);
        let (dw_wanted, db_wanted) = reference::outer(x, &dy[at..], width);
        for kernels in Kernels::all() {
            let (mut dw, mut db) = (vec![T::of(7.0); n_inputs * width], vec![T::of(7.0); width]);
            kernels.outer(x, &dy[at..], width, (&mut dw, &mut db));
            assert_same(&format!("{kernels:?} dw {what}"), &dw, &dw_wanted);
            assert_same(&format!("{kernels:?} db {what}"), &db, &db_wanted);
        }
    }
}

fn adam<T: Real>() {
    let mut stream = Stream::new(2, "kernels");
    let step = |size: f64| AdamStep {
        rest_1: T::of(0.1),
        beta_2: T::of(0.999),
        rest_2: T::of(0.001),
        size: T::of(size),
        scale: T::of(1.7),
        epsilon: T::of(1e-8),
    };
    for odd in [false, true] {
        let n = 40 * T::LANES;
        let start = [(); 4].map(|()| some::<T>(&mut stream, n, odd, 0));
        let mut wanted = start.clone();
        let steps = [0.01, 0.0, 1e4].map(step);
        let [g, m, v, params] = &mut wanted;
        // Second moments are squares.
        let squares = |v: &[T]| v.iter().map(|v| *v * *v).collect::<Vec<T>>();
        *v = squares(v);
        for step in &steps {
            reference::adam(step, g, m, v, params);
        }
        for kernels in Kernels::all() {
            let [g, mut m, v, mut params] = start.clone();
            let mut v = squares(&v);
            for step in &steps {
                kernels.adam(step, &g, (&mut m, &mut v), &mut params);
            }
            for (what, got, wanted) in
                [("m", m, &wanted[1]), ("v", v, &wanted[2]), ("params", params, &wanted[3])]
            {
                assert_same(&format!("{kernels:?} {what}, odd: {odd}"), &got, wanted);
            }
        }
    }
}

fn the_others<T: Real>() {
    let mut stream = Stream::new(3, "kernels");
    for (vectors, odd) in [(1, false), (2, false), (5, true), (64, false), (64, true)] {
        let n = vectors * T::LANES;
        let (from, to) = (some::<T>(&mut stream, n, odd, 0), some::<T>(&mut stream, n, odd, 0));
        let rate = T::of(0.005);
        let mut blended = to.clone();
        reference::blend(rate, &from, &mut blended);
        let scaled: Vec<T> = from.iter().map(|x| *x * rate).collect();
        let sum = reference::sum_of_squares(&from);
        for kernels in Kernels::all() {
            let what = format!("{kernels:?}, {vectors} vectors, odd: {odd}");
            let (mut x, mut y) = (from.clone(), to.clone());
            kernels.blend(rate, &x, &mut y);
            assert_same(&what, &y, &blended);
            assert_same(&what, &[kernels.sum_of_squares(&x)], &[sum]);
            kernels.scale(rate, &mut x);
            assert_same(&what, &x, &scaled);
        }
    }
}

#[test]
fn every_instruction_set_gives_the_bits_of_the_plain_loops() {
    affine_and_outer::<f32>();
    affine_and_outer::<f64>();
    adam::<f32>();
    adam::<f64>();
    the_others::<f32>();
    the_others::<f64>();
}

/// Of a unit that has died, the moments fade to 0 and not into subnormal numbers.
#[test]
fn fading_moments_become_zero() {
    let step = AdamStep {
        rest_1: 0.1,
        beta_2: 0.999,
        rest_2: 0.001,
        size: 0.001,
        scale: 1.0,
        epsilon: 1e-8,
    };
    for kernels in Kernels::all() {
        let (mut m, mut v, mut params) = ([1e-3f32; 16], [1e-35f32; 16], [0.5f32; 16]);
        for _ in 0..5000 {
            kernels.adam(&step, &[0.0; 16], (&mut m, &mut v), &mut params);
            assert!(m.iter().chain(&v).all(|x| !x.is_subnormal()), "{m:?} {v:?}");
        }
        assert_eq!((m, v), ([0.0; 16], [0.0; 16]));
    }
}
