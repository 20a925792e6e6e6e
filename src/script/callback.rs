//! Calling script functions while training.

use std::cell::{OnceCell, RefCell};
use std::collections::BTreeMap;
use std::rc::Rc;

use rhai::{AST, Dynamic, Engine, Scope};

use super::diagnostic::Diagnostic;
use super::engine::{CALLBACK_OPERATIONS, Context};
use super::lower::Library;
use super::native::{Role, Tier};
use super::params::show;
use super::plan::Callback;
use super::prepared::Prepared;
use super::record;
use super::state::{State, StepView};
use super::value::Value;
use crate::mdp::{Action, Env, Schema};
use crate::shaping::{
    ActionFn, ActionSet, CellFn, Fault, MAX_FIELDS, PhiFn, Scale, ScriptedReward, ShieldFn, StepFn,
    Transition,
};

fn fault(diagnostic: Diagnostic) -> Fault {
    Fault(Box::new(diagnostic))
}

/// One thread's compiled script, ready to be called.
pub struct Callbacks {
    pub(super) engine: Engine,
    pub(super) ast: AST,
    pub(super) context: Rc<Context>,
    /// The script's constants, which its functions see.
    pub(super) constants: BTreeMap<String, Value>,
    /// Its functions and those of its modules, once a callback is to be lowered.
    pub(super) library: OnceCell<Library>,
    pub(super) scope: RefCell<Scope<'static>>,
}

impl Callbacks {
    pub(super) fn new(
        mut engine: Engine,
        ast: AST,
        context: Rc<Context>,
        constants: BTreeMap<String, Value>,
    ) -> Rc<Self> {
        engine.set_max_operations(CALLBACK_OPERATIONS);
        context.operations.set(0);
        context.max_operations.set(CALLBACK_OPERATIONS);
        let (library, scope) = (OnceCell::new(), RefCell::new(Scope::new()));
        Rc::new(Self { engine, ast, context, constants, library, scope })
    }

    pub(super) fn annotate(&self, diagnostic: Diagnostic) -> Diagnostic {
        self.context.sources.borrow().annotate(diagnostic)
    }

    /// A call that must give a number.
    fn number<const N: usize>(
        &self,
        callback: &Prepared,
        what: &str,
        given: [Dynamic; N],
        state: &State,
    ) -> Result<f64, Diagnostic> {
        let on = || format!("on the state {}", state.describe());
        let result = self.call(callback, given).map_err(|d| d.note(on()))?;
        let number = super::params::number(&result);
        match number {
            Some(x) if x.is_finite() => Ok(x),
            _ => {
                let got = if result.is_unit() { "nothing: ()".into() } else { show(&result) };
                let mut d = Diagnostic::error(format!(
                    "{what} {} must return a finite number, it returned {got}",
                    callback.callback.described()
                ));
                if result.is_unit() {
                    d = d.hint(
                        "a function's value is its last line's; an `if` without `else` has none",
                    );
                }
                Err(self.annotate(d.at(callback.callback.place.clone()).note(on())))
            }
        }
    }

    /// `callback` as a potential of the state's fields, and of the episode if it takes two
    /// arguments.
    pub fn potential(self: &Rc<Self>, callback: &Callback, schema: &Schema) -> PhiFn {
        let kernel = self.number_kernel(callback, Role::Potential, schema);
        let of_episode = callback.arity == 2;
        let (host, callback, schema) =
            (self.clone(), self.prepare(callback), Rc::new(schema.clone()));
        let script = move |fields: &[f64], episode: u32| {
            let state = State::new(&schema, fields);
            let s = Dynamic::from(state.clone());
            let number = if callback.callback.arity == 1 {
                host.number(&callback, "the potential", [s], &state)
            } else {
                let given = [s, Dynamic::from(i64::from(episode))];
                host.number(&callback, "the potential", given, &state)
                    .map_err(|d| d.note(format!("for episode {episode}")))
            };
            number.map_err(fault)
        };
        PhiFn::new(script).with_kernel(kernel, of_episode)
    }

    /// `callback` as a number of a state and an action, called `what` in messages; of the state
    /// alone if it takes one argument.
    pub fn of_action(
        self: &Rc<Self>,
        callback: &Callback,
        what: &'static str,
        schema: &Schema,
    ) -> ActionFn {
        let kernel = self.number_kernel(callback, Role::OfAction, schema);
        let (host, callback, schema) =
            (self.clone(), self.prepare(callback), Rc::new(schema.clone()));
        Box::new(move |fields, action| {
            if let Some(kernel) = &kernel {
                let mut inputs = [0.0; MAX_FIELDS + 1];
                inputs[..fields.len()].copy_from_slice(fields);
                inputs[fields.len()] = action as f64;
                let number = kernel.call(&inputs[..=fields.len()]);
                if number.is_finite() {
                    return Ok(number);
                }
            }
            let state = State::new(&schema, fields);
            let s = Dynamic::from(state.clone());
            let number = if callback.callback.arity == 1 {
                host.number(&callback, what, [s], &state)
            } else {
                host.number(&callback, what, [s, Dynamic::from(action as i64)], &state)
                    .map_err(|d| d.note(format!("for action {}", called(&schema, action))))
            };
            number.map_err(fault)
        })
    }

