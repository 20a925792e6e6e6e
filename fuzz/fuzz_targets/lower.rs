//! Any text as the body of a callback: as machine code and interpreted, it must give the same.

#![no_main]

use std::fmt::Debug;

use libfuzzer_sys::{Corpus, fuzz_target};
use runner::mdp::{Field, FieldKind, Schema};
use runner::script::{DiscretiserSpec, Host, Tier, Variant};
use runner::shaping::Fault;

/// What a body stands in: a number, a truth value and a cell of float states, then of integer ones.
/// Diagnostics speak of the first line of a function, which is the same for every body.
fn script(body: &str) -> String {
    format!(
        "const MAXI = 9223372036854775807;
const FLOATS = [0.5, -1.5, 1e300, -0.0];
const INTS = [3, -1, 0, 9223372036854775807, 2];
fn h(x) {{ if x > 0 {{ x * 2 }} else {{ -x }} }}
fn p(s, a) {{
{body}
}}
fn c(s) {{
let a = 1;
{body}
}}
let agent = q_learning(#{{ alpha: 0.1, gamma: 0.9, epsilon: 0.1 }});
let pole = experiment(#{{
    name: \"number\", env: \"CartPole-v1\", agent: agent, discretiser: bins(#{{ x: [-1.0, 1.0, 2] }}),
    episodes: 1, seeds: 1, potential: p, potential_on: \"raw\",
    allowed: p,
}});
let lake = experiment(#{{
    name: \"lake\", env: \"FrozenLake-v1\", agent: agent, episodes: 1, seeds: 1, potential: p, potential_on: \"raw\",
    allowed: p,
}});
[pole, pole.with(#{{ name: \"cells\", discretiser: cells(9, c) }}), lake,
    lake.with(#{{ name: \"lake cells\", discretiser: cells(9, c) }})]
"
    )
}

const FLOATS: [f64; 12] = [
    0.0,
    -0.0,
    0.5,
    -1.5,
    3.0,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    1e308,
    5e-324,
    9_223_372_036_854_775_808.0,
    -9_007_199_254_740_993.0,
];
const INTEGERS: [f64; 7] = [0.0, 1.0, 2.0, -1.0, 3.0, 9_007_199_254_740_992.0, -9e18];
const LETTERS: [char; 5] = ['S', 'F', 'H', 'G', 'é'];

/// The `k`th value of field number `i`.
fn number(field: &Field, i: usize, k: usize) -> f64 {
    let at = k * (2 * i + 1) + i;
    match field.kind {
        FieldKind::Float => FLOATS[at % FLOATS.len()],
        FieldKind::Int => INTEGERS[at % INTEGERS.len()],
        FieldKind::Letter => f64::from(u32::from(LETTERS[at % LETTERS.len()])),
    }
}

fn same<T: PartialEq + Debug>(
    what: &str,
    state: &[f64],
    native: Result<T, Fault>,
    script: Result<T, Fault>,
) {
    match (native, script) {
        (Ok(a), Ok(b)) => assert_eq!(a, b, "{what} of {state:?}, native and interpreted"),
        (Err(_), Err(_)) => {}
        (native, script) => {
            let error = native.as_ref().err().or(script.as_ref().err()).map(ToString::to_string);
            let error = error.unwrap_or_default();
            // Time and memory are not the same twice.
            let is_chance = error.contains("takes too") || error.contains("keeps memory");
            assert!(is_chance, "{what} of {state:?}: native {native:?}, interpreted {script:?}");
        }
    }
}

fn compare(host: &Host, variant: &Variant, schema: &Schema, n_actions: usize) {
    let functions = host.callbacks();
    let states: Vec<Vec<f64>> = (0..12)
        .map(|k| schema.fields.iter().enumerate().map(|(i, f)| number(f, i, k)).collect())
        .collect();
    for tiered in functions.tiers(variant, schema) {
        if matches!(tiered.tier, Tier::Interpreted(_)) {
            continue;
        }
        let callback = tiered.callback;
        match (tiered.key.as_str(), &variant.discretiser) {
            ("potential", _) => {
                let mut native = functions.potential(callback, schema);
                let mut script = functions.potential(callback, schema).with_kernel(None, false);
                for (episode, s) in (1..).zip(&states) {
                    let bits = |phi: Result<f64, Fault>| phi.map(f64::to_bits);
                    same("Φ", s, bits(native.at(s, episode)), bits(script.at(s, episode)));
                }
            }
            ("allowed", _) => {
                let mut native = functions.shield(callback, n_actions, schema);
                let mut script = functions.shield(callback, n_actions, schema).with_kernel(None, 0);
                for s in &states {
                    let bits =
                        |set: Result<runner::shaping::ActionSet, Fault>| set.map(|set| set.0);
                    same("the shield", s, bits(native.at(s)), bits(script.at(s)));
                }
            }
            ("discretiser", DiscretiserSpec::Cells { shape, .. }) => {
                let mut native = functions.cells(callback, shape, &[], schema);
                let mut script = functions.cells(callback, shape, &[], schema).with_kernel(None);
                for s in &states {
                    same("the cell", s, native.at(s), script.at(s));
                }
            }
            (key, _) => panic!("a callback that this script does not have: {key}"),
        }
    }
}

fuzz_target!(|body: &str| -> Corpus {
    // A body that does not parse, or ends its function and goes on, is for the other target.
    let Ok(plan) = runner_fuzz::load_text(script(body).as_bytes()) else { return Corpus::Reject };
    let Ok(host) = Host::open(&plan) else { return Corpus::Reject };
    for variant in &plan.variants {
        let Ok(env) = variant.environment() else { continue };
        compare(&host, variant, &env.schema(), env.n_actions());
    }
    Corpus::Keep
});
