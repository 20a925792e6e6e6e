//! Agents that learn a network.

use super::shared::{EPSILON, GAMMA, UNIT};
use super::{AgentSpec, Build};
use crate::learn::dqn::{Dqn, DqnConfig};
use crate::learn::{ParamKind, ParamSpec, ParamValue, Schedule, Unit, Widths};

const COUNT: ParamKind = ParamKind::Int { min: 1 };

const fn count(name: &'static str, default: u64, doc: &'static str) -> ParamSpec {
    ParamSpec { name, kind: COUNT, function: None, default: ParamValue::Int(default), doc }
}

const fn switch(name: &'static str, doc: &'static str) -> ParamSpec {
    let default = ParamValue::Bool(false);
    ParamSpec { name, kind: ParamKind::Bool, function: None, default, doc }
}

const fn maybe(name: &'static str, max: f64, doc: &'static str) -> ParamSpec {
    let default = ParamValue::Word(ParamKind::NONE);
    ParamSpec { name, kind: ParamKind::Maybe { max }, function: None, default, doc }
}

const NET_ARCH: Widths = match Widths::new(&[24, 24]) {
    Some(widths) => widths,
    None => panic!("these are widths"),
};

/// By the names of Stable-Baselines3.
const PARAMS: &[ParamSpec] = &[
    ParamSpec {
        name: "learning_rate",
        kind: ParamKind::Rate { open: false },
        function: None,
        default: ParamValue::Schedule(Schedule::Constant { value: 0.001 }),
        doc: "step size of Adam: a number or a schedule",
    },
    GAMMA,
    ParamSpec {
        default: ParamValue::Schedule(Schedule::Exponential {
            start: 1.0,
            factor: 0.99,
            min: 0.01,
            unit: Unit::Episode,
        }),
        ..EPSILON
    },
    ParamSpec {
        name: "net_arch",
        kind: ParamKind::Widths,
        function: None,
        default: ParamValue::Widths(NET_ARCH),
        doc: "units of each hidden layer, all rectified",
    },
    count("batch_size", 64, "transitions in a minibatch"),
    count("buffer_size", 2000, "transitions that the replay buffer holds"),
    ParamSpec {
        name: "learning_starts",
        kind: ParamKind::Int { min: 0 },
        function: None,
        default: ParamValue::Int(0),
        doc: "random steps before learning starts, which also needs a full minibatch",
    },
    count("train_freq", 1, "steps between two trainings"),
    count("gradient_steps", 1, "minibatches of a training"),
    count("target_update_interval", 50, "steps between two updates of the target network"),
    ParamSpec {
        name: "tau",
        kind: ParamKind::Float { min: 0.0, max: 1.0, open: true },
        function: None,
        default: ParamValue::Float(1.0),
        doc: "how far an update moves the target network; 1 copies",
    },
    ParamSpec {
        name: "loss",
        kind: ParamKind::Word(&["mse", "huber"]),
        function: None,
        default: ParamValue::Word("mse"),
        doc: "what is minimised: the squared error, or beyond 1 its size",
    },
    maybe("max_grad_norm", f64::INFINITY, "length to which a longer gradient is shortened"),
    count("n_steps", 1, "rewards that a target looks ahead"),
    switch("dueling", "action values as a value and advantages (Wang et al. 2016)"),
    switch("replace", "draw minibatches with replacement"),
    switch("prioritized_replay", "draw transitions with large errors more often"),
    ParamSpec {
        name: "prioritized_replay_alpha",
        kind: UNIT,
        function: None,
        default: ParamValue::Float(0.6),
        doc: "how much more often: priorities are (|δ| + eps)^alpha",
    },
    ParamSpec {
        name: "prioritized_replay_beta",
        kind: ParamKind::Rate { open: false },
        function: None,
        default: ParamValue::Schedule(Schedule::Constant { value: 0.4 }),
        doc: "how far weights correct for it, 1 wholly: a number or a schedule",
    },
    ParamSpec {
        name: "prioritized_replay_eps",
        kind: ParamKind::Float { min: 0.0, max: f64::INFINITY, open: true },
        function: None,
        default: ParamValue::Float(1e-6),
        doc: "what keeps priorities above 0",
    },
    maybe("exploration_fraction", 1.0, "part of the episodes over which epsilon falls linearly"),
    maybe("exploration_initial_eps", 1.0, "where it starts; 1 if only the others are given"),
    maybe("exploration_final_eps", 1.0, "where it ends; 0.05 if only the others are given"),
    count("log_interval", 1000, "steps between two lines of learning.csv"),
];

/// CleanRL's names, and those of tutorials.
const ALIASES: &[(&str, &str)] = &[
    ("lr", "learning_rate"),
    ("alpha", "learning_rate"),
    ("memory_size", "buffer_size"),
    ("replay_size", "buffer_size"),
    ("memory", "buffer_size"),
    ("maxlen", "buffer_size"),
    ("minibatch_size", "batch_size"),
    ("batch", "batch_size"),
    ("train_frequency", "train_freq"),
    ("target_network_frequency", "target_update_interval"),
    ("target_update", "target_update_interval"),
    ("target_update_freq", "target_update_interval"),
    ("start_e", "exploration_initial_eps"),
    ("end_e", "exploration_final_eps"),
    ("eps_start", "exploration_initial_eps"),
    ("eps_end", "exploration_final_eps"),
    ("eps_decay", "epsilon"),
    ("epsilon_decay", "epsilon"),
    ("hidden_layers", "net_arch"),
    ("hidden", "net_arch"),
    ("layers", "net_arch"),
    ("policy_kwargs", "net_arch"),
    ("max_grad", "max_grad_norm"),
    ("n_step", "n_steps"),
    ("n", "n_steps"),
    ("per", "prioritized_replay"),
    ("prioritized", "prioritized_replay"),
    ("prioritised_replay", "prioritized_replay"),
    ("duelling", "dueling"),
    ("loss_fn", "loss"),
    ("learn_start", "learning_starts"),
    ("warmup", "learning_starts"),
];

pub(super) const DQN: AgentSpec = AgentSpec {
    name: "dqn",
    doc: "deep Q-learning: a network, replay and a target network (Mnih et al. 2015)",
    params: PARAMS,
    build: Build::Network(|c, setup| Dqn::new(DqnConfig::new(c, false), setup)),
    aliases: ALIASES,
    linear: None,
};

pub(super) const DOUBLE_DQN: AgentSpec = AgentSpec {
    name: "double_dqn",
    doc: "DQN whose own network chooses what the target network values (van Hasselt et al. 2016)",
    build: Build::Network(|c, setup| Dqn::new(DqnConfig::new(c, true), setup)),
    ..DQN
};
