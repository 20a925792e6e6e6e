//! The columns of `episodes.csv` and `summary.csv`.

use super::summary::{OverSeeds, VariantSummary};
use crate::experiment::{Audit, EpisodeRow, StartValue, Unit};
use crate::learn::AgentConfig;
use crate::script::Plan;

/// The columns of `episodes.csv` that only some studies have.
pub(super) struct EpisodeColumns<'a> {
    /// The names of extra terms.
    terms: Vec<&'a str>,
    /// Whether a variant predicts values.
    predicts: bool,
    /// Whether a variant learns a network.
    networks: bool,
}

impl<'a> EpisodeColumns<'a> {
    pub(super) fn of(plan: &'a Plan) -> Self {
        let any = |of: fn(&AgentConfig) -> bool| plan.variants.iter().any(|v| of(&v.agent));
        Self {
            terms: term_names(plan),
            predicts: any(AgentConfig::is_predictor),
            networks: any(AgentConfig::is_network),
        }
    }

    pub(super) fn header(&self) -> Vec<&'a str> {
        let mut header =
            vec!["variant", "seed", "episode", "steps", "return", "learned_return", "shaping"];
        header.extend(&self.terms);
        header.extend(["epsilon", "ending"]);
        header.extend(self.predicts.then_some("value_error"));
        header.extend(self.networks.then_some(["start_value", "start_return"]).iter().flatten());
        header
    }

    /// One line; episodes count from 1, what the variant does not have is empty.
    pub(super) fn line(
        &self,
        plan: &Plan,
        unit: &Unit,
        episode: usize,
        row: &EpisodeRow,
    ) -> Vec<String> {
        let variant = &plan.variants[unit.variant];
        let mut line = vec![
            variant.name.clone(),
            unit.seed.to_string(),
            (episode + 1).to_string(),
            row.steps.to_string(),
            float(row.native),
            float(row.learned),
            float(row.shaping),
        ];
        for term in &self.terms {
            let i = variant.terms.keys().position(|name| name == term);
            line.push(maybe(i.and_then(|i| row.terms.get(i)).copied()));
        }
        line.extend([float(row.epsilon), row.ending.as_str().to_string()]);
        if self.predicts {
            line.push(maybe(row.value_error));
        }
        if self.networks {
            let start = |of: fn(StartValue) -> f64| maybe(row.start.map(of));
            line.extend([start(|s| s.believed), start(|s| s.brought)]);
        }
        line
    }
}

fn term_names(plan: &Plan) -> Vec<&str> {
    let mut names: Vec<&str> =
        plan.variants.iter().flat_map(|v| v.terms.keys().map(String::as_str)).collect();
    names.sort_unstable();
    names.dedup();
    names
}

/// A float as the shortest text that reads back as the same float.
fn float(x: f64) -> String {
    format!("{x:?}")
}

fn maybe(x: Option<f64>) -> String {
    x.map_or_else(String::new, float)
}

/// The columns of `summary.csv` that every study has.
const SUMMARY_HEADER: [&str; 16] = [
    "variant",
    "seeds",
    "episodes",
    "window",
    "return_mean",
    "return_iqm",
    "return_low",
    "return_high",
    "auc_mean",
    "auc_iqm",
    "auc_low",
    "auc_high",
    "threshold",
    "solved_seeds",
    "median_episode_solved",
    "audit",
];

/// What a study's summaries may have beside: the beginning of the columns' names, and what is in them.
type More = (&'static str, fn(&VariantSummary) -> Option<&OverSeeds>);
const MORE: [More; 2] = [
    ("value_error", |s| s.value_error.as_ref()),
    ("overestimation", |s| s.overestimation.as_ref()),
];

/// The lines of `summary.csv`, its header first.
pub(super) fn summary_lines(summaries: &[VariantSummary], audits: &[Audit]) -> Vec<Vec<String>> {
    let there = |(_, of): &&More| summaries.iter().any(|s| of(s).is_some());
    let more: Vec<&More> = MORE.iter().filter(there).collect();
    let mut header = SUMMARY_HEADER.map(String::from).to_vec();
    for (name, _) in &more {
        header.extend(["mean", "iqm", "low", "high"].map(|of| format!("{name}_{of}")));
    }
    let mut lines = vec![header];
    for (s, audit) in summaries.iter().zip(audits) {
        let mut line = summary_line(s, audit);
        for (_, of) in &more {
            let x = of(s);
            line.extend([x.map(|x| x.mean), x.map(|x| x.iqm)].map(maybe));
            line.extend([x.and_then(|x| x.low), x.and_then(|x| x.high)].map(maybe));
        }
        lines.push(line);
    }
    lines
}

fn summary_line(s: &VariantSummary, audit: &Audit) -> Vec<String> {
    vec![
        s.name.clone(),
        s.seeds.to_string(),
        s.episodes.to_string(),
        s.window.to_string(),
        float(s.final_return.mean),
        float(s.final_return.iqm),
        maybe(s.final_return.low),
        maybe(s.final_return.high),
        float(s.auc.mean),
        float(s.auc.iqm),
        maybe(s.auc.low),
        maybe(s.auc.high),
        maybe(s.threshold),
        s.solved.as_ref().map_or(String::new(), |x| x.seeds.to_string()),
        maybe(s.solved.as_ref().and_then(|x| x.median_episode)),
        audit.verdict.as_str().to_string(),
    ]
}
