//! What deep Q-learning must agree with: its equations written out, PyTorch's numbers, theorems.

mod agent;
mod identity;
mod replay;
mod resume;
mod shadow;
mod targets;

use super::{Dqn, DqnConfig, NetworkSetup};
use crate::learn::{Last, Learn, Schedule};
use crate::mdp::Action;
use crate::mdp::streams::Stream;
use crate::nn::Loss;
use crate::shaping::{ActionSet, Fields, Inputs, MAX_FIELDS};

const N_FIELDS: usize = 3;
const N_ACTIONS: usize = 4;

/// DQN without options, small.
fn config() -> DqnConfig {
    DqnConfig {
        learning_rate: Schedule::constant(0.01),
        buffer_size: 40,
        learning_starts: 0,
        batch_size: 8,
        tau: 1.0,
        gamma: 0.9,
        train_freq: 1,
        gradient_steps: 1,
        target_update_interval: 10,
        epsilon: Schedule::constant(0.3),
        max_grad_norm: None,
        net_arch: vec![9, 5],
        loss: Loss::SquaredError,
        dueling: false,
        n_steps: 1,
        replace: false,
        priorities: None,
        log_interval: 1 << 40,
        double: false,
    }
}

fn setup(shielded: bool, seed: u64) -> NetworkSetup {
    let inputs = Inputs::fields(N_FIELDS, &[]);
    NetworkSetup { inputs, n_actions: N_ACTIONS, shielded, seed, model: None }
}

fn agent(config: &DqnConfig) -> Dqn {
    Dqn::new(config.clone(), setup(false, 1))
}

fn fields(numbers: [f64; N_FIELDS], allowed: ActionSet) -> Fields {
    let mut values = [0.0; MAX_FIELDS];
    values[..N_FIELDS].copy_from_slice(&numbers);
    Fields { values, index: 0, allowed }
}

/// What happened in a step, for whoever wants to know.
#[derive(Debug, Clone, Copy)]
struct Step {
    s: Fields,
    a: Action,
    reward: f64,
    /// The state that followed; `None` if it is terminal.
    next: Option<Fields>,
    ended: bool,
}

/// A world of chance: states, rewards and how episodes end depend on nothing.
#[derive(Debug, Clone)]
struct Chance {
    stream: Stream,
    shielded: bool,
}

impl Chance {
    fn new(shielded: bool) -> Self {
        Self { stream: Stream::new(4, "chance"), shielded }
    }

    fn state(&mut self) -> Fields {
        let numbers = [(); N_FIELDS].map(|()| 2.0 * self.stream.uniform() - 1.0);
        // One or more of the actions.
        let allowed = 1 + self.stream.below((1 << N_ACTIONS) - 1) as u64;
        let allowed = if self.shielded { ActionSet(allowed) } else { ActionSet::ALL };
        fields(numbers, allowed)
    }

    /// Plays an episode of up to 12 steps; `each` sees the agent after each of them.
    fn episode(&mut self, agent: &mut Dqn, mut each: impl FnMut(&Step, &Dqn)) {
        let mut s = self.state();
        let mut a = agent.begin(s);
        for i in 0.. {
            let reward = 4.0 * self.stream.uniform() - 2.0;
            let u = self.stream.uniform();
            let next = self.state();
            let (terminated, truncated) = (u < 0.1, i == 11 || u > 0.95);
            let ended = terminated || truncated;
            let step = Step { s, a, reward, next: (!terminated).then_some(next), ended };
            match (terminated, truncated) {
                (true, _) => agent.end(reward, Last::Terminated),
                (_, true) => agent.end(reward, Last::Truncated(next)),
                _ => a = agent.step(reward, next),
            }
            each(&step, agent);
            if ended {
                return;
            }
            s = next;
        }
    }
}
