//! Shaping by a potential is the same as starting from it (Wiewiora 2003): a learner with the
//! shaping reward and Q = 0 and one without it and Q = Φ make the same choices for ever, and
//! `Q₁ + Φ = Q₂` all along. Holds for every learner here, the whole training loop included, or
//! something in it is wrong.
//!
//! Self-driven, both play by their own values. Replayed, both play at random, so that they meet the
//! same experience whatever they have learned.

use std::sync::atomic::AtomicBool;

use runner::env::{EnvVisitor, make};
use runner::experiment::{Limits, World, train};
use runner::learn::registry::{Setup, TabularAgent, find};
use runner::learn::{Agent, AgentConfig, Exploration, Last, Learn, ParamValue, QTable, Schedule};
use runner::mdp::numpy::NumpyRng;
use runner::mdp::streams::Stream;
use runner::mdp::{Action, Env};
use runner::shaping::{
    CellPotential, NativeReward, NoPotential, Potential, RewardModel, StateIndex, Transition,
};
use serde_json::json;

use crate::support::build_of;

/// Where it is tried.
#[derive(Clone, Copy)]
struct Task {
    id: &'static str,
    kwargs: &'static str,
    gamma: f64,
    max_steps: u32,
    episodes: u32,
    phi: fn(usize) -> f64,
}

const LAKE: Task = Task {
    id: "FrozenLake-v1",
    kwargs: r#"{ "map_name": "8x8" }"#,
    gamma: 0.99,
    max_steps: 60,
    episodes: 2500,
    phi: |s| 1.0 - 0.05 * ((7 - s / 8) + (7 - s % 8)) as f64,
};
const CLIFF: Task = Task {
    id: "CliffWalking-v1",
    kwargs: "{}",
    gamma: 1.0,
    max_steps: 200,
    episodes: 4000,
    phi: |s| -(((3 - s / 12) + (11 - s % 12)) as f64),
};
const TAXI: Task = Task {
    id: "Taxi-v4",
    kwargs: "{}",
    gamma: 0.99,
    max_steps: 200,
    episodes: 2500,
    // Nothing that would help: it has to hold for any.
    phi: |s| (s * 37 % 101) as f64 / 10.0 - 5.0,
};

const SOFTMAX: ParamValue = ParamValue::Exploration(Exploration::Softmax { temperature: 0.5 });
const UCB: ParamValue = ParamValue::Exploration(Exploration::Ucb { c: 0.5 });
const REPLACING: ParamValue = ParamValue::Word("replacing");
const COUNTS: ParamValue = ParamValue::VisitCount { omega: 0.7 };

