//! Agents, and what their parameters can be besides numbers and words.

use std::collections::BTreeMap;
use std::rc::Rc;

use rhai::{Dynamic, Engine, Map, NativeCallContext};

use super::super::diagnostic::Diagnostic;
use super::super::draft::AgentDraft;
use super::super::engine::Context;
use super::super::params::{VisitCount, merge_agent, number, per_step, show, whole};
use super::Call;
use crate::learn::registry::{AGENTS, AgentSpec};
use crate::learn::{AgentConfig, Exploration, Schedule, Unit};

pub(super) fn register(engine: &mut Engine, context: &Rc<Context>) {
    engine.register_type_with_name::<AgentDraft>("agent");
    engine.register_type_with_name::<Schedule>("schedule");
    engine.register_type_with_name::<Exploration>("behaviour policy");
    engine.register_type_with_name::<VisitCount>("step size");
    for spec in AGENTS {
        agent(engine, context, spec);
    }
    schedules(engine, context);
    behaviours(engine, context);
}

fn agent(engine: &mut Engine, context: &Rc<Context>, spec: &'static AgentSpec) {
    let default = move || AgentDraft {
        spec,
        params: AgentConfig::new(spec).params,
        functions: BTreeMap::new(),
    };
    engine.register_fn(spec.name, default);
    let c = context.clone();
    engine.register_fn(spec.name, move |native: NativeCallContext, map: Map| {
        let call = Call::new(&c, &native);
        let mut draft = default();
        call.finish(merge_agent(&mut draft, &map, |key| call.key(key)).map(|()| draft))
    });
}

fn schedules(engine: &mut Engine, context: &Rc<Context>) {
    type D = Dynamic;
    let c = context.clone();
    engine.register_fn("constant", move |native: NativeCallContext, value: Dynamic| {
        let call = Call::new(&c, &native);
        call.finish(finite(&call, 0, "the value", &value).map(Schedule::constant))
    });
    let unit = |steps: bool| if steps { Unit::Step } else { Unit::Episode };
    let linear = move |call: &Call<'_>, [start, end, over]: [Dynamic; 3], options: &Map| {
        call.finish((|| {
            Ok(Schedule::Linear {
                start: finite(call, 0, "the start", &start)?,
                end: finite(call, 1, "the end", &end)?,
                over: whole("the number of episodes or steps", &over, 1, i64::MAX)
                    .map_err(|d| d.at(call.arg(2).place()))? as u64,
                unit: unit(per_step(options, |key| call.key(key))?),
            })
        })())
    };
    let exponential = move |call: &Call<'_>, [start, factor, min]: [Dynamic; 3], options: &Map| {
        call.finish((|| {
            let factor = finite(call, 1, "the factor", &factor)?;
            if !(factor > 0.0 && factor <= 1.0) {
                return Err(Diagnostic::error(format!(
                    "the factor of an exponential schedule is above 0 and at most 1, got {factor}"
                ))
                .at(call.arg(1).place()));
            }
            Ok(Schedule::Exponential {
                start: finite(call, 0, "the start", &start)?,
                factor,
                min: finite(call, 2, "the minimum", &min)?,
                unit: unit(per_step(options, |key| call.key(key))?),
            })
        })())
    };
    let c = context.clone();
    engine.register_fn("linear", move |n: NativeCallContext, a: D, b: D, over: D| {
        linear(&Call::new(&c, &n), [a, b, over], &Map::new())
    });
    let c = context.clone();
    engine.register_fn("linear", move |n: NativeCallContext, a: D, b: D, over: D, options: Map| {
        linear(&Call::new(&c, &n), [a, b, over], &options)
    });
    let c = context.clone();
    engine.register_fn("exponential", move |n: NativeCallContext, a: D, factor: D, min: D| {
        exponential(&Call::new(&c, &n), [a, factor, min], &Map::new())
    });
    let c = context.clone();
    engine.register_fn(
        "exponential",
        move |n: NativeCallContext, a: D, factor: D, min: D, options: Map| {
            exponential(&Call::new(&c, &n), [a, factor, min], &options)
        },
    );
}

/// The `i`-th argument of a schedule, a finite number.
fn finite(call: &Call<'_>, i: usize, what: &str, value: &Dynamic) -> Result<f64, Diagnostic> {
    number(value).filter(|x| x.is_finite()).ok_or_else(|| {
        Diagnostic::error(format!("{what} of a schedule is a number, got {}", show(value)))
            .at(call.arg(i).place())
    })
}

/// Behaviour policies and step sizes by visits.
fn behaviours(engine: &mut Engine, context: &Rc<Context>) {
    let c = context.clone();
    engine.register_fn("softmax", move |native: NativeCallContext, temperature: Dynamic| {
        let call = Call::new(&c, &native);
        let allowed = ("the temperature of softmax", "a number above 0");
        let temperature = only(&call, allowed, &temperature, |x| x > 0.0);
        call.finish(temperature.map(|temperature| Exploration::Softmax { temperature }))
    });
    let c = context.clone();
    engine.register_fn("ucb", move |native: NativeCallContext, factor: Dynamic| {
        let call = Call::new(&c, &native);
        let allowed = ("the c of ucb", "a number of at least 0");
        call.finish(only(&call, allowed, &factor, |x| x >= 0.0).map(|c| Exploration::Ucb { c }))
    });
    engine.register_fn("visit_count", || VisitCount { omega: 1.0 });
    let c = context.clone();
    engine.register_fn("visit_count", move |native: NativeCallContext, omega: Dynamic| {
        let call = Call::new(&c, &native);
        let allowed = ("the exponent of visit_count", "a number above 0 and at most 1");
        let omega = only(&call, allowed, &omega, |x| x > 0.0 && x <= 1.0);
        call.finish(omega.map(|omega| VisitCount { omega }))
    });
}

/// The only argument: a finite number that is `right`.
fn only(
    call: &Call<'_>,
    (what, allowed): (&str, &str),
    value: &Dynamic,
    right: impl Fn(f64) -> bool,
) -> Result<f64, Diagnostic> {
    number(value).filter(|x| x.is_finite() && right(*x)).ok_or_else(|| {
        Diagnostic::error(format!("{what} is {allowed}, got {}", show(value)))
            .at(call.arg(0).place())
    })
}
