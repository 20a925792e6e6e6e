//! What a variant adds to the native reward, step by step, as the training loop computes it.

use crate::audit::Asked;
use crate::experiment::{assemble, shaped};
use crate::mdp::Env;
use crate::script::{DiscretiserSpec, Host, Variant};
use crate::shaping::{
    AnyCells, AnyPotential, AnyReward, Bins, Discretiser, Fault, Potential, RewardModel,
    ScriptedCells, StateIndex, Transition, potential_term,
};

/// Transitions between two of which it is asked what a cut by the time limit changes.
const PROBE_INTERVAL: u32 = 16;

/// Reward, potential and cells of a variant.
pub(super) struct Learned<E: Env> {
    reward: AnyReward<E>,
    potential: AnyPotential,
    cells: Option<AnyCells>,
    clip: Option<[f64; 2]>,
    gamma: f64,
    terms: Vec<f64>,
    asked: u32,
    /// Whether a transition was found that is paid differently where the time limit cuts it off.
    pub(super) depends_on_the_cut: bool,
}

impl<E: Env + 'static> Learned<E> {
    /// Its parts, as samples of a discretised environment ask for them.
    pub(super) fn into_asked(self) -> Asked<'static, E> {
        let Self { mut reward, mut potential, cells, clip, mut terms, .. } = self;
        let mut cells = cells.expect("only discretised environments are sampled");
        Asked {
            cell: Box::new(move |env, obs| cells.see(env, obs)),
            phi: Box::new(move |env, cell, obs| potential.phi(env, cell, obs)),
            extra: Box::new(move |env, t| extra(&mut reward, clip, &mut terms, env, t)),
        }
    }
}

/// The reward learned from, less the native one and without the potential's part.
fn extra<E: Env>(
    reward: &mut AnyReward<E>,
    clip: Option<[f64; 2]>,
    terms: &mut [f64],
    env: &E,
    t: &Transition<'_, E::Obs>,
) -> Result<f64, Fault> {
    let mut learned = reward.reward(env, t, terms)?;
    if let Some([low, high]) = clip {
        learned = learned.clamp(low, high);
    }
    Ok(learned - t.reward)
}

impl<E: Env + Clone + 'static> Learned<E> {
    /// Those of `variant`. Rewards are asked step by step, never tabulated.
    pub(super) fn new(host: &Host, variant: &Variant, env: &E) -> Result<Self, Fault> {
        let cells = match &variant.discretiser {
            DiscretiserSpec::StateIndex => {
                Some(AnyCells::Index(StateIndex { n_states: env.n_states().unwrap_or(0) }))
            }
            DiscretiserSpec::Bins(dims) => {
                Some(AnyCells::Bins(Bins::new(dims).expect("checked when the plan was resolved")))
            }
            DiscretiserSpec::Cells { shape, cell } => {
                let schema = env.schema();
                let cell = host.callbacks().cells(cell, shape, &variant.normalise, &schema);
                let n_cells = shape.iter().product();
                Some(AnyCells::Scripted(ScriptedCells::new(n_cells, schema.fields.len(), cell)))
            }
            DiscretiserSpec::Features(_) | DiscretiserSpec::Raw => None,
        };
        let n_cells = cells.as_ref().map_or(1, Discretiser::<E>::n_cells);
        let mut potential = shaped::potential(host, variant, env, n_cells)?;
        // A potential that changes is what it is at the end.
        Potential::<E>::begin_episode(&mut potential, variant.episodes);
        Ok(Self {
            reward: assemble::scripted_reward(host, variant, env),
            potential,
            cells,
            clip: variant.clip_reward,
            gamma: variant.agent.float("gamma"),
            terms: vec![0.0; variant.terms.len()],
            asked: 0,
            depends_on_the_cut: false,
        })
    }

    /// Φ of a state that is not terminal.
    fn phi(&mut self, env: &E, obs: &E::Obs) -> Result<f64, Fault> {
        let cell = match &mut self.cells {
            Some(cells) => cells.see(env, obs)?,
            None => 0,
        };
        self.potential.phi(env, cell, obs)
    }

    /// Everything that is added to the native reward.
    pub(super) fn added(&mut self, env: &E, t: &Transition<'_, E::Obs>) -> Result<f64, Fault> {
        let mut paid = |t| extra(&mut self.reward, self.clip, &mut self.terms, env, t);
        let extra = paid(t)?;
        if self.asked.is_multiple_of(PROBE_INTERVAL) && !t.terminated {
            let cut = paid(&Transition { truncated: true, ..*t })?;
            self.depends_on_the_cut |= cut.to_bits() != extra.to_bits();
        }
        self.asked = self.asked.wrapping_add(1);
        if matches!(self.potential, AnyPotential::No(_)) {
            return Ok(extra);
        }
        let phi = self.phi(env, t.state)?;
        let next = if t.terminated { 0.0 } else { self.phi(env, t.next_state)? };
        Ok(extra + potential_term(self.gamma, phi, next))
    }
}
