//! `runner play RESULTS`

use std::path::PathBuf;

use clap::{Args as ClapArgs, ValueEnum};

use super::output::note;
use super::view::{View, ViewArgs};
use super::{Failure, Outcome};
use crate::env::Session;
use crate::env::rollout::{Event, Length};
use crate::experiment::play::{PlayedEpisode, Policy, play, session};
use crate::experiment::{Checkpoint, Unit, Values};
use crate::mdp::numpy::Seed;
use crate::report::stored::Stored;
use crate::script::Host;

/// Where the variant has no time limit, play stops after so many steps.
const ENDLESS: usize = 10_000;

#[derive(Debug, ClapArgs)]
pub(super) struct Args {
    /// The results folder
    results: PathBuf,
    /// The variant [default: the first]
    #[arg(long, value_name = "NAME")]
    variant: Option<String>,
    /// The training seed whose policy plays [default: the variant's first]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Seed of the first reset; the same for all policies unless you change it
    #[arg(long, value_name = "N", default_value = "0")]
    env_seed: String,
    /// Episodes to play; they go on with one random stream
    #[arg(long, value_name = "K", default_value_t = 1,
          value_parser = clap::value_parser!(u32).range(1..))]
    episodes: u32,
    /// Stop after so many steps in all [default: no limit but the variant's; 10000 without one]
    #[arg(long, value_name = "MAX", value_parser = clap::value_parser!(u64).range(1..))]
    steps: Option<u64>,
    /// Which of its networks plays, of agents that learn such [default: last]
    #[arg(long, value_enum)]
    model: Option<Which>,
    #[command(flatten)]
    view: ViewArgs,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Which {
    /// That of the end of training
    Last,
    /// That of the best returns
    Best,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let env_seed: Seed =
        args.env_seed.parse().map_err(|e| Failure::Message(format!("--env-seed: {e}"), None))?;
    let stored = Stored::open(&args.results)?;
    let index = stored.variant(args.variant.as_deref())?;
    let variant = &stored.plan.variants[index];
    let unit = stored.unit(index, args.seed)?;
    let host = Host::open(&stored.plan)?;
    let mut session = session(variant)?;
    let mut policy = policy(args, &stored, unit, (&host, &session))?;
    if args.variant.is_none() && stored.plan.variants.len() > 1 {
        let names: Vec<&str> = stored.plan.variants.iter().map(|v| v.name.as_str()).collect();
        note(&format!("playing `{}`; --variant chooses among {}", variant.name, names.join(", ")));
    }
    let endless = if variant.max_steps.is_some() { usize::MAX } else { ENDLESS };
    let length = Length {
        steps: args.steps.map_or(endless, |n| usize::try_from(n).unwrap_or(usize::MAX)),
        episodes: args.episodes as usize,
    };
    let mut view = View::open(&args.view, &session)?;
    let each = |session: &Session, event: Event<'_>| view.event(session, event);
    let played = play(&mut session, &mut policy, &env_seed, length, each);
    let Some(played) = view.finish(played)? else { return Ok(Outcome::Fine) };
    for (i, episode) in played.iter().enumerate() {
        note(&describe(i + 1, episode));
    }
    if played.len() > 1 {
        let finished: Vec<f64> =
            played.iter().filter(|e| e.ending.is_some()).map(|e| e.native).collect();
        let mean = crate::stats::mean(&finished);
        note(&format!("mean return of {} finished episodes: {mean}", finished.len()));
    }
    Ok(Outcome::Fine)
}

/// What the unit has learned, at play.
fn policy(
    args: &Args,
    stored: &Stored,
    unit: &Unit,
    (host, session): (&Host, &Session),
) -> Result<Policy, Failure> {
    let variant = &stored.plan.variants[unit.variant];
    let (name, agent) = (&variant.name, variant.agent.spec.name);
    if variant.agent.is_network() {
        let which = match args.model {
            Some(Which::Best) => Checkpoint::Best,
            Some(Which::Last) | None => Checkpoint::Last,
        };
        return Ok(Policy::of_network(host, variant, session, stored.model(unit, which)?));
    }
    if args.model.is_some() {
        return Err(Failure::Message(
            format!("--model: variant `{name}` has no networks: its agent `{agent}` learns none"),
            Some("leave it out".into()),
        ));
    }
    let Values::Q(q) = stored.learned(unit)?.values else {
        return Err(Failure::Message(
            format!(
                "variant `{name}` has no policy of its own: its agent `{agent}` learns the values \
                 of one that is given"
            ),
            Some(format!("to see random play: runner rollout {} --policy random", variant.env.id)),
        ));
    };
    Ok(Policy::new(host, variant, session, q))
}

fn describe(number: usize, episode: &PlayedEpisode) -> String {
    let ending = episode.ending.map_or("stopped", |e| e.as_str());
    let plural = if episode.steps == 1 { "" } else { "s" };
    format!("episode {number}: {} step{plural}, return {}, {ending}", episode.steps, episode.native)
}