    /// `callback` as a policy over `n_actions` actions: the number of one of them.
    pub fn policy(
        self: &Rc<Self>,
        callback: &Callback,
        n_actions: usize,
        schema: &Schema,
    ) -> impl FnMut(&[f64]) -> Result<Action, Fault> + use<> {
        let kernel = self.integer_kernel(callback, Role::Policy, schema);
        let (host, callback, schema) =
            (self.clone(), self.prepare(callback), Rc::new(schema.clone()));
        move |fields| {
            let compiled = kernel.as_ref().map(|kernel| kernel.call(fields));
            if let Some(Ok(action)) = compiled.map(usize::try_from)
                && action < n_actions
            {
                return Ok(action);
            }
            let state = State::new(&schema, fields);
            let on = || format!("on the state {}", state.describe());
            let given = [Dynamic::from(state.clone())];
            let value = host.call(&callback, given).map_err(|d| fault(d.note(on())))?;
            let action = value.as_int().ok().and_then(|a| usize::try_from(a).ok());
            action.filter(|&a| a < n_actions).ok_or_else(|| {
                let d = Diagnostic::error(format!(
                    "the policy {} must return the number of an action, 0 to {}, it returned {}",
                    callback.callback.described(),
                    n_actions - 1,
                    show(&value)
                ));
                let d = d.maybe_hint(value.is_float().then(|| "write floor(x).to_int()".into()));
                fault(host.annotate(d.at(callback.callback.place.clone()).note(on())))
            })
        }
    }

    /// `callback` as a shield over `n_actions` actions.
    pub fn shield(
        self: &Rc<Self>,
        callback: &Callback,
        n_actions: usize,
        schema: &Schema,
    ) -> ShieldFn {
        let kernel = self.integer_kernel(callback, Role::Shield, schema);
        let (host, callback, schema) =
            (self.clone(), self.prepare(callback), Rc::new(schema.clone()));
        let script = move |fields: &[f64]| {
            let state = State::new(&schema, fields);
            let on = || format!("on the state {}", state.describe());
            let mut allowed = 0;
            for action in 0..n_actions {
                let args = [Dynamic::from(state.clone()), Dynamic::from(action as i64)];
                let value = host.call(&callback, args).map_err(|d| fault(d.note(on())))?;
                let allows = value.as_bool().map_err(|_| {
                    let d = Diagnostic::error(format!(
                        "the shield {} must return true or false, it returned {} for action {}",
                        callback.callback.described(),
                        show(&value),
                        called(&schema, action)
                    ));
                    fault(host.annotate(d.at(callback.callback.place.clone()).note(on())))
                })?;
                allowed |= u64::from(allows) << action;
            }
            if allowed == 0 {
                let d = Diagnostic::error(format!(
                    "the shield {} allows no action in a state that is not terminal",
                    callback.callback.described()
                ));
                let d = d.at(callback.callback.place.clone()).note(on());
                return Err(fault(host.annotate(d.hint("allow at least one action everywhere"))));
            }
            Ok(ActionSet(allowed))
        };
        ShieldFn::new(script).with_kernel(kernel, n_actions)
    }

    /// `callback` as a discretiser into a table of the given shape; it sees the fields that
    /// `scales` speak of normalised.
    pub fn cells(
        self: &Rc<Self>,
        callback: &Callback,
        shape: &[usize],
        scales: &[Scale],
        schema: &Schema,
    ) -> CellFn {
        let kernel = self.integer_kernel(callback, Role::Cells(shape), schema);
        let (host, callback, schema) =
            (self.clone(), self.prepare(callback), Rc::new(schema.clone()));
        let shape = shape.to_vec();
        let script = move |shown: &[f64]| {
            let state = State::new(&schema, shown);
            let result = host.call(&callback, [Dynamic::from(state.clone())]);
            result
                .and_then(|value| {
                    cell_index(&value, &shape, &callback.callback).map_err(|d| host.annotate(d))
                })
                .map_err(|d| fault(d.note(format!("on the state {}", state.describe()))))
        };
        CellFn::new(scales, script).with_kernel(kernel)
    }

    /// `reward` (the native one if `None`) plus `terms`, as a reward model.
    pub fn reward<E: Env>(
        self: &Rc<Self>,
        reward: Option<&Callback>,
        terms: &[Callback],
        schema: &Schema,
    ) -> ScriptedReward<E> {
        let schema = Rc::new(schema.clone());
        let reward = reward.map(|callback| self.of_step(callback, "the reward", &schema));
        let terms = terms.iter().map(|callback| self.of_step(callback, "the term", &schema));
        ScriptedReward::new(reward, terms.collect())
    }

