//! A small, reviewable text that pins down what a script learns: per variant the greedy action
//! sets, returns at a few checkpoints, and on finite environments the exact check.

use std::fmt::Write;
use std::sync::atomic::AtomicBool;

use sha2::{Digest, Sha256};

use super::assemble::middle;
use super::audit::{Audit, audit_variant};
use super::hex;
use super::landscape::features;
use super::record::{StateValues, UnitRecord};
use super::unit::{UnitError, run_unit};
use crate::env::EnvVisitor;
use crate::learn::{LinearQ, QTable, greedy_sets};
use crate::mdp::{Env, Grid, Schema};
use crate::script::{Diagnostic, DiscretiserSpec, Host, Plan, SeedList, Variant};
use crate::shaping::{Bins, Dim};
use crate::stats::rolling_mean;

/// What a golden run plays at most, unless the script says otherwise.
const EPISODES: u32 = 200;
const SEEDS: u32 = 2;
/// Checkpoints of the learning curve.
const CHECKPOINTS: [u32; 4] = [25, 50, 75, 100];

/// Runs `plan` within its golden budget and describes what was learned.
///
/// # Errors
/// If a callback fails.
pub fn text(plan: &Plan) -> Result<String, Diagnostic> {
    let host = Host::open(plan)?;
    let mut out = format!("study {}\n", plan.name);
    for variant in &plan.variants {
        let episodes = plan.golden.episodes.unwrap_or(EPISODES).min(variant.episodes);
        let n_seeds = plan.golden.seeds.unwrap_or(SEEDS).min(variant.seeds.0.len() as u32);
        let seeds = SeedList(variant.seeds.0[..n_seeds as usize].to_vec());
        let variant = Variant { episodes, seeds, ..variant.clone() };
        describe(&host, &variant, &mut out)?;
    }
    Ok(out)
}

const MEMORY: &str = "writing to a string does not fail";

fn describe(host: &Host, variant: &Variant, out: &mut String) -> Result<(), Diagnostic> {
    let params: Vec<String> = variant.agent.in_effect().map(|(k, v)| format!("{k}: {v}")).collect();
    writeln!(out, "\nvariant {}", variant.name).expect(MEMORY);
    let kwargs = serde_json::Value::Object(variant.config.kwargs.clone());
    writeln!(out, "  env {} {kwargs}", variant.env.id).expect(MEMORY);
    for line in variant.setting() {
        writeln!(out, "  {line}").expect(MEMORY);
    }
    writeln!(out, "  agent {}({})", variant.agent.spec.name, params.join(", ")).expect(MEMORY);
    if let DiscretiserSpec::Features(features) = &variant.discretiser {
        writeln!(out, "  features {features}").expect(MEMORY);
    }
    if let Some(threshold) = variant.stops_at() {
        let window = variant.window;
        writeln!(out, "  stops at a mean return of {threshold} over {window} episodes")
            .expect(MEMORY);
    }
    let audit = audit_variant(host, variant, None)?;
    exact(&audit, out);
    let look = look(variant)?;
    for (i, &seed) in variant.seeds.0.iter().enumerate() {
        let record = match run_unit(host, variant, seed, &AtomicBool::new(false), &mut |_| {}) {
            Ok(record) => record,
            Err(UnitError::Script(d) | UnitError::Diverged(d, _)) => return Err(*d),
            Err(UnitError::Interrupted | UnitError::Store(_)) => {
                unreachable!("nothing raises the flag, nothing is written")
            }
        };
        writeln!(out, "  seed {seed}").expect(MEMORY);
        returns(variant, &record, out);
        if let (Some(weights), Some(features)) = (&record.weights, features(variant)) {
            linear(&LinearQ::from_weights(features, weights.clone()), variant, &look, i == 0, out);
        }
        network(&record, out);
        if let Some(values) = &record.values {
            state_values(&record, values, out);
        }
        if let Some(q) = &record.q {
            let sets = greedy_sets(q);
            writeln!(out, "    greedy sets {} of {} states", digest(&sets), sets.len())
                .expect(MEMORY);
            if let Some(grid) = &look.schema.grid {
                draw_grid(grid, q, &sets, out);
            } else if let (0, DiscretiserSpec::Bins(dims)) = (i, &variant.discretiser) {
                draw_bins(dims, &look.schema, q, &sets, out);
            }
        }
    }
    Ok(())
}

