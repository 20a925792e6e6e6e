//! The reward an agent learns from: the native one, or a script's.

use super::scripted::StepInputs;
use super::{Fault, StepFn};
use crate::mdp::{Action, Env, FiniteMdp};

/// One step as a reward model sees it.
#[derive(Debug, Clone, Copy)]
pub struct Transition<'a, O> {
    /// The observation before the step, s.
    pub state: &'a O,
    /// The action played.
    pub action: Action,
    /// The native reward.
    pub reward: f64,
    /// The observation after the step, s′.
    pub next_state: &'a O,
    /// Whether s′ is terminal.
    pub terminated: bool,
    /// Whether the time limit ended the episode here (never together with `terminated`).
    pub truncated: bool,
    /// Which step of the episode this is, from 0.
    pub step: u32,
}

/// The learned reward, before potential shaping.
pub trait RewardModel<E: Env> {
    /// The reward of `t`; adds the value of each extra term to `terms` (one sum per name).
    ///
    /// # Errors
    /// If a scripted reward fails.
    fn reward(
        &mut self,
        env: &E,
        t: &Transition<'_, E::Obs>,
        terms: &mut [f64],
    ) -> Result<f64, Fault>;
}

/// What the environment pays.
#[derive(Debug, Clone, Copy)]
pub struct NativeReward;

impl<E: Env> RewardModel<E> for NativeReward {
    #[inline]
    fn reward(&mut self, _: &E, t: &Transition<'_, E::Obs>, _: &mut [f64]) -> Result<f64, Fault> {
        Ok(t.reward)
    }
}

/// A reward of a finite environment, tabulated over its transitions before training.
#[derive(Debug, Clone)]
pub struct TabulatedReward {
    n_terms: usize,
    /// Per outcome: running through, then cut off by the time limit; each `1 + n_terms` values,
    /// the total first. Shape `[n_outcomes, 2, 1 + n_terms]`.
    table: Vec<f64>,
}

impl TabulatedReward {
    /// Evaluates `reward(s, a, outcome index, truncated, terms)` over all outcomes of `mdp`.
    ///
    /// # Errors
    /// The first error of `reward`.
    pub fn new(
        mdp: &FiniteMdp,
        n_terms: usize,
        mut reward: impl FnMut(usize, usize, usize, bool, &mut [f64]) -> Result<f64, Fault>,
    ) -> Result<Self, Fault> {
        let width = 1 + n_terms;
        let mut table = vec![0.0; mdp.outcomes().len() * 2 * width];
        for s in 0..mdp.n_states() {
            for a in 0..mdp.n_actions() {
                for i in mdp.range(s, a) {
                    for cut in [false, true] {
                        let row = (2 * i + usize::from(cut)) * width;
                        // A terminal step is reported as terminated only.
                        let truncated = cut && !mdp.outcomes()[i].terminated;
                        let mut terms = vec![0.0; n_terms];
                        table[row] = reward(s, a, i, truncated, &mut terms)?;
                        table[row + 1..row + width].copy_from_slice(&terms);
                    }
                }
            }
        }
        Ok(Self { n_terms, table })
    }

    /// The reward of an outcome that the time limit does not cut off.
    pub fn of(&self, outcome: usize) -> f64 {
        self.table[2 * outcome * (1 + self.n_terms)]
    }

    /// Whether being cut off by the time limit changes a reward.
    pub fn depends_on_truncation(&self) -> bool {
        let width = 1 + self.n_terms;
        self.table.chunks_exact(2 * width).any(|pair| pair[..width] != pair[width..])
    }

    /// Reads the row of `outcome`, adding the terms to their sums.
    #[inline]
    fn read(&self, outcome: usize, truncated: bool, terms: &mut [f64]) -> f64 {
        let width = 1 + self.n_terms;
        let row = &self.table[(2 * outcome + usize::from(truncated)) * width..][..width];
        for (sum, term) in terms.iter_mut().zip(&row[1..]) {
            *sum += term;
        }
        row[0]
    }
}

impl<E: Env> RewardModel<E> for TabulatedReward {
    #[inline]
    fn reward(
        &mut self,
        env: &E,
        t: &Transition<'_, E::Obs>,
        terms: &mut [f64],
    ) -> Result<f64, Fault> {
        let outcome = env.outcome_index(t.next_state).expect("only built for finite environments");
        Ok(self.read(outcome, t.truncated, terms))
    }
}

/// A scripted reward, called at every step.
pub struct ScriptedReward<E: Env> {
    /// Replaces the native reward.
    reward: Option<StepFn<E>>,
    /// Is added to it.
    terms: Vec<StepFn<E>>,
    /// Whether one of them reads the inputs.
    is_compiled: bool,
    inputs: Box<StepInputs>,
}

impl<E: Env> ScriptedReward<E> {
    /// `reward` (the native one if `None`) plus `terms`.
    pub fn new(reward: Option<StepFn<E>>, terms: Vec<StepFn<E>>) -> Self {
        let is_compiled = reward.iter().chain(&terms).any(StepFn::is_compiled);
        Self { reward, terms, is_compiled, inputs: Box::new(StepInputs::new()) }
    }
}

impl<E: Env> RewardModel<E> for ScriptedReward<E> {
    #[inline]
    fn reward(
        &mut self,
        env: &E,
        t: &Transition<'_, E::Obs>,
        terms: &mut [f64],
    ) -> Result<f64, Fault> {
        if self.is_compiled {
            self.inputs.fill(env, t);
        }
        let mut total = match &mut self.reward {
            Some(reward) => reward.at(env, t, &self.inputs)?,
            None => t.reward,
        };
        for (sum, term) in terms.iter_mut().zip(&mut self.terms) {
            let term = term.at(env, t, &self.inputs)?;
            *sum += term;
            total += term;
        }
        Ok(total)
    }
}

/// Any of the reward models, chosen per run.
pub enum AnyReward<E: Env> {
    /// The environment's own.
    Native(NativeReward),
    /// Tabulated over a finite model.
    Tabulated(TabulatedReward),
    /// Called at every step.
    Scripted(ScriptedReward<E>),
}

impl<E: Env> RewardModel<E> for AnyReward<E> {
    #[inline]
    fn reward(
        &mut self,
        env: &E,
        t: &Transition<'_, E::Obs>,
        terms: &mut [f64],
    ) -> Result<f64, Fault> {
        match self {
            Self::Native(r) => r.reward(env, t, terms),
            Self::Tabulated(r) => r.reward(env, t, terms),
            Self::Scripted(r) => r.reward(env, t, terms),
        }
    }
}
