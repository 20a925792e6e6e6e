//! The least that a learner's step can cost: the same tasks written by hand, everything known at
//! compile time, nothing checked, reported or configurable.
//!
//! They draw from the same generators and do the same arithmetic, but for the tie tolerance of the
//! greedy choice, the schedules, the sums of an episode and the calls that let a run be stopped.

use divan::Bencher;
use divan::counter::ItemsCount;
use runner::mdp::math::sin_cos;
use runner::mdp::numpy::NumpyRng;
use runner::mdp::streams::Stream;
use runner::mdp::{Env, FiniteMdp};

use super::lake;
use super::learner::{ALPHA, CART_POLE_EPISODES, EPSILON, GAMMA, LAKE_EPISODES};

/// A row of Q: ε-greedy.
fn choose<const N: usize>(row: &[f64; N], stream: &mut Stream) -> usize {
    let u = stream.uniform();
    if u < EPSILON {
        return ((u / EPSILON * N as f64) as usize).min(N - 1);
    }
    let mut best = 0;
    for a in 1..N {
        if row[a] > row[best] {
            best = a;
        }
    }
    best
}

fn largest<const N: usize>(row: &[f64; N]) -> f64 {
    row.iter().fold(f64::NEG_INFINITY, |m, &q| if q > m { q } else { m })
}

/// Outcomes as `(running sum of probabilities, next state, reward, terminal)`.
type Rows = Vec<[[(f64, usize, f64, bool); 3]; 4]>;

fn rows(mdp: &FiniteMdp) -> Rows {
    let row = |s, a| {
        let mut sum = 0.0;
        let mut outcomes = [(f64::INFINITY, 0, 0.0, true); 3];
        for (slot, o) in outcomes.iter_mut().zip(mdp.of(s, a)) {
            sum += o.probability;
            *slot = (sum, o.next_state as usize, o.reward, o.terminated);
        }
        outcomes
    };
    (0..mdp.n_states()).map(|s| std::array::from_fn(|a| row(s, a))).collect()
}

/// FrozenLake 8x8, Q-learning; with a table of potentials if `SHAPED`.
fn frozen_lake<const SHAPED: bool>(rows: &Rows, episodes: u32) -> u64 {
    let mut q = [[0.0f64; 4]; 64];
    let phi: [f64; 64] =
        std::array::from_fn(|s| 1.0 - 0.05 * ((7 - s / 8) as f64 + (7 - s % 8) as f64));
    let mut rng = NumpyRng::from_u64(0);
    let mut stream = Stream::new(0, "agent");
    let mut steps = 0;
    for _ in 0..episodes {
        rng.random();
        let mut s = 0;
        for _ in 0..200 {
            let a = choose(&q[s], &mut stream);
            let u = rng.random();
            let outcomes = &rows[s][a];
            let passed = outcomes.iter().filter(|o| o.0 <= u).count();
            let (_, next, mut reward, terminal) = outcomes[passed % 3];
            if SHAPED {
                reward += GAMMA * if terminal { 0.0 } else { phi[next] } - phi[s];
            }
            let future = if terminal { 0.0 } else { largest(&q[next]) };
            q[s][a] += ALPHA * (reward + GAMMA * future - q[s][a]);
            steps += 1;
            if terminal {
                break;
            }
            s = next;
        }
    }
    steps
}

/// CartPole with 12 x 12 x 24 x 24 bins, Q-learning. Bins by multiplication alone, which is not
/// NumPy's answer at every edge.
fn cart_pole(episodes: u32) -> u64 {
    const N: [f64; 4] = [12.0, 12.0, 24.0, 24.0];
    const HI: [f64; 4] = [2.4, 3.0, 0.5, 2.0];
    const LIMIT: f64 = 12.0 * 2.0 * std::f64::consts::PI / 360.0;
    fn cell(state: &[f64; 4]) -> usize {
        let mut cell = 0;
        for i in 0..4 {
            let x = f64::from(state[i] as f32);
            let k = ((x + HI[i]) * (N[i] / (2.0 * HI[i]))).clamp(0.0, N[i] - 1.0);
            cell = cell * N[i] as usize + k as i32 as usize;
        }
        cell
    }
    let mut q = vec![[0.0f64; 2]; 12 * 12 * 24 * 24];
    let mut rng = NumpyRng::from_u64(0);
    let mut stream = Stream::new(0, "agent");
    let mut steps = 0;
    for _ in 0..episodes {
        let mut state: [f64; 4] = std::array::from_fn(|_| rng.uniform(-0.05, 0.05));
        let mut s = cell(&state);
        for _ in 0..500 {
            let a = choose(&q[s], &mut stream);
            let force = if a == 1 { 10.0 } else { -10.0 };
            let [x, x_dot, theta, theta_dot] = state;
            let (sin, cos) = sin_cos(theta);
            let temp = (force + 0.05 * (theta_dot * theta_dot) * sin) / 1.1;
            let theta_acc =
                (9.8 * sin - cos * temp) / (0.5 * (4.0 / 3.0 - 0.1 * (cos * cos) / 1.1));
            let x_acc = temp - 0.05 * theta_acc * cos / 1.1;
            state = [
                x + 0.02 * x_dot,
                x_dot + 0.02 * x_acc,
                theta + 0.02 * theta_dot,
                theta_dot + 0.02 * theta_acc,
            ];
            let terminal = state[0].abs() > 2.4 || state[2].abs() > LIMIT;
            let next = cell(&state);
            let future = if terminal { 0.0 } else { largest(&q[next]) };
            q[s][a] += ALPHA * (1.0 + GAMMA * future - q[s][a]);
            steps += 1;
            if terminal {
                break;
            }
            s = next;
        }
    }
    steps
}

#[divan::bench]
fn frozen_lake_plain(bencher: Bencher) {
    let rows = rows(lake().finite().expect("FrozenLake has a model"));
    let steps = frozen_lake::<false>(&rows, LAKE_EPISODES);
    bencher.counter(ItemsCount::new(steps)).bench(|| frozen_lake::<false>(&rows, LAKE_EPISODES));
}

#[divan::bench]
fn frozen_lake_shaped(bencher: Bencher) {
    let rows = rows(lake().finite().expect("FrozenLake has a model"));
    let steps = frozen_lake::<true>(&rows, LAKE_EPISODES);
    bencher.counter(ItemsCount::new(steps)).bench(|| frozen_lake::<true>(&rows, LAKE_EPISODES));
}

#[divan::bench]
fn cart_pole_plain(bencher: Bencher) {
    let steps = cart_pole(CART_POLE_EPISODES);
    bencher.counter(ItemsCount::new(steps)).bench(|| cart_pole(CART_POLE_EPISODES));
}
