//! Any bytes as a script: parsed, run, resolved; then compiled once more, its callbacks lowered.

#![no_main]

use libfuzzer_sys::fuzz_target;
use runner::experiment::tiers;
use runner::script::Host;

fuzz_target!(|text: &[u8]| {
    let Ok(plan) = runner_fuzz::load_text(text) else { return };
    let Ok(host) = Host::open(&plan) else { return };
    for variant in &plan.variants {
        let _ = tiers(&host, variant);
    }
});
