//! The one place where environments are registered: one entry of `environments!` each.
//!
//! `list`, suggestions, editor definitions, conformance tests and documents iterate [`specs`].

use serde_json::{Map, Value};

use super::acrobot::Acrobot;
use super::any::Dynamic;
use super::blackjack::Blackjack;
use super::cart_pole::CartPole;
use super::cliff_walking::CliffWalking;
use super::error::{EnvError, did_you_mean, list};
use super::frozen_lake::FrozenLake;
use super::kwargs::{KwargSpec, Kwargs};
use super::lunar_lander::LunarLander;
use super::mountain_car::MountainCar;
use super::mountain_car_continuous::MountainCarContinuous;
use super::pendulum::Pendulum;
use super::registered::{Example, Registered};
use super::scene::Draw;
use super::taxi::Taxi;
use crate::mdp::Env;

/// An environment's id and what Gymnasium registers with it.
#[derive(Debug)]
pub struct EnvSpec {
    /// The id, for example `CartPole-v1`.
    pub id: &'static str,
    /// The time limit, in steps.
    pub max_steps: Option<u32>,
    /// The mean return from which it counts as solved.
    pub reward_threshold: Option<f64>,
    /// One line for `list`.
    pub summary: &'static str,
    /// Steps per second at which it is shown.
    pub fps: u32,
    /// What a first script for it may say.
    pub example: Example,
    /// The reset options it knows.
    pub reset_options: &'static [&'static str],
    /// The attributes that may be set before the first reset.
    pub attributes: &'static [&'static str],
    declared: &'static [KwargSpec],
    /// The declared defaults that this id changes: name and JSON.
    overrides: &'static [(&'static str, &'static str)],
    build: fn(&Kwargs) -> Result<AnyEnv, EnvError>,
}

impl EnvSpec {
    /// The constructor's arguments, with this id's defaults.
    pub fn kwargs(&self) -> Vec<KwargSpec> {
        let mut specs = self.declared.to_vec();
        for spec in &mut specs {
            if let Some((_, default)) = self.overrides.iter().find(|(name, _)| *name == spec.name) {
                spec.default = default;
            }
        }
        specs
    }

    /// The arguments in canonical form: defaults filled in, names sorted, numbers as floats. Two
    /// maps that mean the same give the same JSON, so a configuration's hash may be taken over it.
    ///
    /// # Errors
    /// On an unknown name or a value of the wrong type.
    pub fn resolve_kwargs(
        &self,
        given: &Map<String, Value>,
    ) -> Result<Map<String, Value>, EnvError> {
        Ok(Kwargs::resolve(self.id, &self.kwargs(), given)?.into_map())
    }

    /// Builds the environment with these constructor's arguments; see [`EnvConfig`](super::EnvConfig) for everything
    /// else that may be said about it.
    ///
    /// # Errors
    /// As [`Self::resolve_kwargs`], and if a value is out of its range.
    pub fn make(&self, given: &Map<String, Value>) -> Result<AnyEnv, EnvError> {
        (self.build)(&Kwargs::resolve(self.id, &self.kwargs(), given)?)
    }
}

/// Something to be done with an environment whose type it then knows: the dispatch happens once
/// per run, and the steps inside are static.
pub trait EnvVisitor {
    /// What comes of it.
    type Out;

    /// Does it.
    fn visit<E: Env + Clone + 'static>(self, env: E) -> Self::Out;
}

/// Generates [`AnyEnv`] and the list of specs from entries of the form
/// `Type: ["id", time limit, reward threshold, "kwarg" = "changed default as JSON"...], [...];`
macro_rules! environments {
    ($($type:ident:
        $([$id:literal, $steps:expr, $threshold:expr $(, $key:literal = $default:literal)*]),+;
    )*) => {
        /// Any registered environment.
        #[derive(Debug, Clone)]
        pub enum AnyEnv {
            $(
                #[doc = concat!("See [`", stringify!($type), "`].")]
                $type($type),
            )*
        }

        impl AnyEnv {
            /// Hands the environment, with its type, to `visitor`.
            pub fn visit<V: EnvVisitor>(self, visitor: V) -> V::Out {
                match self {
                    $(Self::$type(env) => visitor.visit(env),)*
                }
            }

            pub(super) fn dynamic(&self) -> &dyn Dynamic {
                match self {
                    $(Self::$type(env) => env,)*
                }
            }

            pub(super) fn dynamic_mut(&mut self) -> &mut dyn Dynamic {
                match self {
                    $(Self::$type(env) => env,)*
                }
            }
        }

        static SPECS: &[EnvSpec] = &[
            $($(EnvSpec {
                id: $id,
                max_steps: $steps,
                reward_threshold: $threshold,
                fps: <$type as Draw>::FPS,
                summary: <$type as Registered>::SUMMARY,
                example: <$type as Registered>::EXAMPLE,
                reset_options: <$type as Registered>::RESET_OPTIONS,
                attributes: <$type as Registered>::ATTRIBUTES,
                declared: <$type as Registered>::KWARGS,
                overrides: &[$(($key, $default)),*],
                build: |kwargs| Ok(AnyEnv::$type(<$type as Registered>::from_kwargs(kwargs)?)),
            },)+)*
        ];
    };
}

