//! What builds the plan.

use super::{Call, Known, Parameter, arg, call, function, method, pattern};

const NUMBER: &str = "int | float";
const EXPERIMENT: Parameter = arg("experiment", "Experiment");
const STUDY: Parameter = arg("study", "Study");
const KEYS: Parameter = pattern("keys", "Map", "map");
const STEPS: Parameter = pattern("options", "Map", "#{ steps: true }");
const CELL: Parameter = pattern("cell", "FnPtr", "|s| i");

const LINEAR: Call = call(
    &[arg("start", NUMBER), arg("end", NUMBER), arg("n", "int")],
    "Schedule",
    "linear(1.0, 0.05, 500)",
);
const EXPONENTIAL: Call = call(
    &[arg("start", NUMBER), arg("factor", NUMBER), arg("min", NUMBER)],
    "Schedule",
    "exponential(1.0, 0.995, 0.01)",
);

pub(super) const BUILDERS: &[Known] = &[
    function(
        "experiment",
        &[call(
            &[KEYS],
            "Experiment",
            "experiment(#{ env: \"CartPole-v1\", agent: q_learning(#{ gamma: 0.99 }) })",
        )],
        "one variant; its keys are listed under `list keys`",
    ),
    method(
        "with",
        &[call(
            &[EXPERIMENT, KEYS],
            "Experiment",
            "experiment(#{ env: \"CartPole-v1\" }).with(#{ name: \"shaped\", potential: |s| s.x })",
        )],
        "a copy with some keys changed; maps inside (agent, env, terms) are merged",
    ),
    function(
        "study",
        &[call(
            &[arg("name", "String"), pattern("experiments", "Array", "[experiments]")],
            "Study",
            "study(\"cartpole\", [experiment(#{ env: \"CartPole-v1\" })])",
        )],
        "the plan: variants to compare",
    ),
    method(
        "expect",
        &[call(
            &[STUDY, arg("text", "String"), pattern("check", "FnPtr", "|r| bool")],
            "Study",
            "study(\"s\", []).expect(\"it learns\", |r| r.plain.final_return.mean > 195.0)",
        )],
        "a claim about the results, r.<variant>.<statistic>; decides the exit code",
    ),
    method(
        "baseline",
        &[call(&[STUDY, arg("name", "String")], "Study", "study(\"s\", []).baseline(\"plain\")")],
        "the variant that the others are compared with",
    ),
    method(
        "golden",
        &[call(
            &[STUDY, pattern("budget", "Map", "#{ episodes: 200, seeds: 2 }")],
            "Study",
            "study(\"s\", []).golden(#{ episodes: 200, seeds: 2 })",
        )],
        "how much of the study its golden file covers; these are the defaults",
    ),
    method(
        "notes",
        &[call(
            &[STUDY, arg("text", "String")],
            "Study",
            "study(\"s\", []).notes(\"why these bins\")",
        )],
        "the rationale, carried into the manifest",
    ),
    function(
        "env",
        &[
            call(&[arg("id", "String")], "Environment", "env(\"Taxi-v4\")"),
            call(
                &[arg("id", "String"), pattern("kwargs", "Map", "#{kwargs}")],
                "Environment",
                "env(\"FrozenLake-v1\", #{ map_name: \"8x8\", is_slippery: false })",
            ),
        ],
        "an environment with Gymnasium's constructor arguments",
    ),
    function(
        "generate_random_map",
        &[call(
            &[arg("size", "int"), arg("p", NUMBER), arg("seed", "int")],
            "Array",
            "generate_random_map(8, 0.8, 42)",
        )],
        "Gymnasium's random map for FrozenLake's `desc`: tiles are ice with probability p",
    ),
    function(
        "bins",
        &[
            call(
                &[pattern("ranges", "Map", "#{ field: [lo, hi, n], .. }")],
                "Discretiser",
                "bins(#{ theta: [-0.5, 0.5, 24], theta_dot: [-2.0, 2.0, 24] })",
            ),
            call(
                &[pattern("ranges", "Array", "[[lo, hi, n], ..]")],
                "Discretiser",
                "bins([[-1.2, 0.6, 40], [-0.07, 0.07, 40]])",
            ),
        ],
        "uniform bins: NumPy's linspace and digitize, clamped; fields left out are ignored",
    ),
    function(
        "cells",
        &[
            call(
                &[arg("n", "int"), CELL],
                "Discretiser",
                "cells(2, |s| if s.theta > 0.0 { 1 } else { 0 })",
            ),
            call(
                &[pattern("sizes", "Array", "[n1, n2]"), pattern("cell", "FnPtr", "|s| [i, j]")],
                "Discretiser",
                "cells([5, 5], |s| [s.row, s.col])",
            ),
        ],
        "scripted cells, numbered from 0",
    ),
    function(
        "tiles",
        &[
            call(
                &[pattern("ranges", "Map", "#{ field: [lo, hi, n], .., tilings: 8 }")],
                "Discretiser",
                "tiles(#{ position: [-1.2, 0.6, 8], velocity: [-0.07, 0.07, 8], tilings: 8 })",
            ),
            call(
                &[pattern("ranges", "Array", "[[lo, hi, n], ..]"), pattern("tilings", "int", "8")],
                "Discretiser",
                "tiles([[-1.2, 0.6, 8], [-0.07, 0.07, 8]], 8)",
            ),
        ],
        "tile coding for linear values: offset tilings of n tiles per field, without hashing",
    ),
    function(
        "fourier",
        &[
            call(&[arg("order", "int")], "Discretiser", "fourier(3)"),
            call(
                &[pattern("ranges", "Map", "#{ order: 3, field: [lo, hi], .. }")],
                "Discretiser",
                "fourier(#{ order: 3, position: [-1.2, 0.6] })",
            ),
        ],
        "the Fourier basis for linear values, over all fields or those that are named",
    ),
    function(
        "learned",
        &[call(&[arg("eta", NUMBER)], "LearnedPotential", "learned(0.5)")],
        "a potential of eta times the learner's own state values, eta · max Q(s, a)",
    ),
    function(
        "constant",
        &[call(&[arg("value", NUMBER)], "Schedule", "constant(0.1)")],
        "a schedule that does not change",
    ),
    function(
        "linear",
        &[
            LINEAR,
            call(
                &[arg("start", NUMBER), arg("end", NUMBER), arg("n", "int"), STEPS],
                "Schedule",
                "linear(1.0, 0.05, 10000, #{ steps: true })",
            ),
        ],
        "from start to end over n episodes (or steps)",
    ),
    function(
        "exponential",
        &[
            EXPONENTIAL,
            call(
                &[arg("start", NUMBER), arg("factor", NUMBER), arg("min", NUMBER), STEPS],
                "Schedule",
                "exponential(1.0, 0.9999, 0.01, #{ steps: true })",
            ),
        ],
        "start · factorⁿ per episode (or step), at least min",
    ),
    function(
        "visit_count",
        &[
            call(&[], "StepSize", "visit_count()"),
            call(&[arg("omega", NUMBER)], "StepSize", "visit_count(0.8)"),
        ],
        "a step size: 1/N(s, a), or N(s, a)^-omega",
    ),
    function(
        "softmax",
        &[call(&[arg("temperature", NUMBER)], "BehaviourPolicy", "softmax(0.5)")],
        "exploration: actions weigh exp(Q / temperature)",
    ),
    function(
        "ucb",
        &[call(&[arg("c", NUMBER)], "BehaviourPolicy", "ucb(2.0)")],
        "exploration: the largest Q + c √(ln N(s) / N(s, a)), actions never tried first",
    ),
];
