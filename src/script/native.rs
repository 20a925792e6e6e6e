//! Which callbacks run as machine code: each is lowered and compiled when it is first wanted, once for
//! all threads.

use std::sync::{Arc, OnceLock};

use super::callback::Callbacks;
use super::diagnostic::Place;
use super::lower::{self, Library, Param, Subject, Want};
use super::plan::{Callback, DiscretiserSpec, Variant};
use crate::jit::{self, Kernel, Program};
use crate::mdp::Schema;
use crate::shaping::StepLayout;

/// What a callback is for: what it gets, and what it must return.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role<'a> {
    /// `(s)` or `(s, episode)`, a number.
    Potential,
    /// `(s)` or `(s, a)`, a number.
    OfAction,
    /// `(t)`, a number.
    OfStep,
    /// `(s)`, a cell of a table of this shape.
    Cells(&'a [usize]),
    /// `(s, a)`, a truth value.
    Shield,
    /// `(s)`, an action.
    Policy,
}

/// How a callback is run.
#[derive(Clone)]
pub enum Tier {
    /// As machine code that gives a number; whether it reads `t.step`.
    Number(Arc<Kernel<f64>>, bool),
    /// As machine code that gives an integer or a truth value.
    Integer(Arc<Kernel<i64>>),
    /// By the interpreter, and why.
    Interpreted(Reason),
}

/// Why a callback is interpreted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reason {
    /// What stands in the way: `a comparison of strings`.
    pub what: String,
    /// Where.
    pub place: Option<Place>,
}

/// A callback's tier, found when it is first wanted. Not part of what a callback is: however it is
/// run, it gives the same bits.
#[derive(Clone, Default)]
pub(super) struct TierCell(Arc<OnceLock<Tier>>);

impl std::fmt::Debug for TierCell {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("TierCell")
    }
}

impl Callbacks {
    /// How `callback` is run on states with this `schema`. A callback has one role and one schema.
    pub(super) fn tier(&self, callback: &Callback, role: Role<'_>, schema: &Schema) -> Tier {
        if !jit::is_enabled() {
            let what = "machine code is switched off".into();
            return Tier::Interpreted(Reason { what, place: None });
        }
        callback.tier.0.get_or_init(|| self.compile(callback, role, schema)).clone()
    }

    fn compile(&self, callback: &Callback, role: Role<'_>, schema: &Schema) -> Tier {
        let _turn = self.context.watched.plan("compiling a function");
        let program = match self.program(callback, role, schema) {
            Ok(program) => program,
            Err(reason) => return Tier::Interpreted(reason),
        };
        let reads_step = role == Role::OfStep && program.reads(StepLayout::STEP);
        let tier = match role {
            Role::Cells(_) | Role::Shield | Role::Policy => {
                Kernel::new(program).map(|kernel| Tier::Integer(Arc::new(kernel)))
            }
            Role::OfStep | Role::Potential | Role::OfAction => {
                Kernel::new(program).map(|kernel| Tier::Number(Arc::new(kernel), reads_step))
            }
        };
        tier.unwrap_or_else(|invalid| {
            Tier::Interpreted(Reason { what: invalid.to_string(), place: None })
        })
    }

    /// `callback` in the intermediate form.
    pub(super) fn program(
        &self,
        callback: &Callback,
        role: Role<'_>,
        schema: &Schema,
    ) -> Result<Program, Reason> {
        let n = schema.fields.len();
        let (params, n_inputs): (&[Param], usize) = match (role, callback.arity) {
            (Role::OfStep, _) => (&[Param::Step], StepLayout::LEN),
            (Role::Cells(_) | Role::Policy, _) | (_, 1) => (&[Param::State(0)], n),
            _ => (&[Param::State(0), Param::Int(n)], n + 1),
        };
        let want = match role {
            Role::Potential | Role::OfAction | Role::OfStep => Want::Number,
            Role::Cells(shape) => Want::Cell(shape.to_vec()),
            Role::Shield => Want::Flag,
            Role::Policy => Want::Integer,
        };
        let subject = Subject {
            function: &callback.function,
            captures: &callback.captures,
            params,
            n_inputs,
            want,
        };
        let library = self.library.get_or_init(|| Library::new(&self.ast, &self.context));
        lower::lower(&subject, library, &self.constants, schema).map_err(|outside| {
            let place = self.context.place(outside.file.as_deref(), outside.position);
            Reason { what: outside.what, place }
        })
    }

    /// Machine code for `callback`, if it gives a number.
    pub(super) fn number_kernel(
        &self,
        callback: &Callback,
        role: Role<'_>,
        schema: &Schema,
    ) -> Option<Arc<Kernel<f64>>> {
        match self.tier(callback, role, schema) {
            Tier::Number(kernel, _) => Some(kernel),
            _ => None,
        }
    }

    /// Machine code for `callback`, if it gives an integer or a truth value.
    pub(super) fn integer_kernel(
        &self,
        callback: &Callback,
        role: Role<'_>,
        schema: &Schema,
    ) -> Option<Arc<Kernel<i64>>> {
        match self.tier(callback, role, schema) {
            Tier::Integer(kernel) => Some(kernel),
            _ => None,
        }
    }

    /// The callbacks of `variant`, whose states have this `schema`, by their keys, each with how it
    /// is run.
    pub fn tiers<'v>(&self, variant: &'v Variant, schema: &Schema) -> Vec<Tiered<'v>> {
        let mut all = Vec::new();
        let mut add = |key: String, callback: Option<&'v Callback>, role: Role<'_>| {
            if let Some(callback) = callback {
                all.push(Tiered { key, callback, tier: self.tier(callback, role, schema) });
            }
        };
        if let DiscretiserSpec::Cells { shape, cell } = &variant.discretiser {
            add("discretiser".into(), Some(cell), Role::Cells(shape));
        }
        add("potential".into(), variant.potential.as_ref(), Role::Potential);
        add("advice".into(), variant.shaping.advice.as_ref(), Role::OfAction);
        add("reward".into(), variant.reward.as_ref(), Role::OfStep);
        for (name, term) in &variant.terms {
            add(format!("terms.{name}"), Some(term), Role::OfStep);
        }
        add("allowed".into(), variant.allowed.as_ref(), Role::Shield);
        for (key, function) in &variant.agent_functions {
            let role = if *key == "policy" { Role::Policy } else { Role::OfAction };
            add(format!("agent.{key}"), Some(function), role);
        }
        all
    }
}

/// A callback with how it is run.
pub struct Tiered<'v> {
    /// Its key in the experiment: `potential`, `terms.fuel`.
    pub key: String,
    /// The callback.
    pub callback: &'v Callback,
    /// How it is run.
    pub tier: Tier,
}
