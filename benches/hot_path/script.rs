//! Calls into scripts, and what opening one costs.

use std::path::PathBuf;

use divan::{Bencher, black_box};
use runner::env::cart_pole::CartPole;
use runner::mdp::Env;
use runner::script::{DiscretiserSpec, Host, Plan, load};
use runner::shaping::{RewardModel, Transition};

const SCRIPT: &str = r#"
fn upright(s) { -20.0 * abs(s.theta) - 2.0 * abs(s.theta_dot + 4.0 * s.theta) }
fn paid(t) { if t.terminated { -1.0 } else { t.reward - abs(t.next_state.x) } }
fn cell(s) { [if s.theta < 0.0 { 0 } else { 1 }, if s.theta_dot < 0.0 { 0 } else { 1 }] }

experiment(#{
    env: "CartPole-v1",
    agent: q_learning(#{ alpha: 0.1, gamma: 0.99, epsilon: 0.1 }),
    discretiser: cells([2, 2], cell),
    potential: upright,
    potential_on: "raw",
    reward: paid,
    episodes: 1,
    seeds: 1,
})
"#;

const FIELDS: [f64; 4] = [0.1, 0.2, 0.03, 0.4];

/// The script as a file, which goes when the folder does.
fn file() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("bench.rhai");
    std::fs::write(&path, SCRIPT).expect("a small file");
    (folder, path)
}

fn plan() -> Plan {
    let (_folder, path) = file();
    load(&path).unwrap_or_else(|d| panic!("the script is sound: {d:?}"))
}

fn host(plan: &Plan) -> Host {
    Host::open(plan).unwrap_or_else(|d| panic!("the script is sound: {d:?}"))
}

#[divan::bench]
fn compile_and_plan(bencher: Bencher) {
    let (_folder, path) = file();
    bencher.bench(|| load(&path).is_ok());
}

#[divan::bench]
fn open_host(bencher: Bencher) {
    let plan = plan();
    bencher.bench(|| Host::open(&plan).is_ok());
}

#[divan::bench]
fn call_potential(bencher: Bencher) {
    let plan = plan();
    let host = host(&plan);
    let callback = plan.variants[0].potential.as_ref().expect("the script has one");
    let mut phi = host.callbacks().potential(callback, &CartPole::new(false).schema());
    bencher.bench_local(|| phi.at(black_box(&FIELDS), 1).expect("a number"));
}

#[divan::bench]
fn call_discretiser(bencher: Bencher) {
    let plan = plan();
    let host = host(&plan);
    let DiscretiserSpec::Cells { shape, cell } = &plan.variants[0].discretiser else {
        unreachable!("the script's discretiser is its own");
    };
    let mut cells = host.callbacks().cells(cell, shape, &[], &CartPole::new(false).schema());
    bencher.bench_local(|| cells.at(black_box(&FIELDS)).expect("a cell"));
}

#[divan::bench]
fn call_reward(bencher: Bencher) {
    let plan = plan();
    let host = host(&plan);
    let env = CartPole::new(false);
    let callback = plan.variants[0].reward.as_ref();
    let mut reward = host.callbacks().reward::<CartPole>(callback, &[], &env.schema());
    let obs = FIELDS.map(|x| x as f32);
    bencher.bench_local(|| {
        let t = Transition {
            state: black_box(&obs),
            action: 1,
            reward: 1.0,
            next_state: &obs,
            terminated: false,
            truncated: false,
            step: 3,
        };
        reward.reward(&env, &t, &mut []).expect("a number")
    });
}
