//! From what the script wrote to what will run: defaults filled in, names and fields resolved,
//! callbacks frozen and hashed.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use rhai::FnPtr;
use sha2::{Digest, Sha256};

use super::callback::Callbacks;
use super::diagnostic::{Diagnostic, suggest};
use super::draft::{DiscretiserDraft, ExperimentDraft, Located, StudyDraft};
use super::plan::{Callback, DiscretiserSpec, Expectation, PhiOn, Plan, SeedList, Variant};
use super::source::{hex, tokens};
use super::value::Value;
use super::world::{clipping_warning, dims, example_bins, physical_bins};
use crate::env::{AnyEnv, EnvSpec};
use crate::learn::AgentConfig;
use crate::shaping::{Dim, Scale};

const EPISODES: u32 = 500;
const SEEDS: u64 = 20;
const WINDOW: u32 = 20;

/// Resolves a study.
pub(super) fn plan(
    study: StudyDraft,
    constants: BTreeMap<String, Value>,
    host: &Rc<Callbacks>,
) -> Result<Plan, Diagnostic> {
    let resolver = Resolver { host, constants: &constants };
    if study.experiments.is_empty() {
        return Err(Diagnostic::error("the study has no experiments").at(study.spot.place()));
    }
    let mut warnings = Vec::new();
    let mut variants: Vec<Variant> = Vec::with_capacity(study.experiments.len());
    for draft in &study.experiments {
        let variant = resolver.variant(draft, &mut warnings)?;
        if let Some(i) = variants.iter().position(|v| v.name == variant.name) {
            // A name that both have from the same place is inherited: the mistake is where the
            // second one comes to be.
            let name_place = |d: &ExperimentDraft| d.name.as_ref().and_then(|n| n.spot.place());
            let place = name_place(draft)
                .filter(|place| name_place(&study.experiments[i]).as_ref() != Some(place))
                .or_else(|| draft.spot.place());
            return Err(Diagnostic::error(format!("two variants are called `{}`", variant.name))
                .at(place)
                .hint("give each a `name` of its own"));
        }
        variants.push(variant);
    }
    let names = || variants.iter().map(|v| v.name.as_str());
    if let Some(baseline) = &study.baseline
        && !names().any(|n| n == baseline.value)
    {
        let names: Vec<&str> = names().collect();
        return Err(Diagnostic::error(format!("no variant is called `{}`", baseline.value))
            .at(baseline.spot.place())
            .maybe_hint(suggest(&baseline.value, names)));
    }
    let mut expectations = Vec::with_capacity(study.expectations.len());
    for (text, check) in &study.expectations {
        let check = resolver.callback(check, "(r) -> bool", 1)?;
        expectations.push(Expectation { text: text.clone(), check });
    }
    let sources = host.context.sources.borrow().clone();
    let warnings = warnings.into_iter().map(|w| sources.annotate(w)).collect();
    Ok(Plan {
        name: study.name,
        variants,
        expectations,
        baseline: study.baseline.map(|b| b.value),
        notes: study.notes,
        golden: study.golden,
        sources,
        constants,
        warnings,
        printed: host.context.printed.borrow().clone(),
    })
}

/// Resolves one study's experiments.
pub(super) struct Resolver<'a> {
    pub(super) host: &'a Rc<Callbacks>,
    constants: &'a BTreeMap<String, Value>,
}

