//! Everything that may be said about an instance of an environment, beside its id.

use serde_json::{Map, Value};

use super::actions::ActionTable;
use super::error::EnvError;
use super::registry::{AnyEnv, EnvSpec};
use crate::mdp::ActionSpace;

/// What distinguishes one instance of an environment from another.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EnvConfig {
    /// The constructor's arguments.
    pub kwargs: Map<String, Value>,
    /// Attributes that Gymnasium's users set on the instance, for example `CartPole`'s
    /// `kinematics_integrator`.
    pub attributes: Map<String, Value>,
    /// Gymnasium's reset options, for every reset.
    pub reset_options: Map<String, Value>,
    /// Where actions are real numbers: those that agents choose among, `[action][component]`;
    /// `None` for the environment's own choice.
    pub actions: Option<Vec<Vec<f64>>>,
}

impl EnvSpec {
    /// Builds the environment that `config` describes.
    ///
    /// # Errors
    /// If a name is unknown or a value is not allowed: the error's key names it.
    pub fn build(&self, config: &EnvConfig) -> Result<AnyEnv, EnvError> {
        let mut env = self.make(&config.kwargs)?;
        for (name, value) in &config.attributes {
            self.set_attribute(&mut env, name, value)?;
        }
        if !config.reset_options.is_empty() {
            self.set_reset_options(&mut env, &config.reset_options)?;
        }
        if let Some(rows) = &config.actions {
            let ActionSpace::Box { low, high } = env.action_space() else {
                let n = env.n_actions();
                let message = format!("the actions of {} are 0 to {}, as they are", self.id, n - 1);
                return Err(EnvError::about("actions", message).hint(
                    "leave out `actions`: it is for environments whose actions are real numbers",
                ));
            };
            env.dynamic_mut().set_action_table(ActionTable::new(rows, low, high)?);
        }
        Ok(env)
    }

    /// Sets an attribute of an instance.
    pub(super) fn set_attribute(
        &self,
        env: &mut AnyEnv,
        name: &str,
        value: &Value,
    ) -> Result<(), EnvError> {
        if !self.attributes.contains(&name) {
            return Err(EnvError::unknown_key(self.id, "attributes", name, self.attributes));
        }
        env.dynamic_mut().set_attribute(name, value)
    }

    /// Sets the options of the resets to come, those left out to their defaults.
    pub(super) fn set_reset_options(
        &self,
        env: &mut AnyEnv,
        options: &Map<String, Value>,
    ) -> Result<(), EnvError> {
        if let Some(key) = options.keys().find(|key| !self.reset_options.contains(&key.as_str())) {
            return Err(EnvError::unknown_key(self.id, "reset options", key, self.reset_options));
        }
        env.dynamic_mut().set_reset_options(options)
    }
}
