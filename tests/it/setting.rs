//! The keys that set up and wrap an environment: actions, attributes, reset options, frame skip,
//! reward clipping, normalisation.

use std::sync::atomic::AtomicBool;

use runner::experiment::{audit_variant, run_unit};
use runner::mdp::numpy::NumpyRng;
use runner::mdp::streams::Stream;
use runner::script::{DiscretiserSpec, Host, Plan, Variant, load};

use crate::support::{folder, write};

/// The plan of an experiment with these keys.
fn plan(keys: &str) -> Plan {
    let folder = folder();
    let script = write(folder.path(), "s.rhai", &format!("experiment(#{{ {keys} }})"));
    load(&script).unwrap_or_else(|d| panic!("{d}"))
}

fn only(plan: &Plan) -> &Variant {
    &plan.variants[0]
}

/// Per episode: steps, native return, learned return.
fn episodes(plan: &Plan) -> Vec<(u32, f64, f64)> {
    let host = Host::open(plan).unwrap();
    let record =
        run_unit(&host, only(plan), 0, &AtomicBool::new(false), &mut |_| {}).expect("it runs");
    record.rows.iter().map(|row| (row.steps, row.native, row.learned)).collect()
}

#[test]
fn actions_are_listed_spaced_or_scripted() {
    let actions = |actions: &str| {
        let plan =
            plan(&format!("env: \"Pendulum-v1\", agent: random_agent(#{{}}), actions: {actions}"));
        only(&plan).environment().unwrap().schema().actions
    };
    assert_eq!(actions("[[-2.0], [0], 1.5]"), ["-2", "0", "1.5"]);
    assert_eq!(actions("bins([[-2.0, 2.0, 5]])"), ["-2", "-1", "0", "1", "2"]);
    assert_eq!(actions("bins([[-2.0, 1.0, 1]])"), ["-0.5"]);
    assert_eq!(actions("cells(3, |i| [i - 1.5])"), ["-1.5", "-0.5", "0.5"]);
    assert_eq!(actions("cells(2, |i| 2 * i)"), ["0", "2"]);
}

#[test]
fn the_agent_plays_the_actions_it_was_given() {
    // With a single torque every agent plays it: the pendulum's energy falls or stays with none.
    let returns = |torque: &str| {
        let keys = format!(
            "env: \"Pendulum-v1\", agent: random_agent(#{{}}), episodes: 3, actions: [{torque}]"
        );
        episodes(&plan(&keys))
    };
    let mut session = runner::env::Session::new("Pendulum-v1", &serde_json::Map::new()).unwrap();
    for (torque, action) in [("0.0", 0.0), ("1.25", 1.25)] {
        let action = runner::env::PlayedAction::Box(vec![action]);
        session.reset(Some(&0.into()), None).unwrap();
        for (steps, native, _) in returns(torque) {
            let mut total = 0.0;
            for _ in 0..steps {
                total += session.step(&action).unwrap().reward;
            }
            assert_eq!((steps, native), (200, total), "{torque}");
            session.reset(None, None).unwrap();
        }
    }
}

#[test]
fn attributes_and_reset_options_reach_the_training() {
    let keys = |rest: &str| {
        format!("env: \"Acrobot-v1\", agent: random_agent(#{{}}), episodes: 2, max_steps: 50{rest}")
    };
    let lengths = |rest: &str| episodes(&plan(&keys(rest))).iter().map(|e| e.0).collect::<Vec<_>>();
    assert_eq!(lengths(""), [50, 50]);
    // Started upright, folded and fast, the tip is soon above the height.
    assert_eq!(lengths(", reset_options: #{ low: 3.1, high: 3.14 }"), [2, 2]);
    let high = episodes(&plan(
        "env: \"MountainCar-v0\", agent: random_agent(#{}), episodes: 4, reset_options: #{ low: 0.5, high: 0.6 }",
    ));
    // Right of the goal a car is there after a step, unless it rolls back.
    assert!(high.iter().filter(|e| e.0 == 1).count() >= 2, "{high:?}");
    let still =
        plan(&keys(", attributes: #{ dt: 1e-9 }, reset_options: #{ low: 3.1415, high: 3.1415 }"));
    let env = only(&still).environment().unwrap();
    assert_eq!(only(&still).config.attributes["dt"], 1e-9);
    assert_eq!(env.n_actions(), 3);
}

