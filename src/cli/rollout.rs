//! `runner rollout ENV`

use std::io::Write;
use std::path::Path;

use clap::{Args as ClapArgs, ValueEnum};

use super::{Failure, Outcome};
use crate::env::Session;
use crate::env::rollout::{Event, Length, parse_actions, random_policy, rollout, rollout_actions};
use crate::experiment::play::{Policy, play};
use crate::experiment::read_table;
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
    /// the policy.csv of a unit, if the environment is finite
    #[arg(long, value_name = "random|FILE", default_value = "random")]
    policy: String,
    /// Number of steps that the policy plays
    #[arg(long, value_name = "N", default_value_t = 100, conflicts_with = "actions")]
    steps: usize,
    /// How it is printed
    #[arg(long, value_enum, default_value = "jsonl")]
    format: Format,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum Format {
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
    let mut session = Session::new(&args.env, &kwargs)?;
    let mut stdout = std::io::BufWriter::new(std::io::stdout().lock());
    let Format::Jsonl = args.format;
    let played = if let Some(actions) = &args.actions {
        let actions = parse_actions(actions, &session.action_space())?;
        rollout_actions(&mut session, &seed, &actions, &mut stdout)
    } else if args.policy == "random" {
        let stream = Stream::new(seed.words()[0].into(), "policy");
        let mut policy = random_policy(&session, stream);
        rollout(&mut session, &seed, args.steps, |_| policy(), &mut stdout)
    } else {
        let mut policy = table_policy(&session, Path::new(&args.policy))?;
        let length = Length { steps: args.steps, episodes: usize::MAX };
        let each = |_: &Session, event: Event<'_>| Ok(event.write(&mut stdout)?);
        play(&mut session, &mut policy, &seed, length, each).map(|_| ())
    };
    let flushed = stdout.flush();
    played.map_err(Failure::from)?;
    flushed.map(|()| Outcome::Fine).map_err(Failure::from)
}

/// The greedy policy of a `policy.csv`. Its rows are states only where the environment is finite:
/// elsewhere they are cells of a discretiser, which the file does not tell.
fn table_policy(session: &Session, path: &Path) -> Result<Policy, Failure> {
    let id = session.spec().id;
    if !path.exists() {
        return Err(Failure::Message(
            format!("--policy: there is no file `{}`", path.display()),
            Some("give `random`, or the policy.csv of a unit of a results folder".into()),
        ));
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
