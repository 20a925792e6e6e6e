//! Functions that scripts define, as the step calls them: machine code where there is some, without
//! anything in between, and the script's interpreter where there is none, or where the code traps.

use std::sync::Arc;

use super::{ActionSet, Fault, Scale, Transition};
use crate::jit::Kernel;
use crate::mdp::{Env, MAX_FIELDS};

/// Φ as the interpreter has it.
type ScriptPhi = dyn FnMut(&[f64], u32) -> Result<f64, Fault>;
/// A cell as the interpreter has it.
type ScriptCell = dyn FnMut(&[f64]) -> Result<usize, Fault>;
/// A shield as the interpreter has it.
type ScriptShield = dyn FnMut(&[f64]) -> Result<ActionSet, Fault>;
/// A number of a step as the interpreter has it.
type ScriptOfStep<E> = dyn FnMut(&E, &Transition<'_, <E as Env>::Obs>) -> Result<f64, Fault>;

/// From a state's fields and the episode, counted from 1, to Φ.
pub struct PhiFn {
    kernel: Option<Arc<Kernel<f64>>>,
    /// Whether it depends on the episode.
    of_episode: bool,
    shift: f64,
    script: Box<ScriptPhi>,
}

impl PhiFn {
    /// Asks `script`.
    pub fn new(script: impl FnMut(&[f64], u32) -> Result<f64, Fault> + 'static) -> Self {
        Self { kernel: None, of_episode: false, shift: 0.0, script: Box::new(script) }
    }

    /// Asks `kernel` first, whose inputs are the fields and, with `of_episode`, the episode.
    #[must_use]
    pub fn with_kernel(mut self, kernel: Option<Arc<Kernel<f64>>>, of_episode: bool) -> Self {
        (self.kernel, self.of_episode) = (kernel, of_episode);
        self
    }

    /// Adds `shift` to every value.
    #[must_use]
    pub fn shifted(mut self, shift: f64) -> Self {
        self.shift = shift;
        self
    }

    /// Φ of the state with these `fields`, in this `episode`.
    ///
    /// # Errors
    /// If the script fails.
    #[inline]
    pub fn at(&mut self, fields: &[f64], episode: u32) -> Result<f64, Fault> {
        if let Some(kernel) = &self.kernel {
            let phi = if self.of_episode {
                let mut inputs = [0.0; MAX_FIELDS + 1];
                inputs[..fields.len()].copy_from_slice(fields);
                inputs[fields.len()] = f64::from(episode);
                kernel.call(&inputs[..=fields.len()])
            } else {
                kernel.call(fields)
            };
            if phi.is_finite() {
                return Ok(phi + self.shift);
            }
        }
        self.ask(fields, episode)
    }

    #[cold]
    #[inline(never)]
    fn ask(&mut self, fields: &[f64], episode: u32) -> Result<f64, Fault> {
        Ok((self.script)(fields, episode)? + self.shift)
    }
}

/// From a state's fields to a cell. The function itself refuses indices outside the table.
pub struct CellFn {
    kernel: Option<Arc<Kernel<i64>>>,
    scales: Vec<Scale>,
    script: Box<ScriptCell>,
}

impl CellFn {
    /// Asks `script`; it sees the fields that `scales` speak of normalised.
    pub fn new(
        scales: &[Scale],
        script: impl FnMut(&[f64]) -> Result<usize, Fault> + 'static,
    ) -> Self {
        Self { kernel: None, scales: scales.to_vec(), script: Box::new(script) }
    }

    /// Asks `kernel` first, whose inputs are the fields.
    #[must_use]
    pub fn with_kernel(mut self, kernel: Option<Arc<Kernel<i64>>>) -> Self {
        self.kernel = kernel;
        self
    }

    /// The cell of the state with these `fields`.
    ///
    /// # Errors
    /// If the script fails.
    #[inline]
    pub fn at(&mut self, fields: &[f64]) -> Result<usize, Fault> {
        if self.scales.is_empty() {
            return self.of_shown(fields);
        }
        let mut shown = [0.0; MAX_FIELDS];
        let shown = &mut shown[..fields.len()];
        shown.copy_from_slice(fields);
        Scale::show_all(&self.scales, shown);
        self.of_shown(shown)
    }

    #[inline]
    fn of_shown(&mut self, fields: &[f64]) -> Result<usize, Fault> {
        if let Some(kernel) = &self.kernel
            && let Ok(cell) = usize::try_from(kernel.call(fields))
        {
            return Ok(cell);
        }
        (self.script)(fields)
    }
}

/// From a state's fields to the actions allowed there, at least one.
pub struct ShieldFn {
    kernel: Option<Arc<Kernel<i64>>>,
    n_actions: usize,
    script: Box<ScriptShield>,
}

impl ShieldFn {
    /// Asks `script`.
    pub fn new(script: impl FnMut(&[f64]) -> Result<ActionSet, Fault> + 'static) -> Self {
        Self { kernel: None, n_actions: 0, script: Box::new(script) }
    }

    /// Asks `kernel` first, for each of `n_actions` actions; its inputs are the fields and the action.
    #[must_use]
    pub fn with_kernel(mut self, kernel: Option<Arc<Kernel<i64>>>, n_actions: usize) -> Self {
        (self.kernel, self.n_actions) = (kernel, n_actions);
        self
    }

    /// What may be played in the state with these `fields`.
    ///
    /// # Errors
    /// If the script fails, or allows nothing.
    #[inline]
    pub fn at(&mut self, fields: &[f64]) -> Result<ActionSet, Fault> {
        if let Some(allowed) = self.compiled(fields) {
            return Ok(allowed);
        }
        (self.script)(fields)
    }

    #[inline]
    fn compiled(&self, fields: &[f64]) -> Option<ActionSet> {
        let kernel = self.kernel.as_ref()?;
        let mut inputs = [0.0; MAX_FIELDS + 1];
        let inputs = &mut inputs[..=fields.len()];
        inputs[..fields.len()].copy_from_slice(fields);
        let mut allowed = 0;
        for action in 0..self.n_actions {
            inputs[fields.len()] = action as f64;
            match kernel.call(inputs) {
                0 => {}
                1 => allowed |= 1 << action,
                _ => return None,
            }
        }
        // That nothing is allowed is for the script to say.
        (allowed != 0).then_some(ActionSet(allowed))
    }
}

/// From a step to a number: a reward, or a term of one.
pub struct StepFn<E: Env> {
    kernel: Option<Arc<Kernel<f64>>>,
    script: Box<ScriptOfStep<E>>,
}

impl<E: Env> StepFn<E> {
    /// Asks `script`.
    pub fn new(
        script: impl FnMut(&E, &Transition<'_, E::Obs>) -> Result<f64, Fault> + 'static,
    ) -> Self {
        Self { kernel: None, script: Box::new(script) }
    }

    /// Asks `kernel` first, whose inputs are those of [`StepLayout`].
    #[must_use]
    pub fn with_kernel(mut self, kernel: Option<Arc<Kernel<f64>>>) -> Self {
        self.kernel = kernel;
        self
    }

    #[inline]
    pub(super) fn at(
        &mut self,
        env: &E,
        t: &Transition<'_, E::Obs>,
        inputs: &StepInputs,
    ) -> Result<f64, Fault> {
        if let Some(kernel) = &self.kernel {
            let number = kernel.call(&inputs.0);
            if number.is_finite() {
                return Ok(number);
            }
        }
        (self.script)(env, t)
    }

    pub(super) fn is_compiled(&self) -> bool {
        self.kernel.is_some()
    }
}

/// Where a step's parts are among the inputs of a function of a step: the same for every environment,
/// so that laying one out is straight code.
#[derive(Debug, Clone, Copy)]
pub struct StepLayout;

impl StepLayout {
    /// The fields of the state before the step, from here on.
    pub const STATE: usize = 0;
    /// The fields of the state after it, from here on.
    pub const NEXT_STATE: usize = MAX_FIELDS;
    /// The action.
    pub const ACTION: usize = 2 * MAX_FIELDS;
    /// The native reward.
    pub const REWARD: usize = Self::ACTION + 1;
    /// 1 if the state after it is terminal, else 0.
    pub const TERMINATED: usize = Self::ACTION + 2;
    /// 1 if the time limit ends the episode here, else 0.
    pub const TRUNCATED: usize = Self::ACTION + 3;
    /// Which step of the episode it is, from 0.
    pub const STEP: usize = Self::ACTION + 4;
    /// How many inputs there are.
    pub const LEN: usize = Self::ACTION + 5;
}

/// A step as the inputs of a function: laid out once for all functions of it.
pub(super) struct StepInputs([f64; StepLayout::LEN]);

impl StepInputs {
    pub(super) fn new() -> Self {
        Self([0.0; StepLayout::LEN])
    }

    /// Lays out `t`.
    #[inline]
    pub(super) fn fill<E: Env>(&mut self, env: &E, t: &Transition<'_, E::Obs>) {
        let Self(numbers) = self;
        env.fields(t.state, &mut numbers[StepLayout::STATE..StepLayout::NEXT_STATE]);
        env.fields(t.next_state, &mut numbers[StepLayout::NEXT_STATE..StepLayout::ACTION]);
        numbers[StepLayout::ACTION] = t.action as f64;
        numbers[StepLayout::REWARD] = t.reward;
        numbers[StepLayout::TERMINATED] = f64::from(u8::from(t.terminated));
        numbers[StepLayout::TRUNCATED] = f64::from(u8::from(t.truncated));
        numbers[StepLayout::STEP] = f64::from(t.step);
    }
}
