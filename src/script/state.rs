//! What callbacks receive: states and steps.

use std::collections::BTreeSet;
use std::rc::Rc;
use std::sync::OnceLock;

use rhai::{Dynamic, Engine, EvalAltResult, Position};

use super::diagnostic::{Diagnostic, suggest};
use super::engine::Context;
use crate::env::specs;
use crate::mdp::{FieldKind, Schema};
use crate::shaping::MAX_FIELDS;

/// A state, as scripts see it: `s.theta`, `s[2]`, and facts such as `s.rows`.
#[derive(Debug, Clone)]
pub(super) struct State {
    values: [f64; MAX_FIELDS],
    schema: Rc<Schema>,
}

/// A step, as scripts see it.
#[derive(Debug, Clone)]
pub(super) struct StepView {
    pub(super) state: State,
    pub(super) action: i64,
    pub(super) reward: f64,
    pub(super) next_state: State,
    pub(super) terminated: bool,
    pub(super) truncated: bool,
    pub(super) step: i64,
}

fn value(kind: FieldKind, x: f64) -> Dynamic {
    match kind {
        FieldKind::Float => x.into(),
        FieldKind::Int => (x as i64).into(),
        FieldKind::Letter => char::from_u32(x as u32).unwrap_or('?').to_string().into(),
    }
}

impl State {
    /// From the fields' numbers, in the schema's order.
    pub(super) fn new(schema: &Rc<Schema>, fields: &[f64]) -> Self {
        let mut values = [0.0; MAX_FIELDS];
        values[..fields.len()].copy_from_slice(fields);
        Self { values, schema: schema.clone() }
    }

    fn named(&self, name: &str) -> Option<Dynamic> {
        if let Some(i) = self.schema.fields.iter().position(|f| f.name == name) {
            return Some(value(self.schema.fields[i].kind, self.values[i]));
        }
        let (_, kind, x) = self.schema.facts.iter().find(|(n, ..)| *n == name)?;
        Some(value(*kind, *x))
    }

    /// The field or fact called `name`, for scripts.
    fn get(&self, name: &str) -> Result<Dynamic, Box<EvalAltResult>> {
        self.named(name).map_or_else(
            || {
                let fields = self.schema.fields.iter().map(|f| f.name);
                let facts = self.schema.facts.iter().map(|f| f.0);
                let names: Vec<&str> = fields.chain(facts).collect();
                fail(
                    Diagnostic::error(format!("this environment's state has no field `{name}`"))
                        .maybe_hint(suggest(name, names)),
                )
            },
            Ok,
        )
    }

    fn indexed(&self, index: i64) -> Option<Dynamic> {
        let n = self.schema.fields.len() as i64;
        let i = if index < 0 { index.checked_add(n)? } else { index };
        let i = usize::try_from(i).ok().filter(|i| *i < self.schema.fields.len())?;
        Some(value(self.schema.fields[i].kind, self.values[i]))
    }

    /// The state in words: `row 2, col 3, …`.
    pub(super) fn describe(&self) -> String {
        let fields = self.schema.fields.iter().zip(&self.values);
        let text = fields.map(|(f, x)| format!("{} = {}", f.name, value(f.kind, *x)));
        text.collect::<Vec<_>>().join(", ")
    }
}

fn fail<T>(diagnostic: Diagnostic) -> Result<T, Box<EvalAltResult>> {
    Err(Box::new(EvalAltResult::ErrorRuntime(Dynamic::from(diagnostic), Position::NONE)))
}

/// The names of every environment's fields and facts.
fn names() -> &'static BTreeSet<&'static str> {
    static NAMES: OnceLock<BTreeSet<&'static str>> = OnceLock::new();
    NAMES.get_or_init(|| {
        let none = serde_json::Map::new();
        let schemas = specs().iter().filter_map(|spec| spec.make(&none).ok()).map(|e| e.schema());
        schemas
            .flat_map(|s| {
                let facts: Vec<_> = s.facts.iter().map(|f| f.0).collect();
                s.fields.iter().map(|f| f.name).chain(facts).collect::<Vec<_>>()
            })
            .collect()
    })
}

/// What a step has: names, types as definition files write them, meanings.
pub(super) const STEP_FIELDS: [(&str, &str, &str); 7] = [
    ("state", "?", "The state before it: fields as of the environment's states"),
    ("action", "int", "The action's number"),
    ("reward", "float", "What the environment paid"),
    ("next_state", "?", "The state after it"),
    ("terminated", "bool", "Whether the episode ended in a terminal state"),
    ("truncated", "bool", "Whether the time limit cut the episode off"),
    ("step", "int", "Its number in the episode, from 0"),
];

/// Registers both types with their properties.
pub(super) fn register(engine: &mut Engine, context: &Rc<Context>) {
    engine.register_type_with_name::<State>("State");
    // Rhai finds a getter at once, and the indexer only after it has looked for one in vain.
    for &name in names() {
        engine.register_get(name, move |s: &mut State| s.get(name));
    }
    engine.register_indexer_get(|s: &mut State, name: &str| s.get(name));
    engine.register_indexer_get(|s: &mut State, index: i64| {
        s.indexed(index).map_or_else(
            || {
                let n = s.schema.fields.len();
                fail(Diagnostic::error(format!(
                    "index {index} is outside the state, which has {n} fields (0 to {})",
                    n - 1
                )))
            },
            Ok,
        )
    });
    engine.register_indexer_set(|_: &mut State, name: &str, _: Dynamic| {
        fail::<()>(Diagnostic::error(format!("states are read-only: `{name}` cannot be assigned")))
    });
    engine.register_indexer_set(|_: &mut State, index: i64, _: Dynamic| {
        fail::<()>(Diagnostic::error(format!("states are read-only: [{index}] cannot be assigned")))
    });
    engine.register_fn("to_string", |s: &mut State| format!("#{{{}}}", s.describe()));
    engine.register_fn("to_debug", |s: &mut State| format!("#{{{}}}", s.describe()));
    engine.register_fn("len", |s: &mut State| s.schema.fields.len() as i64);

    engine.register_type_with_name::<StepView>("Step");
    engine.register_get("state", |t: &mut StepView| t.state.clone());
    engine.register_get("action", |t: &mut StepView| t.action);
    engine.register_get("reward", |t: &mut StepView| t.reward);
    engine.register_get("next_state", |t: &mut StepView| t.next_state.clone());
    engine.register_get("terminated", |t: &mut StepView| t.terminated);
    engine.register_get("truncated", |t: &mut StepView| t.truncated);
    let step_read = context.step_read.clone();
    engine.register_get("step", move |t: &mut StepView| {
        step_read.set(true);
        t.step
    });
    engine.register_indexer_set(|_: &mut StepView, name: &str, _: Dynamic| {
        fail::<()>(Diagnostic::error(format!("steps are read-only: `{name}` cannot be assigned")))
    });
    let step_read = context.step_read.clone();
    engine.register_indexer_get(move |t: &mut StepView, name: &str| {
        Ok(match name {
            "state" => Dynamic::from(t.state.clone()),
            "action" => t.action.into(),
            "reward" => t.reward.into(),
            "next_state" => Dynamic::from(t.next_state.clone()),
            "terminated" => t.terminated.into(),
            "truncated" => t.truncated.into(),
            "step" => {
                step_read.set(true);
                t.step.into()
            }
            _ => {
                let diagnostic = Diagnostic::error(format!("a step has no field `{name}`"));
                return fail(diagnostic.maybe_hint(suggest(name, STEP_FIELDS.map(|f| f.0))));
            }
        })
    });
}
