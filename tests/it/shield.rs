//! A shield: what it refuses is neither taken nor bootstrapped from, by any agent. And initial
//! action values as functions.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use runner::env::{EnvVisitor, make};
use runner::experiment::{Limits, World, train};
use runner::learn::registry::{AGENTS, Setup, TabularAgent};
use runner::learn::{Agent, AgentConfig, Exploration, Last, Learn, ParamValue, QTable};
use runner::mdp::numpy::NumpyRng;
use runner::mdp::streams::Stream;
use runner::mdp::{Action, Env};
use runner::shaping::{
    ActionSet, AnyCells, Bins, Dim, NativeReward, NoPotential, Seen, Shield, ShieldFn, Shielded,
    ShieldedCells, StateIndex,
};
use serde_json::json;

use crate::support::{
    build_of, code, expect_code, folder, run, runner, stderr, stdout, stored, write,
};

/// Checks every action against what was allowed where it was taken.
struct Witness {
    agent: Box<dyn TabularAgent>,
    /// Cell, what was allowed, what was played.
    seen: Vec<(usize, ActionSet, Action)>,
}

impl Witness {
    fn note(&mut self, s: Shielded, a: Action) -> Action {
        assert!(s.allows(a), "action {a} is refused in {s:?}");
        self.seen.push((s.cell, s.allowed, a));
        a
    }
}

impl Agent for Witness {
    fn gamma(&self) -> f64 {
        self.agent.gamma()
    }

    fn bootstraps_when_truncated(&self) -> bool {
        self.agent.bootstraps_when_truncated()
    }

    fn epsilon(&self) -> f64 {
        self.agent.epsilon()
    }

    fn q(&self) -> Option<&QTable> {
        self.agent.q()
    }
}

impl Learn<Shielded> for Witness {
    fn begin(&mut self, s: Shielded) -> Action {
        let a = self.agent.begin(s);
        self.note(s, a)
    }

    fn step(&mut self, reward: f64, next: Shielded) -> Action {
        let a = self.agent.step(reward, next);
        self.note(next, a)
    }

    fn end(&mut self, reward: f64, last: Last<Shielded>) {
        self.agent.end(reward, last);
    }
}

/// On the 8x8 lake: left is refused everywhere, up in odd columns.
fn refused(s: usize) -> ActionSet {
    if s.is_multiple_of(2) { ActionSet(0b1110) } else { ActionSet(0b0110) }
}

/// Lets every learner loose behind the shield; what is refused has tempting values.
struct Temptation;

impl EnvVisitor for Temptation {
    type Out = usize;

    fn visit<E: Env + Clone + 'static>(self, env: E) -> usize {
        let behaviours = [
            Exploration::EpsilonGreedy,
            Exploration::Softmax { temperature: 0.5 },
            Exploration::Ucb { c: 0.5 },
        ];
        let mut tried = 0;
        for spec in AGENTS.iter().filter(|s| s.params.iter().any(|p| p.name == "initial_q")) {
            for exploration in behaviours {
                let mut config = AgentConfig::new(spec);
                let explores = config.params.contains_key("exploration");
                if explores {
                    config.params.insert("exploration", ParamValue::Exploration(exploration));
                } else if exploration != Exploration::EpsilonGreedy {
                    continue;
                }
                let Some(build) = build_of(spec) else { continue };
                let agent = build(&config, setup(&env)).boxed();
                Self::tempt(spec.name, &env, agent);
                tried += 1;
            }
        }
        tried
    }
}

const TEMPTING: f64 = 1e6;

fn setup<E: Env>(env: &E) -> Setup {
    let (n_states, n_actions) = (env.n_states().unwrap(), env.n_actions());
    let value = |i| if refused(i / n_actions).contains(i % n_actions) { 0.0 } else { TEMPTING };
    let initial_q = Some((0..n_states * n_actions).map(value).collect());
    let stream = Stream::new(3, "agent");
    Setup { n_states, n_actions, seed: 3, stream, initial_q, initial_v: None, policy: None }
}

impl Temptation {
    fn tempt<E: Env + Clone>(name: &str, env: &E, agent: Box<dyn TabularAgent>) {
        let n_states = env.n_states().unwrap();
        // The lake's fields are row, column, index and tile.
        let allowed = ShieldFn::new(|fields| Ok(refused(fields[2] as usize)));
        let mut world = World {
            env: env.clone(),
            discretiser: ShieldedCells {
                cells: AnyCells::Index(StateIndex { n_states }),
                shield: Shield::new(4, n_states, allowed),
            },
            potential: NoPotential,
            reward: NativeReward,
        };
        // Short enough for some episodes to be truncated.
        let limits = Limits { episodes: 300, max_steps: Some(15), ..Limits::EPISODE };
        let mut witness = Witness { agent, seen: Vec::new() };
        let (mut rng, stop) = (NumpyRng::from_u64(1), AtomicBool::new(false));
        assert!(train(&mut world, &mut witness, limits, &mut rng, &stop, |_, _| {}).is_ok());
        assert!(witness.seen.len() > 2_000, "{name}");
        let q = witness.q().unwrap();
        for (i, value) in q.values().iter().enumerate() {
            let (s, a) = (i / q.n_actions(), i % q.n_actions());
            if refused(s).contains(a) {
                // Rewards are at most 1; entropy is worth at most 0.1 ln 4 a step.
                assert!((0.0..15.0).contains(value), "{name}: Q({s}, {a}) = {value}");
            } else {
                assert_eq!(*value, TEMPTING, "{name}: Q({s}, {a}) has been learned");
            }
        }
    }
}

