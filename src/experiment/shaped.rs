//! Puts a variant's shaping together: its potential, and an agent that takes advice or is shaped by
//! its own values.

use super::assemble::{of_action, representative};
use crate::learn::registry::{BuildFn, Setup};
use crate::learn::{AnyAgent, Bootstrapped, LookBack, QTable};
use crate::mdp::{Env, Schema};
use crate::script::{AdviceOn, DiscretiserSpec, Host, PhiOn, Variant};
use crate::shaping::{
    AnyPotential, CellPotential, EpisodePotential, Fault, NoPotential, PhiFn, RawPotential,
};

/// Φ of a state's fields in an episode, as `variant` means it, the shift included; `None` without a
/// potential. What an agent learns itself is not in it.
pub(super) fn phi(host: &Host, variant: &Variant, schema: &Schema) -> Option<PhiFn> {
    let shift = variant.shaping.shift;
    let Some(callback) = &variant.potential else {
        return (shift != 0.0).then(|| PhiFn::new(move |_, _| Ok(shift)));
    };
    Some(host.callbacks().potential(callback, schema).shifted(shift))
}

/// How a variant's potential is evaluated: on the states themselves, on bin centres, or raw.
pub(super) fn potential<E: Env + Clone + 'static>(
    host: &Host,
    variant: &Variant,
    env: &E,
    n_cells: usize,
) -> Result<AnyPotential, Fault> {
    if variant.potential.is_none() && variant.shaping.shift != 0.0 {
        // The same wherever it is evaluated, be there a representative or not.
        let shift = variant.shaping.shift;
        return Ok(AnyPotential::Cell(CellPotential::new(n_cells, Box::new(move |_| Ok(shift)))));
    }
    let schema = env.schema();
    let Some(mut phi) = phi(host, variant, &schema) else {
        return Ok(AnyPotential::No(NoPotential));
    };
    let n_fields = schema.fields.len();
    let fields_of = match variant.potential_on {
        PhiOn::Raw if !matches!(variant.discretiser, DiscretiserSpec::StateIndex) => None,
        _ => representative(variant, env),
    };
    let Some(fields_of) = fields_of else {
        return Ok(AnyPotential::Raw(RawPotential::new(n_fields, phi)));
    };
    let mut at = move |cell: usize, episode| phi.at(&fields_of(cell)[..n_fields], episode);
    if variant.is_dynamic() {
        return Ok(AnyPotential::Episode(EpisodePotential::new(n_cells, Box::new(at))));
    }
    let potential = if let DiscretiserSpec::StateIndex = variant.discretiser {
        // Reachable states at once, so that a mistake shows before training; the others, which may
        // be junk, never. Without a model nobody knows which those are.
        let reachable = env.finite().map(|mdp| mdp.reachable()).unwrap_or_default();
        let mut table = vec![f64::NAN; n_cells];
        for (index, _) in reachable.iter().enumerate().filter(|(_, r)| **r) {
            table[index] = at(index, 1)?;
        }
        CellPotential::partial(table, Box::new(move |cell| at(cell, 1)))
    } else {
        CellPotential::new(n_cells, Box::new(move |cell| at(cell, 1)))
    };
    Ok(AnyPotential::Cell(potential))
}

/// The learner that `build` makes, with the variant's advice, or shaped by its own values.
pub(super) fn learner<E: Env + Clone + 'static>(
    host: &Host,
    variant: &Variant,
    env: &E,
    build: BuildFn,
    setup: Setup,
) -> Result<AnyAgent, Fault> {
    let config = &variant.agent;
    if let Some(eta) = variant.shaping.learned {
        let agent = build(config, setup).boxed();
        return Ok(AnyAgent::tabular(Bootstrapped::new(agent, eta)));
    }
    let Some(advice) = &variant.shaping.advice else { return Ok(build(config, setup)) };
    let phi = of_action(host, variant, env, setup.n_states, advice, "the advice")?;
    let phi = QTable::from_values(setup.n_actions, phi);
    Ok(match variant.shaping.advice_on {
        AdviceOn::LookAhead => {
            let agent = config.spec.advised(config, setup, phi);
            agent.expect("checked when the plan was resolved")
        }
        AdviceOn::LookBack => AnyAgent::tabular(LookBack::new(build(config, setup).boxed(), phi)),
    })
}
