//! One variant under one seed: what is run, stored and resumed as a whole.

use std::sync::atomic::AtomicBool;

use sha2::{Digest, Sha256};

use super::record::{EpisodeRow, UnitRecord};
use super::train::{Limits, TrainError, World, train};
use super::{assemble, hex};
use crate::env::EnvVisitor;
use crate::learn::registry::AgentVisitor;
use crate::learn::{Agent, AnyAgent};
use crate::mdp::Env;
use crate::mdp::numpy::NumpyRng;
use crate::script::{Diagnostic, DiscretiserSpec, Host, Plan, Variant};
use crate::shaping::{
    AnyPotential, AnyReward, Bins, Discretiser, Fault, NativeReward, NoPotential, Potential,
    RewardModel, ScriptedCells, StateIndex,
};

/// Raised whenever the same configuration gives other results than before: old units are then not
/// taken for new ones.
pub const SEMANTICS: u32 = 1;

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
    /// The run was asked to stop.
    Interrupted,
}

impl UnitError {
    fn fault(variant: &Variant, seed: u64, fault: Fault) -> Self {
        let d = assemble::diagnostic_of(fault);
        Self::Script(Box::new(d.note(format!("in variant `{}`, seed {seed}", variant.name))))
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
        };
        match Self::fault(variant, seed, fault) {
            Self::Script(d) => Self::Script(Box::new(d.note(moment))),
            Self::Interrupted => Self::Interrupted,
        }
    }
}

/// Runs `variant` under `seed`; `each` hears the number of steps of every finished episode.
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
    let env = variant.environment().map_err(|e| {
        UnitError::Script(Box::new(Diagnostic::error(e.message).maybe_hint(e.hint)))
    })?;
    env.visit(RunUnit { host, variant, seed, stop, each }).map_err(|e| match e {
        UnitError::Script(d) => UnitError::Script(Box::new(host.annotate(*d))),
        UnitError::Interrupted => UnitError::Interrupted,
    })
}

struct RunUnit<'a> {
    host: &'a Host,
    variant: &'a Variant,
    seed: u64,
    stop: &'a AtomicBool,
    each: &'a mut dyn FnMut(u32),
}

impl EnvVisitor for RunUnit<'_> {
    type Out = Result<UnitRecord, UnitError>;

    fn visit<E: Env + Clone + 'static>(self, env: E) -> Self::Out {
        match &self.variant.discretiser {
            DiscretiserSpec::StateIndex => {
                if const { E::INDEXED } {
                    let n_states = env.n_states().unwrap_or(0);
                    self.with_discretiser(env, StateIndex { n_states })
                } else {
                    unreachable!("a plan is resolved with the discretiser that its states need")
                }
            }
            DiscretiserSpec::Bins(dims) => {
                let bins = Bins::new(dims).expect("checked when the plan was resolved");
                self.with_discretiser(env, bins)
            }
            DiscretiserSpec::Cells { shape, cell } => {
                let schema = env.schema();
                let cell =
                    self.host.callbacks().cells(cell, shape, &self.variant.normalise, &schema);
                let n_cells = shape.iter().product();
                let cells = ScriptedCells::new(n_cells, schema.fields.len(), cell);
                self.with_discretiser(env, cells)
            }
        }
    }
}

impl RunUnit<'_> {
    /// Plain and potential-only runs get loops of their own, if the discretiser is fast; other
    /// combinations share one.
    fn with_discretiser<E, D>(self, env: E, discretiser: D) -> Result<UnitRecord, UnitError>
    where
        E: Env + Clone + 'static,
        D: Discretiser<E>,
    {
        let (host, variant, seed) = (self.host, self.variant, self.seed);
        let fault = |f| UnitError::fault(variant, seed, f);
        let n_cells = discretiser.n_cells();
        let potential = assemble::potential(host, variant, &env, n_cells).map_err(fault)?;
        let reward = assemble::reward(host, variant, &env).map_err(fault)?;
        let (agent, sweeps) = assemble::agent(host, variant, &env, n_cells, seed).map_err(fault)?;
        let mut record = if const { D::FAST } {
            match (potential, reward) {
                (AnyPotential::No(_), AnyReward::Native(_)) => {
                    let (potential, reward) = (NoPotential, NativeReward);
                    self.with_agent(World { env, discretiser, potential, reward }, agent)
                }
                (AnyPotential::Cell(potential), AnyReward::Native(reward)) => {
                    self.with_agent(World { env, discretiser, potential, reward }, agent)
                }
                (potential, reward) => {
                    self.with_agent(World { env, discretiser, potential, reward }, agent)
                }
            }
        } else {
            self.with_agent(World { env, discretiser, potential, reward }, agent)
        }?;
        record.sweeps = sweeps;
        Ok(record)
    }

    fn with_agent<E, D, P, R>(
        self,
        world: World<E, D, P, R>,
        agent: AnyAgent,
    ) -> Result<UnitRecord, UnitError>
    where
        E: Env,
        D: Discretiser<E>,
        P: Potential<E>,
        R: RewardModel<E>,
    {
        agent.visit(Train { unit: self, world })
    }
}

struct Train<'a, E, D, P, R> {
    unit: RunUnit<'a>,
    world: World<E, D, P, R>,
}

impl<E, D, P, R> AgentVisitor for Train<'_, E, D, P, R>
where
    E: Env,
    D: Discretiser<E>,
    P: Potential<E>,
    R: RewardModel<E>,
{
    type Out = Result<UnitRecord, UnitError>;

    fn visit<A: Agent>(self, mut agent: A) -> Self::Out {
        let RunUnit { variant, seed, stop, each, .. } = self.unit;
        let mut world = self.world;
        let limits = Limits {
            episodes: variant.episodes,
            max_steps: variant.max_steps,
            n_terms: variant.terms.len(),
            frame_skip: variant.frame_skip,
            clip_reward: variant.clip_reward,
        };
        let mut rng = NumpyRng::from_u64(seed);
        let mut rows: Vec<EpisodeRow> = Vec::with_capacity(limits.episodes as usize);
        train(&mut world, &mut agent, limits, &mut rng, stop, |row| {
            each(row.steps);
            rows.push(row);
        })
        .map_err(|e| UnitError::train(variant, seed, e))?;
        Ok(UnitRecord { rows, q: agent.q().cloned(), sweeps: Vec::new() })
    }
}
