//! Calling script functions while training, and turning Rhai's errors into diagnostics.

use std::cell::RefCell;
use std::rc::Rc;

use rhai::{
    AST, CallFnOptions, Dynamic, Engine, EvalAltResult, FnPtr, ParseErrorType, Position, Scope,
};

use super::diagnostic::{Diagnostic, nearest};
use super::engine::{BUILT_IN_CONSTANTS, CALLBACK_OPERATIONS, Context};
use super::functions::functions;
use super::params::show;
use super::plan::Callback;
use super::state::{State, StepView};
use crate::mdp::{Env, Schema};
use crate::shaping::{CellFn, Fault, MAX_FIELDS, PhiFn, RewardFn};

/// A callback failed: the diagnostic, as an error type.
pub type CallbackFault = Diagnostic;

fn fault(diagnostic: Diagnostic) -> Fault {
    Fault(Box::new(diagnostic))
}

/// One thread's compiled script, ready to be called.
pub struct Callbacks {
    pub(super) engine: Engine,
    pub(super) ast: AST,
    pub(super) context: Rc<Context>,
    scope: RefCell<Scope<'static>>,
}

impl Callbacks {
    pub(super) fn new(mut engine: Engine, ast: AST, context: Rc<Context>) -> Rc<Self> {
        engine.set_max_operations(CALLBACK_OPERATIONS);
        Rc::new(Self { engine, ast, context, scope: RefCell::new(Scope::new()) })
    }

    /// The function called `name`, as a value.
    pub(super) fn function(&self, name: &str) -> Option<FnPtr> {
        self.ast.iter_fn_def().find(|f| f.name == name).map(|f| FnPtr::from(f.clone()))
    }

    /// Calls `callback` with `args` after its captured values.
    pub(super) fn call(
        &self,
        callback: &Callback,
        args: Vec<Dynamic>,
    ) -> Result<Dynamic, Diagnostic> {
        let function = |name: &str| self.function(name);
        let mut all: Vec<Dynamic> = callback.captures.iter().map(|v| v.thaw(&function)).collect();
        all.extend(args);
        let options = CallFnOptions::new().eval_ast(false).rewind_scope(true);
        let mut scope = self.scope.borrow_mut();
        let result = self.engine.call_fn_with_options::<Dynamic>(
            options,
            &mut scope,
            &self.ast,
            &callback.function,
            all,
        );
        result.map_err(|e| {
            self.annotate(diagnostic(&self.context, &e, None).at(callback.place.clone()))
        })
    }

    fn annotate(&self, diagnostic: Diagnostic) -> Diagnostic {
        self.context.sources.borrow().annotate(diagnostic)
    }

    /// A call that must give a number.
    fn number(
        &self,
        callback: &Callback,
        what: &str,
        arg: Dynamic,
        state: &State,
    ) -> Result<f64, Diagnostic> {
        let on = || format!("on the state {}", state.describe());
        let result = self.call(callback, vec![arg]).map_err(|d| d.note(on()))?;
        let number = super::params::number(&result);
        match number {
            Some(x) if x.is_finite() => Ok(x),
            _ => {
                let got = if result.is_unit() { "nothing: ()".into() } else { show(&result) };
                let mut d = Diagnostic::error(format!(
                    "{what} `{}` must return a finite number, it returned {got}",
                    callback.label
                ));
                if result.is_unit() {
                    d = d.hint("is the last line missing its value, or ended with a `;`?");
                }
                Err(self.annotate(d.at(callback.place.clone()).note(on())))
            }
        }
    }

    /// `callback` as a potential of the state's fields.
    pub fn potential(self: &Rc<Self>, callback: &Callback, schema: &Schema) -> PhiFn {
        let (host, callback, schema) = (self.clone(), callback.clone(), Rc::new(schema.clone()));
        Box::new(move |fields| {
            let state = State::new(&schema, fields);
            let arg = Dynamic::from(state.clone());
            host.number(&callback, "the potential", arg, &state).map_err(fault)
        })
    }

