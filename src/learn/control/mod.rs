//! Temporal-difference control: agents that learn a table of action values step by step (Sutton &
//! Barto 2018, chapters 6 to 8 and 12).
//!
//! - one step: [`QLearning`], [`Sarsa`], [`ExpectedSarsa`], [`DoubleQLearning`], [`SoftQLearning`]
//! - several: [`NStepSarsa`], and with eligibility [`Trace`]s [`SarsaLambda`] and [`QLambda`]
//! - with a model learned on the way: [`DynaQ`]
//! - with advice on actions: [`Advised`]
//! - [`Tabular`]: what they share
//!
//! Every one bootstraps from the state in which an episode was truncated and from no terminal
//! state, and takes into account only actions that the shield allows.

mod advised;
mod double_q_learning;
mod dyna_q;
mod expected_sarsa;
mod n_step_sarsa;
mod q_lambda;
mod q_learning;
mod sarsa;
mod sarsa_lambda;
mod soft_q_learning;
mod tabular;
mod traces;

pub use advised::{Advised, Backup};
pub use double_q_learning::DoubleQLearning;
pub use dyna_q::DynaQ;
pub use expected_sarsa::ExpectedSarsa;
pub use n_step_sarsa::NStepSarsa;
pub use q_lambda::QLambda;
pub use q_learning::QLearning;
pub use sarsa::Sarsa;
pub use sarsa_lambda::SarsaLambda;
pub use soft_q_learning::SoftQLearning;
pub use tabular::{Tabular, td_error};
pub use traces::{Trace, Traces};

#[cfg(test)]
mod tests;