environments! {
    CartPole: ["CartPole-v0", Some(200), Some(195.0)], ["CartPole-v1", Some(500), Some(475.0)];
    MountainCar: ["MountainCar-v0", Some(200), Some(-110.0)];
    MountainCarContinuous: ["MountainCarContinuous-v0", Some(999), Some(90.0)];
    Acrobot: ["Acrobot-v1", Some(500), Some(-100.0)];
    Pendulum: ["Pendulum-v1", Some(200), None];
    LunarLander: ["LunarLander-v3", Some(1000), Some(200.0)],
        ["LunarLanderContinuous-v3", Some(1000), Some(200.0), "continuous" = "true"];
    FrozenLake: ["FrozenLake-v1", Some(100), Some(0.7)],
        ["FrozenLake8x8-v1", Some(200), Some(0.85), "map_name" = "\"8x8\""];
    CliffWalking: ["CliffWalking-v1", None, None],
        ["CliffWalkingSlippery-v1", None, None, "is_slippery" = "true"];
    Taxi: ["Taxi-v4", Some(200), Some(8.0)];
    Blackjack: ["Blackjack-v1", None, None];
}

/// Old ids that are still understood: the id, its successor, and why that is the same.
const ALIASES: &[(&str, &str, &str)] =
    &[("Taxi-v3", "Taxi-v4", "a dry taxi without fickle passengers is the same in both")];

/// Every registered environment.
pub fn specs() -> &'static [EnvSpec] {
    SPECS
}

/// Looks up an id; one without a version means the newest.
///
/// # Errors
/// If there is no such environment: with its successor if the version is an old one (`Taxi-v3` is
/// understood), else with the most similar id.
pub fn find(id: &str) -> Result<&'static EnvSpec, EnvError> {
    find_with_note(id).map(|(spec, _)| spec)
}

/// As [`find`], with a note for the user if the id was not a full one.
///
/// # Errors
/// As [`find`].
pub fn find_with_note(id: &str) -> Result<(&'static EnvSpec, Option<String>), EnvError> {
    if let Some(spec) = SPECS.iter().find(|spec| spec.id == id) {
        return Ok((spec, None));
    }
    if let Some((old, new, why)) = ALIASES.iter().find(|(old, ..)| *old == id) {
        let note = format!("Gymnasium 1.4 calls `{old}` `{new}`: {why}");
        return find(new).map(|spec| (spec, Some(note)));
    }
    let (name, version) = split(id);
    let mut family: Vec<_> = SPECS.iter().filter(|spec| split(spec.id).0 == name).collect();
    family.sort_by_key(|spec| split(spec.id).1);
    let Some(newest) = family.last() else {
        return Err(unknown(id));
    };
    let Some(version) = version else {
        let note = format!("`{id}` has no version: using the newest, `{}`", newest.id);
        return Ok((newest, Some(note)));
    };
    let hint = format!("use `{}`", newest.id);
    if Some(version) < split(newest.id).1 {
        let message = format!("version v{version} of the environment `{name}` is out of date");
        return Err(EnvError::new(message).hint(hint));
    }
    let versions: Vec<_> = family.iter().map(|spec| spec.id).collect();
    let message = format!("there is no `{id}`; there is {}", list(&versions));
    Err(EnvError::new(message).hint(hint))
}

/// Builds the environment `id` with the arguments `kwargs`.
///
/// # Errors
/// As [`find`] and [`EnvSpec::make`].
pub fn make(id: &str, kwargs: &Map<String, Value>) -> Result<AnyEnv, EnvError> {
    find(id)?.make(kwargs)
}

/// An id's name and version.
fn split(id: &str) -> (&str, Option<u32>) {
    match id.rsplit_once("-v") {
        Some((name, version)) => match version.parse() {
            Ok(version) => (name, Some(version)),
            Err(_) => (id, None),
        },
        None => (id, None),
    }
}

