//! The loops in which training spends its time, for every instruction set.
//!
//! A result must have the same bits on any machine, so what a machine has may decide how many
//! numbers are worked on at once, but never the order in which one of them is made. Hence
//!
//! - vectors run across results, not along sums: every result is summed in the order of its index,
//!   starting from what it starts from (a bias, or 0);
//! - a product that is added is added fused: rounded once, correctly, by hardware or (on x86-64
//!   without FMA, slowly) by software;
//! - where a sum does run along a vector, the vector has [`Real::LANES`] numbers on every machine.
//!
//! How many rows and columns are worked on at once (`R`, `C`) therefore changes nothing but speed.

#![allow(
    clippy::inline_always,
    reason = "a loop is compiled for an instruction set only as a part of what `vectorize` calls"
)]

use fearless_simd::{Level, Select, Simd, SimdBase, SimdFloat};

use super::Real;

/// The kernels for one instruction set.
#[derive(Debug, Clone, Copy)]
pub struct Kernels {
    level: Level,
}

/// `y = x w + b`, or what of it passes a gate.
#[derive(Debug, Clone, Copy)]
pub(super) struct Affine<'a, T> {
    /// The inputs: rows of `n_inputs` numbers, `stride` apart.
    pub(super) x: &'a [T],
    pub(super) stride: usize,
    pub(super) n_inputs: usize,
    /// Shape `[n_inputs, width]`.
    pub(super) w: &'a [T],
    /// What each result starts from, shape `[width]`; 0 without.
    pub(super) bias: Option<&'a [T]>,
    pub(super) gate: Gate<'a, T>,
}

/// What becomes of a result.
#[derive(Debug, Clone, Copy)]
pub(super) enum Gate<'a, T> {
    /// It stays.
    Open,
    /// The rectifier: 0 if it is negative.
    Relu,
    /// The rectifier's derivative: 0 where the number in this place is not positive.
    Passed(&'a [T]),
}

/// The numbers of a step of Adam.
#[derive(Debug, Clone, Copy)]
pub(super) struct AdamStep<T> {
    /// 1 − β₁, β₂ and 1 − β₂.
    pub(super) rest_1: T,
    pub(super) beta_2: T,
    pub(super) rest_2: T,
    /// The learning rate over 1 − β₁ᵗ.
    pub(super) size: T,
    /// 1 over √(1 − β₂ᵗ).
    pub(super) scale: T,
    pub(super) epsilon: T,
}

/// 2⁻¹²⁰: moments of Adam below it become 0. Those of a unit that has died would otherwise fade into
/// subnormal numbers and stay there, which most machines calculate with a hundred times slower; next
/// to ε they weigh nothing.
const TINY: f64 = 7.523_163_845_262_64e-37;

/// Calls `$body` with a token of the best instruction set, and whether its registers hold 16 vectors
/// and more.
macro_rules! dispatch {
    ($level:expr, |$simd:ident, $wide:ident| $body:expr) => {{
        #[cfg(target_arch = "x86_64")]
        {
            if let Some($simd) = $level.as_avx512() {
                const $wide: bool = true;
                return $simd.vectorize(
                    #[inline(always)]
                    || $body,
                );
            }
            if let Some($simd) = $level.as_avx2() {
                const $wide: bool = false;
                return $simd.vectorize(
                    #[inline(always)]
                    || $body,
                );
            }
            if let Some($simd) = $level.as_sse2() {
                const $wide: bool = false;
                return $simd.vectorize(
                    #[inline(always)]
                    || $body,
                );
            }
        }
        #[cfg(target_arch = "aarch64")]
        if let Some($simd) = $level.as_neon() {
            const $wide: bool = false;
            return $simd.vectorize(
                #[inline(always)]
                || $body,
            );
        }
        unreachable!("x86-64 has SSE2, arm64 has NEON")
    }};
}

impl Kernels {
    /// Those of the best instruction set that the machine has.
    pub fn detect() -> Self {
        Self { level: Level::new() }
    }

