//! Training that is interrupted goes on as if it had not been.

use super::shadow::configs;
use super::{Chance, agent, config, fields, setup};
use crate::learn::dqn::{Dqn, DqnConfig, Snapshot};
use crate::learn::{Last, Learn};
use crate::shaping::ActionSet;

fn saved(agent: &Dqn) -> Snapshot {
    let mut snapshot = Snapshot::default();
    agent.save(&mut snapshot);
    snapshot
}

/// The bits of everything saved.
fn bits(s: &Snapshot) -> (Vec<u32>, Vec<u64>, Vec<String>) {
    (
        s.singles.values().flatten().map(|x| x.to_bits()).collect(),
        s.doubles.values().flatten().map(|x| x.to_bits()).collect(),
        s.values.values().cloned().collect(),
    )
}

#[test]
fn an_agent_goes_on_where_it_was() {
    for shielded in [false, true] {
        for config in configs() {
            let config = DqnConfig { log_interval: 7, ..config };
            let fresh = || Dqn::new(config.clone(), setup(shielded, 5));
            for episodes in [0, 1, 12, 30] {
                let (mut through, mut world) = (fresh(), Chance::new(shielded));
                (0..episodes).for_each(|_| world.episode(&mut through, |_, _| {}));
                let mut resumed = fresh().restore(&saved(&through)).unwrap();
                let mut same_world = world.clone();
                for _ in 0..15 {
                    let mut played = Vec::new();
                    world.episode(&mut through, |step, _| played.push(step.a));
                    let mut steps = played.iter();
                    same_world.episode(&mut resumed, |step, _| {
                        assert_eq!(Some(&step.a), steps.next());
                    });
                }
                assert!(bits(&saved(&through)) == bits(&saved(&resumed)), "{episodes} {config:?}");
                assert_eq!(through.log().len(), resumed.log().len());
                assert!(through.log() == resumed.log());
            }
        }
    }
}

/// Of a terminal state nothing is known: not even that an earlier state was something.
#[test]
fn an_episode_of_one_step_leaves_the_same_numbers() {
    let mut through = agent(&config());
    let mut world = Chance::new(false);
    (0..12).for_each(|_| world.episode(&mut through, |_, _| {}));
    let mut resumed = agent(&config()).restore(&saved(&through)).unwrap();
    for agent in [&mut through, &mut resumed] {
        agent.begin(fields([0.5; 3], ActionSet::ALL));
        agent.end(1.0, Last::Terminated);
    }
    assert!(bits(&saved(&through)) == bits(&saved(&resumed)));
}

/// Where everything has diverged, that is what is kept.
#[test]
fn numbers_that_are_none_are_kept() {
    let config = DqnConfig { log_interval: 7, ..config() };
    let mut through = agent(&config);
    let mut world = Chance::new(false);
    through.q.params_mut().fill(f32::NAN);
    (0..3).for_each(|_| world.episode(&mut through, |_, _| {}));
    let mut resumed = agent(&config).restore(&saved(&through)).expect("it is the same agent");
    let mut same_world = world.clone();
    world.episode(&mut through, |_, _| {});
    same_world.episode(&mut resumed, |_, _| {});
    assert!(bits(&saved(&through)) == bits(&saved(&resumed)));
    assert!(through.failed_at().is_some());
}

#[test]
fn what_another_agent_saved_is_refused() {
    let mut one = agent(&config());
    let mut world = Chance::new(false);
    (0..10).for_each(|_| world.episode(&mut one, |_, _| {}));
    let snapshot = saved(&one);
    assert!(agent(&config()).restore(&snapshot).is_some());
    for other in [
        DqnConfig { net_arch: vec![9, 6], ..config() },
        DqnConfig { net_arch: vec![9, 5, 5], ..config() },
        DqnConfig { buffer_size: 8, ..config() },
        DqnConfig { priorities: configs()[9].priorities, ..config() },
    ] {
        assert!(agent(&other).restore(&snapshot).is_none(), "{other:?}");
    }
    for name in ["network", "target", "adam.m", "adam.v", "replay"] {
        let mut less = snapshot.clone();
        less.singles.get_mut(name).unwrap().pop();
        assert!(agent(&config()).restore(&less).is_none(), "{name}");
        less.singles.remove(name);
        assert!(agent(&config()).restore(&less).is_none(), "{name}");
    }
    for name in snapshot.values.keys() {
        let mut less = snapshot.clone();
        less.values.remove(name);
        assert!(agent(&config()).restore(&less).is_none(), "{name}");
    }
    for name in snapshot.doubles.keys() {
        let mut less = snapshot.clone();
        less.doubles.remove(name);
        assert!(agent(&config()).restore(&less).is_none(), "{name}");
    }
}
