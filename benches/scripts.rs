//! Scripted against compiled: whole training runs whose potential and reward are a script's, the same
//! runs with both written in Rust, and with both interpreted; and single callbacks the same three
//! ways. Both sides of a run learn the same table, to the bit, or this stops.
//!
//! ```sh
//! cargo bench --bench scripts -- [--rounds 7]
//! ```
//!
//! `--parts` prints instead where the time of a step goes, for every sample script.
//!
//! Every round measures all sides one after the other; ratios are medians over the rounds.

#![expect(clippy::manual_midpoint, reason = "as the scripts have it")]

use std::hint::black_box;
use std::io::Write;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use runner::env::EnvVisitor;
use runner::experiment::{Limits, World, run_unit, train};
use runner::learn::{Agent, QLearning, QTable, Schedule};
use runner::mdp::numpy::NumpyRng;
use runner::mdp::streams::Stream;
use runner::mdp::{Env, MAX_FIELDS};
use runner::script::{DiscretiserSpec, Host, Plan, Variant, load};
use runner::shaping::{
    Bins, CellPotential, Discretiser, Fault, RewardModel, StateIndex, TabulatedReward, Transition,
};

const GAMMA: f64 = 0.99;

/// A task: its script, and the same functions in Rust, of the fields of one state or two.
struct Task {
    name: &'static str,
    script: &'static str,
    potential: fn(&[f64]) -> f64,
    reward: fn(&[f64], &[f64], f64) -> f64,
}

const TASKS: [Task; 3] = [
    Task {
        name: "CartPole, bins",
        script: r#"
            fn upright(s) { -20.0 * abs(s.theta) - 2.0 * abs(s.theta_dot + 4.0 * s.theta) }
            fn centred(t) {
                if abs(t.next_state.theta) > 0.2095 { return -1.0; }
                let r = t.reward;
                if abs(t.next_state.x) > 1.2 { r -= 0.5; }
                r
            }
            experiment(#{
                env: "CartPole-v1",
                agent: q_learning(#{ alpha: 0.1, gamma: 0.99, epsilon: 0.1 }),
                discretiser: bins([[-2.4, 2.4, 12], [-3.0, 3.0, 12], [-0.5, 0.5, 24], [-2.0, 2.0, 24]]),
                potential: upright, reward: centred, episodes: 6000, seeds: 1,
            })"#,
        potential: |s| -20.0 * s[2].abs() - 2.0 * (s[3] + 4.0 * s[2]).abs(),
        reward: |_, next, r| {
            if next[2].abs() > 0.2095 {
                return -1.0;
            }
            if next[0].abs() > 1.2 { r - 0.5 } else { r }
        },
    },
    Task {
        name: "MountainCar, bins",
        script: r#"
            fn height(s) { (1.0 + sin(3.0 * s.position)) / 2.0 }
            fn swing(t) { t.reward + 0.1 * abs(t.next_state.velocity) / 0.07 }
            experiment(#{
                env: "MountainCar-v0",
                agent: q_learning(#{ alpha: 0.1, gamma: 0.99, epsilon: 0.1 }),
                discretiser: bins([[-1.2, 0.6, 40], [-0.07, 0.07, 40]]),
                potential: |s| 80.0 * (height(s) - 1.0), reward: swing, episodes: 4000, seeds: 1,
            })"#,
        potential: |s| 80.0 * ((1.0 + runner::mdp::math::sin(3.0 * s[0])) / 2.0 - 1.0),
        reward: |_, next, r| r + 0.1 * next[1].abs() / 0.07,
    },
    Task {
        name: "FrozenLake 8x8",
        script: r#"
            fn near(s) { -0.05 * (abs(s.goal_row - s.row) + abs(s.goal_col - s.col)) }
            fn careful(t) { if t.terminated && t.reward == 0.0 { -0.5 } else { t.reward } }
            experiment(#{
                env: env("FrozenLake-v1", #{ map_name: "8x8" }),
                agent: q_learning(#{ alpha: 0.1, gamma: 0.99, epsilon: 0.1 }),
                potential: near, reward: careful, episodes: 60000, seeds: 1,
            })"#,
        potential: |s| -0.05 * ((7.0 - s[0]).abs() + (7.0 - s[1]).abs()),
        reward: |_, _, r| r,
    },
];

/// A reward of two states' fields, in Rust.
struct RustReward {
    reward: fn(&[f64], &[f64], f64) -> f64,
}

impl<E: Env> RewardModel<E> for RustReward {
    #[inline]
    fn reward(&mut self, env: &E, t: &Transition<'_, E::Obs>, _: &mut [f64]) -> Result<f64, Fault> {
        let (mut state, mut next) = ([0.0; MAX_FIELDS], [0.0; MAX_FIELDS]);
        env.fields(t.state, &mut state);
        env.fields(t.next_state, &mut next);
        Ok((self.reward)(&state, &next, t.reward))
    }
}

/// The run in Rust. Gives what was learned, and the seconds that training took.
struct RustRun<'a> {
    task: &'a Task,
    variant: &'a Variant,
}

