//! `runner rollout ENV`

use std::path::Path;

use clap::Args as ClapArgs;

use super::output::note;
use super::view::{View, ViewArgs};
use super::{Failure, Outcome};
use crate::env::rollout::{Event, Length, drive, parse_actions, random_policy};
use crate::env::{PlayedAction, Session, find_with_note};
use crate::experiment::play::{Policy, play};
use crate::experiment::{holds_model, holds_weights, read_model, read_table, read_weights};
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
    /// Who plays if no actions are given: `random` for uniformly random actions from the seed, or
    /// the policy.csv of a unit, if the environment is finite, or its weights.csv, or the
    /// model.safetensors or best.safetensors of a network
    #[arg(long, value_name = "random|FILE", default_value = "random")]
    policy: String,
    /// Number of steps that the policy plays
    #[arg(long, value_name = "N", default_value_t = 100, conflicts_with = "actions")]
    steps: usize,
    #[command(flatten)]
    view: ViewArgs,
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
    let actions = match &args.actions {
        Some(actions) => Some(parse_actions(actions, &session.action_space())?),
        None => None,
    };
    let mut policy = match actions {
        Some(_) => None,
        None if args.policy == "random" => None,
        None => Some(stored_policy(&session, Path::new(&args.policy))?),
    };
    let mut view = View::open(&args.view, &session)?;
    let steps = actions.as_ref().map_or(args.steps, Vec::len);
    let length = Length { steps, episodes: usize::MAX };
    let each = |session: &Session, event: Event<'_>| view.event(session, event);
    let played = if let Some(actions) = actions {
        let mut next = actions.into_iter();
        // There are exactly as many calls as actions.
        let list = |_: &Session, _: &_| Ok(next.next().unwrap_or(PlayedAction::Index(-1)));
        drive(&mut session, &seed, length, list, each)
    } else if let Some(policy) = &mut policy {
        play(&mut session, policy, &seed, length, each).map(|_| ())
    } else {
        let stream = Stream::new(seed.words()[0].into(), "policy");
        let mut random = random_policy(&session, stream);
        drive(&mut session, &seed, length, |_, _| Ok(random()), each)
    };
    view.finish(played)?;
    Ok(Outcome::Fine)
}

/// The greedy policy of a model, of a `weights.csv`, or of a `policy.csv`. The rows of the latter are states only
/// where the environment is finite: elsewhere they are cells of a discretiser, which the file does
/// not tell.
fn stored_policy(session: &Session, path: &Path) -> Result<Policy, Failure> {
    let id = session.spec().id;
    if !path.exists() {
        return Err(Failure::Message(
            format!("--policy: there is no file `{}`", path.display()),
            Some(
                "give `random`, or the policy.csv, weights.csv or model.safetensors of a unit of a \
                 results folder"
                    .into(),
            ),
        ));
    }
    if holds_model(path) {
        return Ok(Policy::of_model(read_model(path, session)?));
    }
    if holds_weights(path) {
        let (q, frame_skip) = read_weights(path, session.schema())?;
        return Ok(Policy::of_weights(q, frame_skip));
    }
    let Some(n_states) = session.n_states() else {
        return Err(Failure::Message(
            format!(
                "--policy: {id} is not finite: a policy.csv does not say how its states were \
                     made into cells"
            ),
            Some("runner play RESULTS knows: it takes the discretiser from the script".into()),
        ));
    };
    let q = read_table(path, n_states, session.schema().actions.len())?;
    Ok(Policy::of_states(q))
}
