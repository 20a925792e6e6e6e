//! From what the script wrote to what will run: defaults filled in, names and fields resolved,
//! callbacks frozen and hashed.

use std::collections::BTreeMap;
use std::rc::Rc;

use rhai::FnPtr;

use super::callback::Callbacks;
use super::diagnostic::{Diagnostic, suggest};
use super::draft::{DiscretiserDraft, ExperimentDraft, Located, StudyDraft};
use super::features::{self, Surroundings};
use super::freeze::{ALLOWED, OF_STEP};
use super::network;
use super::plan::{Callback, DiscretiserSpec, Expectation, Plan, SeedList, Variant};
use super::value::Value;
use super::world::{clipping_warning, dims, example_bins, physical_bins};
use crate::env::{AnyEnv, EnvSpec};
use crate::learn::{AgentConfig, ParamValue, Signature};
use crate::shaping::{ActionSet, Dim, Scale};

const EPISODES: u32 = 500;
const SEEDS: u64 = 20;
const WINDOW: u32 = 20;
/// Variants that a study may have, and units: variants times their seeds.
const MAX_VARIANTS: usize = 1_000;
const MAX_UNITS: usize = 1_000_000;

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
    if study.experiments.len() > MAX_VARIANTS {
        let n = study.experiments.len();
        let d = Diagnostic::error(format!("{n} variants are too many (at most {MAX_VARIANTS})"));
        return Err(d.at(study.spot.place()));
    }
    let mut warnings = Vec::new();
    let mut units = 0;
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
        units += variant.seeds.0.len();
        if units > MAX_UNITS {
            let d = Diagnostic::error(format!("more than {MAX_UNITS} variants times seeds"));
            return Err(d.at(draft.spot.place()).hint("fewer `seeds`, or fewer variants"));
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
        let check = resolver.callback(check, Signature { text: "(r) -> bool", arities: &[1] })?;
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
    pub(super) constants: &'a BTreeMap<String, Value>,
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
        let mut agent = Located {
            value: AgentConfig { spec: agent.value.spec, params: agent.value.params.clone() },
            spot: agent.spot.clone(),
        };
        let episodes = draft.episodes.unwrap_or(EPISODES);
        if agent.value.is_network() {
            network::resolve(&mut agent.value, episodes).map_err(|d| d.at(agent.spot.place()))?;
        }
        let schema = any.schema();
        let setting = &draft.setting;
        let normalise = match &setting.normalise {
            Some(n) => n.value.scales(&schema, spec, &n.spot)?,
            None => Vec::new(),
        };
        let discretiser = self.discretiser(draft, &agent, spec, &any, &normalise, warnings)?;
        warnings.extend(physical_bins(draft, &schema, &normalise));
        if let Some(clip) = &setting.clip_reward {
            let warning = clipping_warning(clip);
            if !warnings.contains(&warning) {
                warnings.push(warning);
            }
        }
        let shaped = self.shaping(&draft.shaping, &agent.value, &discretiser, warnings)?;
        let allowed = self.allowed(draft, &any, spec)?;
        use_of_model(draft, &agent, spec, &any, &discretiser)?;
        let threshold = draft.threshold.or(spec.reward_threshold);
        let stop_when_solved = stop_when_solved(draft, &agent.value, spec, threshold)?;
        let mut agent_functions = BTreeMap::new();
        if let Some(drafted) = &draft.agent {
            for (name, f) in &drafted.value.functions {
                agent_functions.insert(*name, self.agent_function(&agent, name, f, &discretiser)?);
            }
        }
        let mut terms = BTreeMap::new();
        for (name, f) in &draft.terms {
            terms.insert(name.clone(), self.callback(f, OF_STEP)?);
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
            start: None,
            agent_functions,
            discretiser,
            episodes,
            seeds: SeedList(draft.seeds.clone().unwrap_or_else(|| (0..SEEDS).collect())),
            max_steps: draft.max_steps.or(spec.max_steps).filter(|&n| n > 0),
            threshold,
            window: draft.window.unwrap_or(WINDOW),
            stop_when_solved,
            potential: shaped.potential,
            potential_on: shaped.potential_on,
            shaping: shaped.shaping,
            reward: self.optional(draft.reward.as_ref(), OF_STEP)?,
            terms,
            allowed,
            notes: draft.notes.clone(),
        })
    }

    /// The shield.
    fn allowed(
        &self,
        draft: &ExperimentDraft,
        env: &AnyEnv,
        spec: &EnvSpec,
    ) -> Result<Option<Callback>, Diagnostic> {
        let Some(f) = &draft.allowed else { return Ok(None) };
        let (n, most) = (env.n_actions(), ActionSet::CAPACITY);
        if n > most {
            return Err(Diagnostic::error(format!(
                "a shield tells at most {most} actions apart, here {} has {n}",
                spec.id
            ))
            .at(f.spot.place())
            .hint("give fewer `actions`"));
        }
        self.callback(f, ALLOWED).map(Some)
    }

    /// A function among an agent's parameters.
    fn agent_function(
        &self,
        agent: &Located<AgentConfig>,
        name: &str,
        f: &Located<FnPtr>,
        discretiser: &DiscretiserSpec,
    ) -> Result<Callback, Diagnostic> {
        let param = agent.value.spec.params.iter().find(|p| p.name == name);
        let signature = param.and_then(|p| p.function).expect("checked when it was merged");
        let without = match discretiser {
            DiscretiserSpec::Cells { .. } => "scripted cells",
            DiscretiserSpec::Features(_) => "features",
            DiscretiserSpec::Raw => "networks",
            DiscretiserSpec::StateIndex | DiscretiserSpec::Bins(_) => "",
        };
        if !without.is_empty() {
            return Err(Diagnostic::error(format!(
                "{without} have no representative to evaluate `{name}` on"
            ))
            .at(f.spot.place())
            .hint("use bins(..), or give a number"));
        }
        self.callback(f, signature)
    }

    fn discretiser(
        &self,
        draft: &ExperimentDraft,
        agent: &Located<AgentConfig>,
        spec: &'static EnvSpec,
        env: &AnyEnv,
        normalise: &[Scale],
        warnings: &mut Vec<Diagnostic>,
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
        if let (true, Some(d)) = (agent.value.is_network(), draft.discretiser.as_ref()) {
            return Err(Diagnostic::error(format!(
                "`{}` sees the state itself: it takes no discretiser",
                agent.value.spec.name
            ))
            .at(d.spot.place())
            .hint("leave out `discretiser`; `normalise` brings numbers into a common range"));
        }
        match draft.discretiser.as_ref() {
            None if env.n_states().is_some() => Ok(DiscretiserSpec::StateIndex),
            None if agent.value.is_network() => Ok(DiscretiserSpec::Raw),
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
                DiscretiserDraft::Features(features) => {
                    let schema = &env.schema();
                    let at = Surroundings { spec, schema, normalise, agent };
                    features::resolve(features, &d.spot, &at, warnings)
                        .map(DiscretiserSpec::Features)
                        .map_err(|e| e.at(d.spot.place()))
                }
                DiscretiserDraft::Cells { shape, cell } => {
                    let cell = Located { value: cell.clone(), spot: d.spot.clone() };
                    let cell =
                        self.callback(&cell, Signature { text: "(s) -> index", arities: &[1] })?;
                    Ok(DiscretiserSpec::Cells { shape: shape.clone(), cell })
                }
            },
        }
    }
}