#[test]
fn no_learner_takes_or_bootstraps_from_what_is_refused() {
    let kwargs = json!({ "map_name": "8x8" });
    let env = make("FrozenLake-v1", kwargs.as_object().unwrap()).unwrap();
    assert!(env.visit(Temptation) >= 25);
}

/// One cell for all of CartPole, and a shield that is a controller.
struct OneCell;

impl EnvVisitor for OneCell {
    type Out = ();

    fn visit<E: Env + Clone + 'static>(self, env: E) {
        let dim = Dim { field: 2, lo: -0.3, hi: 0.3, n: 1 };
        let towards = |fields: &[f64]| Ok(ActionSet(if fields[2] > 0.0 { 0b10 } else { 0b01 }));
        let mut world = World {
            env,
            discretiser: ShieldedCells {
                cells: AnyCells::Bins(Bins::new(&[dim]).unwrap()),
                shield: Shield::new(4, 0, ShieldFn::new(towards)),
            },
            potential: NoPotential,
            reward: NativeReward,
        };
        let spec = AGENTS.iter().find(|spec| spec.name == "sarsa_lambda").unwrap();
        let build = build_of(spec).expect("a learner");
        let stream = Stream::new(0, "agent");
        let (initial_q, initial_v, policy) = (None, None, None);
        let setup =
            Setup { n_states: 1, n_actions: 2, seed: 0, stream, initial_q, initial_v, policy };
        let agent = build(&AgentConfig::new(spec), setup).boxed();
        let mut witness = Witness { agent, seen: Vec::new() };
        let limits = Limits { episodes: 20, max_steps: Some(500), ..Limits::EPISODE };
        let (mut rng, stop) = (NumpyRng::from_u64(0), AtomicBool::new(false));
        assert!(train(&mut world, &mut witness, limits, &mut rng, &stop, |_, _| {}).is_ok());
        // Chance alone holds the pole for 22 steps, pushing the way it falls for about 42.
        assert!((700..1_000).contains(&witness.seen.len()), "{}", witness.seen.len());
        for set in [0b01, 0b10] {
            let n = witness.seen.iter().filter(|(_, allowed, _)| allowed.0 == set).count();
            assert!(n > 200, "{n} of the states of the only cell allow {set:b}");
        }
    }
}

#[test]
fn on_bins_the_state_itself_is_asked() {
    make("CartPole-v1", &serde_json::Map::new()).unwrap().visit(OneCell);
}