fn exact(audit: &Audit, out: &mut String) {
    writeln!(out, "  shaping {}: {}", audit.label(), audit.basis).expect(MEMORY);
    if let Some(exact) = audit.preservation() {
        let holds = if exact.identity_holds() { "holds" } else { "does not hold" };
        writeln!(
            out,
            "  exact check: Q_F + Φ = Q {holds}; {}",
            match exact.states_changed.as_slice() {
                [] => "the greedy sets are equal in every reachable state".to_string(),
                states => format!("the greedy sets differ in states {states:?}"),
            }
        )
        .expect(MEMORY);
    }
}

fn returns(variant: &Variant, record: &UnitRecord, out: &mut String) {
    let native: Vec<f64> = record.rows.iter().map(|r| r.native).collect();
    let rolling = rolling_mean(&native, variant.window as usize);
    let points = CHECKPOINTS.map(|percent| {
        let episode = (rolling.len() * percent as usize / 100).max(1);
        format!("{:.4} after {episode}", rolling[episode - 1])
    });
    writeln!(out, "    return {}", points.join(", ")).expect(MEMORY);
    writeln!(out, "    steps {}", record.steps()).expect(MEMORY);
}

/// What a predictor learned: its error, where it is known, and a digest of the values.
fn state_values(record: &UnitRecord, values: &StateValues, out: &mut String) {
    if let Some(error) = record.rows.last().and_then(|row| row.value_error) {
        writeln!(out, "    value error {error:.6}").expect(MEMORY);
    }
    let mut hash = Sha256::new();
    values.v.iter().for_each(|v| hash.update(v.to_bits().to_le_bytes()));
    let digest = hex(&hash.finalize()[..8]);
    writeln!(out, "    values {digest} of {} states", values.v.len()).expect(MEMORY);
}

/// Pins every set without listing them all.
fn digest(sets: &[Vec<usize>]) -> String {
    hex(&Sha256::digest(format!("{sets:?}").as_bytes())[..8])
}

/// Every bit of the network that was learned, which is the same on every machine, and where its
/// training ended.
fn network(record: &UnitRecord, out: &mut String) {
    let Some(last) = record.networks.first() else { return };
    let bits = last.net.params().iter().flat_map(|w| w.to_bits().to_le_bytes());
    let bits: Vec<u8> = bits.collect();
    writeln!(out, "    network {}", hex(&Sha256::digest(&bits)[..8])).expect(MEMORY);
    if let Some((row, loss)) = record.log.last().and_then(|row| Some((row, row.loss?))) {
        let (step, updates) = (row.step, row.updates);
        writeln!(out, "    loss {loss:.6e} after {step} steps, {updates} updates").expect(MEMORY);
    }
}

/// What is needed of the environment to draw.
struct Look {
    schema: Schema,
}

fn look(variant: &Variant) -> Result<Look, Diagnostic> {
    struct Ask;
    impl EnvVisitor for Ask {
        type Out = Schema;
        fn visit<E: Env + Clone + 'static>(self, env: E) -> Schema {
            env.schema()
        }
    }
    let env = variant.environment().map_err(|e| Diagnostic::error(e.message).maybe_hint(e.hint))?;
    Ok(Look { schema: env.visit(Ask) })
}

/// Places of the lattice on which linear values are pinned down, by the number of their fields.
const LATTICE: [usize; 7] = [1, 64, 40, 12, 8, 5, 4];

