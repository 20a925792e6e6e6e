//! All contact with Rhai's syntax tree, whose types change between versions: constants, imports,
//! the places of map keys and closures, and the tokens of a function.

use std::collections::BTreeMap;

use rhai::{AST, ASTFlags, ASTNode, Expr, FnCallExpr, Position, Stmt};

use super::source::{Token, tokens};

/// Line and column, counted from 1; (0, 0) where Rhai has none.
pub(super) type At = (usize, usize);

/// What the host needs to know about a file's syntax.
#[derive(Debug, Clone, Default)]
pub(super) struct Syntax {
    /// Names of constants defined at the top level.
    pub(super) constants: Vec<String>,
    /// Names of other variables defined at the top level.
    pub(super) variables: Vec<String>,
    /// Imports at the top level: (path, alias), where the path is a literal.
    pub(super) imports: Vec<(String, String)>,
    /// Names and numbers of parameters of the functions, closures left out.
    pub(super) functions: Vec<(String, usize)>,
    /// An import elsewhere, or of a computed path: the host could not repeat it for callbacks.
    pub(super) misplaced_import: Option<At>,
    /// By the position of a call: the keys of the map literals among its arguments, as dotted
    /// paths, and their positions; the items of array literals count as keys `0`, `1`, ….
    pub(super) keys: BTreeMap<At, BTreeMap<String, At>>,
    /// By the position of a call: where its arguments start.
    pub(super) args: BTreeMap<At, Vec<At>>,
    /// Position of each closure's first `|`, by the name Rhai gave it. Equal closures share one.
    closures: BTreeMap<String, At>,
}

fn at(position: Position) -> At {
    (position.line().unwrap_or(0), position.position().unwrap_or(0))
}

impl Syntax {
    /// Reads the tree of one file.
    pub(super) fn of(ast: &AST) -> Self {
        let mut syntax = Self::default();
        for f in ast.iter_functions().filter(|f| !f.name.starts_with("anon$")) {
            syntax.functions.push((f.name.to_string(), f.params.len()));
        }
        let mut proper = Vec::new();
        for stmt in ast.statements() {
            match stmt {
                Stmt::Var(x, flags, _) if flags.intersects(ASTFlags::CONSTANT) => {
                    syntax.constants.push(x.0.name.to_string());
                }
                Stmt::Var(x, ..) => syntax.variables.push(x.0.name.to_string()),
                Stmt::Import(x, pos) => {
                    if let Expr::StringConstant(path, _) = &x.0 {
                        proper.push(at(*pos));
                        syntax.imports.push((path.to_string(), x.1.name.to_string()));
                    }
                }
                _ => {}
            }
        }
        ast.walk(&mut |path: &[ASTNode<'_>]| {
            match path.last() {
                Some(
                    ASTNode::Expr(Expr::FnCall(x, pos) | Expr::MethodCall(x, pos))
                    | ASTNode::Stmt(Stmt::FnCall(x, pos)),
                ) => syntax.call(x, at(*pos)),
                Some(ASTNode::Stmt(Stmt::Import(_, pos))) if !proper.contains(&at(*pos)) => {
                    syntax.misplaced_import.get_or_insert(at(*pos));
                }
                Some(ASTNode::Expr(Expr::DynamicConstant(value, pos))) => {
                    if let Some(f) = value.read_lock::<rhai::FnPtr>() {
                        syntax.closures.entry(f.fn_name().to_string()).or_insert_with(|| at(*pos));
                    }
                }
                _ => {}
            }
            true
        });
        syntax
    }

    /// Where the function `name` begins, given the file's text: a closure's first `|`, or the
    /// name after `fn`.
    pub(super) fn definition(&self, text: &str, name: &str) -> Option<At> {
        if let Some(&at) = self.closures.get(name) {
            return Some(at);
        }
        let tokens = tokens(text);
        let start = (0..tokens.len()).find_map(|i| function_name(&tokens, i, name))?.start;
        let before = &text[..start];
        let line_start = before.rfind('\n').map_or(0, |i| i + 1);
        Some((before.matches('\n').count() + 1, before[line_start..].chars().count() + 1))
    }

    fn call(&mut self, call: &FnCallExpr, pos: At) {
        self.args.insert(pos, call.args.iter().map(|e| at(e.position())).collect());
        for arg in &call.args {
            let keys = self.keys.entry(pos).or_default();
            map_keys(arg, "", keys);
        }
    }

    /// The tokens of the function `name`, from its parameters to its end, given the file's text.
    pub(super) fn function_tokens<'a>(&self, text: &'a str, name: &str) -> Option<Vec<Token<'a>>> {
        let tokens = tokens(text);
        if let Some(&(line, column)) = self.closures.get(name) {
            let start = byte_offset(text, line, column)?;
            let first = tokens.iter().position(|t| t.start == start)?;
            return Some(closure(&tokens[first..]));
        }
        // `fn name(…) { … }`, whatever its number of parameters: overloads count together.
        let mut found = Vec::new();
        for i in 0..tokens.len().saturating_sub(1) {
            if function_name(&tokens, i, name).is_some() {
                let open = (i..tokens.len()).find(|&k| tokens[k].text == "{")?;
                let end = open + balanced(&tokens[open..]);
                found.extend_from_slice(&tokens[i..end]);
            }
        }
        (!found.is_empty()).then_some(found)
    }
}

