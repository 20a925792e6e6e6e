//! An environment as `gymnasium.make` returns it: with its own random stream, its time limit, and
//! checks on the order and the arguments of calls.
//!
//! Training loops do not use it: they are generic over the environment (see
//! [`EnvVisitor`](super::EnvVisitor)). Sessions serve rollouts and the replay of recordings.
//!
//! Deviations from Gymnasium:
//! 1. The first reset needs a seed; Gymnasium takes one from the operating system.
//! 2. Unknown reset options and attributes are errors, and attributes are set before the first
//!    reset only.
//! 3. A time limit of 0 or less than -1 is refused as in Gymnasium, and so is one beyond 2^32 - 1.

use serde::Serialize;
use serde_json::{Map, Value};

use super::actions::{ActionTable, PlayedAction, checked_box};
use super::config::EnvConfig;
use super::error::EnvError;
use super::registered::{ActionMask, Observation, Seen};
use super::registry::{AnyEnv, EnvSpec, find};
use super::scene::{Scene, TextPicture};
use crate::mdp::numpy::{NumpyRng, Seed};
use crate::mdp::{ActionSpace, Schema};

/// What one step of a [`Session`] brought.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SessionStep {
    /// The next observation.
    pub obs: Observation,
    /// The native reward.
    pub reward: f64,
    /// Whether the environment ended the episode.
    pub terminated: bool,
    /// Whether the time limit is reached. As with Gymnasium's `TimeLimit`, this may come together
    /// with `terminated`, and it stays true if the session is stepped on.
    pub truncated: bool,
    /// The probability of this outcome, on finite environments: Gymnasium's `info["prob"]`.
    #[serde(skip)]
    pub probability: Option<f64>,
    /// Which actions can do anything next, in environments for which Gymnasium says so.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mask: Option<ActionMask>,
}

/// An environment, its random stream and its time limit.
#[derive(Debug, Clone)]
pub struct Session {
    spec: &'static EnvSpec,
    env: AnyEnv,
    schema: Schema,
    rng: Option<NumpyRng>,
    limit: Option<u32>,
    /// The reset options of a reset that gives none.
    reset_options: Map<String, Value>,
    /// Steps since the last reset; `None` before the first one.
    elapsed: Option<u32>,
    seen: Seen,
    mask: Option<ActionMask>,
}

impl Session {
    /// Makes the environment `id`, with the time limit it is registered with.
    ///
    /// # Errors
    /// If the id or an argument is wrong.
    pub fn new(id: &str, kwargs: &Map<String, Value>) -> Result<Self, EnvError> {
        Self::of(find(id)?, &EnvConfig { kwargs: kwargs.clone(), ..EnvConfig::default() })
    }

    /// Makes the environment that `spec` and `config` describe, with its time limit.
    ///
    /// # Errors
    /// As [`EnvSpec::build`].
    pub fn of(spec: &'static EnvSpec, config: &EnvConfig) -> Result<Self, EnvError> {
        let env = spec.build(config)?;
        let schema = env.schema();
        let (limit, reset_options) = (spec.max_steps, config.reset_options.clone());
        let seen = Seen::default();
        Ok(Self {
            spec,
            env,
            schema,
            rng: None,
            limit,
            reset_options,
            elapsed: None,
            seen,
            mask: None,
        })
    }

    /// Replaces the time limit: -1 means none.
    ///
    /// # Errors
    /// As [`time_limit`].
    pub fn with_max_episode_steps(mut self, steps: i64) -> Result<Self, EnvError> {
        self.limit = time_limit(self.spec, Some(steps))?;
        Ok(self)
    }

