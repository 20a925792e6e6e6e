//! The functions with which a script builds its plan.

mod agents;
mod discretisers;
mod features;

use std::rc::Rc;

use rhai::{Array, Dynamic, Engine, EvalAltResult, FnPtr, ImmutableString, Map, NativeCallContext};

use super::diagnostic::{Diagnostic, Place};
use super::draft::{
    EnvDraft, ExperimentDraft, Located, Spot, StudyDraft, captured_now, is_name, notes,
};
use super::engine::Context;
use super::params::{number, show, whole};
use super::plan::GoldenBudget;
use super::setting::Entries;
use super::shaping::LearnedPotential;
use crate::env::frozen_lake::{MAX_TILES, random_map_within};
use crate::mdp::numpy::Seed;

type Fallible<T> = Result<T, Box<EvalAltResult>>;

/// Characters of an expectation.
const MAX_CLAIM: usize = 1_000;

/// A call in progress: finds the places of the call, its arguments and their keys.
struct Call<'a> {
    context: &'a Context,
    source: Option<String>,
    position: rhai::Position,
}

impl<'a> Call<'a> {
    fn new(context: &'a Context, native: &NativeCallContext) -> Self {
        Self {
            context,
            source: native.call_source().map(str::to_string),
            position: native.call_position(),
        }
    }

    fn place(&self) -> Option<Place> {
        self.context.place(self.source.as_deref(), self.position)
    }

    fn spot(&self) -> Spot {
        Spot(self.place())
    }

    fn found(
        &self,
        find: impl Fn(&super::syntax::Syntax, (usize, usize)) -> Option<(usize, usize)>,
    ) -> Spot {
        let place = self.place();
        let Some(here) = &place else { return Spot(None) };
        let syntax = self.context.syntax.borrow();
        let at = syntax.get(&*here.file).and_then(|s| find(s, (here.line, here.column)));
        Spot(match at {
            Some((line, column)) => Some(Place { file: here.file.clone(), line, column }),
            None => place,
        })
    }

    /// The place of a (dotted) key in a map literal of this call; else the call's own.
    fn key(&self, key: &str) -> Spot {
        self.found(|syntax, call| syntax.keys.get(&call)?.get(key).copied())
    }

    /// The place of the `i`-th argument; else the call's own.
    fn arg(&self, i: usize) -> Spot {
        self.found(|syntax, call| {
            syntax.args.get(&call)?.get(i).copied().filter(|at| *at != (0, 0))
        })
    }

    fn fail<T>(&self, diagnostic: Diagnostic) -> Fallible<T> {
        let diagnostic = diagnostic.at(self.place());
        Err(Box::new(EvalAltResult::ErrorRuntime(Dynamic::from(diagnostic), self.position)))
    }

    fn finish<T>(&self, result: Result<T, Diagnostic>) -> Fallible<T> {
        result.or_else(|diagnostic| self.fail(diagnostic))
    }
}

/// Registers the builders and their types.
pub(super) fn register(engine: &mut Engine, context: &Rc<Context>) {
    engine.register_type_with_name::<ExperimentDraft>("experiment");
    engine.register_type_with_name::<StudyDraft>("study");
    engine.register_type_with_name::<EnvDraft>("environment");
    engine.register_type_with_name::<LearnedPotential>("learned potential");
    experiments(engine, context);
    studies(engine, context);
    environments(engine, context);
    agents::register(engine, context);
    discretisers::register(engine, context);
    features::register(engine, context);
    potentials(engine, context);
}

fn experiments(engine: &mut Engine, context: &Rc<Context>) {
    let c = context.clone();
    engine.register_fn("experiment", move |native: NativeCallContext, map: Map| {
        let call = Call::new(&c, &native);
        let mut draft = ExperimentDraft { spot: call.spot(), ..ExperimentDraft::default() };
        call.finish(draft.merge(&map, &|key| call.key(key)).map(|()| draft))
    });
    let c = context.clone();
    engine.register_fn(
        "with",
        move |native: NativeCallContext, base: &mut ExperimentDraft, map: Map| {
            let call = Call::new(&c, &native);
            let mut draft = ExperimentDraft { spot: call.spot(), ..base.clone() };
            call.finish(draft.merge(&map, &|key| call.key(key)).map(|()| draft))
        },
    );
}