#[test]
fn frame_skip_repeats_actions_and_adds_up_rewards() {
    let keys = |skip: u32, limit: u32| {
        format!(
            "env: \"MountainCar-v0\", agent: random_agent(#{{}}), episodes: 1, frame_skip: {skip}, max_steps: {limit}"
        )
    };
    // 50 environment steps are 12 whole decisions and one of two frames.
    assert_eq!(episodes(&plan(&keys(4, 50))), [(13, -50.0, -50.0)]);
    assert_eq!(episodes(&plan(&keys(1, 50))), [(50, -50.0, -50.0)]);

    // By hand: the same decisions of the same stream, each played four times.
    let keys = "env: \"CartPole-v1\", agent: random_agent(#{}), episodes: 5, frame_skip: 4";
    let mut env = runner::env::cart_pole::CartPole::new(false);
    let (mut rng, mut agent) = (NumpyRng::from_u64(0), Stream::new(0, "agent"));
    let by_hand: Vec<(u32, f64, f64)> = (0..5)
        .map(|_| {
            use runner::mdp::Env;
            env.reset(&mut rng);
            let (mut decisions, mut total, mut ended) = (0, 0.0, false);
            while !ended {
                let action = agent.below(2);
                decisions += 1;
                for _ in 0..4 {
                    let step = env.step(action, &mut rng);
                    total += step.reward;
                    ended = step.terminated;
                    if ended {
                        break;
                    }
                }
            }
            (decisions, total, total)
        })
        .collect();
    assert_eq!(episodes(&plan(keys)), by_hand);
}

#[test]
fn clipping_changes_what_is_learned_but_not_what_is_reported() {
    let keys =
        "env: \"Pendulum-v1\", agent: random_agent(#{}), episodes: 2, clip_reward: [-1.0, 1.0]";
    let plan = plan(keys);
    assert!(plan.warnings[0].to_string().contains("clipping changes the reward"));
    for (steps, native, learned) in episodes(&plan) {
        assert!(native < -200.0);
        assert!(learned >= -f64::from(steps) && learned > native);
    }
    // On a finite model the verdict is exact: holes that cost 5 become holes that cost nothing.
    let lake = |clip: &str| {
        self::plan(&format!(
            "env: env(\"FrozenLake-v1\", #{{ reward_schedule: [1, -5, 0] }}), \
             agent: value_iteration(#{{ gamma: 0.9 }}) {clip}"
        ))
    };
    let verdict =
        |plan: &Plan| audit_variant(&Host::open(plan).unwrap(), only(plan), None).unwrap().label();
    assert_eq!(verdict(&lake("")), "unshaped");
    assert_eq!(verdict(&lake(", clip_reward: [-5, 1]")), "unshaped");
    assert_eq!(verdict(&lake(", clip_reward: [0, 1]")), "policy changed (2)");
}

#[test]
fn skipped_frames_have_no_model_of_single_steps() {
    let keys = "env: \"FrozenLake-v1\", agent: q_learning(#{}), episodes: 3, frame_skip: 2";
    let verdict = |rest: &str| {
        let plan = plan(&format!("{keys}{rest}"));
        let audit = audit_variant(&Host::open(&plan).unwrap(), only(&plan), None).unwrap();
        // Whatever is said about it, it has to run.
        episodes(&plan);
        audit.verdict.as_str()
    };
    assert_eq!(verdict(""), "unshaped");
    assert_eq!(verdict(", potential: |s| s.row + s.col"), "potential-based");
    assert_eq!(verdict(", reward: |t| t.reward - 0.01"), "not-potential-based");
}

#[test]
fn normalised_fields_go_from_minus_one_to_one() {
    let base = "env: \"MountainCar-v0\", agent: q_learning(#{}), episodes: 2";
    // The same bins, in physical and in normalised units.
    let physical = plan(&format!(
        "{base}, discretiser: bins(#{{ position: [-1.2, 0.6, 20], velocity: [-0.07, 0.07, 20] }})"
    ));
    let normalised = plan(&format!(
        "{base}, discretiser: bins(#{{ position: [-1, 1, 20], velocity: [-1, 1, 20] }}), \
         normalise: #{{ position: [-1.2, 0.6], velocity: [-0.07, 0.07] }}"
    ));
    let dims = |plan: &Plan| match &only(plan).discretiser {
        DiscretiserSpec::Bins(dims) => dims.clone(),
        other => panic!("{other:?}"),
    };
    assert_eq!(dims(&physical), dims(&normalised));
    assert_eq!(episodes(&physical), episodes(&normalised));

    // Scripted cells see [-1, 1], callbacks the physical units.
    let scripted = plan(&format!(
        "{base}, normalise: true, potential_on: \"raw\", potential: |s| if s.velocity.abs() > 0.08 {{ () }} else {{ 0.0 }}, \
         discretiser: cells(10, |s| if s.position < -1.0 || s.position > 1.0 {{ -1 }} else {{ 3 }})"
    ));
    assert_eq!(episodes(&scripted).len(), 2);
}