impl RustRun<'_> {
    fn run<E, D, R>(
        &self,
        env: E,
        discretiser: D,
        fields_of: impl Fn(&E, usize) -> [f64; MAX_FIELDS] + 'static,
        reward: R,
    ) -> (Vec<f64>, f64)
    where
        E: Env + Clone + 'static,
        D: Discretiser<E, State = usize>,
        R: RewardModel<E>,
    {
        let variant = self.variant;
        let (n_cells, n_actions, seed) =
            (discretiser.n_cells(), env.n_actions(), variant.seeds.0[0]);
        let constant = |value| Schedule::Constant { value };
        let agent = QTable::new(n_cells, n_actions, 0.0);
        let stream = Stream::new(seed, "agent");
        let mut agent = QLearning::new(agent, GAMMA, constant(0.1), constant(0.1), stream);
        let (phi, states) = (self.task.potential, env.clone());
        let potential =
            CellPotential::new(n_cells, Box::new(move |cell| Ok(phi(&fields_of(&states, cell)))));
        let mut world = World { env, discretiser, potential, reward };
        let limits =
            Limits { episodes: variant.episodes, max_steps: variant.max_steps, ..Limits::EPISODE };
        let mut rng = NumpyRng::from_u64(seed);
        let stop = AtomicBool::new(false);
        let start = Instant::now();
        train(&mut world, &mut agent, limits, &mut rng, &stop, |row, _| {
            black_box(row);
        })
        .expect("nothing fails");
        let took = start.elapsed().as_secs_f64();
        (agent.q().expect("a table").values().to_vec(), took)
    }
}

impl EnvVisitor for RustRun<'_> {
    type Out = (Vec<f64>, f64);

    fn visit<E: Env + Clone + 'static>(self, env: E) -> Self::Out {
        if let DiscretiserSpec::Bins(dims) = &self.variant.discretiser {
            let bins = Bins::new(dims).expect("checked");
            let centres = Bins::new(dims).expect("checked");
            let fields_of = move |_: &E, cell| {
                let mut fields = [0.0; MAX_FIELDS];
                centres.centre(cell, &mut fields);
                fields
            };
            let reward = RustReward { reward: self.task.reward };
            return self.run(env, bins, fields_of, reward);
        }
        let n_states = env.n_states().expect("a finite environment");
        let fields_of = |env: &E, index: usize| {
            let mut fields = [0.0; MAX_FIELDS];
            env.fields(&env.state(index).expect("a state"), &mut fields);
            fields
        };
        let mdp = env.finite().expect("a finite environment").clone();
        let reward = TabulatedReward::new(&mdp, 0, |_, _, i, _, _| {
            let outcome = mdp.outcomes()[i];
            Ok(if outcome.terminated && outcome.reward == 0.0 { -0.5 } else { outcome.reward })
        });
        self.run(env, StateIndex { n_states }, fields_of, reward.expect("nothing fails"))
    }
}

fn plan(task: &Task, folder: &Path) -> Plan {
    let path = folder.join("task.rhai");
    std::fs::write(&path, task.script).expect("a writable folder");
    load(&path).unwrap_or_else(|d| panic!("{}: {d}", task.name))
}

/// The scripted run, whose plan has been loaded anew.
fn scripted(plan: &Plan) -> (Vec<f64>, f64) {
    let host = Host::open(plan).expect("it was loaded");
    let variant = &plan.variants[0];
    let stop = AtomicBool::new(false);
    let start = Instant::now();
    let record = run_unit(&host, variant, variant.seeds.0[0], &stop, &mut |steps| {
        black_box(steps);
    })
    .unwrap_or_else(|e| panic!("{e:?}"));
    let took = start.elapsed().as_secs_f64();
    (record.q.expect("a table").values().to_vec(), took)
}

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

/// A function of fields.
type Call = dyn FnMut(&[f64]) -> f64;

/// The callback of `sample` as it is run now: native, or interpreted.
fn callback(sample: &Sample) -> Box<Call> {
    let plan = load(Path::new(sample.script)).unwrap_or_else(|d| panic!("{}: {d}", sample.name));
    let host = Host::open(&plan).expect("it was loaded");
    let variant = &plan.variants[sample.variant];
    let schema = variant.environment().expect("it was resolved").schema();
    if sample.is_cell {
        let DiscretiserSpec::Cells { shape, cell } = &variant.discretiser else {
            panic!("{}: no cells", sample.name)
        };
        let mut cells = host.callbacks().cells(cell, shape, &[], &schema);
        Box::new(move |fields| cells.at(fields).expect("a cell") as f64)
    } else {
        let potential = variant.potential.as_ref().expect("it has one");
        let mut phi = host.callbacks().potential(potential, &schema);
        Box::new(move |fields| phi.at(fields, 1).expect("a number"))
    }
}

