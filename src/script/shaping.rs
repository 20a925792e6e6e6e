//! What shapes an experiment's reward: potentials of the state, of the episode too, shifted, or
//! learned, and advice on actions.

use rhai::{Dynamic, FnPtr};
use serde::Serialize;
use serde_json::{Value as Json, json};

use super::diagnostic::{Diagnostic, Place};
use super::draft::{Located, Spot, function, wrong};
use super::freeze::{ADVICE, POTENTIAL};
use super::params::{number, text};
use super::plan::{Callback, DiscretiserSpec, PhiOn};
use super::resolve::Resolver;
use crate::learn::registry::{AGENTS, AgentSpec};
use crate::learn::{AgentConfig, AlphaSource, stability_bound};

/// `potential`, as a script gives it.
#[derive(Debug, Clone)]
pub(super) enum PotentialDraft {
    /// A function of the state, or of the state and the episode.
    Function(FnPtr),
    /// `learned(eta)`.
    Learned(LearnedPotential),
}

/// `learned(eta)`: the potential is η times what the learner thinks the state is worth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LearnedPotential(pub(super) f64);

/// Which way advice looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum AdviceOn {
    /// `γ Φ(s′, a′) − Φ(s, a)`, choices corrected by Φ.
    #[default]
    LookAhead,
    /// `Φ(s, a) − γ⁻¹ Φ(s⁻, a⁻)`, (s⁻, a⁻) being the step before.
    LookBack,
}

/// What shapes a variant's reward besides a function of the state.
#[derive(Debug, Clone, Default)]
pub struct Shaping {
    /// What is added to the potential of every state that is not terminal.
    pub shift: f64,
    /// η, where the potential is η times the learner's own state values.
    pub learned: Option<f64>,
    /// Φ(s, a).
    pub advice: Option<Callback>,
    /// Which way it looks.
    pub advice_on: AdviceOn,
}

impl Shaping {
    /// Whether there is any.
    pub fn is_active(&self) -> bool {
        self.shift != 0.0 || self.learned.is_some() || self.advice.is_some()
    }

    /// Everything that can change a result; null if there is none.
    pub(super) fn identity(&self) -> Json {
        if !self.is_active() {
            return Json::Null;
        }
        let advice = self.advice.as_ref().map(|advice| (&advice.digest, self.advice_on));
        json!({ "shift": self.shift, "learned": self.learned, "advice": advice })
    }
}

/// The keys of an experiment that say how its reward is shaped.
#[derive(Debug, Clone, Default)]
pub(super) struct ShapingDraft {
    pub(super) potential: Option<Located<PotentialDraft>>,
    pub(super) potential_on: Option<Located<PhiOn>>,
    pub(super) shift: Option<f64>,
    pub(super) advice: Option<Located<FnPtr>>,
    pub(super) advice_on: AdviceOn,
}

impl ShapingDraft {
    /// Whether `key` is one of those that [`Self::set`] reads.
    pub(super) fn knows(key: &str) -> bool {
        const KEYS: [&str; 5] =
            ["potential", "potential_on", "potential_shift", "advice", "advice_on"];
        KEYS.contains(&key)
    }

    /// Sets `key`; `()` goes back to its default.
    pub(super) fn set(&mut self, key: &str, value: &Dynamic, spot: Spot) -> Result<(), Diagnostic> {
        let removed = value.is_unit();
        match key {
            "potential" if removed => self.potential = None,
            "potential" => {
                let draft = match value.clone().flatten().try_cast::<LearnedPotential>() {
                    Some(learned) => PotentialDraft::Learned(learned),
                    None => PotentialDraft::Function(
                        function(key, POTENTIAL.text, value).map_err(|d| {
                            d.maybe_hint(number(value).map(|_| {
                                "a number for every state is `potential_shift`; `learned(eta)` is \
                                 eta times the learner's own values"
                                    .into()
                            }))
                        })?,
                    ),
                };
                self.potential = Some(Located { value: draft, spot });
            }
            "potential_on" => {
                let value = match text(value).as_deref() {
                    Some("cell") => PhiOn::Cell,
                    Some("raw") => PhiOn::Raw,
                    _ => return Err(wrong(key, "\"cell\" or \"raw\"", value)),
                };
                self.potential_on = Some(Located { value, spot });
            }
            "potential_shift" if removed => self.shift = None,
            "potential_shift" => {
                let finite = number(value).filter(|x| x.is_finite());
                self.shift = Some(finite.ok_or_else(|| wrong(key, "a finite number", value))?);
            }
            "advice" if removed => self.advice = None,
            "advice" => {
                let value = function(key, ADVICE.text, value)?;
                self.advice = Some(Located { value, spot });
            }
            _ if removed => self.advice_on = AdviceOn::default(),
            _ => {
                self.advice_on = match text(value).as_deref() {
                    Some("look_ahead") => AdviceOn::LookAhead,
                    Some("look_back") => AdviceOn::LookBack,
                    _ => return Err(wrong(key, "\"look_ahead\" or \"look_back\"", value)),
                }
            }
        }
        Ok(())
    }
}

