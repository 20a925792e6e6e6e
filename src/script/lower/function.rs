//! The bodies of a script's functions.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;
use std::sync::Arc;

use rhai::{AST, ASTFlags, ASTNode, Expr, FnAccess, Stmt};

use crate::script::engine::Context;
use crate::script::source::{Source, resolve_import};

/// One function.
#[derive(Debug)]
pub(in crate::script) struct Function {
    pub(super) params: Vec<String>,
    pub(super) body: Vec<Stmt>,
    /// The variables that are assigned to after they were defined.
    pub(super) assigned: Rc<BTreeSet<String>>,
}

/// Functions by their names and numbers of parameters; `None` for those that are not there.
type Known = BTreeMap<(String, usize), Option<Rc<Function>>>;

/// One file's functions, read when they are asked for.
pub(in crate::script) struct File {
    /// Its name in messages.
    pub(super) name: Arc<str>,
    ast: AST,
    /// What integers and truth values are as cases of a `switch`, by the hashes that stand for them
    /// in the syntax tree.
    pub(super) cases: BTreeMap<u64, super::switch::Case>,
    /// The files that it imports, by their aliases.
    pub(super) aliases: BTreeMap<String, usize>,
    read: RefCell<Known>,
}

/// A script and the files that it imports: the script is the first.
pub(in crate::script) struct Library {
    files: Vec<Rc<File>>,
}

impl Library {
    /// The files of `context`, whose script is `ast`.
    pub(in crate::script) fn new(ast: &AST, context: &Context) -> Self {
        let sources = context.sources.borrow();
        let trees = context.trees.borrow();
        let syntax = context.syntax.borrow();
        let keys: Vec<&String> = trees.keys().collect();
        let mut files = vec![File::new(&sources.script, ast.clone())];
        for (key, ast) in trees.iter() {
            files.push(File::new(&sources.imports[key], ast.clone()));
        }
        for (i, file) in files.iter_mut().enumerate() {
            let from = i.checked_sub(1).map(|i| keys[i].as_str());
            let Some(syntax) = syntax.get(&*file.name) else { continue };
            for (path, alias) in &syntax.imports {
                let key = resolve_import(from, path).ok();
                if let Some(at) = key.and_then(|key| keys.iter().position(|k| **k == key)) {
                    file.aliases.insert(alias.clone(), at + 1);
                }
            }
        }
        Self { files: files.into_iter().map(Rc::new).collect() }
    }

    /// A file; 0 is the script.
    pub(super) fn file(&self, index: usize) -> &Rc<File> {
        &self.files[index]
    }
}

impl File {
    fn new(source: &Source, ast: AST) -> Self {
        Self {
            name: source.name.clone(),
            ast,
            cases: super::switch::cases(&source.text),
            aliases: BTreeMap::new(),
            read: RefCell::default(),
        }
    }

    /// Whether there is such a function, with any number of parameters if `arity` is `None`.
    pub(super) fn contains(&self, name: &str, arity: Option<usize>) -> bool {
        let fits = |n: usize| arity.is_none_or(|arity| arity == n);
        self.ast.iter_functions().any(|f| f.name == name && fits(f.params.len()))
    }

    /// Whether other files may call it.
    pub(super) fn is_public(&self, name: &str, arity: usize) -> bool {
        let found = self.ast.iter_functions().find(|f| f.name == name && f.params.len() == arity);
        found.is_some_and(|f| f.access == FnAccess::Public)
    }

    /// The expression that defines the constant `name` at the top level.
    pub(super) fn constant(&self, name: &str) -> Option<Expr> {
        self.ast.statements().iter().rev().find_map(|stmt| match stmt {
            Stmt::Var(x, flags, _)
                if flags.intersects(ASTFlags::CONSTANT) && x.0.name.as_str() == name =>
            {
                Some(x.1.clone())
            }
            _ => None,
        })
    }

    /// The function `name` with `arity` parameters.
    pub(super) fn get(&self, name: &str, arity: usize) -> Option<Rc<Function>> {
        let key = (name.to_string(), arity);
        if let Some(known) = self.read.borrow().get(&key) {
            return known.clone();
        }
        let function = self.read_function(name, arity).map(Rc::new);
        self.read.borrow_mut().insert(key, function.clone());
        function
    }

    fn read_function(&self, name: &str, arity: usize) -> Option<Function> {
        // A function's body is of a type that cannot be named; a tree with that function alone can be
        // walked.
        let mut alone = self.ast.clone_functions_only();
        alone.retain_functions(|_, _, n, params| n == name && params == arity);
        let params = {
            // Functions of a type (`fn float.half()`) are methods, and may share the name.
            let mut all = alone.iter_functions();
            let f = all.next().filter(|f| f.this_type.is_none())?;
            if all.next().is_some() {
                return None;
            }
            f.params.iter().map(ToString::to_string).collect()
        };
        let (mut body, mut assigned) = (Vec::new(), BTreeSet::new());
        alone.walk(&mut |path: &[ASTNode<'_>]| {
            if let (1, Some(ASTNode::Stmt(stmt))) = (path.len(), path.last()) {
                body.push((*stmt).clone());
            }
            if let Some(ASTNode::Stmt(Stmt::Assignment(x))) = path.last()
                && let Some(name) = root(&x.1.lhs)
            {
                assigned.insert(name.to_string());
            }
            true
        });
        Some(Function { params, body, assigned: Rc::new(assigned) })
    }
}

/// The variable that an expression on the left of `=` starts with.
fn root(expr: &Expr) -> Option<&str> {
    match expr {
        Expr::Variable(x, ..) => Some(x.1.as_str()),
        Expr::Dot(x, ..) | Expr::Index(x, ..) => root(&x.lhs),
        _ => None,
    }
}