    /// What is registered under its id.
    pub fn spec(&self) -> &'static EnvSpec {
        self.spec
    }

    /// How scripts name its states, and what its actions are called.
    pub fn schema(&self) -> &Schema {
        &self.schema
    }

    /// Steps since the last reset.
    pub fn elapsed(&self) -> u32 {
        self.elapsed.unwrap_or(0)
    }

    /// Number of states, if they are finite (with a model or without).
    pub fn n_states(&self) -> Option<usize> {
        self.env.n_states()
    }

    /// The index of the present state in the environment's model, if it has one; `None` before the
    /// first reset.
    pub fn state_index(&self) -> Option<usize> {
        self.seen.index
    }

    /// The numbers of the present state that [`Self::schema`] names; zeros before the first reset.
    pub fn fields(&self) -> &[f64] {
        &self.seen.fields[..self.schema.fields.len()]
    }

    /// What actions it takes.
    pub fn action_space(&self) -> ActionSpace {
        self.env.action_space()
    }

    /// Where actions are real numbers: the ones that agents choose among.
    pub fn action_table(&self) -> Option<&ActionTable> {
        self.env.action_table()
    }

    /// The action that an agent means by `index`: itself, or the entry of [`Self::action_table`].
    ///
    /// # Panics
    /// If there is no such entry.
    pub fn action(&self, index: usize) -> PlayedAction {
        match self.action_table() {
            None => PlayedAction::Index(index as i64),
            Some(table) => {
                PlayedAction::Box(table.get(index).iter().map(|&x| f64::from(x)).collect())
            }
        }
    }

    /// The time limit in force.
    pub fn max_episode_steps(&self) -> Option<u32> {
        self.limit
    }

    /// Which actions can do anything in the present state, in environments for which Gymnasium
    /// says so (after the first reset).
    pub fn action_mask(&self) -> Option<&ActionMask> {
        self.mask.as_ref()
    }

    /// What the present state looks like; `last` is the action that led to it: none after a reset.
    pub fn scene(&self, last: Option<&PlayedAction>) -> Scene {
        self.env.scene(last)
    }

    /// The present state in characters, if it is a world for them.
    pub fn text(&self, last: Option<&PlayedAction>) -> Option<TextPicture> {
        self.env.text(last)
    }

    /// Sets an attribute, for example `CartPole`'s `kinematics_integrator`.
    ///
    /// # Errors
    /// If the environment has no such attribute, the value is not allowed, or the session has
    /// been reset already.
    pub fn set_attribute(&mut self, name: &str, value: &Value) -> Result<(), EnvError> {
        if self.elapsed.is_some() && self.spec.attributes.contains(&name) {
            let message = format!("`{name}` must be set before the first reset");
            return Err(EnvError::about(name, message));
        }
        self.spec.set_attribute(&mut self.env, name, value)
    }

    /// Starts an episode. A seed starts a fresh random stream, no seed continues the one there is;
    /// no options are those of the configuration. A failed reset changes nothing.
    ///
    /// # Errors
    /// If the first reset has no seed, or an option is wrong.
    pub fn reset(
        &mut self,
        seed: Option<&Seed>,
        options: Option<&Map<String, Value>>,
    ) -> Result<Observation, EnvError> {
        let options = options.unwrap_or(&self.reset_options);
        let mut rng = match (seed, &self.rng) {
            (Some(seed), _) => NumpyRng::from_seed(seed),
            (None, Some(rng)) => rng.clone(),
            (None, None) => return Err(EnvError::about("seed", "the first reset needs a seed")),
        };
        self.spec.set_reset_options(&mut self.env, options)?;
        let (obs, seen, mask) = self.env.dynamic_mut().reset(&mut rng);
        (self.seen, self.mask) = (seen, mask);
        self.rng = Some(rng);
        self.elapsed = Some(0);
        Ok(obs)
    }

    /// Plays `action`. Stepping on after the end of an episode is allowed, as in Gymnasium.
    ///
    /// # Errors
    /// Before the first reset, and if there is no such action.
    pub fn step(&mut self, action: &PlayedAction) -> Result<SessionStep, EnvError> {
        let (Some(rng), Some(elapsed)) = (&mut self.rng, &mut self.elapsed) else {
            let message = "an episode starts with a reset: there was no reset before this step";
            return Err(EnvError::new(message));
        };
        let step = match (self.env.action_space(), action) {
            (ActionSpace::Discrete(n), &PlayedAction::Index(index)) => {
                let Some(index) = usize::try_from(index).ok().filter(|&a| a < n) else {
                    let names = self.schema.actions.iter().enumerate();
                    let names: Vec<_> = names.map(|(i, name)| format!("{i} ({name})")).collect();
                    let (id, names) = (self.spec.id, names.join(", "));
                    let message = format!("{id} has no action {index}: its actions are {names}");
                    return Err(EnvError::new(message));
                };
                self.env.dynamic_mut().step(index, rng)
            }
            (space, action) => {
                let action = checked_box(self.spec.id, &space, action)?;
                self.env.dynamic_mut().step_box(&action, rng)
            }
        };
        *elapsed = elapsed.saturating_add(1);
        self.seen = step.seen;
        self.mask.clone_from(&step.mask);
        Ok(SessionStep {
            obs: step.obs,
            reward: step.reward,
            terminated: step.terminated,
            truncated: self.limit.is_some_and(|limit| *elapsed >= limit),
            probability: step.probability,
            mask: step.mask,
        })
    }
}

