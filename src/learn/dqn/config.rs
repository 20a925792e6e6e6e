//! The numbers of a DQN agent.

use crate::learn::{AgentConfig, ParamValue, Schedule};
use crate::nn::Loss;

/// How a DQN agent learns, by the names of its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct DqnConfig {
    /// Step size of the optimiser.
    pub learning_rate: Schedule,
    /// Transitions that the replay buffer holds.
    pub buffer_size: usize,
    /// Steps before learning starts; until then actions are random.
    pub learning_starts: u64,
    /// Transitions in a minibatch.
    pub batch_size: usize,
    /// How far the target network moves towards the other at an update; 1 copies it.
    pub tau: f64,
    /// Discount factor γ.
    pub gamma: f64,
    /// Steps between two trainings.
    pub train_freq: u64,
    /// Gradient steps of a training.
    pub gradient_steps: u64,
    /// Steps between two updates of the target network.
    pub target_update_interval: u64,
    /// Exploration rate.
    pub epsilon: Schedule,
    /// Length to which gradients are shortened.
    pub max_grad_norm: Option<f32>,
    /// Units of each hidden layer.
    pub net_arch: Vec<usize>,
    /// What is minimised.
    pub loss: Loss,
    /// Whether the network has dueling heads.
    pub dueling: bool,
    /// Rewards that a target looks ahead.
    pub n_steps: usize,
    /// Whether a minibatch may hold a transition twice.
    pub replace: bool,
    /// Replay by priorities.
    pub priorities: Option<Priorities>,
    /// Steps between two entries of the log.
    pub log_interval: u64,
    /// Whether the network that learns chooses the action that the target network evaluates.
    pub double: bool,
}

/// How replay prefers transitions with large errors (Schaul et al. 2016).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Priorities {
    /// A priority is `(|δ| + eps)^alpha`.
    pub alpha: f64,
    /// How far importance weights correct for it: `(N · P)^−beta`.
    pub beta: Schedule,
    /// What keeps priorities from 0.
    pub eps: f64,
}

impl DqnConfig {
    /// From an agent's parameters.
    pub fn new(c: &AgentConfig, double: bool) -> Self {
        let max_grad_norm = match c.params["max_grad_norm"] {
            ParamValue::Float(x) => Some(x as f32),
            _ => None,
        };
        let priorities = c.is_on("prioritized_replay").then(|| Priorities {
            alpha: c.float("prioritized_replay_alpha"),
            beta: c.schedule("prioritized_replay_beta"),
            eps: c.float("prioritized_replay_eps"),
        });
        Self {
            learning_rate: c.schedule("learning_rate"),
            buffer_size: c.int("buffer_size") as usize,
            learning_starts: c.int("learning_starts"),
            batch_size: c.int("batch_size") as usize,
            tau: c.float("tau"),
            gamma: c.float("gamma"),
            train_freq: c.int("train_freq"),
            gradient_steps: c.int("gradient_steps"),
            target_update_interval: c.int("target_update_interval"),
            epsilon: c.schedule("epsilon"),
            max_grad_norm,
            net_arch: c.widths("net_arch"),
            loss: if c.word("loss") == "huber" { Loss::Huber } else { Loss::SquaredError },
            dueling: c.is_on("dueling"),
            n_steps: c.int("n_steps") as usize,
            replace: c.is_on("replace"),
            priorities,
            log_interval: c.int("log_interval"),
            double,
        }
    }
}