fn median(mut list: Vec<f64>) -> f64 {
    list.sort_by(f64::total_cmp);
    list[list.len() / 2]
}

fn main() {
    let mut rounds = 7;
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        match arg.as_str() {
            "--rounds" => {
                rounds = args.next().and_then(|x| x.parse().ok()).expect("--rounds NUMBER");
            }
            "--parts" => {
                breakdown(&mut std::io::stdout().lock(), Path::new("scripts"));
                return;
            }
            // Cargo says so.
            "--bench" => {}
            other => panic!("what is {other}?"),
        }
    }
    let folder = tempfile::tempdir().expect("a writable folder");
    let mut out = std::io::stdout().lock();
    let mut native = Vec::new();
    for task in &TASKS {
        let (mut ratios, mut ours, mut theirs) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..rounds {
            let plan = plan(task, folder.path());
            let variant = &plan.variants[0];
            let env = variant.environment().expect("it was resolved");
            let (rust_q, rust) = env.visit(RustRun { task, variant });
            let (q, script) = scripted(&plan);
            assert!(
                rust_q.iter().map(|x| x.to_bits()).eq(q.iter().map(|x| x.to_bits())),
                "{}: script and Rust learn different tables",
                task.name
            );
            ratios.push(script / rust);
            ours.push(script);
            theirs.push(rust);
        }
        writeln!(
            out,
            "{}: Rust {:.1} ms, script {:.1} ms, {:.3} times",
            task.name,
            1e3 * median(theirs),
            1e3 * median(ours.clone()),
            median(ratios)
        )
        .expect("somebody reads this");
        native.push(median(ours));
    }
    let mut calls = Vec::new();
    for sample in &SAMPLES {
        let states = states(sample.scale);
        let mut native = callback(sample);
        for state in &states {
            assert_eq!(native(state), (sample.rust)(state), "{}", sample.name);
        }
        let rust = black_box(sample.rust);
        let floor = nanoseconds(&states, 101, black_box(|s: &[f64]| s[0]));
        calls.push((nanoseconds(&states, 101, rust), nanoseconds(&states, 101, native), floor));
    }
    // From here on everything is interpreted: that cannot be taken back.
    runner::jit::disable();
    for (sample, (rust, native, floor)) in SAMPLES.iter().zip(calls) {
        let interpreted = nanoseconds(&states(sample.scale), 5, callback(sample));
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
    for (task, native) in TASKS.iter().zip(native) {
        let (_, interpreted) = scripted(&plan(task, folder.path()));
        writeln!(
            out,
            "{}: interpreted {:.0} ms, {:.1} times native",
            task.name,
            1e3 * interpreted,
            interpreted / native
        )
        .expect("somebody reads this");
    }
}

/// Where the time of a step goes, for every sample script: what its parts cost alone, and what is
/// left for the learner and the loop.
mod parts {
    use super::{
        AtomicBool, Bins, DiscretiserSpec, Env, EnvVisitor, Host, Instant, MAX_FIELDS, NumpyRng,
        Plan, RewardModel, Stream, Transition, Variant, black_box, median, run_unit,
    };

    /// Nanoseconds per step.
    pub(super) struct Parts {
        total: f64,
        env: f64,
        discretiser: f64,
        callbacks: f64,
    }

    /// Steps that are measured.
    const STEPS: usize = 1 << 16;

