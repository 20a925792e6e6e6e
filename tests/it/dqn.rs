//! Networks in studies: what is learned where the answer is known, and how scripts set it up.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use runner::experiment::{Checkpoint, EpisodeRow, UnitRecord, run_unit};
use runner::learn::greedy_set;
use runner::nn::{Activations, Kernels, Mlp};
use runner::script::{Host, Plan};

use crate::language::plan_of;
use crate::support::{assert_same, expect_code, folder, runner, write};

fn trained(plan: &Plan, variant: usize, seed: u64) -> UnitRecord {
    let host = Host::open(plan).unwrap();
    let never = AtomicBool::new(false);
    run_unit(&host, &plan.variants[variant], seed, &never, &mut |_| {}).unwrap()
}

/// The action values of each of `n` states.
fn values(net: &Mlp<f32>, n: usize) -> Vec<Vec<f64>> {
    assert_eq!(net.shape().n_inputs, n, "an input a state");
    let mut out = Activations::new(net, 1);
    (0..n)
        .map(|s| {
            let x: Vec<f32> = (0..n).map(|i| f32::from(u8::from(i == s))).collect();
            net.forward(Kernels::detect(), &x, n, &mut out);
            out.q(0).iter().map(|q| f64::from(*q)).collect()
        })
        .collect()
}

/// The network at the end of training.
fn network(record: &UnitRecord) -> &Mlp<f32> {
    let last = record.networks.iter().find(|n| n.which == Checkpoint::Last);
    &last.expect("it is kept").net
}

/// Start, ice and goal in a row: with γ = 0.9 right is worth 0.9 and 1, left 0.81 in both, and
/// what runs into a wall as much as staying: 0.81 and 0.9.
#[test]
fn the_values_of_a_chain() {
    let script = r#"
let agent = #{
    gamma: 0.9, epsilon: 1.0, net_arch: [16], batch_size: 32, buffer_size: 2000,
    target_update_interval: 20, learning_rate: linear(0.01, 0.0005, 1500, #{ steps: true }),
};
let plain = experiment(#{
    name: "plain", env: env("FrozenLake-v1", #{ desc: ["SFG"], is_slippery: false }),
    agent: dqn(agent), episodes: 200, seeds: 1,
});
study("chain", [
    plain,
    plain.with(#{ name: "all on", agent: double_dqn(agent + #{
        dueling: true, loss: "huber", max_grad_norm: 10.0, prioritized_replay: true, tau: 0.2,
        target_update_interval: 4, n_steps: 1, replace: true,
    }) }),
])"#;
    let plan = plan_of(script, &[]);
    for variant in 0..2 {
        let record = trained(&plan, variant, 1);
        let q = values(network(&record), 3);
        let wanted = [[0.81, 0.81, 0.9, 0.81], [0.81, 0.9, 1.0, 0.9]];
        for (s, wanted) in wanted.iter().enumerate() {
            for (a, wanted) in wanted.iter().enumerate() {
                let error = (q[s][a] - wanted).abs();
                assert!(
                    error < 0.002,
                    "variant {variant}: Q({s}, {a}) = {}, not {wanted}",
                    q[s][a]
                );
            }
        }
    }
}

/// On dry land six steps are the fewest, and only actions that lie on a way of six are optimal.
#[test]
fn dry_land_is_crossed_by_the_shortest_way() {
    let script = r#"
let plain = experiment(#{
    name: "plain", env: env("FrozenLake-v1", #{ is_slippery: false }),
    agent: dqn(#{
        gamma: 0.95, net_arch: [32], learning_rate: 0.003, epsilon: linear(1.0, 0.1, 150),
        target_update_interval: 50, batch_size: 32,
    }),
    episodes: 200, seeds: 1,
});
study("lake", [
    plain,
    plain.with(#{ name: "shaped", potential: |s| 0.2 * (s.row + s.col) }),
])"#;
    let plan = plan_of(script, &[]);
    for variant in 0..2 {
        let record = trained(&plan, variant, 3);
        let q = values(network(&record), 16);
        // 0 left, 1 down, 2 right, 3 up.
        let (mut s, mut way) = (0, vec![0]);
        while s != 15 {
            s = match greedy_set(&q[s], 1.0)[0] {
                1 => s + 4,
                2 => s + 1,
                a => panic!("variant {variant}: {a} in {s} leads away from the goal"),
            };
            way.push(s);
            assert!(![5, 7, 11, 12].contains(&s) && way.len() <= 7, "{way:?}");
        }
        assert_eq!(way.len(), 7);
    }
    // What is paid and what is learned from are told apart.
    let record = trained(&plan, 1, 3);
    for row in &record.rows {
        assert!((row.native + row.shaping - row.learned).abs() < 1e-9, "{row:?}");
        assert!(row.native == 0.0 || row.native == 1.0);
    }
    assert!(record.rows.iter().any(|row| row.shaping != 0.0));
    assert!(trained(&plan, 0, 3).rows.iter().all(|row| row.shaping == 0.0));
}

