//! Steps per second of every registered environment, alone: random actions, drawn beforehand, and
//! resets at the end of episodes. One JSON line each, for `benches/peers/steps.py`.
//!
//! ```sh
//! cargo bench --bench env_steps -- [--seconds 1] [--id CartPole-v1]
//! ```
//!
//! `lanes` is the number of instances that are stepped in turn: 1, and 1024 to compare with
//! implementations that step many at once.

use std::hint::black_box;
use std::io::Write;
use std::time::{Duration, Instant};

use runner::env::{EnvSpec, EnvVisitor, specs};
use runner::mdp::Env;
use runner::mdp::numpy::NumpyRng;
use runner::mdp::streams::Stream;
use serde_json::Map;

/// Actions drawn beforehand; a power of two, so that going round is cheap.
const ACTIONS: usize = 4096;

fn main() {
    let (mut seconds, mut only) = (1.0, None);
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        match arg.as_str() {
            "--seconds" => {
                seconds = args.next().and_then(|x| x.parse().ok()).expect("--seconds NUMBER");
            }
            "--id" => only = Some(args.next().expect("--id ID")),
            // Cargo says so.
            "--bench" => {}
            other => panic!("what is {other}?"),
        }
    }
    let mut out = std::io::stdout().lock();
    for spec in specs().iter().filter(|spec| only.as_ref().is_none_or(|id| *id == spec.id)) {
        for lanes in [1, 1024] {
            let env = spec.make(&Map::new()).expect("the defaults are right");
            let (steps, took) = env.visit(Walk { spec, lanes, seconds });
            let line = serde_json::json!({
                "id": spec.id, "lanes": lanes, "steps": steps, "seconds": took,
                "steps_per_second": steps as f64 / took,
            });
            writeln!(out, "{line}").expect("somebody reads this");
        }
    }
}

struct Walk {
    spec: &'static EnvSpec,
    lanes: usize,
    seconds: f64,
}

/// One instance, with its stream and the steps of its episode.
struct Lane<E> {
    env: E,
    rng: NumpyRng,
    steps: u32,
}

impl EnvVisitor for Walk {
    type Out = (u64, f64);

    fn visit<E: Env + Clone + 'static>(self, env: E) -> Self::Out {
        let limit = self.spec.max_steps.unwrap_or(u32::MAX);
        let mut stream = Stream::new(0, "bench");
        let actions: Vec<usize> = (0..ACTIONS).map(|_| stream.below(env.n_actions())).collect();
        if self.lanes == 1 {
            let mut lane = Lane::new(env, 0);
            // Looking at the clock costs as much as a few steps.
            return timed(self.seconds, || {
                for &action in &actions {
                    lane.step(action, limit);
                }
                actions.len()
            });
        }
        let mut lanes: Vec<Lane<E>> =
            (0..self.lanes).map(|i| Lane::new(env.clone(), i as u64)).collect();
        let mut next = 0;
        timed(self.seconds, || {
            for _ in 0..8 {
                for lane in &mut lanes {
                    lane.step(actions[next % ACTIONS], limit);
                    next += 1;
                }
            }
            8 * lanes.len()
        })
    }
}

impl<E: Env> Lane<E> {
    fn new(mut env: E, seed: u64) -> Self {
        let mut rng = NumpyRng::from_u64(seed);
        env.reset(&mut rng);
        Self { env, rng, steps: 0 }
    }

    #[inline(always)]
    #[expect(clippy::inline_always, reason = "a call would be measured too")]
    fn step(&mut self, action: usize, limit: u32) {
        let step = self.env.step(action, &mut self.rng);
        self.steps += 1;
        if step.terminated || self.steps >= limit {
            black_box(self.env.reset(&mut self.rng));
            self.steps = 0;
        }
        black_box(step);
    }
}

/// Calls `work` for `seconds`: the steps that it says it has done, and the seconds they took.
fn timed(seconds: f64, mut work: impl FnMut() -> usize) -> (u64, f64) {
    let (start, budget) = (Instant::now(), Duration::from_secs_f64(seconds));
    let mut done = 0;
    loop {
        done += work() as u64;
        let took = start.elapsed();
        if took >= budget {
            return (done, took.as_secs_f64());
        }
    }
}