/// The greedy actions of linear values at the centres of a lattice of bins over the fields' ranges.
fn linear(values: &LinearQ, variant: &Variant, look: &Look, draw: bool, out: &mut String) {
    let DiscretiserSpec::Features(spec) = &variant.discretiser else { return };
    let n = LATTICE.get(spec.dims.len()).copied().unwrap_or(2);
    let dims: Vec<Dim> = spec.dims.iter().map(|d| Dim { n, ..*d }).collect();
    let bins = Bins::new(&dims).expect("the ranges have been checked");
    let state = |cell: usize| {
        let mut fields = middle(&look.schema).to_vec();
        bins.centre(cell, &mut fields);
        fields
    };
    let states: Vec<Vec<f64>> = (0..bins.n_cells()).map(state).collect();
    let q = values.table(&states);
    let sets = greedy_sets(&q);
    writeln!(out, "    greedy sets {} of {} places", digest(&sets), sets.len()).expect(MEMORY);
    if draw {
        draw_bins(&dims, &look.schema, &q, &sets, out);
    }
}

/// Whether nothing was learned in `cell` that would prefer an action.
fn is_flat(q: &QTable, cell: usize) -> bool {
    let row = q.row(cell);
    row.iter().all(|v| *v == row[0])
}

/// The map: each cell its tile and, where something was learned, the arrows of its greedy set.
fn draw_grid(grid: &Grid, q: &QTable, sets: &[Vec<usize>], out: &mut String) {
    let cols = grid.rows.first().map_or(0, |r| r.chars().count());
    for (r, row) in grid.rows.iter().enumerate() {
        let cells = row.chars().enumerate().map(|(c, tile)| {
            let state = r * cols + c;
            let set = &sets[state];
            let arrows: String = if matches!(tile, 'H' | 'G') || is_flat(q, state) {
                String::new()
            } else {
                set.iter().map(|&a| grid.arrows[a]).collect()
            };
            format!("{tile}{arrows:<width$}", width = grid.arrows.len())
        });
        writeln!(out, "    {}", cells.collect::<Vec<_>>().join(" ").trim_end()).expect(MEMORY);
    }
}

/// The last two binned fields as a map, the others in those bins where the most was learned; a
/// digit where one action is greedy, `*` where several are, `.` where nothing was learned.
fn draw_bins(dims: &[Dim], schema: &Schema, q: &QTable, sets: &[Vec<usize>], out: &mut String) {
    let (rows, cols) = match dims {
        [.., a, b] => (Some(a), b),
        [b] => (None, b),
        [] => return,
    };
    let fixed = &dims[..dims.len().saturating_sub(2)];
    let n_rows = rows.map_or(1, |d| d.n);
    let size = n_rows * cols.n;
    let slices: usize = fixed.iter().map(|d| d.n).product();
    let learned =
        |slice: usize| (slice * size..(slice + 1) * size).filter(|&cell| !is_flat(q, cell)).count();
    // The first of those with the most.
    let best = (0..slices).max_by_key(|&slice| (learned(slice), std::cmp::Reverse(slice)));
    let base = best.unwrap_or(0);
    let name = |d: &Dim| schema.fields[d.field].name;
    let down = rows.map_or(String::new(), |d| format!(" (down) against {}", name(d)));
    let mut rest = base;
    let mut at: Vec<String> = Vec::new();
    for d in fixed.iter().rev() {
        at.push(format!("{} in bin {} of {}", name(d), rest % d.n + 1, d.n));
        rest /= d.n;
    }
    at.reverse();
    let at = if at.is_empty() { String::new() } else { format!(", {}", at.join(", ")) };
    writeln!(out, "    greedy action by {}{down}{at}:", name(cols)).expect(MEMORY);
    for r in 0..n_rows {
        let line: String = (0..cols.n)
            .map(|c| {
                let cell = (base * n_rows + r) * cols.n + c;
                match sets[cell].as_slice() {
                    _ if is_flat(q, cell) => '.',
                    [a] => char::from_digit(*a as u32, 36).unwrap_or('?'),
                    _ => '*',
                }
            })
            .collect();
        writeln!(out, "    {line}").expect(MEMORY);
    }
}
