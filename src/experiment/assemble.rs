//! Puts together what a variant describes: discretiser, reward, agent.

use super::endless::refuse_endless;
use super::predict::{Exact, given_policy};
use super::shaped::{learner, potential};
use super::shielded::playable;
use crate::learn::dqn::{Dqn, NetworkSetup};
use crate::learn::planning::{PlannedAgent, Sweep};
use crate::learn::registry::{Build, Setup};
use crate::learn::{AnyAgent, Learn, LinearSetup};
use crate::mdp::streams::Stream;
use crate::mdp::{Env, FiniteMdp, Schema};
use crate::script::{Callback, Diagnostic, DiscretiserSpec, Host, Variant};
use crate::shaping::{
    AnyReward, Bins, Fault, FeatureSpec, Features, Fields, Inputs, MAX_FIELDS, NativeReward,
    Potential, RewardModel, ScriptedReward, Shield, TabulatedReward, Transition, shaped_model,
};

/// A state with every field in the middle of its range (0 where that is unbounded): the values of
/// fields that are not binned.
pub(super) fn middle(schema: &Schema) -> [f64; MAX_FIELDS] {
    let mut fields = [0.0; MAX_FIELDS];
    for (x, f) in fields.iter_mut().zip(&schema.fields) {
        let middle = f64::midpoint(f.low, f.high);
        *x = if f.low.is_finite() && f.high.is_finite() { middle } else { 0.0 };
    }
    fields
}

/// From a cell to the fields of the state that stands for it.
pub(super) type Representative = Box<dyn Fn(usize) -> [f64; MAX_FIELDS]>;

/// The state that stands for each cell: itself, or the centre of the bins. Scripted cells and
/// features have none.
pub(super) fn representative<E: Env + Clone + 'static>(
    variant: &Variant,
    env: &E,
) -> Option<Representative> {
    match &variant.discretiser {
        DiscretiserSpec::StateIndex => {
            let states = env.clone();
            Some(Box::new(move |index| {
                let mut fields = [0.0; MAX_FIELDS];
                let obs = states.state(index).expect("StateIndex is given to finite states only");
                states.fields(&obs, &mut fields);
                fields
            }))
        }
        DiscretiserSpec::Bins(dims) => {
            let bins = Bins::new(dims).expect("checked when the plan was resolved");
            let base = middle(&env.schema());
            Some(Box::new(move |cell| {
                let mut fields = base;
                bins.centre(cell, &mut fields);
                fields
            }))
        }
        DiscretiserSpec::Cells { .. } | DiscretiserSpec::Features(_) | DiscretiserSpec::Raw => None,
    }
}

/// The variant's shield, if it has one.
pub(super) fn shield<E: Env>(host: &Host, variant: &Variant, env: &E) -> Option<Shield> {
    let schema = env.schema();
    let allowed = variant.allowed.as_ref()?;
    let allowed = host.callbacks().shield(allowed, env.n_actions(), &schema);
    Some(Shield::new(schema.fields.len(), env.n_states().unwrap_or(0), allowed))
}

/// Calls `each(cell, fields)` for every cell with the fields of the state that stands for it; not for
/// states that cannot be reached, which may be junk.
pub(super) fn for_each_cell<E: Env + Clone + 'static>(
    variant: &Variant,
    env: &E,
    n_cells: usize,
    mut each: impl FnMut(usize, &[f64]) -> Result<(), Fault>,
) -> Result<(), Fault> {
    let n_fields = env.schema().fields.len();
    let fields_of = representative(variant, env).expect("refused when the plan was resolved");
    let reachable = match variant.discretiser {
        DiscretiserSpec::StateIndex => env.finite().map(|mdp| mdp.reachable()),
        _ => None,
    };
    for cell in 0..n_cells {
        if reachable.as_ref().is_none_or(|reachable| reachable[cell]) {
            each(cell, &fields_of(cell)[..n_fields])?;
        }
    }
    Ok(())
}

/// A number for every cell, called `what` in messages; 0 in states that cannot be reached.
fn of_state<E: Env + Clone + 'static>(
    host: &Host,
    variant: &Variant,
    env: &E,
    n_cells: usize,
    callback: &Callback,
    what: &'static str,
) -> Result<Vec<f64>, Fault> {
    let mut number = host.callbacks().of_action(callback, what, &env.schema());
    let mut values = vec![0.0; n_cells];
    for_each_cell(variant, env, n_cells, |cell, fields| {
        values[cell] = number(fields, 0)?;
        Ok(())
    })?;
    Ok(values)
}

/// A number for every cell and action, shape `[n_cells, n_actions]`, called `what` in messages;
/// 0 in states that cannot be reached.
pub(super) fn of_action<E: Env + Clone + 'static>(
    host: &Host,
    variant: &Variant,
    env: &E,
    n_cells: usize,
    callback: &Callback,
    what: &'static str,
) -> Result<Vec<f64>, Fault> {
    let mut number = host.callbacks().of_action(callback, what, &env.schema());
    let n_actions = env.n_actions();
    let mut values = vec![0.0; n_cells * n_actions];
    for_each_cell(variant, env, n_cells, |cell, fields| {
        let row = &mut values[cell * n_actions..][..n_actions];
        let of_state = if callback.arity == 1 { Some(number(fields, 0)?) } else { None };
        for (action, value) in row.iter_mut().enumerate() {
            *value = match of_state {
                Some(value) => value,
                None => number(fields, action)?,
            };
        }
        Ok(())
    })?;
    Ok(values)
}