    /// `callback` as a discretiser into a table of the given shape.
    pub fn cells(self: &Rc<Self>, callback: &Callback, shape: &[usize], schema: &Schema) -> CellFn {
        let (host, callback, schema) = (self.clone(), callback.clone(), Rc::new(schema.clone()));
        let shape = shape.to_vec();
        Box::new(move |fields| {
            let state = State::new(&schema, fields);
            let result = host.call(&callback, vec![Dynamic::from(state.clone())]);
            result
                .and_then(|value| {
                    cell_index(&value, &shape, &callback).map_err(|d| host.annotate(d))
                })
                .map_err(|d| fault(d.note(format!("on the state {}", state.describe()))))
        })
    }

    /// `reward` (the native one if `None`) plus `terms`, as a reward model.
    pub fn reward<E: Env>(
        self: &Rc<Self>,
        reward: Option<&Callback>,
        terms: &[Callback],
        schema: &Schema,
    ) -> RewardFn<E> {
        let (host, schema) = (self.clone(), Rc::new(schema.clone()));
        let (reward, terms) = (reward.cloned(), terms.to_vec());
        let n_fields = schema.fields.len();
        Box::new(move |env, t, sums| {
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
            let call = |callback: &Callback, what: &str| {
                let arg = Dynamic::from(step.clone());
                host.number(callback, what, arg, &step.state).map_err(|d| {
                    fault(d.note(format!(
                        "action {}, to {}",
                        step.action,
                        step.next_state.describe()
                    )))
                })
            };
            let mut total = match &reward {
                Some(callback) => call(callback, "the reward")?,
                None => t.reward,
            };
            for (sum, callback) in sums.iter_mut().zip(&terms) {
                let term = call(callback, "the term")?;
                *sum += term;
                total += term;
            }
            Ok(total)
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
        let value = self.call(claim, vec![dynamic(results)])?;
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

fn dynamic(json: &serde_json::Value) -> Dynamic {
    match json {
        serde_json::Value::Null => Dynamic::UNIT,
        serde_json::Value::Bool(b) => (*b).into(),
        serde_json::Value::Number(n) => {
            n.as_i64().map_or_else(|| n.as_f64().unwrap_or(f64::NAN).into(), Dynamic::from)
        }
        serde_json::Value::String(s) => s.clone().into(),
        serde_json::Value::Array(a) => a.iter().map(dynamic).collect::<rhai::Array>().into(),
        serde_json::Value::Object(o) => {
            let map: rhai::Map = o.iter().map(|(k, v)| (k.as_str().into(), dynamic(v))).collect();
            map.into()
        }
    }
}

/// The row-major index of what a scripted discretiser returned.
fn cell_index(value: &Dynamic, shape: &[usize], callback: &Callback) -> Result<usize, Diagnostic> {
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
                "the discretiser `{}` must return {expected}, it returned {}",
                callback.label,
                show(value)
            ))
            .maybe_hint(value.is_float().then(|| "write to_int(x) or floor(x).to_int()".into())),
        );
    };
    let mut cell = 0;
    for (&i, &n) in indices.iter().zip(shape) {
        match usize::try_from(i) {
            Ok(i) if i < n => cell = cell * n + i,
            _ => {
                return wrong(Diagnostic::error(format!(
                    "the discretiser `{}` returned index {i}, outside its table of {n} (0 to {})",
                    callback.label,
                    n - 1
                )));
            }
        }
    }
    Ok(cell)
}