/// `q_learning, sarsa`: the agents for which `can` holds.
fn those(can: impl Fn(&AgentSpec) -> bool) -> String {
    let names: Vec<&str> = AGENTS.iter().filter(|a| can(a)).map(|a| a.name).collect();
    names.join(", ")
}

/// Adds a warning that variants which inherit its cause say once.
fn warn(warnings: &mut Vec<Diagnostic>, warning: Diagnostic) {
    if !warnings.contains(&warning) {
        warnings.push(warning);
    }
}

/// What a draft's shaping is resolved to.
pub(super) struct Resolved {
    pub(super) potential: Option<Callback>,
    pub(super) potential_on: PhiOn,
    pub(super) shaping: Shaping,
}

impl Resolver<'_> {
    /// What shapes the reward of an experiment with this agent and discretiser.
    pub(super) fn shaping(
        &self,
        draft: &ShapingDraft,
        agent: &AgentConfig,
        discretiser: &DiscretiserSpec,
        warnings: &mut Vec<Diagnostic>,
    ) -> Result<Resolved, Diagnostic> {
        let mut shaping = Shaping {
            shift: draft.shift.unwrap_or(0.0),
            advice_on: draft.advice_on,
            ..Shaping::default()
        };
        let potential_on = potential_on(draft.potential_on.as_ref(), discretiser)?;
        let mut potential = None;
        if let Some(Located { value, spot }) = &draft.potential {
            match value {
                PotentialDraft::Learned(LearnedPotential(eta)) => {
                    learned(*eta, agent, discretiser).map_err(|d| d.at(spot.place()))?;
                    shaping.learned = Some(*eta);
                }
                PotentialDraft::Function(f) => {
                    let f = Located { value: f.clone(), spot: spot.clone() };
                    let callback = self.callback(&f, POTENTIAL)?;
                    potential_of(&callback, potential_on, agent, discretiser, warnings)
                        .map_err(|d| d.at(spot.place()))?;
                    potential = Some(callback);
                }
            }
        }
        if let Some(f) = &draft.advice {
            let wrong = |d: Diagnostic| d.at(f.spot.place());
            if shaping.learned.is_some() {
                return Err(wrong(Diagnostic::error(
                    "advice and a `learned` potential cannot be combined: what the learner's \
                     values mean depends on the advice",
                )));
            }
            advice(draft.advice_on, agent, discretiser, f.spot.place(), warnings).map_err(wrong)?;
            shaping.advice = Some(self.callback(f, ADVICE)?);
        }
        Ok(Resolved { potential, potential_on, shaping })
    }
}

/// On what a potential is evaluated: features have no cells.
fn potential_on(
    asked: Option<&Located<PhiOn>>,
    discretiser: &DiscretiserSpec,
) -> Result<PhiOn, Diagnostic> {
    match (discretiser, asked.map(|on| on.value)) {
        (DiscretiserSpec::Features(_), Some(PhiOn::Cell)) => {
            Err(Diagnostic::error("features have no cells to evaluate the potential on")
                .at(asked.and_then(|on| on.spot.place()))
                .hint("leave out `potential_on`: it is evaluated on the state itself"))
        }
        (DiscretiserSpec::Raw, Some(PhiOn::Cell)) => {
            Err(Diagnostic::error("a network has no cells to evaluate the potential on")
                .at(asked.and_then(|on| on.spot.place()))
                .hint("leave out `potential_on`: it is evaluated on the state itself"))
        }
        (DiscretiserSpec::Features(_) | DiscretiserSpec::Raw, _) => Ok(PhiOn::Raw),
        (_, on) => Ok(on.unwrap_or(PhiOn::Cell)),
    }
}