/// There are two ways of six steps around the holes, and the first, down from the start, is closed
/// at its second bend. Who plans as if it were open goes down, and stays there.
const CLOSED: &str = r#"
fn open(s, a) { !(s.row == 2 && s.col == 0 && a == 2) }
fn closer(s) { 0.1 * (s.row + s.col) }
let planned = experiment(#{
    name: "planned",
    env: env("FrozenLake-v1", #{ is_slippery: false }),
    agent: value_iteration(#{ gamma: 0.9 }),
    allowed: open,
    episodes: 3,
    seeds: 1,
});
let learned = planned.with(#{
    name: "learned",
    agent: q_learning(#{ gamma: 0.9, exploration: ucb(0.5) }),
    episodes: 400,
    window: 20,
});
study("closed", [
    planned,
    planned.with(#{ name: "shaped", potential: closer }),
    planned.with(#{ name: "iterated", agent: policy_iteration(#{ gamma: 0.9 }) }),
    learned,
    learned.with(#{ name: "paid", terms: #{ stay: |t| if t.state.row == 2 { 0.5 } else { 0.0 } } }),
])
    .expect("the planner goes round", |r| r.planned.final_return.mean == 1.0)
    .expect("with a potential too", |r| r.shaped.final_return.mean == 1.0)
    .expect("and by policy iteration", |r| r.iterated.final_return.mean == 1.0)
    .expect("which keeps the policy", |r| r.shaped.audit.policy_preserved)
    .expect("the learner finds a way", |r| r.learned.final_return.mean > 0.9)
    .expect("pay for staying does not", |r| !r.paid.audit.policy_preserved)
"#;

#[test]
fn planners_go_round_what_is_refused() {
    let dir = folder();
    let results = stored(dir.path(), CLOSED);
    for variant in ["planned", "shaped", "iterated", "learned"] {
        let played = run(&["play", results.to_str().unwrap(), "--variant", variant]);
        expect_code(&played, 0);
        let said = stderr(&played);
        assert!(said.contains("6 steps, return 1, terminated"), "{variant}: {said}");
    }
    // Without planning for it, the shield is where the way ends: nothing here allows (2, 0) right.
    let by_hand = ["rollout", "FrozenLake-v1", "--kwargs", r#"{"is_slippery": false}"#];
    let by_hand = run(&[&by_hand[..], &["--actions", "1,1,2,1,2,2"]].concat());
    let played = run(&["play", results.to_str().unwrap(), "--variant", "planned"]);
    assert_ne!(stdout(&by_hand), stdout(&played), "the way of the plan without a shield");
}

/// A stored policy keeps to the shield though a refused action has the better value.
#[test]
fn a_stored_policy_does_not_play_what_is_refused() {
    let script = r#"
        experiment(#{
            name: "upward",
            env: env("FrozenLake-v1", #{ is_slippery: false }),
            agent: q_learning(#{ initial_q: |s, a| if a == 1 { 1.0 } else { 0.0 } }),
            allowed: |s, a| a != 1,
            episodes: 5,
            seeds: 1,
        })
    "#;
    let dir = folder();
    let results = stored(dir.path(), script);
    let played = run(&["play", results.to_str().unwrap(), "--steps", "3"]);
    assert_eq!(code(&played), 0, "{}", stderr(&played));
    assert!(!stdout(&played).contains("\"action\":1"), "{}", stdout(&played));
    assert!(stdout(&played).contains("\"action\":0"), "{}", stdout(&played));
    let shown = stdout(&run(&["show", results.to_str().unwrap()]));
    assert!(shown.contains('←') && !shown.contains('↓'), "{shown}");
}

/// Every `policy.csv` below `folder`, as rows of numbers by state.
fn policies(folder: &Path) -> Vec<Vec<Vec<f64>>> {
    let mut stack: Vec<PathBuf> = vec![folder.to_path_buf()];
    let mut found = Vec::new();
    while let Some(path) = stack.pop() {
        if path.is_dir() {
            stack.extend(std::fs::read_dir(&path).unwrap().map(|e| e.unwrap().path()));
        } else if path.file_name().is_some_and(|name| name == "policy.csv") {
            let text = std::fs::read_to_string(&path).unwrap();
            let row = |line: &str| line.split(',').map(|x| x.parse().unwrap()).collect();
            found.push(text.lines().skip(1).map(row).collect());
        }
    }
    found
}

/// The table after one step of one episode, which changes one value of it.
fn after_one_step(experiment: &str) -> Vec<Vec<f64>> {
    let dir = folder();
    let script = format!(
        "let e = experiment(#{{ {experiment} }}); e.with(#{{ episodes: 1, seeds: 1, max_steps: 1 }})"
    );
    let results = stored(dir.path(), &script);
    let mut policies = policies(&results);
    assert_eq!(policies.len(), 1);
    policies.remove(0)
}

#[test]
fn initial_values_come_from_the_function() {
    let lake = r#"env: "FrozenLake-v1", agent: double_q_learning(#{ initial_q: |s, a| 10.0 * s.index + a }),"#;
    let rows = after_one_step(lake);
    assert_eq!(rows.len(), 16);
    let mut changed = 0;
    for row in &rows {
        let s = row[0];
        // Holes and the goal are never started from.
        let terminal = [5.0, 7.0, 11.0, 12.0, 15.0].contains(&s);
        for (a, q) in row[2..].iter().enumerate() {
            let expected = if terminal { 0.0 } else { 10.0 * s + a as f64 };
            changed += usize::from(*q != expected);
        }
    }
    assert_eq!(changed, 1, "the one that was learned");

    // The centres of three bins; the velocity stands at its middle, 0.
    let car = r#"env: "MountainCar-v0", agent: sarsa(#{ initial_q: |s| s.position + 100.0 * s.velocity }),
        discretiser: bins(#{ position: [-1.2, 0.6, 3] }),"#;
    let rows = after_one_step(car);
    assert_eq!(rows.len(), 3);
    let far = rows.iter().map(|row| {
        let centre = -0.9 + 0.6 * row[0];
        row[2..].iter().filter(|q| (**q - centre).abs() > 1e-12).count()
    });
    assert_eq!(far.sum::<usize>(), 1, "{rows:?}");
}

#[test]
fn initial_values_start_anew_when_the_function_changes() {
    let dir = folder();
    let script = |value: f64| {
        let text = format!(
            r#"experiment(#{{ env: "FrozenLake-v1", agent: sarsa(#{{ initial_q: |s| {value:?} }}),
                episodes: 1, seeds: 1, max_steps: 1 }})"#
        );
        write(dir.path(), "study.rhai", &text)
    };
    let out = dir.path().join("results");
    let mut first = Vec::new();
    for value in [1.0, 2.0] {
        let output =
            runner().arg("exec").arg(script(value)).arg("--out").arg(&out).output().unwrap();
        expect_code(&output, 0);
        first = policies(&out).iter().map(|rows| rows[1][2]).collect();
    }
    first.sort_by(f64::total_cmp);
    assert_eq!(first.last(), Some(&2.0), "{first:?}");
}
