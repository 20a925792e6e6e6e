//! One variant under one seed: what is run, stored and resumed as a whole.

use std::sync::atomic::AtomicBool;

use sha2::{Digest, Sha256};

use super::assemble::Assembled;
use super::interrupted::{Resumable, SoFar};
use super::predict::Exact;
use super::record::{StartValue, StateValues, UnitRecord};
use super::store::StoreError;
use super::train::{Limits, Solved, TrainError, World, go_on};
use super::{assemble, hex, shaped};
use crate::env::EnvVisitor;
use crate::learn::planning::Sweep;
use crate::learn::registry::{AgentVisitor, TabularAgent};
use crate::learn::{AnyAgent, Learn, QTable};
use crate::mdp::Env;
use crate::script::{Diagnostic, DiscretiserSpec, Host, Plan, Variant};
use crate::shaping::{
    AnyCells, AnyPotential, AnyReward, Bins, Discretiser, Fault, FeatureSpec, Fields, NativeReward,
    NoPotential, Potential, RawFields, RewardModel, ScriptedCells, Shield, ShieldedCells,
    StateIndex,
};

/// Raised whenever the same configuration gives other results than before: old units are then not
/// taken for new ones.
pub const SEMANTICS: u32 = 2;

/// Whether the commonest combinations get loops of their own. Not when debugging: they are most of
/// what there is to compile, and the shared loop gives the same results.
const OWN_LOOPS: bool = !cfg!(debug_assertions);

/// A unit of work.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Unit {
    /// Index into the plan's variants.
    pub variant: usize,
    /// The seed.
    pub seed: u64,
    /// SHA-256 of everything that can change its result, in hexadecimal: its name.
    pub hash: String,
}

/// Every unit of a plan, by variant and seed.
pub fn units(plan: &Plan) -> Vec<Unit> {
    let mut units = Vec::new();
    for (variant, v) in plan.variants.iter().enumerate() {
        let identity = v.identity();
        for &seed in &v.seeds.0 {
            let whole = serde_json::json!({
                "semantics": SEMANTICS,
                "variant": identity,
                "seed": seed,
            });
            let hash = hex(&Sha256::digest(whole.to_string().as_bytes()));
            units.push(Unit { variant, seed, hash });
        }
    }
    units
}

/// Why a unit has no result.
#[derive(Debug)]
pub enum UnitError {
    /// The script's fault: a callback failed.
    Script(Box<Diagnostic>),
    /// A network's loss stopped being finite: what was written down until then.
    Diverged(Box<Diagnostic>, Box<UnitRecord>),
    /// It could not be written down where it stopped.
    Store(StoreError),
    /// The run was asked to stop.
    Interrupted,
}

impl UnitError {
    fn fault(variant: &Variant, seed: u64, fault: Fault) -> Self {
        let d = assemble::diagnostic_of(fault);
        Self::Script(Box::new(d.note(format!("in variant `{}`, seed {seed}", variant.name))))
    }

    /// What was learned is no finite number.
    fn diverged(variant: &Variant, seed: u64) -> Self {
        let d = Diagnostic::error("the learner diverged: what it has learned is not finite")
            .at(variant.place.clone())
            .hint("a smaller `alpha`, shorter traces or gamma < 1 keep values bounded");
        Self::fault(variant, seed, Fault(Box::new(d)))
    }

    /// Episodes are counted from 1, as in `episodes.csv`, steps from 0, as in `t.step`.
    fn train(variant: &Variant, seed: u64, error: TrainError) -> Self {
        let (fault, moment) = match error {
            TrainError::Interrupted => return Self::Interrupted,
            TrainError::Fault { fault, episode, step } => {
                (fault, format!("in episode {}, t.step = {step}", episode + 1))
            }
            TrainError::NotFinite { episode } => {
                let d = Diagnostic::error("the learned return is not finite")
                    .at(variant.place.clone())
                    .hint("rewards or potentials are too large to be added up");
                (Fault(Box::new(d)), format!("in episode {}", episode + 1))
            }
            TrainError::Diverged { episode, step } => {
                let d = Diagnostic::error("the network diverged: its loss is not finite")
                    .at(variant.place.clone())
                    .hint(
                        "a smaller `learning_rate`, `max_grad_norm`, `loss: \"huber\"` or smaller \
                         rewards keep it bounded",
                    );
                let moment = format!("at step {step} of the run, in episode {}", episode + 1);
                (Fault(Box::new(d)), moment)
            }
        };
        match Self::fault(variant, seed, fault) {
            Self::Script(d) => Self::Script(Box::new(d.note(moment))),
            other => other,
        }
    }
}

