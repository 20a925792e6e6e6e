//! Figures and examples of Sutton & Barto (2018) that concern control, and what is known of Taxi.
//! Each asserts what the figure is there to show, over enough runs to be sure of it.

use std::sync::atomic::AtomicBool;

use runner::env::{AnyEnv, make};
use runner::experiment::{Limits, World, train};
use runner::learn::registry::{AGENTS, Setup, TabularAgent};
use runner::learn::{Agent, AgentConfig, ParamValue, QTable, Schedule, Unit, argmax_tol};
use runner::mdp::numpy::NumpyRng;
use runner::mdp::streams::Stream;
use runner::mdp::{Env, FiniteMdp, Outcome};
use runner::shaping::{NativeReward, NoPotential, StateIndex};

use crate::support::build_of;
use crate::task::Task;

fn rate(x: f64) -> ParamValue {
    ParamValue::Schedule(Schedule::constant(x))
}

/// The agent called `name` with these parameters, for a task of this shape.
fn agent(
    name: &str,
    params: &[(&'static str, ParamValue)],
    shape: [usize; 2],
    seed: u64,
) -> Box<dyn TabularAgent> {
    agent_from(name, params, shape, seed, None)
}

/// The same with these initial values.
fn agent_from(
    name: &str,
    params: &[(&'static str, ParamValue)],
    [n_states, n_actions]: [usize; 2],
    seed: u64,
    initial_q: Option<Vec<f64>>,
) -> Box<dyn TabularAgent> {
    let spec = AGENTS.iter().find(|spec| spec.name == name).unwrap();
    let mut config = AgentConfig::new(spec);
    for (key, value) in params {
        assert!(config.params.insert(key, *value).is_some(), "{name} has {key}");
    }
    let stream = Stream::new(seed, "agent");
    let (initial_v, policy) = (None, None);
    let setup = Setup { n_states, n_actions, seed, stream, initial_q, initial_v, policy };
    build_of(spec).unwrap()(&config, setup).boxed()
}

/// Trains; steps and return of every episode, and the table.
fn run<E: Env>(
    env: E,
    mut agent: Box<dyn TabularAgent>,
    (episodes, max_steps): (u32, Option<u32>),
    seed: u64,
) -> (Vec<(u32, f64)>, QTable) {
    let discretiser = StateIndex { n_states: env.n_states().unwrap() };
    let mut world = World { env, discretiser, potential: NoPotential, reward: NativeReward };
    let limits = Limits { episodes, max_steps, ..Limits::EPISODE };
    let mut rows = Vec::new();
    let (mut rng, stop) = (NumpyRng::from_u64(seed), AtomicBool::new(false));
    let trained = train(&mut world, &mut agent, limits, &mut rng, &stop, |row, _| {
        rows.push((row.steps, row.native));
    });
    assert!(trained.is_ok());
    (rows, agent.q().unwrap().clone())
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (n, sum) = values.fold((0.0, 0.0), |(n, sum), x| (n + 1.0, sum + x));
    sum / n
}

/// The states of the greedy path from `start`, to the end or until it has gone on for too long.
fn greedy_path(mdp: &FiniteMdp, q: &QTable, start: usize) -> (Vec<usize>, bool) {
    let mut path = vec![start];
    while path.len() < 100 {
        let s = path[path.len() - 1];
        let o = mdp.of(s, argmax_tol(q.row(s)))[0];
        path.push(o.next_state as usize);
        if o.terminated {
            return (path, true);
        }
    }
    (path, false)
}

#[test]
fn example_6_6_the_cliff() {
    let AnyEnv::CliffWalking(env) = make("CliffWalking-v1", &serde_json::Map::new()).unwrap()
    else {
        unreachable!("the id says so")
    };
    let params = [("alpha", rate(0.5)), ("gamma", ParamValue::Float(1.0)), ("epsilon", rate(0.1))];
    let mdp = env.finite().unwrap().clone();
    let learned = |name: &str| -> Vec<(f64, Vec<usize>, bool)> {
        (0..50)
            .map(|seed| {
                let agent = agent(name, &params, [48, 4], seed);
                let (rows, q) = run(env.clone(), agent, (500, None), seed);
                let online = mean(rows[400..].iter().map(|row| row.1));
                let (path, ended) = greedy_path(&mdp, &q, 36);
                (online, path, ended)
            })
            .collect()
    };
    let (q_learning, sarsa) = (learned("q_learning"), learned("sarsa"));
    let online = |runs: &[(f64, Vec<usize>, bool)]| mean(runs.iter().map(|run| run.0));
    // The figure: about -25 against -50.
    assert!(online(&sarsa) > -32.0, "{}", online(&sarsa));
    assert!(online(&q_learning) < -40.0, "{}", online(&q_learning));
    // Q-learning finds the shortest path, 13 steps along the edge; SARSA keeps its distance.
    let edge = q_learning.iter().filter(|(_, path, ended)| *ended && path.len() == 14).count();
    assert!(edge >= 45, "{edge} of 50");
    let top = |path: &[usize]| path.iter().map(|s| s / 12).min();
    let safe = sarsa.iter().filter(|(_, path, _)| top(path) <= Some(1)).count();
    assert!(safe >= 45, "{safe} of 50");
}

#[test]
fn example_6_7_maximisation_bias() {
    let out =
        |probability, reward| Outcome { probability, next_state: 0, reward, terminated: true };
    let to_b = Outcome { probability: 1.0, next_state: 1, reward: 0.0, terminated: false };
    // A: half of the actions end the episode for nothing, half lead to B; B: whatever is done ends
    // it for -0.1 on average, with a standard deviation of 1.
    let a = (0..10).map(|i| if i < 5 { vec![out(1.0, 0.0)] } else { vec![to_b] }).collect();
    let b = (0..10).map(|_| vec![out(0.5, -1.1), out(0.5, 0.9)]).collect();
    let task = Task::new(&[a, b], 0);
    let params = [("alpha", rate(0.1)), ("gamma", ParamValue::Float(1.0)), ("epsilon", rate(0.1))];
    // The share of episodes that go by B, which takes a step more; 5 % would be best.
    let by_b = |name: &str| {
        mean((0..500).map(|seed| {
            let (rows, _) =
                run(task.clone(), agent(name, &params, [2, 10], seed), (100, None), seed);
            mean(rows.iter().map(|row| f64::from(row.0 - 1)))
        }))
    };
    let (single, double) = (by_b("q_learning"), by_b("double_q_learning"));
    assert!(single > 0.3, "{single}");
    assert!(double < 0.2, "{double}");
}

#[test]
fn figure_8_2_planning_in_the_dyna_maze() {
    const MAZE: [&[u8]; 6] =
        [b".......#G", b"..#....#.", b"S.#....#.", b"..#......", b".....#...", b"........."];
    let free = |r: i32, c: i32| {
        (0..6).contains(&r) && (0..9).contains(&c) && MAZE[r as usize][c as usize] != b'#'
    };
    let table: Vec<Vec<Vec<Outcome>>> = (0..54)
        .map(|s: i32| {
            let moves = [(-1, 0), (1, 0), (0, -1), (0, 1)];
            let go = |(dr, dc): (i32, i32)| {
                let (r, c) = (s / 9 + dr, s % 9 + dc);
                let next = if free(r, c) { r * 9 + c } else { s };
                let goal = next == 8;
                let reward = f64::from(u8::from(goal));
                vec![Outcome {
                    probability: 1.0,
                    next_state: next as u32,
                    reward,
                    terminated: goal,
                }]
            };
            moves.into_iter().map(go).collect()
        })
        .collect();
    let maze = Task::new(&table, 18);
    // The mean number of steps of each episode, over 30 runs as in the figure, which breaks ties at
    // random; here initial values that differ a little do, high enough not to fade before the goal
    // is found.
    let steps = |n: u64| -> Vec<f64> {
        let params = [
            ("alpha", rate(0.1)),
            ("gamma", ParamValue::Float(0.95)),
            ("epsilon", rate(0.1)),
            ("planning_steps", ParamValue::Int(n)),
        ];
        let runs: Vec<_> = (0..30)
            .map(|seed| {
                let mut ties = Stream::new(seed, "ties");
                let initial = (0..54 * 4).map(|_| 0.1 + 1e-3 * ties.uniform()).collect();
                let agent = agent_from("dyna_q", &params, [54, 4], seed, Some(initial));
                run(maze.clone(), agent, (50, Some(20_000)), seed).0
            })
            .collect();
        (0..50).map(|i| mean(runs.iter().map(|rows| f64::from(rows[i].0)))).collect()
    };
    let [none, five, fifty] = [0, 5, 50].map(steps);
    let shown = format!("{none:.0?}\n{five:.0?}\n{fifty:.0?}");
    // In the second episode already, and far apart.
    assert!(fifty[1] < 0.7 * five[1] && five[1] < 0.7 * none[1], "{shown}");
    // A few episodes of planning are enough; without it takes some 25.
    assert!(fifty[4] < 30.0 && five[9] < 40.0 && none[9] > 2.0 * five[9], "{shown}");
    assert!(none[45] < 40.0, "{shown}");
}

#[test]
fn taxi_reaches_about_8() {
    let AnyEnv::Taxi(env) = make("Taxi-v4", &serde_json::Map::new()).unwrap() else {
        unreachable!("the id says so")
    };
    let fading = Schedule::Exponential { start: 0.3, factor: 0.995, min: 0.0, unit: Unit::Episode };
    let params = [("alpha", rate(0.5)), ("epsilon", ParamValue::Schedule(fading))];
    let returns: Vec<f64> = (0..10)
        .map(|seed| {
            let agent = agent("q_learning", &params, [500, 6], seed);
            let (rows, _) = run(env.clone(), agent, (3000, Some(200)), seed);
            mean(rows[2500..].iter().map(|row| row.1))
        })
        .collect();
    // The optimum is 7.9 on average over the starts.
    assert!(mean(returns.iter().copied()) > 7.6, "{returns:?}");
    assert!(returns.iter().all(|x| (6.5..8.5).contains(x)), "{returns:?}");
}
