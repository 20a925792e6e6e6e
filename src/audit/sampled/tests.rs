use super::*;
use crate::env::cart_pole::CartPole;
use crate::env::lunar_lander::{LunarLander, Mission};
use crate::env::mountain_car::MountainCar;
use crate::env::pendulum::Pendulum;
use crate::learn::greedy_set;
use crate::mdp::math;
use crate::shaping::Bins;

const GAMMA: f64 = 0.99;

type CarStep<'a> = Transition<'a, [f32; 2]>;
type Term = fn(&CarStep<'_>) -> f64;

fn dims() -> Vec<Dim> {
    vec![Dim { field: 0, lo: -1.2, hi: 0.6, n: 40 }, Dim { field: 1, lo: -0.07, hi: 0.07, n: 40 }]
}

fn settings() -> SampledSettings {
    SampledSettings {
        n_cells: 1_600,
        samples: 25,
        starts: 1_000,
        gamma: GAMMA,
        frame_skip: 1,
        seed: 0,
        threads: 2,
    }
}

/// Optimal values, and the greedy sets.
struct Solved {
    v: Vec<f64>,
    sets: Vec<Vec<usize>>,
}

/// Value iteration to 1e-8.
fn solve(mdp: &FiniteMdp) -> Solved {
    let mut v = vec![0.0; mdp.n_states()];
    let q = |v: &[f64], s: usize| -> Vec<f64> {
        let backup = |o: &Outcome| {
            let next = if o.terminated { 0.0 } else { v[o.next_state as usize] };
            o.probability * (o.reward + GAMMA * next)
        };
        (0..mdp.n_actions()).map(|a| mdp.of(s, a).iter().map(backup).sum()).collect()
    };
    let mut change = f64::INFINITY;
    while change > 1e-10 {
        change = 0.0;
        for s in 0..v.len() {
            let best = q(&v, s).into_iter().fold(f64::NEG_INFINITY, f64::max);
            change = change.max((best - v[s]).abs());
            v[s] = best;
        }
    }
    let scale = v.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    // Values are off by 1e-8, and differences of them.
    let sets = (0..v.len()).map(|s| greedy_set(&q(&v, s), 100.0 * scale)).collect();
    Solved { v, sets }
}

fn at_start(mdp: &FiniteMdp, v: &[f64]) -> f64 {
    mdp.initial().iter().zip(v).map(|(p, v)| p * v).sum()
}

/// The native model without a choice: every cell's first greedy action is played.
fn played(model: &Sampled, shaped: &Solved) -> FiniteMdp {
    let first = |(s, set): (usize, &Vec<usize>)| vec![model.mdp.of(s, set[0]).to_vec()];
    let table: Vec<Vec<Vec<Outcome>>> = shaped.sets.iter().enumerate().map(first).collect();
    FiniteMdp::new(&table, model.mdp.initial().to_vec()).unwrap()
}

/// The probability that an episode of a model without a choice ends within so many steps.
fn ends_within(mdp: &FiniteMdp, steps: usize) -> f64 {
    let (mut at, mut ended) = (mdp.initial().to_vec(), 0.0);
    for _ in 0..steps {
        let mut next = vec![0.0; at.len()];
        for (s, mass) in at.iter().enumerate() {
            for o in mdp.of(s, 0) {
                let p = mass * o.probability;
                if o.terminated { ended += p } else { next[o.next_state as usize] += p }
            }
        }
        at = next;
    }
    ended
}

/// The car with a potential and an extra reward.
fn car_with(
    settings: &SampledSettings,
    phi: impl Fn([f32; 2]) -> f64 + Sync,
    extra: impl Fn(&CarStep<'_>) -> f64 + Sync,
) -> Sampled {
    let (phi, extra) = (&phi, &extra);
    let dims = dims();
    let asked = || {
        let bins = Bins::new(&dims).unwrap();
        Asked::<MountainCar> {
            cell: Box::new(move |_, obs| Ok(bins.index(&obs.map(f64::from)))),
            phi: Box::new(move |_, _, obs| Ok(phi(*obs))),
            extra: Box::new(move |_, t| Ok(extra(t))),
        }
    };
    let ranges = cell_ranges(&dims, &[[-1.2, 0.6], [-0.07, 0.07]]);
    let env = MountainCar::new(0.0);
    sampled(&env, settings, &ranges, &asked, &|_, _| {}).unwrap().unwrap()
}

fn car(
    phi: impl Fn([f32; 2]) -> f64 + Sync,
    extra: impl Fn(&CarStep<'_>) -> f64 + Sync,
) -> Sampled {
    car_with(&settings(), phi, extra)
}

fn none(_: [f32; 2]) -> f64 {
    0.0
}

fn speed(x: f32) -> f64 {
    f64::from(x).abs()
}

/// States whose greedy sets differ.
fn changed(a: &Solved, b: &Solved) -> usize {
    a.sets.iter().zip(&b.sets).filter(|(a, b)| a != b).count()
}

#[test]
fn terms_that_are_taught_do_to_mountain_car_what_they_do() {
    let plain = car(none, |_| 0.0);
    let q = solve(&plain.mdp);
    let best = at_start(&plain.mdp, &q.v);
    let plain_play = played(&plain, &q);
    // Two columns of cells beyond the goal, at velocities of 0 and more.
    assert_eq!((plain.n_excluded(), plain.lost), (40, 0));
    assert_eq!(plain.transitions, (1_600 - 40) * 3 * 25);
    // From seed to seed the sampling moves this by 0.9 (standard deviation).
    assert!((best + 63.8).abs() < 2.5, "{best}");

    // The reward's name, its term, and the range of the true value that its optimal policy has.
    let heights =
        |t: &CarStep<'_>| 5.0 * (0.45 * math::sin(3.0 * f64::from(t.next_state[0])) + 0.55);
    let near = |t: &CarStep<'_>| {
        let to_the_right = t.state[0] > -std::f32::consts::FRAC_PI_6;
        if (t.action, to_the_right) == (2, true) || (t.action, to_the_right) == (0, false) {
            15.0
        } else {
            0.0
        }
    };
    let terms: [(&str, Term, f64, f64); 8] = [
        ("16 |v'|", |t| 16.0 * speed(t.next_state[1]), 1.03 * best, 1.002 * best),
        ("100 |v'|", |t| 100.0 * speed(t.next_state[1]), -99.9, -99.4),
        ("|x' + 0.5|", |t| speed(t.next_state[0] + 0.5), 1.03 * best, 1.002 * best),
        ("10 |x' + 0.5|", |t| 10.0 * speed(t.next_state[0] + 0.5), -99.2, -97.5),
        ("height x 5", heights, -99.2, -97.5),
        ("towards the near side", near, -100.0 - 1e-6, -99.98),
        ("goal", |t| if t.terminated { 250.0 } else { 0.0 }, best - 1e-6, best + 1e-6),
        (
            "another discount factor",
            |t| 300.0 * (0.95 * speed(t.next_state[1]) - speed(t.state[1])),
            1.02 * best,
            best,
        ),
    ];
    for (name, term, low, high) in terms {
        let model = car(none, term);
        assert_eq!(model.mdp, plain.mdp, "the same samples");
        let shaped = solve(&model.shaped());
        let played = played(&model, &shaped);
        let value = at_start(&played, &solve(&played).v);
        assert!(low <= value && value <= high, "{name}: {value}, of {best}");
        assert_eq!(changed(&shaped, &q) == 0, name == "goal", "{name}");
        if name == "100 |v'|" {
            let (lost, won) = (ends_within(&played, 300), ends_within(&plain_play, 300));
            assert!(lost < 0.05 && won > 0.99, "{lost} {won}");
        }
    }
}

#[test]
fn a_potential_of_the_cell_is_one_and_a_potential_of_the_state_is_none() {
    let bins = Bins::new(&dims()).unwrap();
    let of_cell = |obs: [f32; 2]| {
        let mut centre = [0.0; 2];
        bins.centre(bins.index(&obs.map(f64::from)), &mut centre);
        300.0 * centre[1].abs()
    };
    let cell = car(of_cell, |_| 0.0);
    let raw = car(|obs| 300.0 * speed(obs[1]), |_| 0.0);
    for (s, phi) in cell.phi.iter().enumerate().filter(|(s, _)| !cell.excluded[*s]) {
        for a in 0..3 {
            for i in cell.mdp.range(s, a) {
                let o = &cell.mdp.outcomes()[i];
                let next = if o.terminated { 0.0 } else { cell.phi[o.next_state as usize] };
                assert!((cell.shaping[i] - (GAMMA * next - phi)).abs() < 1e-12, "{s} {a}");
            }
        }
        assert!((raw.phi[s] - phi).abs() < 0.6, "the mean of a cell is near its centre");
    }
    // Every cell has draws of its own.
    let off = |s: usize| raw.phi[s] - cell.phi[s];
    assert!((off(30) - off(70)).abs() > 1e-6 && (off(30) - off(31)).abs() > 1e-6);
    let q = solve(&cell.mdp);
    assert_eq!(changed(&solve(&cell.shaped()), &q), 0);
    assert!(changed(&solve(&raw.shaped()), &q) > 20);
}

#[test]
fn the_model_depends_on_the_seed_and_on_nothing_else() {
    let model = |seed, threads| {
        let settings = SampledSettings { seed, threads, samples: 3, ..settings() };
        car_with(&settings, |obs| speed(obs[1]), |t| t.action as f64)
    };
    let one = model(0, 1);
    assert_eq!(one, model(0, 2));
    assert_eq!(one, model(0, 7));
    assert_ne!(one, model(1, 1));
    // Probabilities are shares of the samples.
    for (s, &excluded) in one.excluded.iter().enumerate() {
        for a in 0..3 {
            let thirds: f64 = one.mdp.of(s, a).iter().map(|o| 3.0 * o.probability).sum();
            assert!((thirds - 3.0).abs() < 1e-12);
            assert!(one.mdp.of(s, a).len() <= if excluded { 1 } else { 3 });
        }
    }
}

/// A model of `env` in bins over `dims`, without shaping, with samples from within `all`.
fn binned<E: Env<Obs = [f32; N]> + Clone, const N: usize>(
    env: &E,
    dims: &[Dim],
    all: &[[f64; 2]],
) -> Option<Sampled> {
    let asked = || {
        let bins = Bins::new(dims).unwrap();
        Asked::<E> {
            cell: Box::new(move |_, obs| Ok(bins.index(&obs.map(f64::from)))),
            phi: Box::new(|_, _, _| Ok(0.0)),
            extra: Box::new(|_, _| Ok(0.0)),
        }
    };
    let n_cells = dims.iter().map(|d| d.n).product();
    let settings = SampledSettings { n_cells, ..settings() };
    sampled(env, &settings, &cell_ranges(dims, all), &asked, &|_, _| {}).unwrap()
}

#[test]
fn cells_without_a_state_to_act_in_are_excluded() {
    // The pole falls at 0.2094 rad, beyond the middle two of these bins and a part of the next.
    let pole = Dim { field: 2, lo: -0.5, hi: 0.5, n: 8 };
    let all = [[-2.4, 2.4], [-3.0, 3.0], [-0.5, 0.5], [-2.0, 2.0]];
    let model = binned(&CartPole::new(false), &[pole], &all).unwrap();
    assert_eq!(model.excluded, [true, true, false, false, false, false, true, true]);
    assert_eq!((model.n_excluded(), model.lost), (4, 0));
    for s in [0, 1, 6, 7] {
        assert_eq!(model.mdp.of(s, 0).len(), 1);
        assert!(model.mdp.of(s, 0)[0].terminated);
    }
    assert_eq!(model.transitions, 4 * 2 * 25);

    // The circle passes through all of nine cells but the one in the middle.
    let bin = |field| Dim { field, lo: -1.0, hi: 1.0, n: 3 };
    let all = [[-1.0, 1.0], [-1.0, 1.0], [-8.0, 8.0]];
    let model = binned(&Pendulum::new(10.0), &[bin(0), bin(1)], &all).unwrap();
    assert_eq!(model.n_excluded(), 1);
    assert!(model.excluded[4] && model.lost == 0);

    // What is never drawn, but comes up: velocities beyond a tenth of the range.
    let bin = Dim { field: 1, lo: -0.07, hi: 0.07, n: 2 };
    let all = [[0.55, 0.6], [-0.07, 0.07]];
    let model = binned(&MountainCar::new(0.0), &[bin], &all).unwrap();
    assert_eq!(model.excluded, [false, true], "at 0.55 and more only the way back is no end");
    let into: f64 = (0..3)
        .flat_map(|a| model.mdp.of(0, a))
        .map(|o| if o.next_state == 1 && !o.terminated { 25.0 * o.probability } else { 0.0 })
        .sum();
    assert_eq!(model.lost as f64, into.round());

    let lander = LunarLander::new(Mission::default()).unwrap();
    let bin = Dim { field: 0, lo: -1.0, hi: 1.0, n: 2 };
    assert_eq!(binned(&lander, &[bin], &[[-1.0, 1.0]; 8]), None);
}

#[test]
fn the_first_cell_that_fails_is_the_error_whatever_the_threads() {
    let message = |threads, from: usize, cells: usize| {
        let dims = dims();
        let asked = || {
            let bins = Bins::new(&dims).unwrap();
            Asked::<MountainCar> {
                cell: Box::new(move |_, obs| Ok(bins.index(&obs.map(f64::from)))),
                phi: Box::new(move |_, cell, _| {
                    if cell < from { Ok(0.0) } else { Err(Fault(format!("in {cell}").into())) }
                }),
                extra: Box::new(|_, t| Ok(if t.state[0] > 0.3 { f64::NAN } else { 0.0 })),
            }
        };
        let ranges = cell_ranges(&dims, &[[-1.2, 0.6], [-0.07, 0.07]]);
        let settings = SampledSettings { threads, n_cells: cells, ..settings() };
        let env = MountainCar::new(0.0);
        sampled(&env, &settings, &ranges, &asked, &|_, _| {}).unwrap_err().to_string()
    };
    for threads in [1, 2, 5] {
        // The last of the cells before may lead into one of those.
        let first = message(threads, 700, 1_600);
        assert_eq!(first, message(1, 700, 1_600));
        assert!(first.starts_with("in 7"), "{first}");
    }
    assert_eq!(message(2, 1_600, 1_600), "what shaping adds to the reward is not finite: NaN");
    assert!(message(2, 1_600, 900).starts_with("there are 900 cells, and 9"));
}

#[test]
fn progress_is_told_to_the_end() {
    use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
    let (calls, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let dims = dims();
    let asked = || {
        let bins = Bins::new(&dims).unwrap();
        Asked::<MountainCar> {
            cell: Box::new(move |_, obs| Ok(bins.index(&obs.map(f64::from)))),
            phi: Box::new(|_, _, _| Ok(0.0)),
            extra: Box::new(|_, _| Ok(0.0)),
        }
    };
    let ranges = cell_ranges(&dims, &[[-1.2, 0.6], [-0.07, 0.07]]);
    let settings = SampledSettings { samples: 1, ..settings() };
    sampled(&MountainCar::new(0.0), &settings, &ranges, &asked, &|done, total| {
        assert_eq!(total, 1_600);
        calls.fetch_add(1, Relaxed);
        most.fetch_max(done, Relaxed);
    })
    .unwrap();
    assert_eq!((calls.into_inner(), most.into_inner()), (13, 1_600));
}