/// A variant's reward model, asked step by step.
pub(super) fn scripted_reward<E: Env>(host: &Host, variant: &Variant, env: &E) -> AnyReward<E> {
    if variant.reward.is_none() && variant.terms.is_empty() {
        return AnyReward::Native(NativeReward);
    }
    let terms: Vec<Callback> = variant.terms.values().cloned().collect();
    let reward = host.callbacks().reward(variant.reward.as_ref(), &terms, &env.schema());
    AnyReward::Scripted(reward)
}

/// A variant's reward model. On finite environments it is tabulated, unless it reads `t.step`.
pub(super) fn reward<E: Env + Clone + 'static>(
    host: &Host,
    variant: &Variant,
    env: &E,
) -> Result<AnyReward<E>, Fault> {
    let AnyReward::Scripted(mut scripted) = scripted_reward(host, variant, env) else {
        return Ok(AnyReward::Native(NativeReward));
    };
    let callbacks = host.callbacks();
    // Over several frames the last outcome alone does not determine the reward.
    if let (Some(mdp), 1) = (env.finite(), variant.frame_skip) {
        callbacks.clear_step_read();
        let table = tabulate(env, mdp, variant.terms.len(), &mut scripted)?;
        if !callbacks.step_read() {
            return Ok(AnyReward::Tabulated(table));
        }
    }
    Ok(AnyReward::Scripted(scripted))
}

fn tabulate<E: Env>(
    env: &E,
    mdp: &FiniteMdp,
    n_terms: usize,
    scripted: &mut ScriptedReward<E>,
) -> Result<TabulatedReward, Fault> {
    let reachable = mdp.reachable();
    TabulatedReward::new(mdp, n_terms, |s, action, i, truncated, terms| {
        if !reachable[s] {
            return Ok(0.0);
        }
        let outcome = mdp.outcomes()[i];
        let at = |index: usize| env.state(index).expect("a finite environment");
        let t = Transition {
            state: &at(s),
            action,
            reward: outcome.reward,
            next_state: &at(outcome.next_state as usize),
            terminated: outcome.terminated,
            truncated,
            step: 0,
        };
        scripted.reward(env, &t, terms)
    })
}

/// A reward that is not a function of the transition: what it depends on besides.
#[derive(Debug, Clone, Copy)]
pub(super) struct NotAModel(pub(super) &'static str);

impl NotAModel {
    fn fault(self, variant: &Variant) -> Fault {
        let callback = variant.reward.as_ref().or_else(|| variant.terms.values().next());
        let d = Diagnostic::error(self.to_string())
            .at(callback.and_then(|r| r.place.clone()))
            .hint("a model cannot hold it; plan without it");
        Fault(Box::new(NotAModelError { what: self, diagnostic: d }))
    }
}

impl std::fmt::Display for NotAModel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "the reward depends on `{}`: it is not a function of the transition", self.0)
    }
}

/// [`NotAModel`] as an error, with the diagnostic to show where it is one.
#[derive(Debug)]
pub(super) struct NotAModelError {
    pub(super) what: NotAModel,
    pub(super) diagnostic: Diagnostic,
}

impl std::fmt::Display for NotAModelError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.diagnostic.fmt(f)
    }
}

impl std::error::Error for NotAModelError {}

/// A fault's diagnostic.
pub(super) fn diagnostic_of(fault: Fault) -> Diagnostic {
    match fault.0.downcast::<Diagnostic>() {
        Ok(d) => *d,
        Err(other) => match other.downcast::<NotAModelError>() {
            Ok(e) => e.diagnostic,
            Err(other) => Diagnostic::error(other.to_string()),
        },
    }
}

/// The model that a finite variant's agent learns on.
pub(super) struct LearnedModel {
    /// The dynamics with the learned rewards, the potential's included.
    pub(super) shaped: FiniteMdp,
    /// Φ per state; 0 where there is none and in states that cannot be reached.
    pub(super) phi: Vec<f64>,
}

