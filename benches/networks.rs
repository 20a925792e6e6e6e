//! Gradient steps of networks: microseconds, GFLOP/s, and which part that is of what the machine can
//! do at all, for each instruction set that it has.
//!
//! ```text
//! taskset -c 0 cargo bench --bench networks
//! ```
//!
//! A gradient step is what DQN does with a minibatch of 64: both networks forwards, one backwards,
//! Adam. Multiplications and additions are counted in the layers only: `2 · 64 · (3 W + W − W₁)`,
//! where W is the number of weights and W₁ that of the first layer, through which nothing flows back.
//! The peak is measured by products that are added to 24 sums, which nothing else slows down.

use std::hint::black_box;
use std::time::Instant;

use fearless_simd::{Level, Simd, SimdBase, SimdFloat, dispatch, f32x16};
use runner::mdp::streams::Stream;
use runner::nn::{Activations, Adam, Gradient, Kernels, Loss, Mlp, Shape};

const ROWS: usize = 64;
const INPUTS: usize = 4;
const REPEATS: usize = 7;

/// The shortest of several repetitions of `n` calls: seconds a call.
fn time(n: usize, mut f: impl FnMut()) -> f64 {
    let one = |f: &mut dyn FnMut()| {
        let start = Instant::now();
        for _ in 0..n {
            f();
        }
        start.elapsed().as_secs_f64() / n as f64
    };
    (0..REPEATS).map(|_| one(&mut f)).fold(f64::INFINITY, f64::min)
}

const SUMS: usize = 24;
const ROUNDS: usize = 1000;

#[expect(clippy::inline_always, reason = "compiled for the instruction set of its caller")]
#[inline(always)]
fn sums<S: Simd>(simd: S, x: f32) -> f32 {
    let (x, mut sums) = (f32x16::splat(simd, x), [f32x16::splat(simd, 0.0); SUMS]);
    for _ in 0..ROUNDS {
        for sum in &mut sums {
            *sum = sum.mul_add_precise(x, x);
        }
    }
    sums.iter().flat_map(|sum| sum.as_slice().iter()).sum()
}

fn peak() -> f64 {
    let level = Level::new();
    let seconds = time(1000, || {
        let x = black_box(0.5f32);
        black_box(dispatch!(level, simd => sums(simd, x)));
    });
    (2 * 16 * SUMS * ROUNDS) as f64 / seconds / 1e9
}

fn gradient_step(kernels: Kernels, hidden: &[usize], n: usize) -> (f64, f64) {
    let shape = Shape { n_inputs: INPUTS, hidden: hidden.to_vec(), n_actions: 2, dueling: false };
    let flop = 2 * ROWS * (4 * shape.n_weights() - INPUTS * hidden[0]);
    let mut stream = Stream::new(0, "bench");
    let mut online = Mlp::<f32>::new(shape, &mut stream);
    let target = online.clone();
    let (mut here, mut there) = (Activations::new(&online, ROWS), Activations::new(&online, ROWS));
    let (mut gradient, mut adam) = (Gradient::new(&online, ROWS), Adam::new(&online));
    let mut numbers =
        || -> Vec<f32> { (0..ROWS * INPUTS).map(|_| stream.uniform() as f32).collect() };
    let (x, next) = (numbers(), numbers());
    let seconds = time(n, || {
        target.forward(kernels, &next, INPUTS, &mut there);
        online.forward(kernels, &x, INPUTS, &mut here);
        for row in 0..ROWS {
            let q = there.q(row);
            let error = here.q(row)[row % 2] - (1.0 + 0.99 * q[0].max(q[1]));
            let (_, slope) = Loss::SquaredError.of(error);
            gradient.set_row(row, row % 2, slope / ROWS as f32);
        }
        gradient.backward(kernels, &online, (&x, INPUTS), &here);
        adam.step(kernels, 1e-4, &gradient, &mut online);
    });
    (seconds, flop as f64)
}

#[expect(clippy::print_stdout, reason = "this is a program of its own")]
fn main() {
    let peak = peak();
    println!("peak {peak:.0} GFLOP/s, float32, fused");
    println!(
        "{:>8} {:>10} {:>12} {:>10} {:>9} {:>8}",
        "set", "layers", "FLOP", "us", "GFLOP/s", "of peak"
    );
    for (i, kernels) in Kernels::all().into_iter().enumerate() {
        for (hidden, n) in [([24, 24], 4000), ([64, 64], 1500), ([256, 256], 150)] {
            let (seconds, flop) = gradient_step(kernels, &hidden, n / (1 + 20 * (i / 2)));
            println!(
                "{:>8} {:>10} {flop:>12} {:>10.2} {:>9.1} {:>7.0}%",
                kernels.name(),
                format!("{}/{}", hidden[0], hidden[1]),
                seconds * 1e6,
                flop / seconds / 1e9,
                100.0 * flop / seconds / 1e9 / peak
            );
        }
    }
}
