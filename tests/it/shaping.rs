//! The training loop's arithmetic, seen by an agent that writes down what it is given.

use std::sync::atomic::AtomicBool;

use runner::env::frozen_lake::FrozenLake;
use runner::env::{AnyEnv, make};
use runner::experiment::{EpisodeRow, Limits, World, train};
use runner::learn::{Agent, Last, Learn, QTable};
use runner::mdp::numpy::NumpyRng;
use runner::mdp::{Action, Ending, FiniteState};
use runner::shaping::{CellPotential, Fault, NativeReward, NoPotential, Potential, StateIndex};
use serde_json::json;

const GAMMA: f64 = 0.9;

/// Plays a fixed list of actions and records every reward and ending.
struct Scribe {
    actions: Vec<Action>,
    next: usize,
    bootstraps: bool,
    states: Vec<usize>,
    rewards: Vec<f64>,
    last: Option<Last>,
}

impl Scribe {
    fn new(actions: &[Action], bootstraps: bool) -> Self {
        Self {
            actions: actions.to_vec(),
            next: 0,
            bootstraps,
            states: Vec::new(),
            rewards: Vec::new(),
            last: None,
        }
    }
}

impl Agent for Scribe {
    fn gamma(&self) -> f64 {
        GAMMA
    }

    fn bootstraps_when_truncated(&self) -> bool {
        self.bootstraps
    }

    fn epsilon(&self) -> f64 {
        0.0
    }

    fn q(&self) -> Option<&QTable> {
        None
    }
}

impl Learn<usize> for Scribe {
    fn begin(&mut self, s: usize) -> Action {
        self.states.push(s);
        self.next += 1;
        self.actions[self.next - 1]
    }

    fn step(&mut self, reward: f64, next: usize) -> Action {
        self.rewards.push(reward);
        self.begin(next)
    }

    fn end(&mut self, reward: f64, last: Last) {
        self.rewards.push(reward);
        self.last = Some(last);
    }
}

/// Φ(s) = 10 + s on the dry 4x4 lake.
fn phi(s: usize) -> f64 {
    10.0 + s as f64
}

fn lake() -> FrozenLake {
    let kwargs = json!({ "is_slippery": false });
    match make("FrozenLake-v1", kwargs.as_object().unwrap()).unwrap() {
        AnyEnv::FrozenLake(env) => env,
        _ => unreachable!("the id says so"),
    }
}

fn play<P: Potential<FrozenLake>>(potential: P, agent: &mut Scribe, max_steps: u32) -> EpisodeRow {
    let (env, discretiser) = (lake(), StateIndex { n_states: 16 });
    let mut world = World { env, discretiser, potential, reward: NativeReward };
    let limits = Limits { episodes: 1, max_steps: Some(max_steps), ..Limits::EPISODE };
    let mut rng = NumpyRng::from_u64(0);
    let mut rows = Vec::new();
    let stop = AtomicBool::new(false);
    assert!(train(&mut world, agent, limits, &mut rng, &stop, |row, _| rows.push(row)).is_ok());
    rows.remove(0)
}

fn potential() -> CellPotential {
    CellPotential::new(16, Box::new(|cell| Ok(phi(cell))))
}

/// Down, down, right, right, down, right: 0 4 8 9 10 14 15, the last of which is the goal.
const TO_THE_GOAL: [Action; 6] = [1, 1, 2, 2, 1, 2];

#[test]
fn the_potential_of_a_terminal_state_is_zero() {
    let mut agent = Scribe::new(&TO_THE_GOAL, true);
    let row = play(potential(), &mut agent, 100);
    assert_eq!(agent.states, [0, 4, 8, 9, 10, 14]);
    assert_eq!((row.ending, agent.last), (Ending::Terminated, Some(Last::Terminated)));
    let path = [0, 4, 8, 9, 10, 14];
    let mut expected: Vec<f64> = path.windows(2).map(|w| GAMMA * phi(w[1]) - phi(w[0])).collect();
    expected.push(1.0 - phi(14));
    assert_eq!(agent.rewards, expected);
    assert_eq!(row.native, 1.0);
    let sum = |xs: &[f64]| xs.iter().fold(0.0, |a, b| a + b);
    assert_eq!(row.learned, sum(&expected));
    assert!((row.learned - row.native - row.shaping).abs() < 1e-12);
}

