//! One call of a script function, under the ceilings on operations, time and memory.

use std::cell::Cell;

use rhai::{CallFnOptions, Dynamic, FnPtr};

use super::callback::Callbacks;
use super::diagnostic::{Diagnostic, Place};
use super::errors::diagnostic;
use super::memory;
use super::plan::Callback;
use super::state::{State, StepView};
use super::watch::{Watched, kept_too_much};

/// A callback, ready to be called.
pub(super) struct Prepared {
    pub(super) callback: Callback,
    captures: Vec<Dynamic>,
    /// Its number for the ceilings on time and memory.
    activity: usize,
    /// Bytes that its calls have kept so far.
    kept: Cell<isize>,
}

#[cfg(test)]
impl Prepared {
    /// The function `name`, without captured values.
    pub(super) fn named(name: &str) -> Self {
        let callback = Callback {
            function: name.into(),
            captures: Vec::new(),
            arity: 1,
            label: name.into(),
            place: None,
            digest: String::new(),
            tier: super::native::TierCell::default(),
        };
        Self { callback, captures: Vec::new(), activity: 0, kept: Cell::new(0) }
    }
}

impl Callbacks {
    /// The function called `name`, as a value.
    pub(super) fn function(&self, name: &str) -> Option<FnPtr> {
        self.ast.iter_fn_def().find(|f| f.name == name).map(|f| FnPtr::from(f.clone()))
    }

    /// `callback` with its captured values turned back into the script's: once, not at every call.
    pub(super) fn prepare(&self, callback: &Callback) -> Prepared {
        let function = |name: &str| self.function(name);
        let captures = callback.captures.iter().map(|v| v.thaw(&function)).collect();
        let place = self.definition(&callback.function).or_else(|| callback.place.clone());
        let line = place.as_ref().and_then(|place| self.context.sources.borrow().line(place));
        let doing = format!("calling the function {}", callback.described());
        let activity = Watched::activity(doing, place, line.map(Into::into));
        Prepared { callback: callback.clone(), captures, activity, kept: Cell::new(0) }
    }

    /// Calls `callback` with `given` after its captured values, which it gets as copies: what it
    /// does to them is forgotten.
    pub(super) fn call<const N: usize>(
        &self,
        callback: &Prepared,
        given: [Dynamic; N],
    ) -> Result<Dynamic, Diagnostic> {
        let before = memory::taken() - given.iter().map(heap).sum::<isize>();
        let turn = self.context.watched.call(callback.activity);
        let mut args = Vec::with_capacity(callback.captures.len() + N);
        args.extend(callback.captures.iter().cloned());
        args.extend(given);
        let options = CallFnOptions::new().eval_ast(false).rewind_scope(true);
        let mut scope = self.scope.borrow_mut();
        let name = &callback.callback.function;
        self.context.operations.set(0);
        let result =
            self.engine.call_fn_with_options::<Dynamic>(options, &mut scope, &self.ast, name, args);
        drop(turn);
        // A used-up budget or stack loses its place on the way out.
        let place = || self.definition(name).or_else(|| callback.callback.place.clone());
        let fail = |d: Diagnostic| self.annotate(d.at(place()));
        let value = result.map_err(|e| fail(diagnostic(&self.context, &e, None)))?;
        // Where no allocator counts, nothing is known of what is kept.
        if memory::taken() != 0 {
            callback.kept.update(|kept| kept + memory::taken() - heap(&value) - before);
        }
        match kept_too_much(callback.kept.get()) {
            None => Ok(value),
            Some(d) => Err(fail(d)),
        }
    }

    /// Where the script defines the function `name`.
    fn definition(&self, name: &str) -> Option<Place> {
        let script = self.context.sources.borrow().script.clone();
        let syntax = self.context.syntax.borrow();
        let (line, column) = syntax.get(&*script.name)?.definition(&script.text, name)?;
        Some(Place { file: script.name, line, column })
    }
}

/// What a value that callbacks get or return holds on the heap, in bytes.
fn heap(value: &Dynamic) -> isize {
    let bytes = if value.is::<State>() {
        size_of::<State>()
    } else if value.is::<StepView>() {
        size_of::<StepView>()
    } else if let Some(array) = value.read_lock::<rhai::Array>() {
        size_of::<rhai::Array>() + array.capacity() * size_of::<Dynamic>()
    } else {
        0
    };
    bytes as isize
}
