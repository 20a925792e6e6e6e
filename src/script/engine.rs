//! The restricted engine: every limit set, no clock, no `eval`, no files but imports beside the
//! script; `print` is collected.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::rc::Rc;

use rhai::packages::{Package, StandardPackage};
use rhai::{
    Dynamic, Engine, EvalAltResult, Module, ModuleResolver, Position, Scope, Shared, Token,
};

use super::diagnostic::{Diagnostic, Place};
use super::functions::CONSTANTS;
use super::source::SourceSet;
use super::syntax::Syntax;
use super::watch::Watched;
use super::{builders, numeric, record, sandbox, sorting, state};

/// Operations that building the plan may take: about half a second.
const PLAN_OPERATIONS: u64 = 5_000_000;
/// Operations that one call of a callback may take: some tenths of a second.
pub(super) const CALLBACK_OPERATIONS: u64 = 1_000_000;
/// Lines that a script may print; further ones are dropped.
const MAX_PRINTED: usize = 1_000;
/// Characters of a line that it prints; the rest is left out.
const MAX_LINE: usize = 1_000;

/// What the engine's functions share with the host.
#[derive(Debug)]
pub(super) struct Context {
    pub(super) sources: RefCell<SourceSet>,
    /// By the file's name in diagnostics.
    pub(super) syntax: RefCell<BTreeMap<String, Syntax>>,
    /// Constants of the script, known once its top level has run.
    pub(super) constants: RefCell<BTreeMap<String, Dynamic>>,
    /// Modules by their path relative to the script's folder.
    pub(super) modules: RefCell<BTreeMap<String, Shared<Module>>>,
    /// Their syntax trees.
    pub(super) trees: RefCell<BTreeMap<String, rhai::AST>>,
    /// Files being loaded, to catch imports that run in a circle.
    loading: RefCell<Vec<String>>,
    pub(super) printed: RefCell<Vec<String>>,
    /// Whether a callback has read `t.step` since this was last cleared.
    pub(super) step_read: Rc<Cell<bool>>,
    /// Operations since the plan's building or a callback's call began. Rhai has a counter too,
    /// but it loses what functions such as `filter` make their closures do.
    pub(super) operations: Cell<u64>,
    /// How many there may be.
    pub(super) max_operations: Cell<u64>,
    /// This thread's ceilings on time and memory.
    pub(super) watched: Watched,
}

impl Context {
    pub(super) fn new(sources: SourceSet) -> Rc<Self> {
        Rc::new(Self {
            sources: RefCell::new(sources),
            syntax: RefCell::default(),
            constants: RefCell::default(),
            modules: RefCell::default(),
            trees: RefCell::default(),
            loading: RefCell::default(),
            printed: RefCell::default(),
            step_read: Rc::default(),
            operations: Cell::new(0),
            max_operations: Cell::new(PLAN_OPERATIONS),
            watched: Watched::here(),
        })
    }

    /// A place from Rhai's, in the file `source` (the script if there is none).
    pub(super) fn place(&self, source: Option<&str>, position: Position) -> Option<Place> {
        let line = position.line()?;
        let file = match source {
            Some(name) if !name.is_empty() => name.into(),
            _ => self.sources.borrow().script.name.clone(),
        };
        Some(Place { file, line, column: position.position().unwrap_or(1) })
    }
}

/// An engine for the script in `context`.
pub(super) fn engine(context: &Rc<Context>) -> Engine {
    // Rhai otherwise takes seeds made up while compiling it, so that hashes, and with them the way in
    // which a function is looked up, would differ from build to build. It can be set once.
    let _ = rhai::config::hashing::set_hashing_seed(Some([1, 2, 3, 4]));
    let mut engine = Engine::new_raw();
    StandardPackage::new().register_into_engine(&mut engine);
    limits(&mut engine);
    sandbox::register(&mut engine, context);
    sorting::register(&mut engine);
    numeric::register(&mut engine);
    state::register(&mut engine, context);
    record::register(&mut engine);
    builders::register(&mut engine, context);
    output(&mut engine, context);
    constants_in_functions(&mut engine, context);
    engine.set_module_resolver(Imports(context.clone()));
    // What runs is exactly what was written: the places of keys and closures stay findable, and
    // nothing is folded by other rules than the ones it runs by.
    engine.set_optimization_level(rhai::OptimizationLevel::None);
    engine
}

/// Rhai reserves `with` without using it; here it is a method of experiments.
pub(super) fn vocabulary(engine: &mut Engine) {
    #[expect(deprecated, reason = "marked volatile, not going away")]
    engine.on_parse_token(|token, _, _| match token {
        Token::Reserved(word) if *word == "with" => Token::Identifier(word),
        other => other,
    });
}

/// Limits and vocabulary: what decides whether a text parses at all.
fn limits(engine: &mut Engine) {
    vocabulary(engine);
    engine.disable_symbol("eval");
    engine.set_max_operations(PLAN_OPERATIONS);
    engine.set_max_call_levels(48);
    engine.set_max_expr_depths(64, 48);
    engine.set_max_functions(512);
    engine.set_max_variables(512);
    engine.set_max_modules(64);
    engine.set_max_string_size(64 * 1024);
    engine.set_max_array_size(16_384);
    engine.set_max_map_size(4_096);
    engine.set_max_strings_interned(4_096);
}

