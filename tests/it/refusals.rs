//! What the environments refuse, and in which words. Gymnasium refuses most of it too (with an
//! `AssertionError` that may be empty); what it takes silently is marked.

use runner::env::{PlayedAction, Session, specs};
use runner::mdp::ActionSpace;
use serde_json::{Map, Value, json};

fn map(value: &Value) -> Map<String, Value> {
    value.as_object().unwrap().clone()
}

fn session(id: &str) -> Session {
    let mut session = Session::new(id, &Map::new()).unwrap();
    session.reset(Some(&0.into()), None).unwrap();
    session
}

#[test]
fn actions_that_do_not_exist_leave_the_episode_as_it_was() {
    for spec in specs() {
        let (mut env, mut untouched) = (session(spec.id), session(spec.id));
        let refused = match env.action_space() {
            ActionSpace::Discrete(n) => vec![
                PlayedAction::Index(n as i64),
                // Acrobot-v1 takes -1 in Gymnasium.
                PlayedAction::Index(-1),
                PlayedAction::Box(vec![0.0]),
            ],
            ActionSpace::Box { low, .. } => vec![
                PlayedAction::Index(0),
                PlayedAction::Box(vec![]),
                PlayedAction::Box(vec![0.0; low.len() + 1]),
                // Taken in Gymnasium, and the state is NaN from then on.
                PlayedAction::Box(vec![f64::NAN; low.len()]),
                PlayedAction::Box(vec![f64::INFINITY; low.len()]),
            ],
        };
        for action in refused {
            let error = env.step(&action).unwrap_err().message;
            let shown = action.to_string();
            let named = error.contains(spec.id) || error.contains("finite");
            assert!(named && error.contains(&shown), "{}: {shown}: {error}", spec.id);
        }
        let action = env.action(0);
        assert_eq!(env.step(&action).unwrap(), untouched.step(&action).unwrap(), "{}", spec.id);
    }
}

#[test]
fn every_environment_wants_a_reset_first() {
    for spec in specs() {
        let mut env = Session::new(spec.id, &Map::new()).unwrap();
        let error = env.step(&env.action(0)).unwrap_err().message;
        assert_eq!(
            error, "an episode starts with a reset: there was no reset before this step",
            "{}",
            spec.id
        );
    }
}

#[test]
fn numbers_beyond_the_box_are_clipped_as_in_gymnasium() {
    // Gymnasium: Pendulum-v1, reset(seed=0), step([5.]).
    let step = session("Pendulum-v1").step(&PlayedAction::Box(vec![5.0])).unwrap();
    assert_eq!(serde_json::to_string(&step.obs).unwrap(), "[0.6364055,0.7713547,0.40822718]");
    assert_eq!(step.reward.to_string(), "-0.7657553094639244");
}

#[test]
fn reset_options_are_checked() {
    for (id, options, message) in [
        (
            "CartPole-v1",
            json!({"low": 0.1, "high": -0.1}),
            "the reset option `low` (0.1) must not exceed `high` (-0.1)",
        ),
        ("CartPole-v1", json!({"low": "x"}), "the reset option `low` must be a number, not \"x\""),
        ("CartPole-v1", json!({"low": null}), "the reset option `low` must be a number, not null"),
        (
            "CartPole-v1",
            json!({"low": [1, 2]}),
            "the reset option `low` must be a number, not [1,2]",
        ),
        (
            "MountainCar-v0",
            json!({"low": -0.3}),
            "the reset option `low` (-0.3) must not exceed `high` (-0.4)",
        ),
        (
            "MountainCarContinuous-v0",
            json!({"low": 1, "high": 0}),
            "the reset option `low` (1) must not exceed `high` (0)",
        ),
        (
            "Acrobot-v1",
            json!({"low": 0.2, "high": 0.1}),
            "the reset option `low` (0.2) must not exceed `high` (0.1)",
        ),
        (
            "Pendulum-v1",
            json!({"x_init": -1.0}),
            "the reset option `x_init` must be a number of 0 or more that spans a finite range, not -1.0",
        ),
        (
            "Pendulum-v1",
            json!({"y_init": "a"}),
            "the reset option `y_init` must be a number, not \"a\"",
        ),
        // Ignored in Gymnasium, as the next two.
        (
            "Pendulum-v1",
            json!({"low": 1}),
            "`low` is not among the reset options of Pendulum-v1: `x_init`, `y_init`",
        ),
        ("FrozenLake-v1", json!({"low": 5}), "FrozenLake-v1 has no reset options, so no `low`"),
        ("LunarLander-v3", json!({"low": 5}), "LunarLander-v3 has no reset options, so no `low`"),
    ] {
        let mut env = session(id);
        let error = env.reset(None, Some(&map(&options))).unwrap_err();
        assert_eq!(error.message, message);
        assert!(error.key.is_some(), "{message}");
    }
    let zero = session("Acrobot-v1").reset(None, Some(&map(&json!({"low": 0.0, "high": 0.0}))));
    assert_eq!(serde_json::to_value(zero.unwrap()).unwrap(), json!([1.0, 0.0, 1.0, 0.0, 0.0, 0.0]));
    let up = session("Pendulum-v1").reset(None, Some(&map(&json!({"x_init": 0, "y_init": 0}))));
    assert_eq!(serde_json::to_value(up.unwrap()).unwrap(), json!([1.0, 0.0, 0.0]));
}

#[test]
fn constructor_arguments_are_checked() {
    for (id, kwargs, message) in [
        // Taken in Gymnasium until the first step.
        ("Pendulum-v1", json!({"g": "x"}), "`g` must be a finite number, not \"x\""),
        ("Acrobot-v1", json!({"dt": 0.1}), "Acrobot-v1 has no arguments, so no `dt`"),
        (
            "LunarLander-v3",
            json!({"gravity": 0.0}),
            "`gravity` must be between -12 and 0 (excluded), not 0",
        ),
        (
            "LunarLander-v3",
            json!({"gravity": -12.0}),
            "`gravity` must be between -12 and 0 (excluded), not -12",
        ),
        (
            "LunarLander-v3",
            json!({"gravity": 1.0}),
            "`gravity` must be between -12 and 0 (excluded), not 1",
        ),
        // A warning in Gymnasium, as the next one.
        (
            "LunarLander-v3",
            json!({"wind_power": 25.0}),
            "`wind_power` must be between 0 and 20, not 25",
        ),
        (
            "LunarLander-v3",
            json!({"turbulence_power": -1.0}),
            "`turbulence_power` must be between 0 and 2, not -1",
        ),
        (
            "LunarLander-v3",
            json!({"shaping": "non"}),
            "`shaping` must be one of `native`, `none`, not \"non\"",
        ),
        ("LunarLander-v3", json!({"fuel_cost": -1.0}), "`fuel_cost` must be 0 or more, not -1"),
    ] {
        let error = Session::new(id, &map(&kwargs)).unwrap_err();
        assert_eq!(error.message, message, "{id} {kwargs}");
        assert!(error.key.is_some(), "{message}");
    }
}
