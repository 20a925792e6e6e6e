//! Parameters that several agents have.

use crate::learn::{Exploration, ParamKind, ParamSpec, ParamValue, Schedule, Signature, Visits};

pub(super) const UNIT: ParamKind = ParamKind::Float { min: 0.0, max: 1.0, open: false };
pub(super) const ANY: ParamKind =
    ParamKind::Float { min: f64::NEG_INFINITY, max: f64::INFINITY, open: false };

pub(super) const ALPHA: ParamSpec = ParamSpec {
    name: "alpha",
    kind: ParamKind::Rate { open: true },
    function: None,
    default: ParamValue::Schedule(Schedule::Constant { value: 0.1 }),
    doc: "step size: a number or a schedule",
};
pub(super) const STEP_SIZE: ParamSpec = ParamSpec {
    kind: ParamKind::StepSize,
    doc: "step size: a number, a schedule, or visit_count() for 1/N(s, a)",
    ..ALPHA
};
/// A step size that makes a value the mean of what it learns from.
pub(super) const MEAN: ParamSpec =
    ParamSpec { default: ParamValue::VisitCount { omega: 1.0 }, ..STEP_SIZE };
pub(super) const GAMMA: ParamSpec = ParamSpec {
    name: "gamma",
    kind: UNIT,
    function: None,
    default: ParamValue::Float(0.99),
    doc: "discount factor, of the learner and of potential-based shaping",
};
pub(super) const EPSILON: ParamSpec = ParamSpec {
    name: "epsilon",
    kind: ParamKind::Rate { open: false },
    function: None,
    default: ParamValue::Schedule(Schedule::Constant { value: 0.1 }),
    doc: "exploration rate: a number or a schedule",
};
pub(super) const VISITS: ParamSpec = ParamSpec {
    name: "visits",
    kind: ParamKind::Word(Visits::WORDS),
    function: None,
    default: ParamValue::Word("first"),
    doc: "which visits of an episode count",
};
pub(super) const EXPLORATION: ParamSpec = ParamSpec {
    name: "exploration",
    kind: ParamKind::Exploration,
    function: None,
    default: ParamValue::Exploration(Exploration::EpsilonGreedy),
    doc: "the behaviour policy; epsilon plays no part in the others",
};
pub(super) const INITIAL_Q: ParamSpec = ParamSpec {
    name: "initial_q",
    kind: ANY,
    function: Some(Signature { text: "(s) -> number or (s, a) -> number", arities: &[1, 2] }),
    default: ParamValue::Float(0.0),
    doc: "initial action value: a number (optimistic if above what can be reached) or a function",
};