    /// Those of every instruction set that the machine has: they give the same bits.
    pub fn all() -> Vec<Self> {
        let best = Level::new();
        #[cfg(target_arch = "x86_64")]
        let levels = [
            best.as_avx512().map(Level::Avx512),
            best.as_avx2().map(Level::Avx2),
            best.as_sse2().map(Level::Sse2),
        ];
        #[cfg(not(target_arch = "x86_64"))]
        let levels = [Some(best)];
        levels.into_iter().flatten().map(|level| Self { level }).collect()
    }

    /// What the instruction set is called.
    pub fn name(self) -> &'static str {
        #[cfg(target_arch = "x86_64")]
        if self.level.as_avx512().is_some() {
            return "AVX-512";
        } else if self.level.as_avx2().is_some() {
            return "AVX2";
        } else {
            return "SSE2";
        }
        #[cfg(not(target_arch = "x86_64"))]
        "NEON"
    }

    /// `y = x w + b` for every row of `y`, shape `[rows, width]`.
    pub(super) fn affine<T: Real>(self, a: &Affine<'_, T>, width: usize, y: &mut [T]) {
        dispatch!(self.level, |simd, WIDE| affine::<_, T, WIDE>(simd, a, width, y));
    }

    /// `dw = xᵀ dy` and `db = Σ dy`: `x` has `rows` rows of `n_inputs` numbers, `stride` apart, `dy`
    /// as many of `width`; `dw` has shape `[n_inputs, width]`, `db` `[width]`.
    pub(super) fn outer<T: Real>(
        self,
        x: (&[T], usize, usize),
        dy: &[T],
        width: usize,
        (dw, db): (&mut [T], &mut [T]),
    ) {
        dispatch!(self.level, |simd, WIDE| {
            outer::<_, T, WIDE>(simd, x, dy, width, dw);
            sums::<_, T>(simd, dy, width, db);
        });
    }

    /// One step of Adam (Kingma & Ba 2015, algorithm 1) on `params`, with the moments `m` and `v`.
    pub(super) fn adam<T: Real>(
        self,
        step: &AdamStep<T>,
        gradient: &[T],
        (m, v): (&mut [T], &mut [T]),
        params: &mut [T],
    ) {
        dispatch!(self.level, |simd, _WIDE| adam(simd, step, gradient, (m, v), params));
    }

    /// `to += rate · (from − to)`.
    pub(super) fn blend<T: Real>(self, rate: T, from: &[T], to: &mut [T]) {
        dispatch!(self.level, |simd, _WIDE| blend(simd, rate, from, to));
    }

    /// `x *= factor`.
    pub(super) fn scale<T: Real>(self, factor: T, x: &mut [T]) {
        dispatch!(self.level, |simd, _WIDE| scale(simd, factor, x));
    }

    /// Σ x².
    pub(super) fn sum_of_squares<T: Real>(self, x: &[T]) -> T {
        dispatch!(self.level, |simd, _WIDE| sum_of_squares(simd, x))
    }
}

#[inline(always)]
fn splat<S: Simd, T: Real>(simd: S, x: T) -> T::Vector<S> {
    T::Vector::<S>::splat(simd, x)
}

#[inline(always)]
fn load<S: Simd, T: Real>(simd: S, from: &[T]) -> T::Vector<S> {
    T::Vector::<S>::from_slice(simd, &from[..T::LANES])
}

#[inline(always)]
fn affine<S: Simd, T: Real, const WIDE: bool>(
    simd: S,
    a: &Affine<'_, T>,
    width: usize,
    y: &mut [T],
) {
    let vectors = width / T::LANES;
    let mut at = 0;
    while at < vectors {
        let left = vectors - at;
        let j = at * T::LANES;
        at += match (y.len() == width, WIDE) {
            // One row alone leaves registers for more columns.
            (true, true) if left >= 8 => affine_rows::<S, T, 1, 8>(simd, a, width, y, j),
            (true, _) if left >= 4 => affine_rows::<S, T, 1, 4>(simd, a, width, y, j),
            (false, true) if left >= 4 => affine_rows::<S, T, 4, 4>(simd, a, width, y, j),
            (_, true) if left >= 2 => affine_rows::<S, T, 4, 2>(simd, a, width, y, j),
            (_, true) => affine_rows::<S, T, 8, 1>(simd, a, width, y, j),
            (_, false) => affine_rows::<S, T, 4, 1>(simd, a, width, y, j),
        };
    }
}