fn unknown(id: &str) -> EnvError {
    let error = EnvError::new(format!("there is no environment `{id}`"));
    let ids: Vec<_> = SPECS.iter().map(|spec| spec.id).collect();
    // Names are compared without versions: `cartpol` is nearer to CartPole than to nothing.
    let name = did_you_mean(split(id).0, ids.iter().map(|id| split(id).0));
    match name.and_then(|name| find(name).ok()) {
        Some(spec) => error.hint(format!("did you mean `{}`?", spec.id)),
        None => error.hint(format!("there is {}", list(&ids))),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn kwargs(value: &Value) -> Map<String, Value> {
        value.as_object().unwrap().clone()
    }

    #[test]
    fn ids_resolve_or_say_what_to_use() {
        assert_eq!(find("CartPole-v0").unwrap().id, "CartPole-v0");
        let (spec, note) = find_with_note("CartPole").unwrap();
        assert_eq!(spec.id, "CartPole-v1");
        assert_eq!(
            note.as_deref(),
            Some("`CartPole` has no version: using the newest, `CartPole-v1`")
        );
        let (spec, note) = find_with_note("Taxi-v3").unwrap();
        assert_eq!(spec.id, "Taxi-v4");
        assert!(note.unwrap().starts_with("Gymnasium 1.4 calls `Taxi-v3` `Taxi-v4`: "));
        for (id, message) in [
            (
                "FrozenLake-v0",
                "version v0 of the environment `FrozenLake` is out of date (use `FrozenLake-v1`)",
            ),
            (
                "CliffWalking-v0",
                "version v0 of the environment `CliffWalking` is out of date (use \
                 `CliffWalking-v1`)",
            ),
            (
                "Blackjack-v0",
                "version v0 of the environment `Blackjack` is out of date (use `Blackjack-v1`)",
            ),
            ("Taxi-v2", "version v2 of the environment `Taxi` is out of date (use `Taxi-v4`)"),
            ("Taxi-v5", "there is no `Taxi-v5`; there is `Taxi-v4` (use `Taxi-v4`)"),
            (
                "CartPole-v2",
                "there is no `CartPole-v2`; there is `CartPole-v0`, `CartPole-v1` \
                 (use `CartPole-v1`)",
            ),
            ("cartpole-v1", "there is no environment `cartpole-v1` (did you mean `CartPole-v1`?)"),
            ("MontainCar", "there is no environment `MontainCar` (did you mean `MountainCar-v0`?)"),
        ] {
            assert_eq!(find(id).unwrap_err().to_string(), message);
        }
        let hint = find("Chess-v1").unwrap_err().hint.unwrap();
        assert!(hint.starts_with("there is `CartPole-v0`, `CartPole-v1`, "), "{hint}");
    }

    #[test]
    fn an_id_may_change_a_default() {
        let resolve = |id: &str| find(id).unwrap().resolve_kwargs(&Map::new()).unwrap();
        assert_eq!(resolve("FrozenLake-v1")["map_name"], "4x4");
        assert_eq!(resolve("FrozenLake8x8-v1")["map_name"], "8x8");
        let states = |id| make(id, &Map::new()).unwrap().finite().unwrap().n_states();
        assert_eq!((states("FrozenLake-v1"), states("FrozenLake8x8-v1")), (16, 64));
    }

    #[test]
    fn wrong_arguments_name_the_key() {
        let make = |id, given| make(id, &kwargs(&given)).unwrap_err();
        let error = make("FrozenLake-v1", json!({"slippery": true}));
        assert_eq!(error.key.as_deref(), Some("slippery"));
        assert_eq!(error.hint.as_deref(), Some("did you mean `is_slippery`?"));
        let error = make("FrozenLake-v1", json!({"map_name": null}));
        assert_eq!(error.key.as_deref(), Some("map_name"));
        let error = make("FrozenLake-v1", json!({"success_rate": 1.5}));
        assert_eq!(error.message, "`success_rate` must be between 0 and 1, not 1.5");
        let error = make("MountainCar-v0", json!({"goal_velocity": "fast"}));
        assert_eq!(error.message, "`goal_velocity` must be a finite number, not \"fast\"");
    }

    #[test]
    fn every_default_is_valid_and_canonical() {
        for spec in specs() {
            let resolved = spec.resolve_kwargs(&Map::new()).unwrap();
            assert_eq!(spec.resolve_kwargs(&resolved).unwrap(), resolved, "{}", spec.id);
            spec.make(&resolved).unwrap();
            assert!(spec.overrides.iter().all(|(name, _)| resolved.contains_key(*name)));
        }
    }
}