impl Resolver<'_> {
    fn variant(
        &self,
        draft: &ExperimentDraft,
        warnings: &mut Vec<Diagnostic>,
    ) -> Result<Variant, Diagnostic> {
        let missing = |key: &str, hint: &str| {
            Diagnostic::error(format!("the experiment has no `{key}`"))
                .at(draft.spot.place())
                .hint(hint)
        };
        let agent = draft.agent.as_ref().ok_or_else(|| {
            missing("agent", "add, for example, `agent: q_learning(#{ alpha: 0.1 })`")
        })?;
        let (spec, config, any) = self
            .environment(draft, warnings)?
            .ok_or_else(|| missing("env", "add, for example, `env: \"CartPole-v1\"`"))?;
        let agent = Located {
            value: AgentConfig { spec: agent.value.spec, params: agent.value.params.clone() },
            spot: agent.spot.clone(),
        };
        let schema = any.schema();
        let setting = &draft.setting;
        let normalise = match &setting.normalise {
            Some(n) => n.value.scales(&schema, spec, &n.spot)?,
            None => Vec::new(),
        };
        let discretiser = self.discretiser(draft, &agent, spec, &any, &normalise)?;
        warnings.extend(physical_bins(draft, &schema, &normalise));
        if let Some(clip) = &setting.clip_reward {
            let warning = clipping_warning(clip);
            if !warnings.contains(&warning) {
                warnings.push(warning);
            }
        }
        let potential = self.optional(draft.potential.as_ref(), "(s) -> number")?;
        if potential.is_some()
            && draft.potential_raw
            && !matches!(discretiser, DiscretiserSpec::StateIndex)
        {
            let hint = match discretiser {
                DiscretiserSpec::Bins(_) => {
                    "leave out `potential_on: \"raw\"` to evaluate it on each cell's representative"
                }
                _ => "bins(..) have a representative to evaluate it on, scripted cells do not",
            };
            let warning = Diagnostic::warning(
                "a potential of the raw state is not constant on the discretiser's cells",
            )
            .at(draft.potential.as_ref().and_then(|p| p.spot.place()))
            .note("the greedy policy of the discretised problem may change")
            .hint(hint);
            // Variants that inherit their potential say it once.
            if !warnings.contains(&warning) {
                warnings.push(warning);
            }
        }
        if potential.is_some()
            && !draft.potential_raw
            && matches!(discretiser, DiscretiserSpec::Cells { .. })
        {
            return Err(Diagnostic::error(
                "scripted cells have no representative to evaluate the potential on",
            )
            .at(draft.potential.as_ref().and_then(|p| p.spot.place()))
            .hint("use bins(..), or say `potential_on: \"raw\"`"));
        }
        let mut terms = BTreeMap::new();
        for (name, f) in &draft.terms {
            terms.insert(name.clone(), self.callback(f, "(t) -> number", 1)?);
        }
        Ok(Variant {
            name: draft
                .name
                .as_ref()
                .map_or(agent.value.spec.name.to_string(), |n| n.value.clone()),
            place: draft.spot.place(),
            env: spec,
            config,
            frame_skip: setting.frame_skip.unwrap_or(1),
            clip_reward: setting.clip_reward.as_ref().map(|c| c.value),
            normalise,
            agent: agent.value,
            discretiser,
            episodes: draft.episodes.unwrap_or(EPISODES),
            seeds: SeedList(draft.seeds.clone().unwrap_or_else(|| (0..SEEDS).collect())),
            max_steps: draft.max_steps.or(spec.max_steps).filter(|&n| n > 0),
            threshold: draft.threshold.or(spec.reward_threshold),
            window: draft.window.unwrap_or(WINDOW),
            potential,
            potential_on: if draft.potential_raw { PhiOn::Raw } else { PhiOn::Cell },
            reward: self.optional(draft.reward.as_ref(), "(t) -> number")?,
            terms,
            notes: draft.notes.clone(),
        })
    }

    fn discretiser(
        &self,
        draft: &ExperimentDraft,
        agent: &Located<AgentConfig>,
        spec: &EnvSpec,
        env: &AnyEnv,
        normalise: &[Scale],
    ) -> Result<DiscretiserSpec, Diagnostic> {
        let has_model = env.finite().is_some();
        if agent.value.is_planner() && draft.setting.frame_skip.is_some_and(|n| n > 1) {
            return Err(Diagnostic::error(format!(
                "`{}` plans on the model of single steps: leave out `frame_skip`",
                agent.value.spec.name
            ))
            .at(agent.spot.place()));
        }
        if agent.value.is_planner() && (!has_model || draft.discretiser.is_some()) {
            let why = match (has_model, env.n_states()) {
                (true, _) => "it plans on the states themselves",
                (false, None) => "it has none",
                (false, Some(_)) => "with these arguments it has none",
            };
            return Err(Diagnostic::error(format!(
                "`{}` needs the finite model of {}: {why}",
                agent.value.spec.name, spec.id
            ))
            .at(agent.spot.place())
            .hint(if has_model {
                "leave out the discretiser"
            } else {
                "q_learning or sarsa learn without a model"
            }));
        }
        match draft.discretiser.as_ref() {
            None if env.n_states().is_some() => Ok(DiscretiserSpec::StateIndex),
            // It does not look at states.
            None if agent.value.spec.name == "random_agent" => {
                Ok(DiscretiserSpec::Bins(vec![Dim { field: 0, lo: 0.0, hi: 1.0, n: 1 }]))
            }
            None => Err(Diagnostic::error(format!(
                "`{}` needs a `discretiser`: the states of {} are not finite",
                agent.value.spec.name, spec.id
            ))
            .at(agent.spot.place())
            .hint(format!("add, for example, `discretiser: {}`", example_bins(spec)))),
            Some(d) => match &d.value {
                DiscretiserDraft::Bins(bins) => dims(bins, &env.schema(), normalise, spec)
                    .map(DiscretiserSpec::Bins)
                    .map_err(|e| e.at(d.spot.place())),
                DiscretiserDraft::Cells { shape, cell } => {
                    let cell = Located { value: cell.clone(), spot: d.spot.clone() };
                    let cell = self.callback(&cell, "(s) -> index", 1)?;
                    Ok(DiscretiserSpec::Cells { shape: shape.clone(), cell })
                }
            },
        }
    }

    fn optional(
        &self,
        f: Option<&Located<FnPtr>>,
        signature: &str,
    ) -> Result<Option<Callback>, Diagnostic> {
        f.map(|f| self.callback(f, signature, 1)).transpose()
    }

    /// Freezes a function pointer: what it captured becomes plain data, its source is hashed.
    pub(super) fn callback(
        &self,
        f: &Located<FnPtr>,
        signature: &str,
        n_args: usize,
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
        if !arities.contains(&(captures.len() + n_args)) {
            let given = arities[0].saturating_sub(captures.len());
            let s = if given == 1 { "" } else { "s" };
            return fail(Diagnostic::error(format!(
                "{} takes {given} argument{s}; here a function {signature} is expected",
                if is_closure { "this closure".to_string() } else { format!("`{label}`") }
            )));
        }
        let digest = self.digest(name, &captures, &mut Vec::new());
        Ok(Callback { function: name.to_string(), captures, label, place, digest })
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