fn output(engine: &mut Engine, context: &Rc<Context>) {
    let print = |context: Rc<Context>| {
        move |text: &str| {
            let mut printed = context.printed.borrow_mut();
            if printed.len() < MAX_PRINTED {
                let end = text.char_indices().nth(MAX_LINE).map(|(end, _)| end);
                printed.push(end.map_or(text.into(), |end| format!("{}…", &text[..end])));
            } else if printed.len() == MAX_PRINTED {
                printed.push("… (further output dropped)".into());
            }
        }
    };
    let on_print = print(context.clone());
    engine.on_print(on_print);
    let on_debug = print(context.clone());
    engine.on_debug(move |text, _, _| on_debug(text));
}

/// Lets functions see the constants of the top level, which Rhai alone does not.
fn constants_in_functions(engine: &mut Engine, context: &Rc<Context>) {
    let context = context.clone();
    #[expect(deprecated, reason = "`on_var` is marked volatile, not going away")]
    engine.on_var(move |name, index, runtime| {
        let local = runtime.scope().get(name);
        if local.is_some_and(sandbox::too_deep) {
            return sandbox::nested();
        }
        if index > 0 || local.is_some() {
            return Ok(None);
        }
        // While the top level runs, and inside imported modules: the file's own constants so far.
        if let Some(constants) = &runtime.global_runtime_state().constants
            && let Some(value) = constants.borrow().get(name)
        {
            return Ok(Some(value.clone()));
        }
        // The script's own constants come before the built-in ones.
        let own = context.constants.borrow().get(name).cloned();
        let built_in = || CONSTANTS.iter().find(|c| c.name == name).map(|c| c.value.into());
        Ok(own.or_else(built_in))
    });
}

/// Compiles one file: parses it, records its syntax, and checks that every variable in it exists.
pub(super) fn compile(
    engine: &Engine,
    context: &Context,
    name: &str,
    text: &str,
) -> Result<rhai::AST, Diagnostic> {
    let parse_error = |e: rhai::ParseError| {
        super::errors::parse_diagnostic(context, name, e.err_type(), e.position())
    };
    let mut ast = engine.compile(text).map_err(parse_error)?;
    ast.set_source(name);
    let syntax = Syntax::of(&ast);
    if let Some((line, column)) = syntax.misplaced_import {
        let place = Place { file: name.into(), line, column };
        let d = Diagnostic::error("an import stands at the top level, with its path as a string")
            .hint("put `import \"file\" as name;` at the top of the script");
        return Err(context.sources.borrow().annotate(d.at(Some(place))));
    }
    // A second, strict pass only checks names. It must know the constants, which functions see
    // here, and every function, which may be named before it is defined.
    let mut known = Scope::new();
    let functions = ast.iter_functions().map(|f| f.name.to_string()).collect::<Vec<_>>();
    let constants = syntax.constants.iter().map(String::as_str);
    for name in constants.chain(functions.iter().map(String::as_str)) {
        known.push_constant(name, ());
    }
    // A `let` of the same name hides a built-in constant at the top level; in functions, which do
    // not see it, the name would silently mean something else.
    let built_in = CONSTANTS.iter().map(|c| c.name);
    for name in built_in.filter(|n| syntax.variables.iter().all(|v| v != n)) {
        known.push_constant(name, ());
    }
    context.syntax.borrow_mut().insert(name.to_string(), syntax);
    let strict = {
        let mut strict = Engine::new_raw();
        limits(&mut strict);
        strict.set_strict_variables(true);
        strict.set_optimization_level(rhai::OptimizationLevel::None);
        strict.compile_with_scope(&known, text)
    };
    strict.map_err(parse_error)?;
    Ok(ast)
}

/// Resolves `import "path"` to files in the script's own folder tree.
struct Imports(Rc<Context>);

impl ModuleResolver for Imports {
    fn resolve(
        &self,
        engine: &Engine,
        source: Option<&str>,
        path: &str,
        pos: Position,
    ) -> Result<Shared<Module>, Box<EvalAltResult>> {
        self.load(engine, source, path).map_err(|diagnostic| {
            let diagnostic = diagnostic.at(self.0.place(source, pos));
            Box::new(EvalAltResult::ErrorRuntime(Dynamic::from(diagnostic), pos))
        })
    }
}

impl Imports {
    fn load(
        &self,
        engine: &Engine,
        from: Option<&str>,
        path: &str,
    ) -> Result<Shared<Module>, Diagnostic> {
        let context = &self.0;
        let from = from.and_then(|name| {
            let sources = context.sources.borrow();
            sources.imports.iter().find(|(_, s)| &*s.name == name).map(|(k, _)| k.clone())
        });
        let (key, source) = context.sources.borrow_mut().import(from.as_deref(), path)?;
        if let Some(module) = context.modules.borrow().get(&key) {
            return Ok(module.clone());
        }
        if context.loading.borrow().contains(&key) {
            return Err(Diagnostic::error(format!("`{path}` is imported in a circle")));
        }
        context.loading.borrow_mut().push(key.clone());
        let module = compile(engine, context, &source.name, &source.text).and_then(|ast| {
            let module = Module::eval_ast_as_new(Scope::new(), &ast, engine)
                .map_err(|e| super::errors::diagnostic(context, &e, Some(&source.name)))?;
            context.trees.borrow_mut().insert(key.clone(), ast);
            Ok(module)
        });
        context.loading.borrow_mut().pop();
        let module: Shared<Module> = module?.into();
        context.modules.borrow_mut().insert(key, module.clone());
        Ok(module)
    }
}
