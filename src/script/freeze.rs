//! Freezing callbacks: what a function captured becomes plain data, and everything that can change
//! its results is hashed.

use std::collections::BTreeSet;

use rhai::FnPtr;
use sha2::{Digest, Sha256};

use super::diagnostic::Diagnostic;
use super::draft::Located;
use super::native::TierCell;
use super::plan::Callback;
use super::resolve::Resolver;
use super::source::{hex, tokens};
use super::value::Value;
use crate::learn::Signature;

/// A potential.
pub(super) const POTENTIAL: Signature =
    Signature { text: "(s) -> number or (s, episode) -> number", arities: &[1, 2] };
/// Advice on actions.
pub(super) const ADVICE: Signature = Signature { text: "(s, a) -> number", arities: &[2] };
/// A function of a step.
pub(super) const OF_STEP: Signature = Signature { text: "(t) -> number", arities: &[1] };

/// A shield.
pub(super) const ALLOWED: Signature = Signature { text: "(s, a) -> bool", arities: &[2] };

impl Resolver<'_> {
    pub(super) fn optional(
        &self,
        f: Option<&Located<FnPtr>>,
        signature: Signature,
    ) -> Result<Option<Callback>, Diagnostic> {
        f.map(|f| self.callback(f, signature)).transpose()
    }

    /// Freezes a function pointer: what it captured becomes plain data, its source is hashed.
    pub(super) fn callback(
        &self,
        f: &Located<FnPtr>,
        signature: Signature,
    ) -> Result<Callback, Diagnostic> {
        let place = f.spot.place();
        let fail = |d: Diagnostic| Err(d.at(place.clone()));
        let name = f.value.fn_name();
        let is_closure = name.starts_with("anon$");
        let label = if is_closure { "closure".to_string() } else { name.to_string() };
        let captures = match Value::freeze_fn(&f.value) {
            Ok(Value::Fn { captures, .. }) => captures,
            Ok(_) => Vec::new(),
            Err(what) => {
                return fail(Diagnostic::error(format!(
                    "a function used while training can capture numbers, strings, arrays and maps, \
                     not {what}"
                )));
            }
        };
        let arities: Vec<usize> = self
            .host
            .ast
            .iter_functions()
            .filter(|d| d.name == name)
            .map(|d| d.params.len())
            .collect();
        if arities.is_empty() {
            return fail(
                Diagnostic::error(format!("`{label}` is not a function of this script"))
                    .hint("wrap it in a closure: |s| module::function(s)"),
            );
        }
        let fits = |n: &&usize| arities.contains(&(captures.len() + **n));
        let Some(&arity) = signature.arities.iter().find(fits) else {
            let given = arities[0].saturating_sub(captures.len());
            let s = if given == 1 { "" } else { "s" };
            return fail(Diagnostic::error(format!(
                "{} takes {given} argument{s}; here a function {} is expected",
                if is_closure { "this closure".to_string() } else { format!("`{label}`") },
                signature.text
            )));
        };
        let digest = self.digest(name, &captures, &mut Vec::new());
        let tier = TierCell::default();
        Ok(Callback { function: name.to_string(), captures, arity, label, place, digest, tier })
    }

    /// Hashes everything that can change the function's results. Reachability goes by names, which
    /// errs on the side of too much.
    /// `within` names the functions whose digests are being made: a constant may hold a function
    /// that uses that constant.
    fn digest(&self, function: &str, captures: &[Value], within: &mut Vec<String>) -> String {
        if let Some(level) = within.iter().position(|name| name == function) {
            return format!("recursion {level}");
        }
        within.push(function.to_string());
        let script = self.host.context.sources.borrow().script.clone();
        let syntax = self.host.context.syntax.borrow();
        let syntax = &syntax[&*script.name];
        let functions: BTreeSet<String> =
            self.host.ast.iter_functions().map(|f| f.name.to_string()).collect();
        let mut parts = BTreeSet::new();
        let mut queue = vec![function.to_string()];
        let mut seen = BTreeSet::new();
        let mut used = BTreeSet::new();
        while let Some(name) = queue.pop() {
            if !seen.insert(name.clone()) {
                continue;
            }
            let Some(body) = syntax.function_tokens(&script.text, &name) else { continue };
            for token in &body {
                // Interpolated strings hold code of their own.
                for word in words(token.text) {
                    if functions.contains(word) {
                        queue.push(word.to_string());
                    }
                    used.insert(word.to_string());
                }
            }
            let is_entry = name == function;
            let text = body.iter().map(|t| t.text).collect::<Vec<_>>().join(" ");
            parts.insert(format!("{} {text}", if is_entry { "entry" } else { "function" }));
        }
        for (name, value) in self.constants.iter().filter(|(name, _)| used.contains(*name)) {
            parts.insert(format!("const {name} = {}", self.canonical(value, within)));
        }
        if syntax.imports.iter().any(|(_, alias)| used.contains(alias)) {
            for (path, source) in &self.host.context.sources.borrow().imports {
                let text =
                    tokens(&source.text).iter().map(|t| t.text).collect::<Vec<_>>().join(" ");
                parts.insert(format!("import {path} {text}"));
            }
        }
        for (i, value) in captures.iter().enumerate() {
            parts.insert(format!("capture {i} = {}", self.canonical(value, within)));
        }
        within.pop();
        let mut hash = Sha256::new();
        for part in parts {
            hash.update((part.len() as u64).to_le_bytes());
            hash.update(part.as_bytes());
        }
        hex(&hash.finalize())
    }

    /// A value as text, with functions replaced by their digests (their names may be made up).
    fn canonical(&self, value: &Value, within: &mut Vec<String>) -> String {
        match value {
            Value::Fn { name, captures } => format!("fn {}", self.digest(name, captures, within)),
            Value::Array(items) => {
                format!(
                    "[{}]",
                    items.iter().map(|v| self.canonical(v, within)).collect::<Vec<_>>().join(",")
                )
            }
            Value::Map(entries) => {
                let entries =
                    entries.iter().map(|(k, v)| format!("{k:?}:{}", self.canonical(v, within)));
                format!("{{{}}}", entries.collect::<Vec<_>>().join(","))
            }
            Value::Float(x) => format!("{:016x}", x.to_bits()),
            other => format!("{other:?}"),
        }
    }
}

/// The identifiers inside a token (a word is one; a backtick string may hold several).
fn words(token: &str) -> impl Iterator<Item = &str> {
    token.split(|c: char| !(c.is_alphanumeric() || c == '_')).filter(|w| !w.is_empty())
}