fn studies(engine: &mut Engine, context: &Rc<Context>) {
    let c = context.clone();
    engine.register_fn("study", move |native: NativeCallContext, name: &str, list: Array| {
        let call = Call::new(&c, &native);
        if !is_name(name) {
            return call.fail(Diagnostic::error(
                "a study's name is a string of 1 to 80 characters, without / or line breaks, not beginning or ending with a blank",
            ));
        }
        let experiments =
            call.finish(experiments_of(&list).map_err(|d| d.at(call.arg(1).place())))?;
        Ok(StudyDraft {
            name: name.to_string(),
            spot: call.spot(),
            experiments,
            expectations: Vec::new(),
            baseline: None,
            notes: None,
            golden: GoldenBudget::default(),
        })
    });
    let c = context.clone();
    engine.register_fn(
        "expect",
        move |native: NativeCallContext, study: &mut StudyDraft, text: &str, check: FnPtr| {
            let call = Call::new(&c, &native);
            if text.chars().nth(MAX_CLAIM).is_some() {
                return call.fail(Diagnostic::error(format!(
                    "an expectation's text has at most {MAX_CLAIM} characters"
                )));
            }
            let check = Located { value: captured_now(check), spot: call.arg(1) };
            let mut study = study.clone();
            study.expectations.push((text.to_string(), check));
            Ok(study)
        },
    );
    let c = context.clone();
    engine.register_fn(
        "baseline",
        move |native: NativeCallContext, study: &mut StudyDraft, name: &str| {
            let call = Call::new(&c, &native);
            let baseline = Some(Located { value: name.to_string(), spot: call.arg(0) });
            StudyDraft { baseline, ..study.clone() }
        },
    );
    let c = context.clone();
    engine.register_fn(
        "golden",
        move |native: NativeCallContext, study: &mut StudyDraft, map: Map| {
            let call = Call::new(&c, &native);
            let mut golden = GoldenBudget::default();
            for (key, value) in &map {
                let n = call.finish(
                    whole(&format!("`{key}`"), value, 1, 1_000_000)
                        .map_err(|d| d.at(call.key(key).place())),
                )?;
                match key.as_str() {
                    "episodes" => golden.episodes = Some(n as u32),
                    "seeds" => golden.seeds = Some(n as u32),
                    _ => {
                        let d = Diagnostic::error(format!("a golden budget has no key `{key}`"));
                        return call
                            .fail(d.at(call.key(key).place()).hint("`episodes` or `seeds`"));
                    }
                }
            }
            Ok(StudyDraft { golden, ..study.clone() })
        },
    );
    let c = context.clone();
    engine.register_fn(
        "notes",
        move |native: NativeCallContext, study: &mut StudyDraft, text: ImmutableString| {
            let notes = Call::new(&c, &native).finish(notes(&text.into()))?;
            Ok(StudyDraft { notes: Some(notes), ..study.clone() }) as Fallible<StudyDraft>
        },
    );
}

/// The experiments of an array.
pub(super) fn experiments_of(list: &Array) -> Result<Vec<ExperimentDraft>, Diagnostic> {
    list.iter()
        .map(|item| {
            item.clone().flatten().try_cast::<ExperimentDraft>().ok_or_else(|| {
                Diagnostic::error(format!("a study is made of experiments, got {}", show(item)))
            })
        })
        .collect()
}

fn environments(engine: &mut Engine, context: &Rc<Context>) {
    let new = |id: &str| EnvDraft { id: id.to_string(), kwargs: Entries::default() };
    engine.register_fn("env", move |id: &str| new(id));
    let c = context.clone();
    engine.register_fn("env", move |native: NativeCallContext, id: &str, kwargs: Map| {
        let call = Call::new(&c, &native);
        let mut draft = new(id);
        call.finish(draft.kwargs.merge(&kwargs, |key| call.key(key)).map(|()| draft))
    });
    let c = context.clone();
    engine.register_fn(
        "generate_random_map",
        move |native: NativeCallContext, size: Dynamic, p: Dynamic, seed: Dynamic| {
            let call = Call::new(&c, &native);
            call.finish(random_map(&call, &size, &p, &seed))
        },
    );
}

fn random_map(
    call: &Call<'_>,
    size: &Dynamic,
    p: &Dynamic,
    seed: &Dynamic,
) -> Result<Array, Diagnostic> {
    let at = |i: usize| move |d: Diagnostic| d.at(call.arg(i).place());
    let size = whole("the size of a random map", size, 2, 100).map_err(at(0))? as usize;
    let p = number(p).ok_or_else(|| {
        at(1)(Diagnostic::error(format!("the p of a random map is a number, got {}", show(p))))
    })?;
    let seed = whole("the seed of a random map", seed, 0, i64::MAX).map_err(at(2))? as u64;
    // Tiles are work like any other that the script has done.
    let Context { operations, max_operations, .. } = call.context;
    let budget = max_operations.get().saturating_sub(operations.get()).min(MAX_TILES);
    let mut left = budget;
    let map = random_map_within(size, p, &Seed::from(seed), &mut left);
    operations.set(operations.get() + budget - left);
    let rows = map.map_err(|e| at(1)(Diagnostic::error(e.message).maybe_hint(e.hint)))?;
    Ok(rows.into_iter().map(Dynamic::from).collect())
}

fn potentials(engine: &mut Engine, context: &Rc<Context>) {
    let c = context.clone();
    engine.register_fn("learned", move |native: NativeCallContext, eta: Dynamic| {
        let call = Call::new(&c, &native);
        let finite = number(&eta).filter(|eta| eta.is_finite()).map(LearnedPotential);
        call.finish(finite.ok_or_else(|| {
            Diagnostic::error(format!("`learned` takes a finite number, got {}", show(&eta)))
        }))
    });
}
