//! A rollout as JSON lines: what was played and what came of it.
//!
//! ```text
//! {"type":"reset","seed":0,"obs":[0.013696169,-0.02302133,-0.045902647,-0.048347235]}
//! {"type":"step","action":1,"obs":[…],"reward":1.0,"terminated":false,"truncated":false}
//! ```
//!
//! Where Gymnasium gives an action mask, each line ends in it: `"mask":"110000"`, one character per
//! action, `1` for those that can do anything next.
//!
//! After an episode has ended, the next action starts another one with an unseeded reset, whose
//! line has `"seed":null`. Where actions are real numbers, `action` is a list.

use std::fmt;
use std::io::{self, Write};

use serde::Serialize;

use super::actions::PlayedAction;
use super::error::EnvError;
use super::registered::{ActionMask, Observation};
use super::session::{Session, SessionStep};
use crate::mdp::ActionSpace;
use crate::mdp::numpy::Seed;
use crate::mdp::streams::Stream;

/// Why a rollout stopped early.
#[derive(Debug)]
pub enum RolloutError {
    /// The environment refused a reset or an action.
    Env(EnvError),
    /// A line could not be written.
    Io(io::Error),
    /// The policy has no action for a state.
    Policy(Box<dyn std::error::Error + Send + Sync>),
}

impl fmt::Display for RolloutError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Env(error) => error.fmt(f),
            Self::Io(error) => error.fmt(f),
            Self::Policy(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for RolloutError {}

impl From<EnvError> for RolloutError {
    fn from(error: EnvError) -> Self {
        Self::Env(error)
    }
}

impl From<io::Error> for RolloutError {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

#[derive(Serialize)]
struct StepLine<'a> {
    r#type: &'static str,
    action: &'a PlayedAction,
    #[serde(flatten)]
    step: &'a SessionStep,
}

/// Something that happened in a rollout.
#[derive(Debug, Clone, Copy)]
pub enum Event<'a> {
    /// An episode started.
    Reset {
        /// The seed of the reset, if it had one.
        seed: Option<&'a Seed>,
        /// The first observation.
        obs: &'a Observation,
        /// Which actions can do anything, where Gymnasium says so.
        mask: Option<&'a ActionMask>,
    },
    /// An action was played.
    Step {
        /// The action.
        action: &'a PlayedAction,
        /// What it brought.
        step: &'a SessionStep,
    },
}

impl Event<'_> {
    /// Writes it as a line of JSON.
    ///
    /// # Errors
    /// If `out` refuses it.
    pub fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        match *self {
            Self::Reset { seed, obs, mask } => write_reset(out, seed, obs, mask),
            Self::Step { action, step } => {
                serde_json::to_writer(&mut *out, &StepLine { r#type: "step", action, step })?;
                out.write_all(b"\n")
            }
        }
    }
}

/// How long a rollout goes on: until the first of both is used up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Length {
    /// Steps, over all episodes.
    pub steps: usize,
    /// Finished episodes.
    pub episodes: usize,
}

