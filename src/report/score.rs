//! The potentials of a study, ranked before training, and how that ranking compares with what
//! training showed.

use std::fmt::Write;

use serde_json::{Value, json};

use super::audit::short;
use super::table::width;
use crate::audit::spearman;
use crate::experiment::Scored;
use crate::script::{Plan, Variant};

/// A variant's scores, or why there are none.
pub type Outcome = Result<Scored, String>;

/// Variants that are scored on the same task, the best first, by their places in the plan.
fn groups(plan: &Plan, outcomes: &[Outcome]) -> Vec<Vec<usize>> {
    let task = |v: &Variant| {
        let identity = v.identity();
        let keys = [
            "env",
            "kwargs",
            "attributes",
            "reset_options",
            "actions",
            "frame_skip",
            "discretiser",
            "allowed",
        ];
        let setting: Vec<Value> = keys.iter().map(|key| identity[*key].clone()).collect();
        (setting, v.agent.float("gamma").to_bits())
    };
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for i in (0..plan.variants.len()).filter(|&i| outcomes[i].is_ok()) {
        let own = task(&plan.variants[i]);
        match groups.iter_mut().find(|group| task(&plan.variants[group[0]]) == own) {
            Some(group) => group.push(i),
            None => groups.push(vec![i]),
        }
    }
    let vi_auc = |i: usize| outcomes[i].as_ref().map_or(f64::NAN, |s| s.score.vi_value);
    for group in &mut groups {
        group.sort_by(|&a, &b| vi_auc(b).total_cmp(&vi_auc(a)).then(a.cmp(&b)));
    }
    groups
}

const HEADER: [&str; 9] = [
    "potential",
    "VI-AUC",
    "sweeps",
    "mean |V*-Φ|",
    "sup |V*-Φ|",
    "agreement",
    "rank",
    "bad ends paid",
    "shift",
];

/// The tables, one for each task, and notes.
pub fn score_text(plan: &Plan, outcomes: &[Outcome], trained: Option<&Value>) -> String {
    let mut text = String::new();
    for group in groups(plan, outcomes) {
        let first = &plan.variants[group[0]];
        let Ok(scored) = &outcomes[group[0]] else { continue };
        let model = scored.samples.map_or(String::new(), |n| {
            format!(", on a model of {n} samples per cell (about that model only)")
        });
        let _ = writeln!(
            text,
            "{}, gamma {}{model}: an optimal policy earns {}, random actions {}",
            first.env.id,
            first.agent.float("gamma"),
            short(scored.optimal),
            short(scored.random)
        );
        let mut rows: Vec<Vec<String>> = vec![HEADER.map(str::to_string).to_vec()];
        rows.extend(group.iter().filter_map(|&i| {
            outcomes[i].as_ref().ok().map(|scored| row(&plan.variants[i].name, scored))
        }));
        text += &aligned(&rows);
        if let Some(note) = trained.and_then(|t| agreement(plan, outcomes, &group, t)) {
            let _ = writeln!(text, "{note}");
        }
        text.push('\n');
    }
    for (variant, outcome) in plan.variants.iter().zip(outcomes) {
        if let Err(why) = outcome {
            let _ = writeln!(text, "{}: not scored, {why}", variant.name);
        }
    }
    text
}

fn row(name: &str, scored: &Scored) -> Vec<String> {
    let score = &scored.score;
    let maybe = |x: Option<f64>| x.map_or("-".into(), |x| format!("{x:.3}"));
    let death = match score.death.bad_ends {
        0 => "-".into(),
        n => format!("{}/{n}", score.death.paid),
    };
    let shift = scored.shift.as_ref().map_or("-".into(), |shift| match shift.suggested {
        0.0 => "0".into(),
        b if b > 0.0 => format!("+{}", short(b)),
        b => short(b),
    });
    vec![
        name.to_string(),
        maybe(score.vi_auc),
        score.sweeps.map_or("-".into(), |n| n.to_string()),
        short(score.mean_error),
        short(score.largest_error),
        format!("{:.3}", score.agreement),
        maybe(score.rank_correlation),
        death,
        shift,
    ]
}

/// Columns, the first to the left, the others to the right.
fn aligned(rows: &[Vec<String>]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let widths: Vec<usize> =
        (0..columns).map(|c| rows.iter().map(|row| width(&row[c])).max().unwrap_or(0)).collect();
    let mut text = String::new();
    for row in rows {
        let mut line = String::new();
        for (c, cell) in row.iter().enumerate() {
            let space = " ".repeat(widths[c] - width(cell));
            let (before, after) = if c == 0 { ("", space) } else { (&*space, String::new()) };
            let _ = write!(line, "  {before}{cell}{after}");
        }
        text += line.trim_end();
        text.push('\n');
    }
    text
}

/// How the ranking by VI-AUC compares with the areas under the learning curves, where the variants
/// of `group` have some: `trained` is a study's `summary.json`.
fn agreement(
    plan: &Plan,
    outcomes: &[Outcome],
    group: &[usize],
    trained: &Value,
) -> Option<String> {
    let summaries = trained["variants"].as_array()?;
    let auc = |name: &str| {
        summaries.iter().find(|s| s["name"] == name).and_then(|s| s["auc"]["mean"].as_f64())
    };
    // Learning curves speak of potentials only where the learner is the same.
    let learner = |&i: &usize| {
        let identity = plan.variants[i].identity();
        [identity["agent"].clone(), identity["params"].clone()]
    };
    let alike = |i: &usize| group.iter().filter(|&j| learner(i) == learner(j)).count();
    let most = group.iter().max_by_key(|i| (alike(i), std::cmp::Reverse(**i)))?;
    let own = learner(most);
    let pairs: Vec<(f64, f64)> = group
        .iter()
        .filter(|i| learner(i) == own)
        .filter_map(|&i| {
            let scored = outcomes[i].as_ref().ok()?;
            Some((scored.score.vi_value, auc(&plan.variants[i].name)?))
        })
        .collect();
    if pairs.len() < 3 {
        return None;
    }
    let (scores, areas): (Vec<f64>, Vec<f64>) = pairs.into_iter().unzip();
    let Some(correlation) = spearman(&scores, &areas, 1e-9) else {
        return Some(
            "  training does not tell them apart: the areas under the curves are equal".into(),
        );
    };
    Some(format!(
        "  training ranked {} of them with a correlation of {correlation:.2} (Spearman, VI-AUC \
         against the mean area under the learning curve)",
        scores.len()
    ))
}

/// The same for programs.
pub fn score_json(plan: &Plan, outcomes: &[Outcome]) -> Value {
    let groups = groups(plan, outcomes);
    let variants: Vec<Value> = plan
        .variants
        .iter()
        .zip(outcomes)
        .enumerate()
        .map(|(i, (variant, outcome))| match outcome {
            Ok(scored) => {
                let group = groups.iter().position(|group| group.contains(&i));
                let rank = group.and_then(|g| groups[g].iter().position(|&j| j == i));
                json!({
                    "name": variant.name,
                    "task": group,
                    "rank": rank.map(|r| r + 1),
                    "score": scored.score,
                    "shift": scored.shift,
                    "optimal": scored.optimal,
                    "random": scored.random,
                    "samples": scored.samples,
                })
            }
            Err(why) => json!({ "name": variant.name, "score": null, "why": why }),
        })
        .collect();
    json!({ "study": plan.name, "variants": variants })
}
