//! Loading a script, and one thread's ready-to-call copy of it.

use std::collections::BTreeMap;
use std::path::Path;
use std::rc::Rc;

use rhai::{Dynamic, Scope};

use super::builders::experiments_of;
use super::callback::Callbacks;
use super::diagnostic::Diagnostic;
use super::draft::{ExperimentDraft, Spot, StudyDraft};
use super::engine::{Context, compile, engine};
use super::errors::diagnostic;
use super::params::show;
use super::plan::{GoldenBudget, Plan};
use super::resolve;
use super::source::SourceSet;
use super::value::Value;

/// Reads, compiles and runs the script at `path`, and resolves the plan it builds.
///
/// # Errors
/// The first mistake found, with its place.
pub fn load(path: &Path) -> Result<Plan, Diagnostic> {
    let sources = SourceSet::open(path)?;
    let stem = path.file_stem().map_or("study".into(), |s| s.to_string_lossy().into_owned());
    load_sources(sources, &stem)
}

/// As [`load`], from text; the plan is called `name` if the script does not say.
///
/// # Errors
/// As [`load`].
pub(super) fn load_sources(sources: SourceSet, name: &str) -> Result<Plan, Diagnostic> {
    let context = Context::new(sources);
    let engine = engine(&context);
    let script = context.sources.borrow().script.clone();
    let ast = compile(&engine, &context, &script.name, &script.text)?;
    let mut scope = Scope::new();
    let value = engine
        .eval_ast_with_scope::<Dynamic>(&mut scope, &ast)
        .map_err(|e| diagnostic(&context, &e, None))?;
    let mut constants = BTreeMap::new();
    for (name, is_constant, value) in scope.iter() {
        // Constants that are not plain data (an experiment, say) are for the top level only.
        if is_constant && let Ok(value) = Value::freeze(&value) {
            constants.insert(name.to_string(), value);
        }
    }
    let study = study(value, name).map_err(|d| context.sources.borrow().annotate(d))?;
    let callbacks = Callbacks::new(engine, ast, context.clone(), constants.clone());
    resolve::plan(study, constants, &callbacks).map_err(|d| context.sources.borrow().annotate(d))
}

/// The plan that the script's last expression stands for.
fn study(value: Dynamic, name: &str) -> Result<StudyDraft, Diagnostic> {
    let of = |experiments: Vec<ExperimentDraft>| StudyDraft {
        name: name.to_string(),
        spot: Spot::default(),
        experiments,
        expectations: Vec::new(),
        baseline: None,
        notes: None,
        golden: GoldenBudget::default(),
    };
    let value = value.flatten();
    if let Some(study) = value.clone().try_cast::<StudyDraft>() {
        return Ok(study);
    }
    if let Some(experiment) = value.clone().try_cast::<ExperimentDraft>() {
        return Ok(of(vec![experiment]));
    }
    if let Some(list) = value.read_lock::<rhai::Array>() {
        return experiments_of(&list).map(of);
    }
    Err(Diagnostic::error(format!(
        "a script ends in a study, an experiment or an array of experiments, this one in {}",
        if value.is_unit() { "nothing: ()".into() } else { show(&value) }
    ))
    .hint("let the last line be `study(\"name\", [experiment, …])`, or a variable that holds one"))
}

/// One thread's copy of a script, for calling its functions.
pub struct Host {
    callbacks: Rc<Callbacks>,
}

impl Host {
    /// Compiles the plan's script again and hands it the plan's constants: nothing of the top
    /// level is run, so that every thread starts from the same state.
    ///
    /// # Errors
    /// If the script does not compile (it did when the plan was made).
    pub fn open(plan: &Plan) -> Result<Self, Diagnostic> {
        let context = Context::new(plan.sources.clone());
        let mut engine = engine(&context);
        let script = plan.sources.script.clone();
        let ast = compile(&engine, &context, &script.name, &script.text)?;
        let imports = context.syntax.borrow()[&*script.name].imports.clone();
        // Without an alias, an import only runs the file's top level.
        for (path, alias) in imports.into_iter().filter(|(_, alias)| !alias.is_empty()) {
            // Functions find imported modules by their alias; the import statement itself, which
            // belongs to the top level, does not run here.
            let line = format!("import {path:?} as {alias};");
            let mut import = engine.compile(line).map_err(|e| Diagnostic::error(e.to_string()))?;
            import.set_source(&*script.name);
            engine.run_ast(&import).map_err(|e| diagnostic(&context, &e, None))?;
            let (key, _) = context.sources.borrow_mut().import(None, &path)?;
            let module = context.modules.borrow()[&key].clone();
            engine.register_static_module(alias, module);
        }
        let callbacks = Callbacks::new(engine, ast, context.clone(), plan.constants.clone());
        let function = |name: &str| callbacks.function(name);
        let constants = plan.constants.iter().map(|(k, v)| (k.clone(), v.thaw(&function)));
        *context.constants.borrow_mut() = constants.collect();
        Ok(Self { callbacks })
    }

    /// `diagnostic` with its source line filled in.
    pub fn annotate(&self, diagnostic: Diagnostic) -> Diagnostic {
        self.callbacks.annotate(diagnostic)
    }

    /// What callbacks have printed since this was last asked: the first lines of it.
    pub fn printed(&self) -> Vec<String> {
        const SHOWN: usize = 20;
        let mut lines = std::mem::take(&mut *self.callbacks.context.printed.borrow_mut());
        if lines.len() > SHOWN {
            lines.truncate(SHOWN);
            lines.push("… (further output of callbacks is not shown)".into());
        }
        lines
    }

    /// The script's functions.
    pub fn callbacks(&self) -> &Rc<Callbacks> {
        &self.callbacks
    }
}
