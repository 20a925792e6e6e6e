//! The keys of an experiment's map: one list for parsing, suggestions, `list` and the docs.

/// A key that `experiment(#{ … })` understands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Key {
    /// The key.
    pub name: &'static str,
    /// Its type, in words.
    pub kind: &'static str,
    /// What it does, and its default.
    pub doc: &'static str,
}

const fn key(name: &'static str, kind: &'static str, doc: &'static str) -> Key {
    Key { name, kind, doc }
}

/// Every key, in the order of the docs.
pub const KEYS: &[Key] = &[
    key("name", "string", "the variant's name in tables and files; default: the agent's"),
    key("env", "id or env(..)", "the environment (required)"),
    key("agent", "agent", "what learns or plans: q_learning(#{..}), … (required)"),
    key(
        "discretiser",
        "bins(..), cells(..), ..",
        "state → cell, or → features: tiles(..), fourier(..); needed where states are not finite",
    ),
    key(
        "actions",
        "array, bins(..) or cells(..)",
        "where actions are real numbers: those the agent chooses among; default: `list envs`",
    ),
    key("attributes", "map", "attributes of the environment: #{ torque_noise_max: 0.5 }"),
    key("reset_options", "map", "options of every reset: #{ low: -0.6, high: -0.4 }"),
    key("frame_skip", "integer", "how many steps an action is repeated; rewards add up; default 1"),
    key(
        "clip_reward",
        "[low, high]",
        "clips the learned reward before the potential's part; changes the problem",
    ),
    key(
        "normalise",
        "true or ranges",
        "the discretiser sees fields as [-1, 1]: #{ x_dot: [-3.0, 3.0] }, or all from their bounds",
    ),
    key("episodes", "integer", "episodes per seed; default 500"),
    key("seeds", "integer or array", "20 means seeds 0 to 19; or the seeds themselves; default 20"),
    key("max_steps", "integer", "time limit per episode; default: the environment's; 0 for none"),
    key("threshold", "number", "rolling-mean return that counts as solved; default: Gymnasium's"),
    key("window", "integer", "episodes in the rolling mean; default 20"),
    key(
        "stop_when_solved",
        "bool",
        "ends the training of a seed as soon as its rolling mean reaches the threshold",
    ),
    key(
        "potential",
        "|s| number, |s, episode| number or learned(eta)",
        "Φ(s): the host adds γΦ(s′) − Φ(s) with the agent's γ and Φ(terminal) = 0",
    ),
    key(
        "potential_on",
        "\"cell\" or \"raw\"",
        "evaluate Φ on the cell's representative (default, keeps the guarantee) or the raw state \
         (always with tiles and fourier)",
    ),
    key("potential_shift", "number", "added to Φ, except of terminal states; default 0"),
    key(
        "advice",
        "|s, a| number",
        "Φ(s, a): adds γΦ(s′, a′) − Φ(s, a), a′ being the action bootstrapped from",
    ),
    key(
        "advice_on",
        "\"look_ahead\" or \"look_back\"",
        "look_back adds Φ(s, a) − Φ of the step before / γ, for on-policy learners",
    ),
    key("reward", "|t| number", "replaces the reward the agent learns from"),
    key("terms", "#{ name: |t| number, .. }", "extra reward terms, each logged under its name"),
    key(
        "allowed",
        "|s, a| bool",
        "a shield: what it refuses is neither taken nor bootstrapped from",
    ),
    key("notes", "string", "the rationale, carried into the manifest"),
];

/// Names of all keys.
pub fn names() -> impl Iterator<Item = &'static str> + Clone {
    KEYS.iter().map(|k| k.name)
}
