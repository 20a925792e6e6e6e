//! What an experiment says about its world: environment, actions, bins.

use super::diagnostic::{Diagnostic, suggest};
use super::draft::{BinDraft, DiscretiserDraft, ExperimentDraft, Located};
use super::resolve::Resolver;
use super::setting::ActionsDraft;
use crate::env::{self, AnyEnv, EnvConfig, EnvError, EnvSpec};
use crate::learn::Signature;
use crate::mdp::Schema;
use crate::shaping::{Bins, Dim, Scale};

impl Resolver<'_> {
    /// The experiment's environment: what is registered, how it is set up, and an instance. What
    /// there is to say about its id goes to `warnings`.
    pub(super) fn environment(
        &self,
        draft: &ExperimentDraft,
        warnings: &mut Vec<Diagnostic>,
    ) -> Result<Option<(&'static EnvSpec, EnvConfig, AnyEnv)>, Diagnostic> {
        let Some(env) = &draft.env else { return Ok(None) };
        let failed = |e| env_error(draft, e);
        let (spec, note) = env::find_with_note(&env.value.id).map_err(failed)?;
        // Variants that inherit their environment say it once.
        let note = note.map(|note| Diagnostic::warning(note).at(env.spot.place()));
        warnings.extend(note.filter(|note| !warnings.contains(note)));
        let config = EnvConfig {
            kwargs: spec.resolve_kwargs(&env.value.kwargs.values).map_err(failed)?,
            attributes: draft.setting.attributes.values.clone(),
            reset_options: draft.setting.reset_options.values.clone(),
            actions: draft.setting.actions.as_ref().map(|a| self.actions(a)).transpose()?,
        };
        let any = spec.build(&config).map_err(failed)?;
        Ok(Some((spec, config, any)))
    }

    /// The real-valued actions to choose among, `[action][component]`.
    fn actions(&self, actions: &Located<ActionsDraft>) -> Result<Vec<Vec<f64>>, Diagnostic> {
        match &actions.value {
            ActionsDraft::Rows(rows) => Ok(rows.clone()),
            ActionsDraft::Scripted(n, action) => {
                let action = Located { value: action.clone(), spot: actions.spot.clone() };
                let action =
                    self.callback(&action, Signature { text: "(i) -> [numbers]", arities: &[1] })?;
                (0..*n).map(|i| self.host.action(&action, i)).collect()
            }
        }
    }
}

/// Bins of a normalised field that go far beyond what it is normalised to: they seem to be in
/// physical units.
pub(super) fn physical_bins(
    draft: &ExperimentDraft,
    schema: &Schema,
    normalise: &[Scale],
) -> Option<Diagnostic> {
    let discretiser = &draft.discretiser.as_ref()?.value;
    let what = match discretiser {
        DiscretiserDraft::Features(_) => "features",
        _ => "bins",
    };
    let field = |bin: &BinDraft| match &bin.field {
        Ok(name) => schema.fields.iter().position(|f| f.name == name),
        Err(i) => Some(*i),
    };
    let far = |bin: &&BinDraft| {
        let is_normalised = field(bin).is_some_and(|f| normalise.iter().any(|s| s.field == f));
        is_normalised && bin.lo.abs().max(bin.hi.abs()) > 2.0
    };
    let bin = discretiser.ranges().iter().find(far)?;
    Some(
        Diagnostic::warning("the discretiser sees a normalised field from -1 to 1")
            .at(bin.spot.place())
            .note(format!(
                "these {what} go from {} to {}: nearly all of them stay empty",
                bin.lo, bin.hi
            )),
    )
}

pub(super) fn clipping_warning(clip: &Located<[f64; 2]>) -> Diagnostic {
    Diagnostic::warning("clipping changes the reward: no potential can undo that")
        .at(clip.spot.place())
        .note("what is optimal for the clipped reward may not be for the environment's")
        .hint("`reward: |t| c * t.reward` keeps the optimal policy for every c > 0")
}

fn env_error(draft: &ExperimentDraft, error: EnvError) -> Diagnostic {
    let env = draft.env.as_ref();
    let place = error.key.as_ref().and_then(|key| {
        let entries = [
            env.map(|env| &env.value.kwargs),
            Some(&draft.setting.attributes),
            Some(&draft.setting.reset_options),
        ];
        let entry = entries.into_iter().flatten().find_map(|entries| entries.spots.get(key));
        let actions = draft.setting.actions.as_ref().filter(|_| key == "actions");
        entry.or(actions.map(|a| &a.spot)).and_then(super::draft::Spot::place)
    });
    let place = place.or_else(|| env.and_then(|env| env.spot.place()));
    Diagnostic::error(error.message).at(place).maybe_hint(error.hint)
}

/// The field that `range`, called a `what` in messages, speaks of.
pub(super) fn field_of(
    range: &BinDraft,
    schema: &Schema,
    spec: &EnvSpec,
    what: &str,
) -> Result<usize, Diagnostic> {
    let at = |d: Diagnostic| d.at(range.spot.place());
    let n_fields = schema.fields.len();
    match &range.field {
        Ok(name) => schema.fields.iter().position(|f| f.name == name).ok_or_else(|| {
            let names: Vec<&str> = schema.fields.iter().map(|f| f.name).collect();
            at(Diagnostic::error(format!("the state of {} has no field `{name}`", spec.id)))
                .maybe_hint(suggest(name, names))
        }),
        Err(i) if *i < n_fields => Ok(*i),
        Err(i) => Err(at(Diagnostic::error(format!(
            "{what} number {} is one too many: the state of {} has {n_fields} fields",
            i + 1,
            spec.id
        )))),
    }
}

/// The bins with their fields found and their edges in physical units.
pub(super) fn dims(
    bins: &[BinDraft],
    schema: &Schema,
    normalise: &[Scale],
    spec: &EnvSpec,
) -> Result<Vec<Dim>, Diagnostic> {
    let mut dims = Vec::with_capacity(bins.len());
    for bin in bins {
        let field = field_of(bin, schema, spec, "bin")?;
        let scale = normalise.iter().find(|scale| scale.field == field);
        let [lo, hi] = [bin.lo, bin.hi].map(|x| scale.map_or(x, |scale| scale.physical(x)));
        dims.push(Dim { field, lo, hi, n: bin.n });
    }
    // In the order of the state's fields, whichever way they were written.
    dims.sort_by_key(|d| d.field);
    Bins::new(&dims).map_err(|e| Diagnostic::error(e.message))?;
    Ok(dims)
}

/// Bins to suggest.
pub(super) fn example_bins(spec: &EnvSpec) -> String {
    format!("bins(#{{ {} }})", spec.example.bins)
}