/// What stands against a scripted potential, and what its author should know.
fn potential_of(
    callback: &Callback,
    on: PhiOn,
    agent: &AgentConfig,
    discretiser: &DiscretiserSpec,
    warnings: &mut Vec<Diagnostic>,
) -> Result<(), Diagnostic> {
    let dynamic = callback.arity == 2;
    if dynamic && agent.is_planner() {
        return Err(Diagnostic::error(format!(
            "`{}` plans before the first episode: its potential is a function of the state alone",
            agent.spec.name
        )));
    }
    let on_cells = matches!(discretiser, DiscretiserSpec::Bins(_) | DiscretiserSpec::Cells { .. });
    if on == PhiOn::Raw && on_cells {
        let hint = match discretiser {
            DiscretiserSpec::Bins(_) => {
                "leave out `potential_on: \"raw\"` to evaluate it on each cell's representative"
            }
            _ => "bins(..) have a representative to evaluate it on, scripted cells do not",
        };
        let warning = Diagnostic::warning(
            "a potential of the raw state is not constant on the discretiser's cells",
        );
        let warning = warning
            .at(callback.place.clone())
            .note("the greedy policy of the discretised problem may change")
            .hint(hint);
        warn(warnings, warning);
    }
    if on == PhiOn::Cell && matches!(discretiser, DiscretiserSpec::Cells { .. }) {
        return Err(Diagnostic::error(
            "scripted cells have no representative to evaluate the potential on",
        )
        .hint("use bins(..), or say `potential_on: \"raw\"`"));
    }
    if dynamic {
        let warning = Diagnostic::warning(
            "a potential that changes from episode to episode is not the same as initial values",
        );
        warn(
            warnings,
            warning
                .at(callback.place.clone())
                .note("the optimal policy is kept all the same (Devlin & Kudenko 2012)"),
        );
    }
    Ok(())
}

/// What stands against advice.
fn advice(
    on: AdviceOn,
    agent: &AgentConfig,
    discretiser: &DiscretiserSpec,
    place: Option<Place>,
    warnings: &mut Vec<Diagnostic>,
) -> Result<(), Diagnostic> {
    let name = agent.spec.name;
    match on {
        AdviceOn::LookAhead if !agent.spec.is_one_step() => {
            let why = if agent.is_planner() {
                "a planner needs none, it knows the model"
            } else {
                "it is for learners of action values that look one step ahead"
            };
            return Err(Diagnostic::error(format!("`{name}` takes no advice: {why}"))
                .hint(format!("one of: {}", those(AgentSpec::is_one_step))));
        }
        AdviceOn::LookBack if !agent.spec.is_on_policy() => {
            return Err(Diagnostic::error(format!(
                "`{name}` takes no look-back advice: it is for learners of the values of the \
                 policy that they play"
            ))
            .hint(format!("one of: {}", those(AgentSpec::is_on_policy))));
        }
        AdviceOn::LookBack if agent.float("gamma") == 0.0 => {
            return Err(Diagnostic::error("look-back advice divides by gamma, which is 0"));
        }
        AdviceOn::LookBack if !agent.spec.learns_from_returns() => {
            let warning = Diagnostic::warning(format!(
                "with `{name}` look-back advice can change which policy is best"
            ));
            let warning = warning
                .at(place)
                .note(
                    "it bootstraps from states without knowing how it came there: where ways \
                     meet, only the average of their advice is taken back",
                )
                .hint("`advice_on: \"look_ahead\"` is exact");
            warn(warnings, warning);
        }
        _ => {}
    }
    let without = match discretiser {
        DiscretiserSpec::Cells { .. } => "scripted cells",
        DiscretiserSpec::Features(_) => "features",
        DiscretiserSpec::Raw => "networks",
        DiscretiserSpec::StateIndex | DiscretiserSpec::Bins(_) => return Ok(()),
    };
    Err(Diagnostic::error(format!("{without} have no representative to evaluate the advice on"))
        .hint("use bins(..)"))
}

/// What stands against a potential of η times the learner's own values.
fn learned(eta: f64, agent: &AgentConfig, discretiser: &DiscretiserSpec) -> Result<(), Diagnostic> {
    let name = agent.spec.name;
    if matches!(discretiser, DiscretiserSpec::Features(_)) {
        return Err(Diagnostic::error(
            "a `learned` potential is for tables: with linear values nothing says that it settles",
        )
        .hint("use bins(..), or give a function"));
    }
    if !agent.spec.is_one_step() {
        return Err(Diagnostic::error(format!(
            "`{name}` cannot be shaped by its own values: a `learned` potential is for learners of \
             action values that look one step ahead"
        ))
        .hint(format!("one of: {}", those(AgentSpec::is_one_step))));
    }
    let alpha = match agent.alpha() {
        AlphaSource::Schedule(schedule) => schedule.range().1,
        // That of the first visit.
        AlphaSource::VisitCount { .. } => 1.0,
    };
    let bound = stability_bound(agent.float("gamma"));
    if eta <= -1.0 || alpha * (1.0 + eta) >= bound {
        let largest = bound / alpha - 1.0;
        return Err(Diagnostic::error(format!(
            "`learned({eta:?})` with alpha up to {alpha:?} does not settle: alpha (1 + eta) must be \
             above 0 and below 2 / (1 + gamma) = {bound:.6}, it is {:?}",
            alpha * (1.0 + eta)
        ))
        .hint(format!("an eta above -1 and below {largest:.6}, or a smaller alpha")));
    }
    Ok(())
}