/// The results of all rows, `R` at a time, in the `C` vectors from column `j` on. Returns `C`.
#[inline(always)]
fn affine_rows<S: Simd, T: Real, const R: usize, const C: usize>(
    simd: S,
    a: &Affine<'_, T>,
    width: usize,
    y: &mut [T],
    j: usize,
) -> usize {
    let rows = y.len() / width;
    let mut r = 0;
    while r + R <= rows {
        affine_block::<S, T, R, C>(simd, a, width, y, r, j);
        r += R;
    }
    while r < rows {
        affine_block::<S, T, 1, C>(simd, a, width, y, r, j);
        r += 1;
    }
    C
}

/// The results of `R` rows from `r` on, in the `C` vectors from column `j` on.
#[inline(always)]
fn affine_block<S: Simd, T: Real, const R: usize, const C: usize>(
    simd: S,
    a: &Affine<'_, T>,
    width: usize,
    y: &mut [T],
    r: usize,
    j: usize,
) {
    let n = a.n_inputs;
    let rows: [&[T]; R] = std::array::from_fn(|i| &a.x[(r + i) * a.stride..][..n]);
    let start: [T::Vector<S>; C] = std::array::from_fn(|c| match a.bias {
        Some(bias) => load::<S, T>(simd, &bias[j + c * T::LANES..]),
        None => splat(simd, T::default()),
    });
    let mut sums = [start; R];
    for (k, w) in a.w.chunks_exact(width).enumerate().take(n) {
        let w = &w[j..][..C * T::LANES];
        let w: [T::Vector<S>; C] = std::array::from_fn(|c| load::<S, T>(simd, &w[c * T::LANES..]));
        for i in 0..R {
            let x = splat(simd, rows[i][k]);
            for c in 0..C {
                sums[i][c] = x.mul_add_precise(w[c], sums[i][c]);
            }
        }
    }
    let zero: T::Vector<S> = splat(simd, T::default());
    for (i, sums) in sums.into_iter().enumerate() {
        for (c, sum) in sums.into_iter().enumerate() {
            let at = (r + i) * width + j + c * T::LANES;
            let result = match a.gate {
                Gate::Open => sum,
                Gate::Relu => sum.simd_lt(zero).select(zero, sum),
                Gate::Passed(x) => load::<S, T>(simd, &x[at..]).simd_gt(zero).select(sum, zero),
            };
            result.store_slice(&mut y[at..][..T::LANES]);
        }
    }
}

#[inline(always)]
fn outer<S: Simd, T: Real, const WIDE: bool>(
    simd: S,
    x: (&[T], usize, usize),
    dy: &[T],
    width: usize,
    dw: &mut [T],
) {
    let vectors = width / T::LANES;
    let mut at = 0;
    while at < vectors {
        let j = at * T::LANES;
        at += match WIDE {
            true if vectors - at >= 2 => outer_rows::<S, T, 8, 2>(simd, x, dy, width, dw, j),
            true => outer_rows::<S, T, 8, 1>(simd, x, dy, width, dw, j),
            false => outer_rows::<S, T, 4, 1>(simd, x, dy, width, dw, j),
        };
    }
}

/// The results of all inputs, `R` at a time, in the `C` vectors from column `j` on. Returns `C`.
#[inline(always)]
fn outer_rows<S: Simd, T: Real, const R: usize, const C: usize>(
    simd: S,
    x: (&[T], usize, usize),
    dy: &[T],
    width: usize,
    dw: &mut [T],
    j: usize,
) -> usize {
    let mut k = 0;
    while k + R <= x.2 {
        outer_block::<S, T, R, C>(simd, x, dy, width, dw, k, j);
        k += R;
    }
    while k + 4 <= x.2 {
        outer_block::<S, T, 4, C>(simd, x, dy, width, dw, k, j);
        k += 4;
    }
    while k < x.2 {
        outer_block::<S, T, 1, C>(simd, x, dy, width, dw, k, j);
        k += 1;
    }
    C
}

