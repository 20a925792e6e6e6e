//! `runner rollout ENV`

use std::io::Write;

use clap::{Args as ClapArgs, ValueEnum};

use super::output::note;
use super::{Failure, Outcome};
use crate::env::rollout::{RolloutError, parse_actions, random_policy, rollout, rollout_actions};
use crate::env::{Session, find_with_note};
use crate::mdp::numpy::Seed;
use crate::mdp::streams::Stream;

#[derive(Debug, ClapArgs)]
pub(super) struct Args {
    /// The environment's id
    env: String,
    /// Constructor arguments as JSON, for example `{"is_slippery": false}`
    #[arg(long, value_name = "JSON", default_value = "{}")]
    kwargs: String,
    /// Seed of the first reset, as in Gymnasium's reset(seed=N)
    #[arg(long, value_name = "N", default_value = "0")]
    seed: String,
    /// Actions to play, separated by commas; `[a,b],..` where one is a list of numbers
    #[arg(long, value_name = "A,B,..", conflicts_with = "policy", allow_hyphen_values = true)]
    actions: Option<String>,
    /// Who plays if no actions are given
    #[arg(long, value_enum, default_value = "random")]
    policy: Policy,
    /// Number of steps that the policy plays
    #[arg(long, value_name = "N", default_value_t = 100, conflicts_with = "actions")]
    steps: usize,
    /// How it is printed
    #[arg(long, value_enum, default_value = "jsonl")]
    format: Format,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Policy {
    /// Uniformly random actions, from the seed
    Random,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Format {
    /// One JSON object a line
    Jsonl,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let kwargs: serde_json::Value = serde_json::from_str(&args.kwargs).map_err(|e| {
        Failure::Message(
            format!("--kwargs is not JSON: {e}"),
            Some("write, for example, --kwargs '{\"is_slippery\": false}'".into()),
        )
    })?;
    let serde_json::Value::Object(kwargs) = kwargs else {
        return Err(Failure::Message(format!("--kwargs is a JSON object, got {kwargs}"), None));
    };
    let seed: Seed =
        args.seed.parse().map_err(|e| Failure::Message(format!("--seed: {e}"), None))?;
    let (spec, remark) = find_with_note(&args.env)?;
    if let Some(remark) = remark {
        note(&remark);
    }
    let mut session = Session::new(spec.id, &kwargs)?;
    let mut stdout = std::io::BufWriter::new(std::io::stdout().lock());
    let (Format::Jsonl, Policy::Random) = (args.format, args.policy);
    let played = if let Some(actions) = &args.actions {
        let actions = parse_actions(actions, &session.action_space())?;
        rollout_actions(&mut session, &seed, &actions, &mut stdout)
    } else {
        let stream = Stream::new(seed.words()[0].into(), "policy");
        let mut policy = random_policy(&session, stream);
        rollout(&mut session, &seed, args.steps, |_| policy(), &mut stdout)
    };
    let flushed = stdout.flush();
    match played {
        Ok(()) => flushed.map(|()| Outcome::Fine).map_err(Failure::from),
        Err(RolloutError::Env(e)) => Err(e.into()),
        Err(RolloutError::Io(e)) => Err(e.into()),
    }
}