/// The model that a finite variant's agent learns on.
///
/// # Errors
/// If a callback fails, or the reward depends on more than the transition.
pub(super) fn learned_model<E: Env + Clone + 'static>(
    host: &Host,
    variant: &Variant,
    env: &E,
) -> Result<LearnedModel, Fault> {
    let mdp = env.finite().expect("only asked of finite environments");
    let reachable = mdp.reachable();
    let base = match reward(host, variant, env)? {
        AnyReward::Native(_) => (**mdp).clone(),
        AnyReward::Tabulated(table) if table.depends_on_truncation() => {
            return Err(NotAModel("t.truncated").fault(variant));
        }
        AnyReward::Tabulated(table) => {
            let mut outcome = 0;
            mdp.with_rewards(|_, _, _| {
                outcome += 1;
                table.of(outcome - 1)
            })
        }
        AnyReward::Scripted(_) => return Err(NotAModel("t.step").fault(variant)),
    };
    let base = match variant.clip_reward {
        Some([low, high]) => base.with_rewards(|_, _, o| o.reward.clamp(low, high)),
        None => base,
    };
    let mut phi = vec![0.0; mdp.n_states()];
    let mut potential = potential(host, variant, env, mdp.n_states())?;
    // A potential that changes is what it is at the end.
    Potential::<E>::begin_episode(&mut potential, variant.episodes);
    for s in (0..mdp.n_states()).filter(|&s| reachable[s]) {
        let obs = env.state(s).expect("a finite environment");
        phi[s] = potential.phi(env, s, &obs)?;
    }
    let base = playable(host, variant, env, base)?;
    let shaped = shaped_model(&base, variant.agent.float("gamma"), &phi);
    Ok(LearnedModel { shaped, phi })
}

/// An agent, and what is known about what it does.
pub(super) struct Assembled {
    pub(super) agent: AnyAgent,
    /// How a planner came to its solution; empty for learners.
    pub(super) sweeps: Vec<Sweep>,
    /// What a predictor should learn, where there is a model.
    pub(super) exact: Option<Exact>,
}

/// The variant's agent for one seed.
pub(super) fn agent<E: Env + Clone + 'static>(
    host: &Host,
    variant: &Variant,
    env: &E,
    n_cells: usize,
    seed: u64,
) -> Result<Assembled, Fault> {
    match variant.agent.spec.build {
        Build::Learner(build)
        | Build::Predictor(build)
        | Build::OnPolicy { build, .. }
        | Build::OneStep { build, .. } => {
            let function = |name: &str| variant.agent_functions.get(name);
            let initial_q = function("initial_q")
                .map(|f| of_action(host, variant, env, n_cells, f, "the initial action value"));
            let initial_v = function("initial_v")
                .map(|f| of_state(host, variant, env, n_cells, f, "the initial state value"));
            let (mut policy, mut exact) = (None, None);
            if variant.agent.is_predictor() {
                policy = given_policy(host, variant, env, n_cells)?;
                exact = Exact::new(host, variant, env, policy.as_deref())?;
            }
            let setup = Setup {
                n_states: n_cells,
                n_actions: env.n_actions(),
                seed,
                stream: Stream::new(seed, "agent"),
                initial_q: initial_q.transpose()?,
                initial_v: initial_v.transpose()?,
                policy,
            };
            let agent = learner(host, variant, env, build, setup)?;
            Ok(Assembled { agent, sweeps: Vec::new(), exact })
        }
        Build::Network(_) => unreachable!("networks have a loop of their own"),
        Build::Planner(build) => {
            let planner = build(&variant.agent);
            let model = learned_model(host, variant, env)?;
            let v0: Vec<f64> = model.phi.iter().map(|phi| -phi).collect();
            let solution = planner.solve(&model.shaped, &v0).map_err(|e| Fault(Box::new(e)))?;
            refuse_endless(variant, &model.shaped, &solution.policy)?;
            let sweeps = solution.sweeps(planner.gamma());
            let agent = AnyAgent::tabular(PlannedAgent::new(solution, planner.gamma()));
            Ok(Assembled { agent, sweeps, exact: None })
        }
    }
}

/// The variant's agent for one seed, where it learns a network.
pub(super) fn network_agent<E: Env>(variant: &Variant, env: &E, seed: u64) -> Dqn {
    let Build::Network(build) = variant.agent.spec.build else {
        unreachable!("only asked of agents that learn networks")
    };
    let setup = NetworkSetup {
        inputs: inputs(variant, env.n_states(), &env.schema()),
        n_actions: env.n_actions(),
        shielded: variant.allowed.is_some(),
        seed,
        model: variant.start.as_ref().map(|start| {
            start.file.as_ref().expect("a plan that was read back is not run").net.clone()
        }),
    };
    build(&variant.agent, setup)
}

/// What the variant's network sees of a state of an environment with so many of them, or infinitely
/// many.
pub(super) fn inputs(variant: &Variant, n_states: Option<usize>, schema: &Schema) -> Inputs {
    match n_states {
        Some(n) => Inputs::OneHot(n),
        None => Inputs::fields(schema.fields.len(), &variant.normalise),
    }
}

/// The variant's agent for one seed, where its values are linear in features.
pub(super) fn linear_agent<E: Env>(
    variant: &Variant,
    features: &FeatureSpec,
    env: &E,
    seed: u64,
) -> Box<dyn Learn<Fields>> {
    let build = variant.agent.spec.linear.expect("checked when the plan was resolved");
    let features = Features::new(features).expect("checked when the plan was resolved");
    let stream = Stream::new(seed, "agent");
    build(&variant.agent, LinearSetup { features, n_actions: env.n_actions(), stream })
}
