//! Single callbacks: in Rust, native, interpreted.

use std::hint::black_box;
use std::io::Write;
use std::path::Path;
use std::time::Instant;

use runner::script::{DiscretiserSpec, Host, load};

use super::median;

/// States all over some bounds, in no order (Weyl sequences), as fields.
fn states(scale: &[f64]) -> Vec<Vec<f64>> {
    let field =
        |i: usize, k: usize| ((i as f64 * ((k + 2) as f64).sqrt()).fract() * 2.0 - 1.0) * scale[k];
    (0..4096).map(|i| (0..scale.len()).map(|k| field(i, k)).collect()).collect()
}

/// Nanoseconds that a call takes, over all of `states`: the median of some rounds.
fn nanoseconds(states: &[Vec<f64>], rounds: usize, mut call: impl FnMut(&[f64]) -> f64) -> f64 {
    let round = |_| {
        let start = Instant::now();
        for state in states {
            black_box(call(black_box(state)));
        }
        1e9 * start.elapsed().as_secs_f64() / states.len() as f64
    };
    median((0..rounds).map(round).collect())
}

/// A callback of a sample, and the same function in Rust.
struct Sample {
    name: &'static str,
    script: &'static str,
    variant: usize,
    scale: &'static [f64],
    rust: fn(&[f64]) -> f64,
    is_cell: bool,
}

fn worth(s: &[f64]) -> f64 {
    use runner::mdp::math::hypot;
    10.0 * (s[6] + s[7]) - 100.0 * (hypot(s[0], s[1]) + hypot(s[2], s[3]) + s[4].abs())
}

fn instruments(s: &[f64]) -> f64 {
    let legs = s[6] + s[7];
    let lean = 0.5 * ((0.5 * s[0] + s[2]).clamp(-0.4, 0.4) - s[4]) - s[5];
    let mut sink = -0.5 * s[3];
    if legs == 0.0 {
        sink += 0.5 * (0.55 * s[0].abs() - s[1]);
    }
    let part = |x: f64| ((x * 10.0 + 2.5).floor() as i64).clamp(0, 4);
    let (a, b, c) = (part(lean), part(sink), legs as i64);
    if c > 2 { -1.0 } else { ((a * 5 + b) * 3 + c) as f64 }
}

const LANDER: &[f64] = &[1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0];

const SAMPLES: [Sample; 5] = [
    Sample {
        name: "CartPole, upright",
        script: "scripts/cartpole.rhai",
        variant: 1,
        scale: &[2.4, 3.0, 0.2, 2.0],
        rust: |s| -20.0 * s[2].abs() - 2.0 * (s[3] + 4.0 * s[2]).abs(),
        is_cell: false,
    },
    Sample {
        name: "MountainCar, height",
        script: "scripts/mountain_car.rhai",
        variant: 1,
        scale: &[1.0, 0.07],
        rust: |s| 80.0 * ((1.0 + runner::mdp::math::sin(3.0 * s[0])) / 2.0 - 1.0),
        is_cell: false,
    },
    Sample {
        name: "MountainCar, energy",
        script: "scripts/mountain_car.rhai",
        variant: 3,
        scale: &[1.0, 0.07],
        rust: |s| {
            let height = (1.0 + runner::mdp::math::sin(3.0 * s[0])) / 2.0;
            let energy = height + 0.5 * (s[1] * s[1]) / (2.0 * 0.0025 / 3.0);
            80.0 * (energy - 1.0).min(0.0)
        },
        is_cell: false,
    },
    Sample {
        name: "LunarLander, worth",
        script: "scripts/lunar_lander.rhai",
        variant: 2,
        scale: LANDER,
        rust: worth,
        is_cell: false,
    },
    Sample {
        name: "LunarLander, instruments",
        script: "scripts/lunar_lander.rhai",
        variant: 0,
        scale: LANDER,
        rust: instruments,
        is_cell: true,
    },
];

/// Nanoseconds of a call of `sample`'s callback as it is run now: native, or interpreted.
fn called(sample: &Sample, rounds: usize) -> f64 {
    let plan = load(Path::new(sample.script)).unwrap_or_else(|d| panic!("{}: {d}", sample.name));
    let host = Host::open(&plan).expect("it was loaded");
    let variant = &plan.variants[sample.variant];
    let schema = variant.environment().expect("it was resolved").schema();
    let states = states(sample.scale);
    let same = |state: &[f64], x: f64| assert_eq!(x, (sample.rust)(state), "{}", sample.name);
    if sample.is_cell {
        let DiscretiserSpec::Cells { shape, cell } = &variant.discretiser else {
            panic!("{}: no cells", sample.name)
        };
        let mut cells = host.callbacks().cells(cell, shape, &[], &schema);
        for state in &states {
            same(state, cells.at(state).expect("a cell") as f64);
        }
        nanoseconds(&states, rounds, |fields| cells.at(fields).expect("a cell") as f64)
    } else {
        let potential = variant.potential.as_ref().expect("it has one");
        let mut phi = host.callbacks().potential(potential, &schema);
        for state in &states {
            same(state, phi.at(state, 1).expect("a number"));
        }
        nanoseconds(&states, rounds, |fields| phi.at(fields, 1).expect("a number"))
    }
}

/// Nanoseconds of a call in Rust, as machine code, and of the loop alone, for every sample.
pub(super) fn compiled() -> Vec<(f64, f64, f64)> {
    let mut calls = Vec::new();
    for sample in &SAMPLES {
        let states = states(sample.scale);
        let rust = black_box(sample.rust);
        let floor = nanoseconds(&states, 101, black_box(|s: &[f64]| s[0]));
        calls.push((nanoseconds(&states, 101, rust), called(sample, 101), floor));
    }
    calls
}

/// Prints what calls cost, now that they are interpreted.
pub(super) fn report(out: &mut impl Write, calls: Vec<(f64, f64, f64)>) {
    for (sample, (rust, native, floor)) in SAMPLES.iter().zip(calls) {
        let interpreted = called(sample, 5);
        writeln!(
            out,
            "{}: Rust {rust:.1} ns, native {native:.1} ns, {:.2} times; interpreted {interpreted:.0} \
             ns, {:.0} times native (the loop alone {floor:.1} ns)",
            sample.name,
            native / rust,
            interpreted / native,
        )
        .expect("somebody reads this");
    }
}