#[test]
fn the_discounted_shaping_of_an_episode_telescopes_to_minus_phi_of_its_start() {
    let mut agent = Scribe::new(&TO_THE_GOAL, true);
    play(potential(), &mut agent, 100);
    let mut plain = Scribe::new(&TO_THE_GOAL, true);
    play(NoPotential, &mut plain, 100);
    let discounted = |rewards: &[f64]| rewards.iter().rev().fold(0.0, |sum, r| r + GAMMA * sum);
    let difference = discounted(&agent.rewards) - discounted(&plain.rewards);
    assert!((difference + phi(0)).abs() < 1e-12, "{difference}");
}

#[test]
fn a_truncated_state_keeps_its_potential_if_and_only_if_it_is_bootstrapped_from() {
    for (bootstraps, phi_last) in [(true, phi(8)), (false, 0.0)] {
        let mut agent = Scribe::new(&TO_THE_GOAL, bootstraps);
        let row = play(potential(), &mut agent, 2);
        assert_eq!((row.ending, agent.last), (Ending::Truncated, Some(Last::Truncated(8))));
        assert_eq!(agent.rewards[1], GAMMA * phi_last - phi(4), "bootstraps: {bootstraps}");
    }
}

#[test]
fn termination_in_the_last_allowed_step_is_termination() {
    let mut agent = Scribe::new(&TO_THE_GOAL, true);
    assert_eq!(play(potential(), &mut agent, 6).ending, Ending::Terminated);
}

#[test]
fn phi_is_evaluated_once_per_visited_state() {
    let calls = std::rc::Rc::new(std::cell::Cell::new(0));
    let counter = calls.clone();
    let counted = CellPotential::new(
        16,
        Box::new(move |cell| {
            counter.set(counter.get() + 1);
            Ok(phi(cell))
        }),
    );
    // Up and down: the start is visited again and again.
    play(counted, &mut Scribe::new(&[3, 3, 1, 3, 1, 3, 1, 3], true), 8);
    assert_eq!(calls.get(), 2);
}

/// A potential that is another at every evaluation; it writes down what it said.
struct Drifting(Vec<f64>);

impl Potential<FrozenLake> for Drifting {
    fn phi(&mut self, _: &FrozenLake, cell: usize, _: &FiniteState) -> Result<f64, Fault> {
        self.0.push(phi(cell) * (1.0 + 1e-3 * self.0.len() as f64));
        Ok(self.0[self.0.len() - 1])
    }
}

/// Φ(s′) is stored on arrival and is what is subtracted on leaving (Devlin & Kudenko 2012).
#[test]
fn a_potential_that_drifts_telescopes_since_it_is_not_evaluated_anew() {
    let mut agent = Scribe::new(&TO_THE_GOAL, true);
    play(Drifting(Vec::new()), &mut agent, 100);
    let discounted = |rewards: &[f64]| rewards.iter().rev().fold(0.0, |sum, r| r + GAMMA * sum);
    let goal = discounted(&[0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    // At the start Φ was asked first.
    let error = discounted(&agent.rewards) - goal + phi(0);
    assert!(error.abs() < 1e-14, "{error}");
    // The control: asked anew on leaving, the potential has drifted in between.
    let mut drifting = Drifting(Vec::new());
    let mut sum = 0.0;
    let path = [0, 4, 8, 9, 10, 14];
    let ask = |drifting: &mut Drifting, cell: usize| {
        let nothing = FiniteState { index: 0, outcome: 0 };
        drifting.phi(&lake(), cell, &nothing).unwrap()
    };
    let mut discount = 1.0;
    for (i, &s) in path.iter().enumerate() {
        let leaving = ask(&mut drifting, s);
        let arriving = path.get(i + 1).map_or(0.0, |&next| ask(&mut drifting, next));
        sum += discount * (GAMMA * arriving - leaving);
        discount *= GAMMA;
    }
    assert!((sum + drifting.0[0]).abs() > 1e-2, "{sum}");
}
