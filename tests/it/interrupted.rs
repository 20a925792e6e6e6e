//! Training of a network that is interrupted goes on as if it had not been.

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use runner::env::{EnvVisitor, make, specs};
use runner::experiment::{
    Resumable, Store, Unit, UnitError, UnitRecord, resume_unit, run_unit, start_from, units,
};
use runner::mdp::Env;
use runner::mdp::numpy::NumpyRng;
use runner::mdp::streams::Stream;
use runner::script::{Host, Plan};

use crate::language::plan_of;
use crate::support::{contents, expect_code, folder, runner, stderr, write};

/// Everything that an agent can have to remember.
const SCRIPT: &str = r#"
experiment(#{
    env: "CartPole-v1",
    agent: double_dqn(#{
        net_arch: [16, 8],
        dueling: true,
        n_steps: 3,
        prioritized_replay: true,
        prioritized_replay_beta: linear(0.4, 1.0, 900, #{ steps: true }),
        learning_rate: linear(0.01, 0.001, 30),
        epsilon: linear(1.0, 0.1, 500, #{ steps: true }),
        buffer_size: 300,
        batch_size: 16,
        target_update_interval: 7,
        max_grad_norm: 1.0,
        log_interval: 50,
    }),
    potential: |s, episode| s.theta * episode,
    terms: #{ still: |t| -0.01 * abs(t.next_state.x_dot) },
    episodes: 40,
    window: 5,
    seeds: 1,
})
"#;

/// Runs the unit up to the end of episode `after`, where it is asked to stop.
fn until(plan: &Plan, unit: &Unit, store: &Store, after: u32) {
    let host = Host::open(plan).unwrap();
    let (stop, played) = (AtomicBool::new(false), AtomicU32::new(0));
    let mut each = |_| {
        if played.fetch_add(1, Ordering::Relaxed) + 1 == after {
            stop.store(true, Ordering::Relaxed);
        }
    };
    let at = Some(Resumable { store, unit });
    let stopped = resume_unit(&host, &plan.variants[0], unit.seed, at, &stop, &mut each);
    assert!(matches!(stopped, Err(UnitError::Interrupted)), "after {after}");
}

/// Runs it to its end; also how many of its episodes were played now.
fn to_the_end(plan: &Plan, unit: &Unit, store: &Store) -> (UnitRecord, u32) {
    let host = Host::open(plan).unwrap();
    let mut now = 0;
    let mut each = |steps| now += u32::from(steps > 0);
    let at = Some(Resumable { store, unit });
    let never = AtomicBool::new(false);
    let record = resume_unit(&host, &plan.variants[0], unit.seed, at, &never, &mut each).unwrap();
    store.commit(unit, &plan.variants[0], &record).unwrap();
    (record, now)
}

fn partial(folder: &Path) -> Option<Vec<u8>> {
    contents(folder)
        .into_iter()
        .find(|(name, _)| name.ends_with(".partial"))
        .map(|(_, bytes)| bytes)
}

#[test]
fn an_interrupted_network_ends_in_the_same_bytes() {
    let plan = plan_of(SCRIPT, &[]);
    let unit = &units(&plan)[0];
    let dir = folder();
    let whole = dir.path().join("whole");
    let (record, now) = to_the_end(&plan, unit, &Store::open(&whole).unwrap());
    assert_eq!((now, record.rows.len()), (40, 40));
    assert!(record.log.len() > 5, "{}", record.log.len());
    for stops in [&[1][..], &[20], &[39], &[3, 10, 11, 33]] {
        let parts = dir.path().join(format!("{stops:?}"));
        let store = Store::open(&parts).unwrap();
        for &after in stops {
            until(&plan, unit, &store, after);
        }
        assert!(partial(&parts).is_some());
        let (_, now) = to_the_end(&plan, unit, &store);
        assert_eq!(now, 40 - stops[stops.len() - 1], "what was done is not done again");
        assert_eq!(contents(&parts), contents(&whole), "{stops:?}");
    }
}

/// The same of one that has started from a stored network.
#[test]
fn a_network_that_is_trained_further_ends_in_the_same_bytes() {
    let mut plan = plan_of(SCRIPT, &[]);
    let dir = folder();
    let first = Store::open(&dir.path().join("first")).unwrap();
    let unit = units(&plan).remove(0);
    to_the_end(&plan, &unit, &first);
    start_from(&mut plan, &first.path(&unit).join("model.safetensors")).unwrap();
    let unit = &units(&plan)[0];
    let (whole, parts) = (dir.path().join("whole"), dir.path().join("parts"));
    to_the_end(&plan, unit, &Store::open(&whole).unwrap());
    let store = Store::open(&parts).unwrap();
    until(&plan, unit, &store, 15);
    assert_eq!(to_the_end(&plan, unit, &store).1, 25);
    assert_eq!(contents(&parts), contents(&whole));
}

/// A crash may come after the episode that solved the task was written down and before the unit was
/// stored: nothing is played beyond it.
#[test]
fn what_was_solved_before_the_crash_is_not_gone_on_with() {
    let plan = plan_of(SCRIPT, &[]);
    let unit = &units(&plan)[0];
    let dir = folder();
    let store = Store::open(dir.path()).unwrap();
    until(&plan, unit, &store, 20);
    // The same unit, had it been asked to stop at what the last five episodes reached at least.
    let stops = |threshold| {
        let mut stopping = plan.clone();
        stopping.variants[0].stop_when_solved = true;
        stopping.variants[0].threshold = Some(threshold);
        to_the_end(&stopping, unit, &store)
    };
    let bytes = partial(dir.path()).unwrap();
    let (record, now) = stops(1.0);
    assert_eq!(
        (record.rows.len(), now),
        (20, 0),
        "an episode of CartPole has a return of 1 or more"
    );
    store.remove(unit).unwrap();
    std::fs::write(store.path(unit).with_extension("partial"), bytes).unwrap();
    let (record, now) = stops(1e6);
    assert_eq!((record.rows.len(), now), (40, 20), "nobody reaches that");
}