/// Collects the keys of a map literal and of those nested in it, also through calls such as
/// `q_learning(#{ … })`, whose keys belong to the key that holds the call.
fn map_keys(expr: &Expr, prefix: &str, keys: &mut BTreeMap<String, At>) {
    let join = |name: &str| {
        if prefix.is_empty() { name.to_string() } else { format!("{prefix}.{name}") }
    };
    if let Expr::Array(items, _) = expr {
        for (i, item) in items.iter().enumerate() {
            keys.insert(join(&i.to_string()), at(item.start_position()));
        }
    }
    let Expr::Map(entries, _) = expr else { return };
    for (key, value) in &entries.0 {
        let path = join(&key.name);
        map_keys(value, &path, keys);
        keys.insert(path, at(key.pos));
    }
}

/// The name in `fn name(…)` or `fn Type.name(…)`, if that stands at `i` and is `name`.
fn function_name<'a>(tokens: &[Token<'a>], i: usize, name: &str) -> Option<Token<'a>> {
    let rest = tokens.get(i..).filter(|rest| rest[0].text == "fn")?;
    let open = rest.iter().position(|t| t.text == "(")?;
    rest[..open].last().copied().filter(|t| t.text == name)
}

/// Number of tokens of the bracketed group at the start.
fn balanced(tokens: &[Token<'_>]) -> usize {
    let mut depth = 0usize;
    for (i, t) in tokens.iter().enumerate() {
        match t.text {
            "(" | "[" | "{" => depth += 1,
            ")" | "]" | "}" => {
                depth = depth.saturating_sub(1);
                if depth == 0 {
                    return i + 1;
                }
            }
            _ => {}
        }
    }
    tokens.len()
}

/// The closure at the start: its parameters, and its body up to the end of the expression.
fn closure<'a>(tokens: &[Token<'a>]) -> Vec<Token<'a>> {
    let params_end = match tokens {
        // `||` comes as two signs here.
        [_, rest @ ..] => 2 + rest.iter().position(|t| t.text == "|").unwrap_or(0),
        [] => 0,
    };
    let body = &tokens[params_end.min(tokens.len())..];
    let mut depth = 0usize;
    let mut end = body.len();
    for (i, t) in body.iter().enumerate() {
        match t.text {
            "(" | "[" | "{" => depth += 1,
            ")" | "]" | "}" | "," | ";" if depth == 0 => {
                end = i;
                break;
            }
            ")" | "]" | "}" => depth -= 1,
            _ => {}
        }
    }
    tokens[..params_end + end].to_vec()
}

/// Byte offset of a line and column (in characters), both from 1.
fn byte_offset(text: &str, line: usize, column: usize) -> Option<usize> {
    let start = if line == 1 {
        0
    } else {
        text.match_indices('\n').nth(line.checked_sub(2)?).map(|(i, _)| i + 1)?
    };
    text[start..].char_indices().nth(column.checked_sub(1)?).map(|(i, _)| start + i)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rhai::Engine;

    fn syntax(text: &str) -> (AST, Syntax) {
        let mut engine = Engine::new_raw();
        engine.set_optimization_level(rhai::OptimizationLevel::None);
        super::super::engine::vocabulary(&mut engine);
        let ast = engine.compile(text).unwrap();
        let syntax = Syntax::of(&ast);
        (ast, syntax)
    }

    #[test]
    fn keys_are_found_by_the_call_they_are_an_argument_of() {
        let text = "let a = f(#{\n  one: 1,\n  two: #{ three: 3 },\n});\na.with(#{ one: 2 })";
        let (_, syntax) = syntax(text);
        assert_eq!(syntax.keys[&(1, 9)]["one"], (2, 3));
        assert_eq!(syntax.keys[&(1, 9)]["two.three"], (3, 11));
        assert_eq!(syntax.keys[&(5, 3)]["one"], (5, 11));
    }

    #[test]
    fn constants_variables_and_imports_of_the_top_level() {
        let (_, syntax) =
            syntax("const K = 1; let v = 2; import \"lib/x\" as x; fn f() { let w = 3; w }");
        assert_eq!((syntax.constants, syntax.variables), (vec!["K".into()], vec!["v".to_string()]));
        assert_eq!(syntax.imports, [("lib/x".to_string(), "x".to_string())]);
    }

    #[test]
    fn the_tokens_of_a_function_end_where_it_does() {
        let text =
            "fn f(s) { g(s) }\nfn g(s) { if s { 1 } else { 2 } }\nlet h = [|s| s.x * f(s), 3];";
        let (ast, syntax) = syntax(text);
        let join = |name: &str| {
            let tokens = syntax.function_tokens(text, name).unwrap();
            tokens.iter().map(|t| t.text).collect::<Vec<_>>().join(" ")
        };
        assert_eq!(join("f"), "fn f ( s ) { g ( s ) }");
        assert_eq!(join("g"), "fn g ( s ) { if s { 1 } else { 2 } }");
        let closure = ast.iter_functions().find(|f| f.name.starts_with("anon")).unwrap();
        assert_eq!(join(closure.name), "| s | s . x * f ( s )");
        assert!(syntax.function_tokens(text, "nothing").is_none());
    }
}
