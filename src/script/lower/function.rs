//! The bodies of a script's functions.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use rhai::{AST, ASTNode, Expr, Stmt};

/// One function.
#[derive(Debug)]
pub(in crate::script) struct Function {
    pub(super) params: Vec<String>,
    pub(super) body: Vec<Stmt>,
    /// The variables that are assigned to after they were defined.
    pub(super) assigned: Rc<BTreeSet<String>>,
}

/// A script's functions, read when they are asked for.
pub(in crate::script) struct Functions<'a> {
    ast: &'a AST,
    /// What integers and truth values are as cases of a `switch`, by the hashes that stand for them
    /// in the syntax tree.
    pub(super) cases: BTreeMap<u64, super::switch::Case>,
    read: RefCell<BTreeMap<(String, usize), Option<Rc<Function>>>>,
}

impl<'a> Functions<'a> {
    /// The functions of `ast`, whose text is `text`.
    pub(in crate::script) fn new(ast: &'a AST, text: &str) -> Self {
        Self { ast, cases: super::switch::cases(text), read: RefCell::default() }
    }

    /// Whether there is such a function, with any number of parameters if `arity` is `None`.
    pub(super) fn contains(&self, name: &str, arity: Option<usize>) -> bool {
        let fits = |n: usize| arity.is_none_or(|arity| arity == n);
        self.ast.iter_functions().any(|f| f.name == name && fits(f.params.len()))
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
