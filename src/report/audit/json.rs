//! Verdicts on shapings as JSON: `docs/audit.md` describes every field.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use crate::audit::{Certificate, Cycle, Walk};
use crate::experiment::{Audit, Exact};
use crate::script::{Plan, Variant};

/// The findings on a study's variants.
pub fn audit_json(plan: &Plan, variants: &[&Variant], audits: &[Audit]) -> Value {
    let list: Vec<Value> =
        variants.iter().zip(audits).map(|(variant, audit)| variant_json(variant, audit)).collect();
    json!({ "study": plan.name, "variants": list })
}

/// # Panics
/// Never: everything in an audit is plain data.
fn plain(value: impl serde::Serialize) -> Value {
    serde_json::to_value(value).expect("plain data")
}

fn variant_json(variant: &Variant, audit: &Audit) -> Value {
    let mut value = plain(audit);
    let exact = audit.exact.as_deref();
    let continuous = audit.continuous.as_deref();
    value["name"] = json!(variant.name);
    value["env"] = json!(variant.env.id);
    value["gamma"] = json!(variant.agent.float("gamma"));
    value["states"] = json!(exact.map(|e| e.states));
    value["certificate"] = json!(certificate(exact));
    value["transitions"] = plain(exact.and_then(|e| e.strict.as_ref()));
    value["expected"] = plain(exact.and_then(|e| e.expected.as_ref()));
    value["scaling"] = plain(exact.and_then(|e| e.scaling.as_ref()));
    value["starc"] = json!(exact.and_then(|e| e.starc));
    value["pattern"] = plain(exact.filter(|e| e.strict.is_some()).map(|e| e.pattern));
    value["changes"] = json!(exact.and_then(|e| {
        let compared = e.preservation.as_ref()?;
        let change = |&s: &usize| {
            json!({ "state": s, "plain": compared.plain[s], "shaped": compared.shaped[s] })
        };
        Some(compared.states_changed.iter().map(change).collect::<Vec<_>>())
    }));
    value["policy"] = plain(exact.and_then(|e| e.change.as_ref()));
    value["loop"] = match exact {
        Some(Exact { hacking: Some(hacking), .. }) => plain(hacking),
        Some(Exact { endless: Some(cycle), .. }) => json!({ "cycle": cycle }),
        _ => Value::Null,
    };
    value["counterexample"] = plain(exact.and_then(|e| e.broken_task.as_ref()));
    value["query"] = plain(continuous.and_then(|c| c.query.as_ref()));
    value["trajectories"] = plain(audit.pathwise());
    value["sampled_model"] = plain(continuous.and_then(|c| c.model.as_ref()));
    value["state_names"] = json!(names(exact));
    // Twice the same would invite the question which one counts.
    if let Some(transitions) = value["transitions"].as_object_mut() {
        transitions.remove("certificate");
    }
    value
}

/// The proof as the two ways that should be paid the same.
fn certificate(exact: Option<&Exact>) -> Option<Value> {
    exact?.strict.as_ref()?.certificate.as_ref().map(plain)
}

/// The loop that pays.
fn cycle(exact: &Exact) -> Option<&Cycle> {
    exact.hacking.as_ref().map(|hacking| &hacking.cycle).or(exact.endless.as_ref())
}

/// What the states are called that are mentioned by their index.
fn names(exact: Option<&Exact>) -> BTreeMap<usize, String> {
    let mut mentioned = Vec::new();
    let Some(exact) = exact else { return BTreeMap::new() };
    if let Some(compared) = &exact.preservation {
        mentioned.extend(&compared.states_changed);
    }
    if let Some(Certificate { direct, detour, .. }) =
        exact.strict.as_ref().and_then(|s| s.certificate.as_ref())
    {
        let states = |walk: &Walk| {
            walk.steps.iter().flat_map(|s| [s.state, s.next_state]).collect::<Vec<_>>()
        };
        mentioned.extend(states(direct));
        mentioned.extend(states(detour));
    }
    mentioned.extend(cycle(exact).map(|c| c.states.as_slice()).unwrap_or_default());
    mentioned.extend(exact.broken_task.as_ref().map(|task| task.start));
    mentioned.extend(exact.change.as_ref().map(|change| change.worst_state));
    mentioned.into_iter().map(|s| (s, exact.naming.state(s))).collect()
}