/// A syntax error as a diagnostic.
pub(super) fn parse_diagnostic(
    context: &Context,
    source: &str,
    error: &ParseErrorType,
    position: Position,
) -> Diagnostic {
    let d = match error {
        ParseErrorType::VariableUndefined(name) => {
            let syntax = context.syntax.borrow();
            let syntax = syntax.get(source);
            let d = Diagnostic::error(format!("there is no variable or function `{name}` here"));
            if syntax.is_some_and(|s| s.variables.contains(name)) {
                d.hint(format!(
                    "functions see constants only: write `const {name} = …`, or use a closure |s| …"
                ))
            } else {
                let constants = syntax.map(|s| s.constants.clone()).unwrap_or_default();
                let functions: Vec<&str> = functions().iter().map(|f| f.name).collect();
                let known = constants.iter().map(String::as_str).chain(functions);
                let best = nearest(name, known.chain(BUILT_IN_CONSTANTS.iter().copied()));
                d.maybe_hint(best.map(|b| format!("did you mean `{b}`?")))
            }
        }
        other => Diagnostic::error(lower_first(&other.to_string())),
    };
    let place = context.place(Some(source), position);
    context.sources.borrow().annotate(d.at(place))
}

fn lower_first(text: &str) -> String {
    let mut chars = text.chars();
    match chars.next() {
        Some(c) => c.to_lowercase().chain(chars).collect(),
        None => String::new(),
    }
}

/// A run-time error as a diagnostic, with the innermost place.
pub(super) fn diagnostic(
    context: &Context,
    error: &EvalAltResult,
    source: Option<&str>,
) -> Diagnostic {
    let mut error = error;
    let mut source = source.map(str::to_string);
    let mut place = None;
    loop {
        // The innermost position that is known wins; the source changes with the function.
        place = context.place(source.as_deref(), error.position()).or(place);
        match error {
            EvalAltResult::ErrorInFunctionCall(_, file, inner, _) => {
                if !file.is_empty() {
                    source = Some(file.clone());
                }
                error = inner;
            }
            EvalAltResult::ErrorInModule(_, inner, _) => error = inner,
            _ => break,
        }
    }
    let d = match error {
        EvalAltResult::ErrorRuntime(value, _) => match value.clone().try_cast::<Diagnostic>() {
            Some(d) => d,
            None => Diagnostic::error(format!("the script threw {}", show(value))),
        },
        EvalAltResult::ErrorParsing(error, position) => {
            let file = source.unwrap_or_else(|| context.sources.borrow().script.name.to_string());
            return parse_diagnostic(context, &file, error, *position);
        }
        EvalAltResult::ErrorFunctionNotFound(signature, _) => not_found(context, signature),
        EvalAltResult::ErrorTooManyOperations(_) => {
            Diagnostic::error("the operation budget is used up").hint("is this loop endless?")
        }
        EvalAltResult::ErrorStackOverflow(_) => Diagnostic::error("calls are nested too deeply")
            .hint("does this function call itself without end?"),
        EvalAltResult::ErrorVariableNotFound(name, _) => {
            Diagnostic::error(format!("there is no variable `{name}` here"))
        }
        EvalAltResult::ErrorDotExpr(what, _) => {
            Diagnostic::error(format!("no such property: {what}"))
                .hint("numbers are floats or integers; is this value of the type you expect?")
        }
        other => {
            let mut bare = String::new();
            let text = other.to_string();
            bare.push_str(text.split(" (line ").next().unwrap_or(&text));
            Diagnostic::error(lower_first(&bare))
        }
    };
    context.sources.borrow().annotate(d.at(place))
}

/// No function of that name takes those arguments.
fn not_found(context: &Context, signature: &str) -> Diagnostic {
    let (name, args) = signature.split_once(" (").unwrap_or((signature, ")"));
    let args = args.trim_end_matches(')').replace("rhai::", "");
    let all = functions();
    if let Some(known) = all.iter().find(|f| f.name == name) {
        return Diagnostic::error(format!("`{name}` cannot be called with ({args})"))
            .hint(format!("it is called as {}", known.signature));
    }
    if !name.chars().next().is_some_and(|c| c.is_alphabetic() || c == '_') {
        return Diagnostic::error(format!("`{name}` cannot be applied to ({args})"));
    }
    let syntax = context.syntax.borrow();
    let _ = &syntax;
    let best = nearest(name, all.iter().map(|f| f.name));
    Diagnostic::error(format!("there is no function `{name}` that takes ({args})"))
        .maybe_hint(best.map(|b| format!("did you mean `{b}`?")))
}
