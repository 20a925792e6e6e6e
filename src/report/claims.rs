//! The claims a study makes about its results (`.expect(text, |r| …)`).

use serde_json::{Map, Value};

use super::results::{Findings, variant_json};
use super::summary::{OverSeeds, VariantSummary, summarise};
use crate::experiment::{Audit, has_exact_values};
use crate::script::{Diagnostic, Host, Plan, Variant};

/// Evaluates every claim on the findings: its text, and whether it holds.
///
/// # Errors
/// If a claim cannot be evaluated.
pub fn judge(
    plan: &Plan,
    host: &Host,
    findings: &Findings,
) -> Result<Vec<(String, bool)>, Diagnostic> {
    let variants = findings.summaries.iter().zip(&findings.audits);
    evaluate(plan, host, variants.map(|(s, a)| (s.name.clone(), variant_json(s, a))).collect())
}

/// Evaluates every claim on made-up results, so that a misspelt statistic is found before an hour
/// of training and not after.
///
/// # Errors
/// If a claim cannot be evaluated.
pub fn rehearse(plan: &Plan) -> Result<(), Diagnostic> {
    if plan.expectations.is_empty() {
        return Ok(());
    }
    let host = Host::open(plan)?;
    let mut results = Map::new();
    for variant in &plan.variants {
        let returns = vec![vec![1.0]; variant.seeds.0.len()];
        let lengths = vec![vec![1]; variant.seeds.0.len()];
        let threshold = variant.threshold.map(|_| 1.0);
        let mut summary = summarise(&variant.name, &returns, &lengths, 1, 1, threshold);
        let made_up = || Some(OverSeeds::of(&vec![1.0; returns.len()]));
        summary.overestimation = made_up().filter(|_| variant.agent.is_network());
        if has_exact_values(&host, variant)? {
            summary = VariantSummary {
                value_error: made_up(),
                value_error_max: made_up(),
                value_error_auc: made_up(),
                ..summary
            };
        }
        results.insert(variant.name.clone(), variant_json(&summary, &Audit::made_up()));
    }
    evaluate(plan, &host, results).map(|_| ())
}

/// Evaluates the claims that speak of nothing but audits: their texts, and whether they hold.
/// `audits` are those of every variant, in order.
///
/// # Panics
/// Never: an audit is plain data.
pub fn judge_audits(plan: &Plan, host: &Host, audits: &[Audit]) -> Vec<(String, bool)> {
    let mut results = Map::new();
    for (variant, audit) in plan.variants.iter().zip(audits) {
        let audit = serde_json::to_value(audit).expect("plain data");
        results.insert(variant.name.clone(), serde_json::json!({ "audit": audit }));
    }
    let results = Value::Object(results);
    // Rehearsed before, a claim that cannot be evaluated now asks for what training would give.
    let held = |claim: &crate::script::Expectation| {
        let holds = host.callbacks().holds(&claim.check, &results).ok()?;
        Some((claim.text.clone(), holds))
    };
    plan.expectations.iter().filter_map(held).collect()
}

/// Variants that learn from a potential alone, and whose optimal policy changes nevertheless: what
/// each promises and does not keep.
pub fn broken_promises(variants: &[&Variant], audits: &[Audit]) -> Vec<String> {
    let pairs = variants.iter().zip(audits);
    let broken = pairs.filter(|(v, a)| !v.changes_reward() && a.policy_preserved == Some(false));
    broken
        .map(|(v, _)| {
            format!("{}: a potential should keep the optimal policy, it does not", v.name)
        })
        .collect()
}

fn evaluate(
    plan: &Plan,
    host: &Host,
    results: Map<String, Value>,
) -> Result<Vec<(String, bool)>, Diagnostic> {
    let results = Value::Object(results);
    let claims = plan.expectations.iter();
    claims
        .map(|claim| Ok((claim.text.clone(), host.callbacks().holds(&claim.check, &results)?)))
        .collect()
}