/// A file that is damaged, or another unit's, costs time and nothing else.
#[test]
fn what_is_not_whole_is_not_gone_on_with() {
    let plan = plan_of(SCRIPT, &[]);
    let unit = &units(&plan)[0];
    let dir = folder();
    let store = Store::open(dir.path()).unwrap();
    until(&plan, unit, &store, 20);
    let bytes = partial(dir.path()).unwrap();
    let path = store.path(unit).with_extension("partial");
    let mut changed = bytes.clone();
    let middle = changed.len() / 2;
    changed[middle] ^= 1;
    for damaged in [&bytes[..bytes.len() - 1], &changed, b"", b"\n\n"] {
        std::fs::write(&path, damaged).unwrap();
        assert_eq!(to_the_end(&plan, unit, &store).1, 40);
        store.remove(unit).unwrap();
    }
    // The file of the same unit, whole: the test above would notice nothing if it were ignored.
    std::fs::write(&path, &bytes).unwrap();
    assert_eq!(to_the_end(&plan, unit, &store).1, 20);
}

/// What going on rests on: after a reset nothing is left of what was before, but the generator.
#[test]
fn environments_forget_at_a_reset() {
    struct Play(&'static str);
    impl EnvVisitor for Play {
        type Out = ();
        fn visit<E: Env + Clone + 'static>(self, env: E) {
            let mut actions = Stream::new(3, "actions");
            let (mut used, mut fresh) = (env.clone(), env);
            let mut rng = NumpyRng::from_u64(5);
            for _ in 0..4 {
                used.reset(&mut rng);
                for _ in 0..60 {
                    if used.step(actions.below(used.n_actions()), &mut rng).terminated {
                        break;
                    }
                }
            }
            let mut copy = rng.clone();
            let show = |x: &dyn std::fmt::Debug| format!("{x:?}");
            assert_eq!(show(&used.reset(&mut rng)), show(&fresh.reset(&mut copy)), "{}", self.0);
            for _ in 0..60 {
                let a = actions.below(used.n_actions());
                let (one, other) = (used.step(a, &mut rng), fresh.step(a, &mut copy));
                assert_eq!(show(&one), show(&other), "{}", self.0);
                if one.terminated {
                    break;
                }
            }
        }
    }
    for spec in specs() {
        make(spec.id, &serde_json::Map::new()).unwrap().visit(Play(spec.id));
    }
}

#[test]
fn a_network_that_diverges_keeps_its_logs_and_names_the_step() {
    let dir = folder();
    let text = r#"
experiment(#{
    name: "huge",
    env: "CartPole-v1",
    agent: dqn(#{ learning_starts: 2000, log_interval: 100 }),
    reward: |t| 1e25,
    episodes: 300,
    seeds: 1,
})
"#;
    let script = write(dir.path(), "huge.rhai", text);
    let out = dir.path().join("out");
    let output = runner().arg("exec").arg(&script).arg("--out").arg(&out).output().unwrap();
    expect_code(&output, 2);
    let text = stderr(&output);
    assert!(text.contains("the network diverged: its loss is not finite"), "{text}");
    assert!(text.contains("at step 2001 of the run, in episode "), "{text}");
    assert!(text.contains("`max_grad_norm`"), "{text}");
    let files = contents(&out);
    let log = files.iter().find(|(name, _)| name.ends_with(".failed/learning.csv")).unwrap();
    let text = std::str::from_utf8(log.1).unwrap();
    assert_eq!(text.lines().count(), 21, "{text}");
    let monitor = files.iter().find(|(name, _)| name.ends_with(".failed/monitor.csv")).unwrap();
    assert!(monitor.1.split(|b| *b == b'\n').count() > 50, "episodes of some 20 steps");
    assert!(!files.keys().any(|name| name.ends_with("result.json")));
}

#[cfg(unix)]
#[test]
fn a_signal_in_the_middle_of_a_unit_loses_nothing() {
    let dir = folder();
    let script = write(dir.path(), "s.rhai", &SCRIPT.replace("episodes: 40", "episodes: 400"));
    let exec = |out: &Path| {
        let mut command = runner();
        command.arg("exec").arg(&script).arg("--out").arg(out).args(["--jobs", "1"]);
        command.stderr(std::process::Stdio::piped()).stdout(std::process::Stdio::piped());
        command
    };
    let (whole, parts) = (dir.path().join("whole"), dir.path().join("parts"));
    expect_code(&exec(&whole).output().unwrap(), 0);
    let mut interrupted = 0;
    for wait in [60, 90, 120] {
        let child = exec(&parts).spawn().unwrap();
        std::thread::sleep(std::time::Duration::from_millis(wait));
        let id = child.id().to_string();
        std::process::Command::new("kill").arg("-INT").arg(id).status().unwrap();
        let ended = child.wait_with_output().unwrap();
        interrupted += u32::from(ended.status.code() == Some(75));
    }
    expect_code(&exec(&parts).output().unwrap(), 0);
    assert!(interrupted > 0, "it was over before any signal came");
    crate::support::assert_same(&whole, &parts);
    let never = AtomicBool::new(false);
    let plan = plan_of(SCRIPT, &[]);
    let host = Host::open(&plan).unwrap();
    assert!(run_unit(&host, &plan.variants[0], 0, &never, &mut |_| {}).is_ok());
}