/// The results of `R` inputs from `k` on, in the `C` vectors from column `j` on.
#[inline(always)]
fn outer_block<S: Simd, T: Real, const R: usize, const C: usize>(
    simd: S,
    (x, stride, _): (&[T], usize, usize),
    dy: &[T],
    width: usize,
    dw: &mut [T],
    k: usize,
    j: usize,
) {
    let mut sums = [[splat::<S, T>(simd, T::default()); C]; R];
    for (x, dy) in x.chunks(stride).zip(dy.chunks_exact(width)) {
        let x = &x[k..][..R];
        let dy = &dy[j..][..C * T::LANES];
        let dy: [T::Vector<S>; C] =
            std::array::from_fn(|c| load::<S, T>(simd, &dy[c * T::LANES..]));
        for i in 0..R {
            let x = splat(simd, x[i]);
            for c in 0..C {
                sums[i][c] = x.mul_add_precise(dy[c], sums[i][c]);
            }
        }
    }
    for i in 0..R {
        for c in 0..C {
            sums[i][c].store_slice(&mut dw[(k + i) * width + j + c * T::LANES..][..T::LANES]);
        }
    }
}

/// The sums of the rows of `dy`, shape `[width]`.
#[inline(always)]
fn sums<S: Simd, T: Real>(simd: S, dy: &[T], width: usize, db: &mut [T]) {
    for (at, db) in db.chunks_exact_mut(T::LANES).enumerate() {
        let mut sum = splat::<S, T>(simd, T::default());
        for dy in dy.chunks_exact(width) {
            sum += load::<S, T>(simd, &dy[at * T::LANES..]);
        }
        sum.store_slice(db);
    }
}

#[inline(always)]
fn adam<S: Simd, T: Real>(
    simd: S,
    step: &AdamStep<T>,
    gradient: &[T],
    (m, v): (&mut [T], &mut [T]),
    params: &mut [T],
) {
    let numbers = [step.rest_1, step.beta_2, step.rest_2, -step.size, step.scale, step.epsilon];
    let [rest_1, beta_2, rest_2, size, scale, epsilon] = numbers.map(|x| splat::<S, T>(simd, x));
    let (zero, tiny) = (splat::<S, T>(simd, T::default()), splat::<S, T>(simd, T::of(TINY)));
    let moments = m.chunks_exact_mut(T::LANES).zip(v.chunks_exact_mut(T::LANES));
    let values = gradient.chunks_exact(T::LANES).zip(params.chunks_exact_mut(T::LANES));
    for ((m, v), (g, p)) in moments.zip(values) {
        let g = load::<S, T>(simd, g);
        let old = load::<S, T>(simd, m);
        let first = (g - old).mul_add_precise(rest_1, old);
        let first = first.abs().simd_lt(tiny).select(zero, first);
        let second = load::<S, T>(simd, v).mul_add_precise(beta_2, g * g * rest_2);
        let second = second.simd_lt(tiny).select(zero, second);
        let root = second.sqrt().mul_add_precise(scale, epsilon);
        let p_new = (first / root).mul_add_precise(size, load::<S, T>(simd, p));
        first.store_slice(m);
        second.store_slice(v);
        p_new.store_slice(p);
    }
}

#[inline(always)]
fn blend<S: Simd, T: Real>(simd: S, rate: T, from: &[T], to: &mut [T]) {
    let rate = splat::<S, T>(simd, rate);
    for (from, to) in from.chunks_exact(T::LANES).zip(to.chunks_exact_mut(T::LANES)) {
        let old = load::<S, T>(simd, to);
        (load::<S, T>(simd, from) - old).mul_add_precise(rate, old).store_slice(to);
    }
}

#[inline(always)]
fn scale<S: Simd, T: Real>(simd: S, factor: T, x: &mut [T]) {
    let factor = splat::<S, T>(simd, factor);
    for x in x.chunks_exact_mut(T::LANES) {
        (load::<S, T>(simd, x) * factor).store_slice(x);
    }
}

#[inline(always)]
fn sum_of_squares<S: Simd, T: Real>(simd: S, x: &[T]) -> T {
    let mut sums = splat::<S, T>(simd, T::default());
    for x in x.chunks_exact(T::LANES) {
        let x = load::<S, T>(simd, x);
        sums = x.mul_add_precise(x, sums);
    }
    sums.as_slice().iter().fold(T::default(), |sum, x| sum + *x)
}
