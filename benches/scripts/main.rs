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

mod calls;
mod parts;

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
                parts::breakdown(&mut std::io::stdout().lock(), Path::new("scripts"));
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
    let calls = calls::compiled();
    // From here on everything is interpreted: that cannot be taken back.
    runner::jit::disable();
    calls::report(&mut out, calls);
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
