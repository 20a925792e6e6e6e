//! `study.json`: what was run (identity, the same for equal runs) apart from where and when
//! (circumstance).

use serde_json::{Value, json};

use crate::experiment::{SEMANTICS, units};
use crate::script::{Plan, Source};

/// Version of the results folder's layout.
pub const SCHEMA: u32 = 1;

/// Where and when a study was run. The only place that looks at the clock.
pub fn circumstance(jobs: usize) -> Value {
    #[expect(clippy::disallowed_methods, reason = "the circumstance is the one place for a date")]
    let now = std::time::SystemTime::now();
    let seconds = now.duration_since(std::time::UNIX_EPOCH).map_or(0, |d| d.as_secs());
    json!({
        "unix_time": seconds,
        "os": std::env::consts::OS,
        "arch": std::env::consts::ARCH,
        "jobs": jobs,
        "cores": std::thread::available_parallelism().map_or(0, std::num::NonZero::get),
    })
}

/// A script's name without its folder: where it lies does not change what it does.
pub(super) fn file_name(source: &Source) -> &str {
    source.name.rsplit(['/', '\\']).next().unwrap_or(&source.name)
}

fn source(source: &Source) -> Value {
    json!({ "name": file_name(source), "sha256": source.sha256() })
}

/// The manifest of `plan`.
pub fn manifest(plan: &Plan, jobs: usize) -> Value {
    let imports: serde_json::Map<String, Value> = plan
        .sources
        .imports
        .iter()
        .map(|(path, s)| (path.clone(), json!({ "sha256": s.sha256() })))
        .collect();
    let hashes = units(plan);
    let variants: Vec<Value> = plan
        .variants
        .iter()
        .enumerate()
        .map(|(i, v)| {
            json!({
                "name": v.name,
                "identity": v.identity(),
                "seeds": v.seeds,
                "window": v.window,
                "threshold": v.threshold,
                "notes": v.notes,
                "units": hashes.iter().filter(|u| u.variant == i).map(|u| &u.hash)
                    .collect::<Vec<_>>(),
            })
        })
        .collect();
    json!({
        "schema": SCHEMA,
        "study": plan.name,
        "identity": {
            "runner": env!("CARGO_PKG_VERSION"),
            "semantics": SEMANTICS,
            "generators": {
                "environment": "NumPy SeedSequence + PCG64",
                "agent": "SHA-256(seed, purpose) + xoshiro256++",
            },
            "script": source(&plan.sources.script),
            "imports": imports,
            "baseline": plan.baseline,
            "notes": plan.notes,
            "variants": variants,
        },
        "circumstance": circumstance(jobs),
    })
}