/// Plays actions chosen by `policy` from a reset with `seed`; `each` hears of every reset and
/// step, with the session as it then is. The session may have been used before.
///
/// # Errors
/// If the environment refuses an action (the message says which one), and what `policy` and `each`
/// report.
pub fn drive(
    session: &mut Session,
    seed: &Seed,
    length: Length,
    mut policy: impl FnMut(&Session, &Observation) -> Result<PlayedAction, RolloutError>,
    mut each: impl FnMut(&Session, Event<'_>) -> Result<(), RolloutError>,
) -> Result<(), RolloutError> {
    let mut obs = session.reset(Some(seed), None)?;
    each(session, Event::Reset { seed: Some(seed), obs: &obs, mask: session.action_mask() })?;
    let (mut episodes, mut ended) = (0, false);
    for i in 0..length.steps {
        if episodes == length.episodes {
            break;
        }
        if ended {
            obs = session.reset(None, None)?;
            each(session, Event::Reset { seed: None, obs: &obs, mask: session.action_mask() })?;
        }
        let action = policy(session, &obs)?;
        let step = session.step(&action).map_err(|mut error| {
            error.message = format!("at step {i}: {}", error.message);
            error
        })?;
        each(session, Event::Step { action: &action, step: &step })?;
        ended = step.terminated || step.truncated;
        episodes += usize::from(ended);
        obs = step.obs;
    }
    Ok(())
}

/// Plays `steps` actions chosen by `policy` from a reset with `seed`, writing one JSON line per
/// reset and step to `out`. The session may have been used before.
///
/// # Errors
/// If the environment refuses an action (the message says which one) or `out` a line. What was
/// played before is written.
pub fn rollout(
    session: &mut Session,
    seed: &Seed,
    steps: usize,
    mut policy: impl FnMut(&Observation) -> PlayedAction,
    out: &mut dyn Write,
) -> Result<(), RolloutError> {
    let length = Length { steps, episodes: usize::MAX };
    let each = |_: &Session, event: Event<'_>| Ok(event.write(out)?);
    drive(session, seed, length, |_, obs| Ok(policy(obs)), each)
}

/// Plays a list of actions: [`rollout`] with as many steps.
///
/// # Errors
/// As [`rollout`].
pub fn rollout_actions(
    session: &mut Session,
    seed: &Seed,
    actions: &[PlayedAction],
    out: &mut dyn Write,
) -> Result<(), RolloutError> {
    let mut next = actions.iter().cloned();
    // There are exactly as many calls as actions.
    rollout(session, seed, actions.len(), |_| next.next().unwrap_or(PlayedAction::Index(-1)), out)
}

/// Uniformly random actions for `session`: an index, or numbers between the bounds of its box.
pub fn random_policy(
    session: &Session,
    mut stream: Stream,
) -> impl FnMut() -> PlayedAction + use<> {
    let space = session.action_space();
    move || match space {
        ActionSpace::Discrete(n) => PlayedAction::Index(stream.below(n) as i64),
        ActionSpace::Box { low, high } => PlayedAction::Box(
            low.iter()
                .zip(high)
                .map(|(&low, &high)| {
                    let (low, high) = (f64::from(low), f64::from(high));
                    f64::from((low + (high - low) * stream.uniform()) as f32)
                })
                .collect(),
        ),
    }
}

/// Reads actions separated by commas, with blanks allowed: `0,1,1`, or, where actions are real
/// numbers, lists `[0.5,-1],[1,0]` (a single number may do without its brackets: `0.5,-1`). An
/// empty text is an empty list.
///
/// # Errors
/// If a part is no action of `space`'s kind.
pub fn parse_actions(text: &str, space: &ActionSpace) -> Result<Vec<PlayedAction>, EnvError> {
    if text.trim().is_empty() {
        return Ok(Vec::new());
    }
    split_actions(text)
        .enumerate()
        .map(|(i, part)| {
            let part = part.trim();
            let (expected, action) = match space {
                ActionSpace::Discrete(_) => {
                    ("integers", part.parse().ok().map(PlayedAction::Index))
                }
                ActionSpace::Box { low, .. } => {
                    let bare = (low.len() == 1).then(|| part.parse().ok()).flatten();
                    let bare = bare.filter(|x: &f64| x.is_finite());
                    let list = bare.map(|x| vec![x]).or_else(|| serde_json::from_str(part).ok());
                    (
                        if low.len() == 1 {
                            "finite numbers"
                        } else {
                            "lists of finite numbers [a, b]"
                        },
                        list.map(PlayedAction::Box),
                    )
                }
            };
            action.ok_or_else(|| {
                let n = i + 1;
                let message = format!(
                    "actions are {expected} separated by commas, but number {n} is `{part}`"
                );
                EnvError::about("actions", message)
            })
        })
        .collect()
}

/// The parts of `text` between commas that stand outside brackets.
fn split_actions(text: &str) -> impl Iterator<Item = &str> {
    let mut depth = 0i32;
    text.split(move |c: char| {
        depth += i32::from(c == '[') - i32::from(c == ']');
        c == ',' && depth <= 0
    })
}

fn write_reset(
    out: &mut dyn Write,
    seed: Option<&Seed>,
    obs: &Observation,
    mask: Option<&ActionMask>,
) -> io::Result<()> {
    // A seed may be too large for any integer type: it is written as the digits it displays.
    let seed = seed.map_or_else(|| "null".to_owned(), Seed::to_string);
    let obs = serde_json::to_string(obs)?;
    let mask = mask.map_or_else(String::new, |mask| format!(r#","mask":"{mask}""#));
    writeln!(out, r#"{{"type":"reset","seed":{seed},"obs":{obs}{mask}}}"#)
}

#[cfg(test)]
mod tests {
    use serde_json::{Map, json};

    use super::*;

    fn play(id: &str, kwargs: &serde_json::Value, seed: &str, actions: &str) -> String {
        let mut session = Session::new(id, kwargs.as_object().unwrap()).unwrap();
        let mut out = Vec::new();
        let actions = parse_actions(actions, &session.action_space()).unwrap();
        rollout_actions(&mut session, &seed.parse().unwrap(), &actions, &mut out).unwrap();
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn lines_by_hand() {
        let kwargs = json!({"desc": ["SFG"], "is_slippery": false});
        assert_eq!(
            play("FrozenLake-v1", &kwargs, "1208925819614629174706175", "2, 2,2"),
            r#"{"type":"reset","seed":1208925819614629174706175,"obs":0}
{"type":"step","action":2,"obs":1,"reward":0.0,"terminated":false,"truncated":false}
{"type":"step","action":2,"obs":2,"reward":1.0,"terminated":true,"truncated":false}
{"type":"reset","seed":null,"obs":0}
{"type":"step","action":2,"obs":1,"reward":0.0,"terminated":false,"truncated":false}
"#
        );
    }

    #[test]
    fn float32_lines_as_gymnasium_prints_them() {
        assert_eq!(
            play("CartPole-v1", &json!({}), "0", "0"),
            r#"{"type":"reset","seed":0,"obs":[0.013696169,-0.02302133,-0.045902647,-0.048347235]}
{"type":"step","action":0,"obs":[0.013235742,-0.21745604,-0.04686959,0.22950698],"reward":1.0,"terminated":false,"truncated":false}
"#
        );
    }

    #[test]
    fn masks_and_tuples_are_written() {
        // Gymnasium: the masks of states 314, 214 and 234.
        assert_eq!(
            play("Taxi-v4", &json!({}), "0", "1,2"),
            r#"{"type":"reset","seed":0,"obs":314,"mask":"110000"}
{"type":"step","action":1,"obs":214,"reward":-1.0,"terminated":false,"truncated":false,"mask":"111000"}
{"type":"step","action":2,"obs":234,"reward":-1.0,"terminated":false,"truncated":false,"mask":"111100"}
"#
        );
        assert_eq!(
            play("Blackjack-v1", &json!({}), "0", "1"),
            r#"{"type":"reset","seed":0,"obs":[11,10,0]}
{"type":"step","action":1,"obs":[12,10,0],"reward":0.0,"terminated":false,"truncated":false}
"#
        );
    }

    #[test]
    fn no_reset_follows_the_last_action() {
        let kwargs = json!({"desc": ["SG"], "is_slippery": false});
        assert_eq!(play("FrozenLake-v1", &kwargs, "0", "2").lines().count(), 2);
        assert_eq!(play("FrozenLake-v1", &kwargs, "0", "").lines().count(), 1);
    }

    #[test]
    fn mistakes_are_located() {
        let mut session = Session::new("CartPole-v1", &Map::new()).unwrap();
        let mut out = Vec::new();
        let error = rollout_actions(&mut session, &Seed::from(0), &[0.into(), 7.into()], &mut out)
            .unwrap_err();
        assert_eq!(
            error.to_string(),
            "at step 1: CartPole-v1 has no action 7: its actions are 0 (left), 1 (right)"
        );
        assert_eq!(String::from_utf8(out).unwrap().lines().count(), 2);
    }

    #[test]
    fn actions_are_read_by_the_kind_of_the_space() {
        let parse = |text: &str, space| parse_actions(text, &space).map_err(|e| e.message);
        let discrete = ActionSpace::Discrete(4);
        let one = ActionSpace::Box { low: &[-1.0], high: &[1.0] };
        let two = ActionSpace::Box { low: &[-1.0; 2], high: &[1.0; 2] };
        let boxed = |lists: &[&[f64]]| {
            Ok(lists.iter().map(|list| PlayedAction::Box(list.to_vec())).collect::<Vec<_>>())
        };
        assert_eq!(parse("3, 0", discrete), Ok(vec![3.into(), 0.into()]));
        assert_eq!(parse("0.5, -1,[0]", one), boxed(&[&[0.5], &[-1.0], &[0.0]]));
        assert_eq!(parse("[0.5,-1], [1, 0]", two), boxed(&[&[0.5, -1.0], &[1.0, 0.0]]));
        for (text, space, message) in [
            ("0,x,1", discrete, "actions are integers separated by commas, but number 2 is `x`"),
            ("0,0.5", discrete, "actions are integers separated by commas, but number 2 is `0.5`"),
            ("0.5,x", one, "actions are finite numbers separated by commas, but number 2 is `x`"),
            (
                "[1,0],0.5",
                two,
                "actions are lists of finite numbers [a, b] separated by commas, but number 2 is `0.5`",
            ),
        ] {
            assert_eq!(parse(text, space).unwrap_err(), message);
        }
    }
}