/// The potential sees physical units whatever the network is shown, and every digit of them.
#[test]
fn a_potential_is_evaluated_on_the_raw_state() {
    let script = r#"
const G = 0.5;
let plain = experiment(#{
    name: "plain", env: "MountainCar-v0", max_steps: 60, episodes: 3, seeds: 1,
    agent: dqn(#{ gamma: G, net_arch: [8], batch_size: 16, learning_starts: 10000, epsilon: 1.0 }),
    potential: |s| 100.0 * s.position + s.velocity,
    terms: #{ potential: |t| 100.0 * (G * t.next_state.position - t.state.position)
        + (G * t.next_state.velocity - t.state.velocity) },
});
study("car", [
    plain,
    plain.with(#{ name: "normalised", normalise: #{ position: [-1.2, 0.6], velocity: [-0.07, 0.07] } }),
])"#;
    let plan = plan_of(script, &[]);
    // Without learning both play the same, by chance.
    let (plain, normalised) = (trained(&plan, 0, 1), trained(&plan, 1, 1));
    for (plain, normalised) in plain.rows.iter().zip(&normalised.rows) {
        assert_ne!(plain.start, normalised.start, "the network is shown other numbers");
        let start = plain.start;
        assert_eq!(*plain, EpisodeRow { start, ..normalised.clone() });
    }
    for row in &plain.rows {
        assert!((row.shaping - row.terms[0]).abs() < 1e-9 * row.shaping.abs(), "{row:?}");
        assert!(row.shaping.abs() > 100.0 && row.native == -60.0, "{row:?}");
    }
}

#[test]
fn exploration_falls_along_a_line() {
    let script = r#"
let plain = experiment(#{
    name: "plain", env: "FrozenLake-v1", episodes: 40, seeds: 1,
    agent: dqn(#{ net_arch: [4], batch_size: 8, exploration_fraction: 0.5,
        exploration_initial_eps: 0.9, exploration_final_eps: 0.1 }),
});
study("epsilon", [
    plain,
    plain.with(#{ name: "default", agent: dqn(#{ net_arch: [4], batch_size: 8,
        exploration_fraction: 0.25 }) }),
    plain.with(#{ name: "to nothing", agent: dqn(#{ net_arch: [4], batch_size: 8,
        exploration_fraction: 1.0, exploration_final_eps: 0.0 }) }),
])"#;
    let plan = plan_of(script, &[]);
    for (variant, [start, end, over]) in
        [[0.9, 0.1, 20.0], [1.0, 0.05, 10.0], [1.0, 0.0, 40.0]].into_iter().enumerate()
    {
        let rows = trained(&plan, variant, 0).rows;
        assert_eq!(rows.len(), 40);
        for (episode, row) in rows.iter().enumerate() {
            let wanted = start + (end - start) * (episode as f64 / over).min(1.0);
            assert!((row.epsilon - wanted).abs() < 1e-12, "episode {episode}: {}", row.epsilon);
        }
    }
}

/// What is refused is neither played nor bootstrapped from: on the way round by the left edge the
/// goal is eight steps away and not six.
#[test]
fn a_shield_is_kept_to() {
    let script = r#"
experiment(#{
    env: env("FrozenLake-v1", #{ desc: ["SFF", "FFF", "FFG"], is_slippery: false }),
    // Down the left edge, then right.
    allowed: |s, a| if s.row < 2 { a == 1 } else { a == 2 || a == 0 },
    agent: dqn(#{ gamma: 0.5, epsilon: 1.0, net_arch: [16], batch_size: 32, learning_rate: 0.005,
        target_update_interval: 20 }),
    episodes: 150, seeds: 1,
})"#;
    let plan = plan_of(script, &[]);
    let record = trained(&plan, 0, 2);
    assert!(record.rows.iter().all(|row| row.native == 1.0), "nothing else leads anywhere");
    let q = values(network(&record), 9);
    for (s, a, wanted) in
        [(0, 1, 0.125), (3, 1, 0.25), (6, 2, 0.5), (7, 2, 1.0), (6, 0, 0.25), (7, 0, 0.25)]
    {
        assert!((q[s][a] - wanted).abs() < 0.002, "Q({s}, {a}) = {}, not {wanted}", q[s][a]);
    }
}

#[test]
fn threads_change_no_byte() {
    let script = r#"
let cart = experiment(#{
    name: "cart", env: "CartPole-v1", episodes: 15, seeds: 3,
    agent: dqn(#{ net_arch: [16, 16], batch_size: 16, log_interval: 50, n_steps: 3 }),
});
study("jobs", [
    cart,
    cart.with(#{ name: "double", agent: double_dqn(#{ net_arch: [16], batch_size: 16,
        dueling: true, prioritized_replay: true }) }),
])"#;
    let dir = folder();
    let script = write(dir.path(), "jobs.rhai", script);
    let exec = |jobs: &str| {
        let out = dir.path().join(jobs);
        let mut command = runner();
        command.arg("exec").arg(&script).args(["--jobs", jobs]).arg("--out").arg(&out);
        expect_code(&command.output().unwrap(), 0);
        out
    };
    let (one, two) = (exec("1"), exec("2"));
    assert_same(&one, &two);
    let read = |name: &str| std::fs::read_to_string(Path::new(&one).join(name)).unwrap();
    assert!(read("episodes.csv").lines().next().unwrap().contains("epsilon"));
}