/// Runs `variant` under `seed`; `each` hears the number of steps of every finished episode; 0 of one that was played before an
/// interruption.
///
/// The environment is seeded as `env.reset(seed=seed)` would, and goes on unseeded; the agent has
/// a stream of its own. Variants with the same seed share both (common random numbers).
///
/// # Errors
/// If a callback fails or `stop` is raised.
pub fn run_unit(
    host: &Host,
    variant: &Variant,
    seed: u64,
    stop: &AtomicBool,
    each: &mut dyn FnMut(u32),
) -> Result<UnitRecord, UnitError> {
    resume_unit(host, variant, seed, None, stop, each)
}

/// The same for a unit that may have been interrupted before: a network's training is written down
/// at `at` when it is interrupted, and from time to time, and goes on from there with the same
/// results. Other units start anew.
///
/// # Errors
/// If a callback fails, the network diverges, it cannot be written down, or `stop` is raised.
pub fn resume_unit(
    host: &Host,
    variant: &Variant,
    seed: u64,
    at: Option<Resumable<'_>>,
    stop: &AtomicBool,
    each: &mut dyn FnMut(u32),
) -> Result<UnitRecord, UnitError> {
    let env = variant.environment().map_err(|e| {
        UnitError::Script(Box::new(Diagnostic::error(e.message).maybe_hint(e.hint)))
    })?;
    host.working_on(&variant.name);
    env.visit(RunUnit { host, variant, seed, at, stop, each }).map_err(|e| match e {
        UnitError::Script(d) => UnitError::Script(Box::new(host.annotate(*d))),
        UnitError::Diverged(d, record) => UnitError::Diverged(Box::new(host.annotate(*d)), record),
        other => other,
    })
}

struct RunUnit<'a> {
    host: &'a Host,
    variant: &'a Variant,
    seed: u64,
    at: Option<Resumable<'a>>,
    stop: &'a AtomicBool,
    each: &'a mut dyn FnMut(u32),
}

impl EnvVisitor for RunUnit<'_> {
    type Out = Result<UnitRecord, UnitError>;

    fn visit<E: Env + Clone + 'static>(self, env: E) -> Self::Out {
        let (host, variant) = (self.host, self.variant);
        let shield = assemble::shield(host, variant, &env);
        if variant.agent.is_network() {
            return self.network(env, shield);
        }
        let cells = match &variant.discretiser {
            DiscretiserSpec::StateIndex => {
                let index = StateIndex { n_states: env.n_states().unwrap_or(0) };
                if const { OWN_LOOPS && E::INDEXED } && shield.is_none() {
                    return self.fast(env, index);
                }
                AnyCells::Index(index)
            }
            DiscretiserSpec::Bins(dims) => {
                let bins = Bins::new(dims).expect("checked when the plan was resolved");
                if const { OWN_LOOPS && !E::INDEXED } && shield.is_none() {
                    return self.fast(env, bins);
                }
                AnyCells::Bins(bins)
            }
            DiscretiserSpec::Features(features) => return self.linear(env, features, shield),
            DiscretiserSpec::Raw => unreachable!("for networks only"),
            DiscretiserSpec::Cells { shape, cell } => {
                let schema = env.schema();
                let cell = host.callbacks().cells(cell, shape, &variant.normalise, &schema);
                let n_cells = shape.iter().product();
                AnyCells::Scripted(ScriptedCells::new(n_cells, schema.fields.len(), cell))
            }
        };
        match shield {
            None => self.shared(env, cells),
            Some(shield) => self.shared(env, ShieldedCells { cells, shield }),
        }
    }
}

/// What a variant trains with, apart from its environment and discretiser.
struct Parts<'a, E: Env> {
    potential: AnyPotential,
    reward: AnyReward<E>,
    agent: AnyAgent,
    /// What else the unit leaves behind.
    extra: Extra<'a>,
}