    struct Alone<'a> {
        host: &'a Host,
        variant: &'a Variant,
    }

    impl EnvVisitor for Alone<'_> {
        type Out = (f64, f64, f64);

        fn visit<E: Env + Clone + 'static>(self, mut env: E) -> Self::Out {
            let (host, variant) = (self.host, self.variant);
            let schema = env.schema();
            let n = schema.fields.len();
            let mut rng = NumpyRng::from_u64(0);
            let mut stream = Stream::new(0, "bench");
            let actions: Vec<usize> = (0..STEPS).map(|_| stream.below(env.n_actions())).collect();
            let limit = variant.max_steps.unwrap_or(u32::MAX);
            let mut walked = Vec::with_capacity(STEPS);
            let mut walk = |keep: bool| {
                let mut obs = env.reset(&mut rng);
                let mut steps = 0;
                let start = Instant::now();
                for &action in &actions {
                    let step = env.step(action, &mut rng);
                    steps += 1;
                    if keep {
                        walked.push((obs, action, step));
                    }
                    obs = step.obs;
                    if step.terminated || steps >= limit {
                        obs = env.reset(&mut rng);
                        steps = 0;
                    }
                    black_box(&obs);
                }
                1e9 * start.elapsed().as_secs_f64() / STEPS as f64
            };
            walk(true);
            let alone = median((0..5).map(|_| walk(false)).collect());
            let fields = |obs: &E::Obs| {
                let mut fields = [0.0; MAX_FIELDS];
                env.fields(obs, &mut fields);
                fields
            };
            let time = |call: &mut dyn FnMut(usize)| {
                let round = |_| {
                    let start = Instant::now();
                    for i in 0..walked.len() {
                        call(i);
                    }
                    1e9 * start.elapsed().as_secs_f64() / walked.len() as f64
                };
                median((0..5).map(round).collect())
            };
            let states: Vec<_> = walked.iter().map(|w| fields(&w.0)).collect();
            let discretiser = match &variant.discretiser {
                DiscretiserSpec::Bins(dims) => {
                    let bins = Bins::new(dims).expect("checked");
                    time(&mut |i| {
                        black_box(bins.index(&states[i][..n]));
                    })
                }
                DiscretiserSpec::Cells { shape, cell } => {
                    let mut cells =
                        host.callbacks().cells(cell, shape, &variant.normalise, &schema);
                    time(&mut |i| {
                        black_box(cells.at(&states[i][..n]).ok());
                    })
                }
                _ => 0.0,
            };
            let mut callbacks = 0.0;
            let is_raw = variant.potential_on == runner::script::PhiOn::Raw;
            if let Some(potential) = variant.potential.as_ref().filter(|_| is_raw) {
                let mut phi = host.callbacks().potential(potential, &schema);
                callbacks += time(&mut |i| {
                    black_box(phi.at(&states[i][..n], 1).ok());
                });
            }
            let terms: Vec<_> = variant.terms.values().cloned().collect();
            if env.finite().is_none() && (variant.reward.is_some() || !terms.is_empty()) {
                let mut reward = host.callbacks().reward(variant.reward.as_ref(), &terms, &schema);
                let mut sums = vec![0.0; terms.len()];
                callbacks += time(&mut |i| {
                    let (state, action, step) = &walked[i];
                    let t = Transition {
                        state,
                        action: *action,
                        reward: step.reward,
                        next_state: &step.obs,
                        terminated: step.terminated,
                        truncated: false,
                        step: 0,
                    };
                    black_box(reward.reward(&env, &t, &mut sums).ok());
                });
            }
            (alone, discretiser, callbacks)
        }
    }

    /// The parts of the steps of `variant`.
    pub(super) fn of(plan: &Plan, variant: &Variant) -> Parts {
        let host = Host::open(plan).expect("it was loaded");
        let stop = AtomicBool::new(false);
        let mut steps = 0u64;
        let start = Instant::now();
        let few = Variant { episodes: variant.episodes.min(1000), ..variant.clone() };
        run_unit(&host, &few, few.seeds.0[0], &stop, &mut |n| steps += u64::from(n))
            .unwrap_or_else(|e| panic!("{e:?}"));
        let total = 1e9 * start.elapsed().as_secs_f64() / steps as f64;
        let env = variant.environment().expect("it was resolved");
        let (env, discretiser, callbacks) = env.visit(Alone { host: &host, variant });
        Parts { total, env, discretiser, callbacks }
    }

    impl std::fmt::Display for Parts {
        fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            let Self { total, env, discretiser, callbacks } = self;
            let rest = total - env - discretiser - callbacks;
            write!(f, "{total:.1} | {env:.1} | {discretiser:.1} | {callbacks:.1} | {rest:.1}")
        }
    }
}

/// A table of the parts of every variant of the scripts in `folder`.
fn breakdown(out: &mut impl Write, folder: &Path) {
    let mut scripts: Vec<_> = std::fs::read_dir(folder)
        .expect("the sample scripts")
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|x| x == "rhai"))
        .collect();
    scripts.sort();
    let head = "| script | variant | ns per step | environment | discretiser | callbacks | rest |";
    writeln!(out, "{head}\n|---|---|--:|--:|--:|--:|--:|").expect("somebody reads this");
    for script in scripts {
        let plan = load(&script).unwrap_or_else(|d| panic!("{}: {d}", script.display()));
        let name = script.file_stem().unwrap_or_default().display();
        for variant in &plan.variants {
            let parts = parts::of(&plan, variant);
            writeln!(out, "| {name} | {} | {parts} |", variant.name).expect("somebody reads this");
        }
    }
}