/// The time limit of `spec`, unless `max_episode_steps` replaces it: -1 means none.
///
/// # Errors
/// If the replacement is 0, below -1, or beyond 2^32 - 1.
pub fn time_limit(spec: &EnvSpec, max_episode_steps: Option<i64>) -> Result<Option<u32>, EnvError> {
    match max_episode_steps {
        None => Ok(spec.max_steps),
        Some(-1) => Ok(None),
        Some(steps) => match u32::try_from(steps) {
            Ok(steps) if steps > 0 => Ok(Some(steps)),
            _ => {
                let message = format!(
                    "`max_episode_steps` must be between 1 and {}, or -1 for no limit, not {steps}",
                    u32::MAX
                );
                Err(EnvError::about("max_episode_steps", message))
            }
        },
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn session(id: &str) -> Session {
        Session::new(id, &Map::new()).unwrap()
    }

    fn seed() -> Seed {
        Seed::from(0)
    }

    #[test]
    fn order_and_actions_are_checked() {
        let mut cart = session("CartPole-v1");
        let message = cart.step(&0.into()).unwrap_err().message;
        assert!(message.contains("there was no reset before this step"), "{message}");
        assert_eq!(cart.reset(None, None).unwrap_err().message, "the first reset needs a seed");
        cart.reset(Some(&seed()), None).unwrap();
        for bad in [2i64, -1] {
            assert_eq!(
                cart.step(&bad.into()).unwrap_err().message,
                format!("CartPole-v1 has no action {bad}: its actions are 0 (left), 1 (right)")
            );
        }
        cart.step(&1.into()).unwrap();
    }

    #[test]
    fn a_failed_reset_changes_nothing() {
        let mut cart = session("CartPole-v1");
        cart.reset(Some(&seed()), None).unwrap();
        let mut untouched = cart.clone();
        let options = |value: Value| value.as_object().unwrap().clone();
        let bad = options(json!({"low": 1}));
        cart.reset(Some(&Seed::from(1)), Some(&bad)).unwrap_err();
        assert_eq!(cart.step(&0.into()).unwrap(), untouched.step(&0.into()).unwrap());
        assert_eq!(cart.reset(None, None).unwrap(), untouched.reset(None, None).unwrap());

        let unknown = options(json!({"lo": 1}));
        let error = cart.reset(None, Some(&unknown)).unwrap_err();
        assert_eq!(error.hint.as_deref(), Some("did you mean `low`?"));
        let error = session("FrozenLake-v1").reset(Some(&seed()), Some(&unknown)).unwrap_err();
        assert_eq!(error.message, "FrozenLake-v1 has no reset options, so no `lo`");
    }

    #[test]
    fn the_limit_truncates_and_stays_truncated() {
        let mut car = session("MountainCar-v0").with_max_episode_steps(2).unwrap();
        car.reset(Some(&seed()), None).unwrap();
        let truncated: Vec<_> = (0..4).map(|_| car.step(&1.into()).unwrap().truncated).collect();
        assert_eq!(truncated, [false, true, true, true]);
        car.reset(None, None).unwrap();
        assert!(!car.step(&1.into()).unwrap().truncated);
        let mut endless = session("MountainCar-v0").with_max_episode_steps(-1).unwrap();
        endless.reset(Some(&seed()), None).unwrap();
        assert!((0..1000).all(|_| !endless.step(&1.into()).unwrap().truncated));
        for bad in [0, -5, 1 << 32] {
            let error = session("MountainCar-v0").with_max_episode_steps(bad).unwrap_err();
            assert_eq!(error.key.as_deref(), Some("max_episode_steps"));
            assert!(error.message.ends_with(&format!("or -1 for no limit, not {bad}")));
        }
    }

    #[test]
    fn termination_and_truncation_may_coincide() {
        let kwargs = json!({"desc": ["SG"], "is_slippery": false});
        let lake = Session::new("FrozenLake-v1", kwargs.as_object().unwrap()).unwrap();
        let mut lake = lake.with_max_episode_steps(1).unwrap();
        lake.reset(Some(&seed()), None).unwrap();
        let step = lake.step(&2.into()).unwrap();
        assert!(step.terminated && step.truncated);
        assert_eq!(step.probability, Some(1.0));
    }

    #[test]
    fn attributes_are_set_before_the_first_reset() {
        let mut cart = session("CartPole-v1");
        let error = cart.set_attribute("integrator", &json!("euler")).unwrap_err();
        assert_eq!(error.key.as_deref(), Some("integrator"));
        cart.set_attribute("kinematics_integrator", &json!("semi-implicit euler")).unwrap();
        cart.reset(Some(&seed()), None).unwrap();
        let error = cart.set_attribute("kinematics_integrator", &json!("euler")).unwrap_err();
        assert_eq!(error.message, "`kinematics_integrator` must be set before the first reset");
    }

    #[test]
    fn observations_read_as_in_gymnasium() {
        let text = |obs: &Observation| serde_json::to_string(obs).unwrap();
        assert_eq!(text(&Observation::Index(7)), "7");
        assert_eq!(text(&Observation::Box(vec![0.1, -0.0, 1.0])), "[0.1,-0.0,1.0]");
        // The first observation of seed 0, as Gymnasium prints it.
        let obs = session("CartPole-v1").reset(Some(&seed()), None).unwrap();
        assert_eq!(text(&obs), "[0.013696169,-0.02302133,-0.045902647,-0.048347235]");
    }
}