/// What a unit knows about its agent beyond what it learns.
struct Extra<'a> {
    sweeps: Vec<Sweep>,
    exact: Option<Exact>,
    /// What was done before it was interrupted, if it is a network's.
    so_far: Option<SoFar<'a>>,
}

impl<'a> RunUnit<'a> {
    fn parts<E: Env + Clone + 'static>(
        &self,
        env: &E,
        n_cells: usize,
    ) -> Result<Parts<'a, E>, UnitError> {
        let (host, variant, seed) = (self.host, self.variant, self.seed);
        let fault = |f| UnitError::fault(variant, seed, f);
        let potential = shaped::potential(host, variant, env, n_cells).map_err(fault)?;
        let reward = assemble::reward(host, variant, env).map_err(fault)?;
        let Assembled { agent, sweeps, exact } =
            assemble::agent(host, variant, env, n_cells, seed).map_err(fault)?;
        Ok(Parts { potential, reward, agent, extra: Extra { sweeps, exact, so_far: None } })
    }

    /// The commonest agents have loops of their own, for plain and potential-only rewards and for
    /// others, where the discretiser is fast.
    fn fast<E, D>(self, env: E, discretiser: D) -> Result<UnitRecord, UnitError>
    where
        E: Env + Clone + 'static,
        D: Discretiser<E, State = usize>,
    {
        let Parts { potential, reward, agent, extra } = self.parts(&env, discretiser.n_cells())?;
        if !agent.is_fast() {
            let world = World { env, discretiser, potential, reward };
            return self.train(world, agent.boxed(), extra);
        }
        let unit = (self, extra);
        match (potential, reward) {
            (AnyPotential::No(_), AnyReward::Native(_)) => {
                let (potential, reward) = (NoPotential, NativeReward);
                agent.visit(Train { unit, world: World { env, discretiser, potential, reward } })
            }
            (AnyPotential::Cell(potential), AnyReward::Native(reward)) => {
                agent.visit(Train { unit, world: World { env, discretiser, potential, reward } })
            }
            (potential, reward) => {
                agent.visit(Train { unit, world: World { env, discretiser, potential, reward } })
            }
        }
    }

    /// One loop for every agent, potential and reward.
    fn shared<E, D>(self, env: E, discretiser: D) -> Result<UnitRecord, UnitError>
    where
        E: Env + Clone + 'static,
        D: Discretiser<E>,
        Box<dyn TabularAgent>: Learn<D::State>,
    {
        let Parts { potential, reward, agent, extra } = self.parts(&env, discretiser.n_cells())?;
        self.train(World { env, discretiser, potential, reward }, agent.boxed(), extra)
    }

    /// One loop for every agent on linear values, potential and reward.
    fn linear<E: Env + Clone + 'static>(
        self,
        env: E,
        features: &FeatureSpec,
        shield: Option<Shield>,
    ) -> Result<UnitRecord, UnitError> {
        let (host, variant, seed) = (self.host, self.variant, self.seed);
        let fault = |f| UnitError::fault(variant, seed, f);
        let potential = shaped::potential(host, variant, &env, 1).map_err(fault)?;
        let reward = assemble::reward(host, variant, &env).map_err(fault)?;
        let agent = assemble::linear_agent(variant, features, &env, seed);
        let discretiser = RawFields { n_states: 0, shield };
        let extra = Extra { sweeps: Vec::new(), exact: None, so_far: None };
        self.train(World { env, discretiser, potential, reward }, agent, extra)
    }

    /// One loop for every network, potential and reward.
    fn network<E: Env + Clone + 'static>(
        self,
        env: E,
        shield: Option<Shield>,
    ) -> Result<UnitRecord, UnitError> {
        let (host, variant, seed) = (self.host, self.variant, self.seed);
        let fault = |f| UnitError::fault(variant, seed, f);
        let n_states = env.n_states().unwrap_or(0);
        let potential = shaped::potential(host, variant, &env, n_states.max(1)).map_err(fault)?;
        let reward = assemble::reward(host, variant, &env).map_err(fault)?;
        let agent = assemble::network_agent(variant, &env, seed);
        let discretiser = RawFields { n_states, shield };
        let (so_far, agent) = SoFar::start(seed, variant.episodes, self.at).resume(agent);
        let agent: Box<dyn Learn<Fields>> = Box::new(agent);
        let extra = Extra { sweeps: Vec::new(), exact: None, so_far: Some(so_far) };
        self.train(World { env, discretiser, potential, reward }, agent, extra)
    }

    fn train<E, D, P, R, A>(
        self,
        mut world: World<E, D, P, R>,
        mut agent: A,
        extra: Extra<'_>,
    ) -> Result<UnitRecord, UnitError>
    where
        E: Env,
        D: Discretiser<E>,
        P: Potential<E>,
        R: RewardModel<E>,
        A: Learn<D::State>,
    {
        let RunUnit { variant, seed, at, stop, each, .. } = self;
        let limits = Limits {
            episodes: variant.episodes,
            max_steps: variant.max_steps,
            n_terms: variant.terms.len(),
            frame_skip: variant.frame_skip,
            clip_reward: variant.clip_reward,
            exploring_starts: variant.agent.is_on("exploring_starts").then_some(seed),
            stop_when: variant
                .stops_at()
                .map(|threshold| Solved { threshold, window: variant.window as usize }),
        };
        let Extra { sweeps, exact, so_far } = extra;
        let spacing = exact.as_ref().map_or(0, |exact| exact.spacing(limits.episodes));
        let mut so_far = so_far.unwrap_or_else(|| SoFar::start(seed, limits.episodes, at));
        for _ in &so_far.rows {
            each(0);
        }
        let past: Vec<f64> = so_far.rows.iter().map(|row| row.native).collect();
        let mut rng = so_far.rng.clone();
        let window = variant.window as usize;
        let trained =
            go_on(&mut world, &mut agent, limits, &past, &mut rng, stop, |mut row, agent, rng| {
                each(row.steps);
                if let (Some(exact), Some(v)) = (&exact, agent.v()) {
                    let episode = so_far.rows.len() as u32;
                    let due = episode.is_multiple_of(spacing) || episode + 1 == limits.episodes;
                    row.value_error = due.then(|| exact.error(v));
                }
                match agent.dqn() {
                    Some(dqn) => {
                        let (believed, brought) = dqn.last_start();
                        row.start = Some(StartValue { believed, brought });
                        so_far.played(row, window, dqn, rng);
                    }
                    None => so_far.rows.push(row),
                }
            });
        so_far.rng = rng;
        if let Err(e) = trained {
            let error = UnitError::train(variant, seed, e);
            return Err(match (error, agent.dqn()) {
                (UnitError::Interrupted, Some(dqn)) => match so_far.write(dqn) {
                    Ok(()) => UnitError::Interrupted,
                    Err(e) => UnitError::Store(e),
                },
                (UnitError::Script(d), Some(dqn)) if dqn.failed_at().is_some() => {
                    let log = dqn.log().to_vec();
                    let record = UnitRecord { rows: so_far.rows, log, ..UnitRecord::default() };
                    UnitError::Diverged(d, Box::new(record))
                }
                (error, _) => error,
            });
        }
        let weights = agent.weights().cloned();
        let q = agent.q().cloned();
        let learned = [&weights, &q].into_iter().flatten().flat_map(QTable::values);
        if !learned.chain(agent.v().unwrap_or_default()).all(|x| x.is_finite()) {
            return Err(UnitError::diverged(variant, seed));
        }
        let values = agent.v().filter(|_| q.is_none()).map(|v| StateValues {
            v: v.to_vec(),
            exact: exact.map_or_else(Vec::new, |exact| exact.v),
        });
        let networks = agent.dqn().map_or_else(Vec::new, |dqn| so_far.networks(dqn));
        let log = agent.dqn().map_or_else(Vec::new, |dqn| dqn.log().to_vec());
        let rows = so_far.rows;
        Ok(UnitRecord { rows, q, weights, values, sweeps, networks, log })
    }
}

struct Train<'a, E, D, P, R> {
    unit: (RunUnit<'a>, Extra<'a>),
    world: World<E, D, P, R>,
}

impl<E, D, P, R> AgentVisitor for Train<'_, E, D, P, R>
where
    E: Env,
    D: Discretiser<E, State = usize>,
    P: Potential<E>,
    R: RewardModel<E>,
{
    type Out = Result<UnitRecord, UnitError>;

    fn visit<A: Learn<usize>>(self, agent: A) -> Self::Out {
        let (unit, extra) = self.unit;
        unit.train(self.world, agent, extra)
    }
}
