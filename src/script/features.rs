//! Features for linear values: which ones a script asks for, and whether they can be had.

use super::diagnostic::Diagnostic;
use super::draft::{BinDraft, Located, Spot};
use super::world::field_of;
use crate::env::EnvSpec;
use crate::learn::registry::AGENTS;
use crate::learn::{AgentConfig, Exploration, ParamValue};
use crate::mdp::{FieldKind, Schema};
use crate::shaping::{Dim, FeatureKind, FeatureSpec, Features, MAX_WEIGHTS, Scale};

/// `tiles(…)` or `fourier(…)` as it was written.
#[derive(Debug, Clone)]
pub(super) struct FeaturesDraft {
    pub(super) kind: FeatureKind,
    /// The fields with their ranges and numbers of tiles, or the order.
    pub(super) ranges: Vec<BinDraft>,
    /// The order of the Fourier basis over all fields, where no range is written.
    pub(super) order: Option<usize>,
}

/// What features are resolved against.
pub(super) struct Surroundings<'a> {
    pub(super) spec: &'static EnvSpec,
    pub(super) schema: &'a Schema,
    pub(super) normalise: &'a [Scale],
    pub(super) agent: &'a Located<AgentConfig>,
}

/// The features of `draft`, their ranges in physical units; what there is to say about them goes to
/// `warnings`.
pub(super) fn resolve(
    draft: &FeaturesDraft,
    spot: &Spot,
    at: &Surroundings<'_>,
    warnings: &mut Vec<Diagnostic>,
) -> Result<FeatureSpec, Diagnostic> {
    let Surroundings { schema, agent, .. } = at;
    able(&agent.value, draft.kind).map_err(|d| d.at(agent.spot.place()))?;
    let mut dims = match draft.order {
        Some(order) => all_fields(order, at)?,
        None => draft.ranges.iter().map(|range| physical(range, at)).collect::<Result<_, _>>()?,
    };
    dims.sort_by_key(|d| d.field);
    let features = FeatureSpec { kind: draft.kind, dims };
    let n_actions = schema.actions.len();
    let weights = features.n_features().and_then(|n| n.checked_mul(n_actions));
    if weights.is_none_or(|n| n > MAX_WEIGHTS) {
        let weights = weights.map_or("too many".into(), |n| n.to_string());
        return Err(Diagnostic::error(format!(
            "{features}, make {weights} weights for {n_actions} actions, more than {MAX_WEIGHTS}"
        ))
        .hint(match draft.kind {
            FeatureKind::Tiles(_) => "use fewer tiles, tilings or fields",
            FeatureKind::Fourier => "use a lower order or fewer fields",
        }));
    }
    Features::new(&features).map_err(|e| Diagnostic::error(e.message))?;
    warnings.extend(alike(&features, schema).map(|d| d.at(spot.place())));
    Ok(features)
}

/// Whether `agent` can learn values that are linear in features of this kind.
fn able(agent: &AgentConfig, kind: FeatureKind) -> Result<(), Diagnostic> {
    let name = agent.spec.name;
    if agent.spec.linear.is_none() {
        let able = AGENTS.iter().filter(|a| a.linear.is_some()).map(|a| a.name);
        return Err(Diagnostic::error(format!(
            "`{name}` cannot learn values that are linear in features"
        ))
        .hint(format!("these can: {}", able.collect::<Vec<_>>().join(", "))));
    }
    let param = |name| agent.params.get(name);
    let counted = if let Some(ParamValue::VisitCount { .. }) = param("alpha") {
        Some(("alpha", "a number or a schedule"))
    } else if let Exploration::Ucb { .. } = agent.exploration() {
        Some(("exploration", "\"epsilon_greedy\" or softmax(..)"))
    } else {
        None
    };
    if let Some((param, instead)) = counted {
        return Err(Diagnostic::error(format!(
            "the `{param}` of `{name}` counts visits, and features have no states to be counted"
        ))
        .hint(format!("use {instead}")));
    }
    if kind == FeatureKind::Fourier && param("traces") == Some(&ParamValue::Word("replacing")) {
        return Err(Diagnostic::error(
            "replacing traces are defined for features that are 0 or 1, as tiles are",
        )
        .hint("with `fourier`, use `traces: \"accumulating\"` or \"dutch\""));
    }
    Ok(())
}

/// A range with its field found, in physical units.
fn physical(range: &BinDraft, at: &Surroundings<'_>) -> Result<Dim, Diagnostic> {
    let field = field_of(range, at.schema, at.spec, "range")?;
    let scale = at.normalise.iter().find(|scale| scale.field == field);
    let [lo, hi] = [range.lo, range.hi].map(|x| scale.map_or(x, |scale| scale.physical(x)));
    Ok(Dim { field, lo, hi, n: range.n })
}

/// Every field that is a number, with the range that it is normalised from or has by itself.
fn all_fields(order: usize, at: &Surroundings<'_>) -> Result<Vec<Dim>, Diagnostic> {
    let fields = at.schema.fields.iter().enumerate();
    let numbers = fields.filter(|(_, f)| f.kind != FieldKind::Letter);
    let ranges = numbers.map(|(field, f)| {
        let scale = at.normalise.iter().find(|scale| scale.field == field);
        let [lo, hi] = scale.map_or([f.low, f.high], |scale| [scale.low, scale.high]);
        if lo.is_finite() && hi.is_finite() {
            return Ok(Dim { field, lo, hi, n: order });
        }
        Err(Diagnostic::error(format!(
            "`{}` of {} goes from {lo} to {hi}: the Fourier basis needs a finite range",
            f.name, at.spec.id
        ))
        .hint(format!("name the fields: fourier(#{{ order: {order}, {}: [lo, hi], .. }})", f.name)))
    });
    ranges.collect()
}

/// Tilings that are offset alike along a field: there they tell states apart no better than one.
fn alike(features: &FeatureSpec, schema: &Schema) -> Option<Diagnostic> {
    let FeatureKind::Tiles(tilings) = features.kind else { return None };
    let different = |j: usize| tilings / gcd(tilings, 2 * j + 1);
    let (j, d) = features.dims.iter().enumerate().find(|(j, _)| different(*j) < tilings)?;
    Some(
        Diagnostic::warning(format!(
            "of {tilings} tilings only {} differ along `{}`",
            different(j),
            schema.fields[d.field].name
        ))
        .note(format!("along this field tilings are offset by {} parts of a tile", 2 * j + 1))
        .hint(
            "take a power of two, at least four times the number of fields \
             (Sutton & Barto 9.5.4)",
        ),
    )
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}
