//! Where the time of a step goes, for every sample script: what its parts cost alone, and what is left
//! for the learner and the loop.

use std::hint::black_box;
use std::io::Write;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use runner::env::EnvVisitor;
use runner::experiment::run_unit;
use runner::mdp::numpy::NumpyRng;
use runner::mdp::streams::Stream;
use runner::mdp::{Env, MAX_FIELDS};
use runner::script::{DiscretiserSpec, Host, PhiOn, Plan, Variant, load};
use runner::shaping::{Bins, RewardModel, Transition};

use super::median;

/// Nanoseconds per step.
struct Parts {
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
                let mut cells = host.callbacks().cells(cell, shape, &variant.normalise, &schema);
                time(&mut |i| {
                    black_box(cells.at(&states[i][..n]).ok());
                })
            }
            _ => 0.0,
        };
        let mut callbacks = 0.0;
        let is_raw = variant.potential_on == PhiOn::Raw;
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
fn of(plan: &Plan, variant: &Variant) -> Parts {
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

/// A table of the parts of every variant of the scripts in `folder`.
pub(super) fn breakdown(out: &mut impl Write, folder: &Path) {
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
            let parts = of(&plan, variant);
            writeln!(out, "| {name} | {} | {parts} |", variant.name).expect("somebody reads this");
        }
    }
}