type Learner = (&'static str, &'static [(&'static str, ParamValue)]);

/// Every learner, with step sizes and behaviours of every kind.
const LEARNERS: &[Learner] = &[
    ("q_learning", &[]),
    ("q_learning", &[("alpha", COUNTS)]),
    ("q_learning", &[("exploration", SOFTMAX)]),
    ("q_learning", &[("exploration", UCB)]),
    ("sarsa", &[]),
    ("sarsa", &[("exploration", SOFTMAX)]),
    ("sarsa", &[("exploration", UCB)]),
    ("expected_sarsa", &[]),
    ("expected_sarsa", &[("exploration", SOFTMAX)]),
    ("expected_sarsa", &[("exploration", UCB)]),
    ("double_q_learning", &[]),
    ("double_q_learning", &[("exploration", SOFTMAX), ("alpha", COUNTS)]),
    ("n_step_sarsa", &[]),
    ("n_step_sarsa", &[("n", ParamValue::Int(12))]),
    ("sarsa_lambda", &[]),
    ("sarsa_lambda", &[("traces", REPLACING), ("exploration", UCB)]),
    ("sarsa_lambda", &[("alpha", COUNTS), ("trace_cutoff", ParamValue::Float(0.0))]),
    ("q_lambda", &[]),
    ("q_lambda", &[("traces", REPLACING), ("exploration", SOFTMAX)]),
    ("dyna_q", &[]),
    ("soft_q_learning", &[("temperature", ParamValue::Float(0.5))]),
];

/// The learner with these initial values.
fn agent(task: Task, (name, params): Learner, replayed: bool, q: QTable) -> Box<dyn TabularAgent> {
    let mut config = AgentConfig::new(find(name).expect("it is registered"));
    config.params.insert("gamma", ParamValue::Float(task.gamma));
    for (key, value) in params {
        config.params.insert(key, *value);
    }
    if replayed {
        config.params.insert("epsilon", ParamValue::Schedule(Schedule::constant(1.0)));
        config.params.insert("exploration", ParamValue::Exploration(Exploration::EpsilonGreedy));
    }
    let build = build_of(config.spec).unwrap_or_else(|| panic!("{name} is a learner"));
    let (n_states, n_actions) = (q.n_states(), q.n_actions());
    let stream = Stream::new(9, "agent");
    let initial_q = Some(q.values().to_vec());
    let (seed, initial_v, policy) = (9, None, None);
    build(&config, Setup { n_states, n_actions, seed, stream, initial_q, initial_v, policy })
        .boxed()
}

/// Writes down what an agent sees and does.
struct Scribe {
    agent: Box<dyn TabularAgent>,
    played: Vec<(u32, u32)>,
}

impl Scribe {
    fn note(&mut self, s: usize, a: Action) -> Action {
        self.played.push((s as u32, a as u32));
        a
    }
}

impl Agent for Scribe {
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

impl Learn<usize> for Scribe {
    fn begin(&mut self, s: usize) -> Action {
        let a = self.agent.begin(s);
        self.note(s, a)
    }

    fn step(&mut self, reward: f64, next: usize) -> Action {
        let a = self.agent.step(reward, next);
        self.note(next, a)
    }

    fn end(&mut self, reward: f64, last: Last) {
        self.agent.end(reward, last);
    }
}

/// What was played, and the values learned.
type Outcome = (Vec<(u32, u32)>, QTable);

fn learn<E, P, R>(
    task: Task,
    env: &E,
    potential: P,
    reward: R,
    agent: Box<dyn TabularAgent>,
) -> Outcome
where
    E: Env + Clone,
    P: Potential<E>,
    R: RewardModel<E>,
{
    let discretiser = StateIndex { n_states: env.n_states().unwrap() };
    let mut world = World { env: env.clone(), discretiser, potential, reward };
    let (episodes, max_steps) = (task.episodes, Some(task.max_steps));
    let limits = Limits { episodes, max_steps, ..Limits::EPISODE };
    let mut scribe = Scribe { agent, played: Vec::new() };
    let (mut rng, stop) = (NumpyRng::from_u64(5), AtomicBool::new(false));
    assert!(train(&mut world, &mut scribe, limits, &mut rng, &stop, |_, _| {}).is_ok());
    let q = scribe.q().unwrap().clone();
    (scribe.played, q)
}

fn tables<E: Env>(task: Task, env: &E) -> (QTable, QTable) {
    let (n, n_actions) = (env.n_states().unwrap(), env.n_actions());
    let from_phi = (0..n * n_actions).map(|i| (task.phi)(i / n_actions)).collect();
    (QTable::new(n, n_actions, 0.0), QTable::from_values(n_actions, from_phi))
}

/// `max |Q₁ + Φ − Q₂|`, and the largest number that went into it.
fn drift(task: Task, shaped: &QTable, initialised: &QTable) -> (f64, f64) {
    let (mut drift, mut scale) = (0.0f64, 1.0f64);
    for (i, (a, b)) in shaped.values().iter().zip(initialised.values()).enumerate() {
        let phi = (task.phi)(i / shaped.n_actions());
        drift = drift.max((a + phi - b).abs());
        // |F| is at most twice |Φ|.
        scale = scale.max(a.abs()).max(b.abs()).max(2.0 * phi.abs());
    }
    (drift, scale)
}

/// Tries every learner in `task`.
struct Equivalence {
    task: Task,
    replayed: bool,
}

impl EnvVisitor for Equivalence {
    type Out = ();

    fn visit<E: Env + Clone + 'static>(self, env: E) {
        let Self { task, replayed } = self;
        let n_states = env.n_states().unwrap();
        for learner in LEARNERS {
            if replayed && learner.0 == "soft_q_learning" {
                // Its behaviour is its own values' and nothing else.
                continue;
            }
            let (zero, from_phi) = tables(task, &env);
            let phi = CellPotential::new(n_states, Box::new(move |cell| Ok((task.phi)(cell))));
            let agent = |q| agent(task, *learner, replayed, q);
            let (played, shaped) = learn(task, &env, phi, NativeReward, agent(zero));
            let (same, initialised) = learn(task, &env, NoPotential, NativeReward, agent(from_phi));
            let what = format!("{} {learner:?}", task.id);
            assert!(played.len() >= 50_000, "{what}: {} steps only", played.len());
            let apart = played.iter().zip(&same).position(|(a, b)| a != b);
            assert!(apart.is_none() && played.len() == same.len(), "{what}: apart at {apart:?}");
            let (drift, scale) = drift(task, &shaped, &initialised);
            let allowed = 1e-12 * scale * (1.0 + played.len() as f64 / 1e5).sqrt();
            assert!(drift <= allowed, "{what}: drift {drift:e}, allowed {allowed:e}");
        }
    }
}

fn equivalence(task: Task, replayed: bool) {
    let kwargs: serde_json::Value = serde_json::from_str(task.kwargs).unwrap();
    let env = make(task.id, kwargs.as_object().unwrap()).unwrap();
    env.visit(Equivalence { task, replayed });
}

#[test]
fn shaping_is_initialisation_on_ice() {
    equivalence(LAKE, false);
}

#[test]
fn shaping_is_initialisation_on_ice_replayed() {
    equivalence(LAKE, true);
}

#[test]
fn shaping_is_initialisation_at_the_cliff_without_discounting() {
    equivalence(CLIFF, false);
}

#[test]
fn shaping_is_initialisation_at_the_cliff_replayed() {
    equivalence(CLIFF, true);
}

#[test]
fn shaping_is_initialisation_in_the_taxi() {
    equivalence(TAXI, false);
}

#[test]
fn shaping_is_initialisation_in_the_taxi_replayed() {
    equivalence(TAXI, true);
}

/// A shaping reward computed as tutorials do: with a γ of its own, or Φ kept at terminal states.
#[derive(Clone, Copy)]
struct Wrong {
    phi: fn(usize) -> f64,
    gamma: f64,
    keeps_terminal: bool,
}

impl<E: Env> RewardModel<E> for Wrong {
    fn reward(
        &mut self,
        env: &E,
        t: &Transition<'_, E::Obs>,
        _: &mut [f64],
    ) -> Result<f64, runner::shaping::Fault> {
        let at = |obs| (self.phi)(env.state_index(obs).unwrap());
        let next = if t.terminated && !self.keeps_terminal { 0.0 } else { at(t.next_state) };
        Ok(t.reward + self.gamma * next - at(t.state))
    }
}

/// Tries every learner on the lake with shapings that are not.
struct Controls;

impl EnvVisitor for Controls {
    type Out = ();

    fn visit<E: Env + Clone + 'static>(self, env: E) {
        let Task { phi, gamma, .. } = LAKE;
        for learner in LEARNERS {
            let (zero, from_phi) = tables(LAKE, &env);
            let agent = |q: &QTable| agent(LAKE, *learner, false, q.clone());
            let (same, initialised) =
                learn(LAKE, &env, NoPotential, NativeReward, agent(&from_phi));
            let run = |gamma, keeps_terminal| {
                let reward = Wrong { phi, gamma, keeps_terminal };
                let (played, shaped) = learn(LAKE, &env, NoPotential, reward, agent(&zero));
                (drift(LAKE, &shaped, &initialised).0, played == same)
            };
            let (right, equal) = run(gamma, false);
            assert!(right < 1e-12 && equal, "{learner:?}: the control's own control: {right:e}");
            for (drift, equal) in [run(1.0, false), run(gamma, true)] {
                assert!(drift > 1e-3 && !equal, "{learner:?}: {drift:e} is no drift");
            }
        }
    }
}

#[test]
fn wrong_shapings_are_not() {
    let kwargs = json!({ "map_name": "8x8" });
    make(LAKE.id, kwargs.as_object().unwrap()).unwrap().visit(Controls);
}