    /// `callback` as a number of a step, called `what` in messages.
    fn of_step<E: Env>(
        self: &Rc<Self>,
        callback: &Callback,
        what: &'static str,
        schema: &Rc<Schema>,
    ) -> StepFn<E> {
        let kernel = match self.tier(callback, Role::OfStep, schema) {
            // Whoever tabulates a reward asks whether it has read `t.step`, which code does not say.
            Tier::Number(kernel, reads_step) if !(E::INDEXED && reads_step) => Some(kernel),
            _ => None,
        };
        let (host, callback, schema) = (self.clone(), self.prepare(callback), schema.clone());
        let n_fields = schema.fields.len();
        let script = move |env: &E, t: &Transition<'_, E::Obs>| {
            let view = |obs: &E::Obs| {
                let mut fields = [0.0; MAX_FIELDS];
                env.fields(obs, &mut fields);
                State::new(&schema, &fields[..n_fields])
            };
            let step = StepView {
                state: view(t.state),
                action: t.action as i64,
                reward: t.reward,
                next_state: view(t.next_state),
                terminated: t.terminated,
                truncated: t.truncated,
                step: i64::from(t.step),
            };
            host.number(&callback, what, [Dynamic::from(step.clone())], &step.state).map_err(|d| {
                fault(d.note(format!("action {}, to {}", step.action, step.next_state.describe())))
            })
        };
        StepFn::new(script).with_kernel(kernel)
    }

    /// The numbers of real-valued action `index`.
    pub(super) fn action(&self, callback: &Callback, index: usize) -> Result<Vec<f64>, Diagnostic> {
        let value = self.call(&self.prepare(callback), [Dynamic::from(index as i64)])?;
        let numbers = match value.read_lock::<rhai::Array>() {
            Some(list) => list.iter().map(super::params::number).collect(),
            None => super::params::number(&value).map(|x| vec![x]),
        };
        numbers.ok_or_else(|| {
            let d = Diagnostic::error(format!(
                "the action {} must return a number or an array of numbers, it returned {} for \
                 action {index}",
                callback.described(),
                show(&value)
            ));
            self.annotate(d.at(callback.place.clone()))
        })
    }

    /// Forgets whether a callback has read `t.step`.
    pub fn clear_step_read(&self) {
        self.context.step_read.set(false);
    }

    /// Whether a callback has read `t.step` since [`Self::clear_step_read`]: then its reward is
    /// not a function of the transition alone.
    pub fn step_read(&self) -> bool {
        self.context.step_read.get()
    }

    /// Whether a claim holds of `results`.
    ///
    /// # Errors
    /// If the claim cannot be evaluated, or is not true or false.
    pub fn holds(&self, claim: &Callback, results: &serde_json::Value) -> Result<bool, Diagnostic> {
        let value = self.call(&self.prepare(claim), [record::dynamic("the results", results)])?;
        value.as_bool().map_err(|_| {
            let d =
                Diagnostic::error(format!("an expectation is true or false, got {}", show(&value)));
            self.annotate(
                d.at(claim.place.clone()).hint(
                    "a statistic that is missing is (): check its name and that of the variant",
                ),
            )
        })
    }
}

/// An action's number, with its name if it has one.
fn called(schema: &Schema, action: usize) -> String {
    match schema.actions.get(action) {
        Some(name) => format!("{action} ({name})"),
        None => action.to_string(),
    }
}

/// The row-major index of what a scripted discretiser returned.
pub(super) fn cell_index(
    value: &Dynamic,
    shape: &[usize],
    callback: &Callback,
) -> Result<usize, Diagnostic> {
    let wrong = |d: Diagnostic| Err(d.at(callback.place.clone()));
    let indices: Option<Vec<i64>> = match value.read_lock::<rhai::Array>() {
        Some(list) => list.iter().map(|v| v.as_int().ok()).collect(),
        None => value.as_int().ok().map(|i| vec![i]),
    };
    let Some(indices) = indices.filter(|i| i.len() == shape.len()) else {
        let expected = match shape.len() {
            1 => "an integer".to_string(),
            n => format!("an array of {n} integers"),
        };
        return wrong(
            Diagnostic::error(format!(
                "the discretiser {} must return {expected}, it returned {}",
                callback.described(),
                show(value)
            ))
            .maybe_hint(value.is_float().then(|| "write floor(x).to_int()".into())),
        );
    };
    let mut cell = 0;
    for (&i, &n) in indices.iter().zip(shape) {
        match usize::try_from(i) {
            Ok(i) if i < n => cell = cell * n + i,
            _ => {
                return wrong(Diagnostic::error(format!(
                    "the discretiser {} returned index {i}, outside its table of {n} (0 to {})",
                    callback.described(),
                    n - 1
                )));
            }
        }
    }
    Ok(cell)
}