/// Whether training stops when the task is solved. Refused where nothing says when that is, and
/// to agents that do not learn to act.
fn stop_when_solved(
    draft: &ExperimentDraft,
    agent: &AgentConfig,
    spec: &EnvSpec,
    threshold: Option<f64>,
) -> Result<bool, Diagnostic> {
    let Some(stop) = draft.stop_when_solved.as_ref().filter(|stop| stop.value) else {
        return Ok(false);
    };
    let name = agent.spec.name;
    let refuse = |message: String, hint: &str| {
        Err(Diagnostic::error(message).at(stop.spot.place()).hint(hint))
    };
    if agent.is_planner() || agent.is_predictor() {
        let why = if agent.is_planner() {
            "has solved its model before the first episode"
        } else {
            "plays the policy that it is given, which gets no better"
        };
        return refuse(
            format!("`stop_when_solved` is for learners: `{name}` {why}"),
            "leave it out, or say `stop_when_solved: false`",
        );
    }
    if threshold.is_none() {
        return refuse(
            format!("`stop_when_solved` needs a `threshold`: none is registered for {}", spec.id),
            "say which mean return counts as solved, for example `threshold: -20.0`",
        );
    }
    Ok(true)
}

/// Refuses parameters of learners that need a finite model where there is none to use.
fn use_of_model(
    draft: &ExperimentDraft,
    agent: &Located<AgentConfig>,
    spec: &EnvSpec,
    env: &AnyEnv,
    discretiser: &DiscretiserSpec,
) -> Result<(), Diagnostic> {
    let (name, id) = (agent.value.spec.name, spec.id);
    let refuse = |message: String, hint: &str| {
        Err(Diagnostic::error(message).at(agent.spot.place()).hint(hint))
    };
    let has_model = env.finite().is_some();
    if agent.value.is_on("exploring_starts") && !has_model {
        return refuse(
            format!(
                "`exploring_starts` draws start states from the finite model of {id}: it has none"
            ),
            "leave it out: epsilon explores too",
        );
    }
    if !agent.value.is_predictor() || agent.value.params["policy"] == ParamValue::Word("random") {
        return Ok(());
    }
    if let Some(f) = &draft.allowed {
        return Err(Diagnostic::error(format!("`{name}` plays the policy that it is given"))
            .at(f.spot.place())
            .hint("leave out `allowed`, or say `policy: \"random\"`"));
    }
    if agent.value.params["policy"] == ParamValue::Word("greedy") {
        let why = match (has_model, discretiser) {
            (false, _) => "it has none",
            (true, DiscretiserSpec::StateIndex)
                if draft.setting.frame_skip.is_none_or(|n| n == 1) =>
            {
                return Ok(());
            }
            (true, DiscretiserSpec::StateIndex) => "it speaks of single steps, not of `frame_skip`",
            (true, _) => "it speaks of states, not of a discretiser's cells",
        };
        return refuse(
            format!(
                "`policy: \"greedy\"` of `{name}` is planned on the finite model of {id}: {why}"
            ),
            "give the policy as a function: `policy: |s| 0` always plays action 0",
        );
    }
    Ok(())
}
