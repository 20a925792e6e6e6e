use super::*;
use crate::env::cart_pole::CartPole;
use crate::env::mountain_car::MountainCar;
use crate::env::pendulum::Pendulum;
use crate::mdp::numpy::NumpyRng;
use crate::shaping::potential_term;

const GAMMA: f64 = 0.99;

type CarStep<'a> = Transition<'a, [f32; 2]>;
type Term<'a> = &'a dyn Fn(&CarStep<'_>) -> f64;

/// A potential of the car: its speed.
fn speed([_, velocity]: [f32; 2]) -> f64 {
    100.0 * f64::from(velocity).abs()
}

/// The term of that potential, done properly.
fn proper(gamma: f64, t: &CarStep<'_>) -> f64 {
    let next = if t.terminated { 0.0 } else { speed(*t.next_state) };
    potential_term(gamma, speed(*t.state), next)
}

fn car(settings: PathwiseSettings, f: impl Fn(&CarStep<'_>) -> f64) -> Pathwise {
    pathwise(&MountainCar::new(0.0), &settings, |_, t| Ok(f(t))).unwrap()
}

fn settings() -> PathwiseSettings {
    PathwiseSettings::new(GAMMA)
}

/// Plays one side of a divergence and adds up anew.
fn replayed(start: &[f64], path: &Path, f: impl Fn(&CarStep<'_>) -> f64) -> (f64, bool) {
    let (mut env, mut rng) = (MountainCar::new(0.0), NumpyRng::from_u64(0));
    let mut obs = env.set_state(start).unwrap();
    let (mut sum, mut discount, mut terminated, mut step) = (0.0, 1.0, false, 0);
    for &(action, times) in &path.actions {
        for _ in 0..times {
            assert!(!terminated, "nothing is played after the end");
            let s = env.step(action, &mut rng);
            terminated = s.terminated;
            let t = Transition {
                state: &obs,
                action,
                reward: s.reward,
                next_state: &s.obs,
                terminated,
                truncated: false,
                step,
            };
            sum += discount * f(&t);
            discount *= GAMMA;
            obs = s.obs;
            step += 1;
        }
    }
    assert_eq!(step, path.steps);
    (sum, terminated)
}

#[test]
fn a_potential_is_paid_the_same_on_every_way() {
    let result = car(settings(), |t| proper(GAMMA, t));
    assert_eq!(result.violation, None);
    assert_eq!(result.step_dependence, None);
    assert!(result.scale > 1.0 && result.spread <= 1e-12 * result.scale, "{result:?}");
    // Twenty states, three actions and eight random ways from each; all of them are long enough.
    assert_eq!((result.trajectories, result.comparisons), (220, 200));
    assert_eq!(result.bound(), Some(0.015));
}

#[test]
fn potentials_of_any_size_pass_and_small_violations_of_them_do_not() {
    for size in [1e-9, 1.0, 1e6, 1e12] {
        let passed = car(settings(), |t| size * proper(GAMMA, t));
        assert_eq!(passed.violation, None, "{size}: {passed:?}");
        let failed = car(settings(), |t| size * (proper(GAMMA, t) + 1e-5 * t.action as f64));
        assert!(failed.violation.is_some(), "{size}: {failed:?}");
    }
    // Large native rewards round F away: what is left of it is no violation.
    let rounded = car(settings(), |t| (1e9 + 1e-3 * proper(GAMMA, t)) - 1e9);
    assert!(rounded.violation.is_some(), "without a reward to blame it on");
    let env = MountainCar::new(0.0);
    let mut costly = Costly(env);
    costly.0.reset(&mut NumpyRng::from_u64(0));
    let rounded =
        pathwise(&costly, &settings(), |_, t| Ok((t.reward + 1e-3 * proper(GAMMA, t)) - t.reward));
    assert_eq!(rounded.unwrap().violation, None);
}

/// The car, at a price.
#[derive(Clone)]
struct Costly(MountainCar);

impl Env for Costly {
    type Obs = [f32; 2];
    fn n_actions(&self) -> usize {
        3
    }
    fn reset(&mut self, rng: &mut NumpyRng) -> [f32; 2] {
        self.0.reset(rng)
    }
    fn step(&mut self, action: Action, rng: &mut NumpyRng) -> crate::mdp::Step<[f32; 2]> {
        crate::mdp::Step { reward: 1e9, ..self.0.step(action, rng) }
    }
    fn schema(&self) -> crate::mdp::Schema {
        self.0.schema()
    }
    fn fields(&self, obs: &[f32; 2], out: &mut [f64]) {
        self.0.fields(obs, out);
    }
}

#[test]
fn what_is_no_potential_is_found_and_the_certificate_holds() {
    let kept = |t: &CarStep<'_>| potential_term(GAMMA, speed(*t.state), speed(*t.next_state));
    let other_gamma = |t: &CarStep<'_>| proper(1.0, t);
    let fuel = |t: &CarStep<'_>| if t.action == 1 { 0.0 } else { -0.001 };
    let bonus = |t: &CarStep<'_>| speed(*t.next_state);
    let goal = |t: &CarStep<'_>| if t.terminated { 250.0 } else { 0.0 };
    let wall = |t: &CarStep<'_>| {
        let at_wall = t.next_state[0] <= -1.2;
        proper(GAMMA, t) + if at_wall { 0.1 } else { 0.0 }
    };
    let terms: [(&str, Term<'_>); 6] = [
        ("potential of the terminal state", &kept),
        ("another discount factor", &other_gamma),
        ("fuel", &fuel),
        ("speed", &bonus),
        ("goal", &goal),
        ("wrong at the wall only", &wall),
    ];
    for (name, f) in terms {
        let result = car(settings(), f);
        let Some(found) = &result.violation else { panic!("{name}: {result:?}") };
        assert_eq!(result.bound(), None);
        assert_eq!(result.step_dependence, None, "{name}");
        let [low, high] = &found.trajectories;
        assert!(high.sum - low.sum - low.rest - high.rest > result.tolerance, "{name}");
        for path in [low, high] {
            // From the state as it was observed, in float32.
            let (sum, terminated) = replayed(&found.start, path, f);
            assert!((sum - path.sum).abs() < 1e-3 * result.scale, "{name}: {sum} {path:?}");
            assert_eq!(terminated, path.ending == Ending::Terminated, "{name}");
        }
    }
}

#[test]
fn some_starts_are_where_episodes_come_to() {
    // Less than fifty steps count, and nobody is at the goal so soon after a reset.
    let goal = |t: &CarStep<'_>| if t.terminated { 250.0 } else { 0.0 };
    let settings = PathwiseSettings { starts: 100, ..PathwiseSettings::new(0.5) };
    assert!(settings.horizon() < 50);
    let found = car(settings, goal).violation.unwrap();
    assert!(found.step > 0);
    assert_eq!(found.trajectories[1].ending, Ending::Terminated);
    // Within a time limit no start is beyond it.
    let limited = PathwiseSettings { time_limit: Some(60), ..settings };
    if let Some(found) = car(limited, goal).violation {
        assert!(found.step < 60, "{found:?}");
    }
}

#[test]
fn undiscounted_only_whole_episodes_count() {
    let settings = PathwiseSettings { gamma: 1.0, ..settings() };
    let good = car(settings, |t| proper(1.0, t));
    assert_eq!(good.violation, None);
    assert!(0 < good.comparisons && good.comparisons < 200, "{good:?}");
    let bad = car(settings, |t| proper(1.0, t) + 0.001 * t.action as f64);
    for path in bad.violation.unwrap().trajectories {
        assert_eq!((path.ending, path.rest), (Ending::Terminated, 0.0));
    }
    // A pendulum swings for ever: there is nothing to compare, and nothing is claimed.
    let env = Pendulum::new(10.0);
    let short = PathwiseSettings { longest: 50, starts: 3, ..settings };
    let none = pathwise(&env, &short, |_, t| Ok(t.action as f64)).unwrap();
    assert_eq!((none.violation.as_ref(), none.comparisons), (None, 0));
    assert_eq!(none.bound(), Some(1.0));
}

#[test]
fn what_is_paid_by_the_clock_is_found_out() {
    // Within a time limit of 200 steps the first bonus is one for the goal, the second is not.
    let limited = PathwiseSettings { time_limit: Some(200), ..settings() };
    let bonus = |before: u32| {
        car(limited, move |t| if t.terminated && t.step < before { 250.0 } else { 0.0 })
    };
    assert_eq!(bonus(200).step_dependence, None);
    let found = bonus(150);
    assert!(found.violation.is_some());
    let dependence = found.step_dependence.unwrap();
    assert!(dependence.terminated && dependence.next_state[0] >= 0.5);
    let [(early, more), (late, less)] = {
        let mut paid = dependence.paid;
        paid.sort_by_key(|(step, _)| *step);
        paid
    };
    assert!(early < 150 && (150..200).contains(&late));
    assert_eq!((more, less), (250.0, 0.0));

    // A potential that changes with time (Devlin & Kudenko 2012) telescopes all the same.
    let phi = |obs: [f32; 2], step: u32| speed(obs) * f64::from(step % 5);
    let moving = car(settings(), |t| {
        let next = if t.terminated { 0.0 } else { phi(*t.next_state, t.step + 1) };
        potential_term(GAMMA, phi(*t.state, t.step), next)
    });
    assert!(moving.violation.is_none() && moving.step_dependence.is_some(), "{moving:?}");
}

#[test]
fn cart_pole_with_skipped_frames() {
    let phi = |obs: &[f32; 4]| -20.0 * f64::from(obs[2]).abs();
    let run = |k: f64| {
        let settings = PathwiseSettings { frame_skip: 3, ..settings() };
        pathwise(&CartPole::new(false), &settings, |_, t| {
            let next = if t.terminated { 0.0 } else { phi(t.next_state) };
            Ok(potential_term(GAMMA, phi(t.state), next) + k * (t.reward - 3.0))
        })
        .unwrap()
    };
    let good = run(0.0);
    assert!(good.violation.is_none() && good.spread < 1e-12, "{good:?}");
    assert!(run(0.01).violation.is_some(), "an episode may end within the skipped frames");
}

#[test]
fn what_is_not_finite_is_an_error() {
    let error = pathwise(&MountainCar::new(0.0), &settings(), |_, t| {
        Ok(if t.step > 50 { f64::NAN } else { 0.0 })
    });
    let message = error.unwrap_err().to_string();
    assert_eq!(message, "what shaping adds to the reward is not finite: NaN");
}

#[test]
fn trajectories_end_where_the_rest_is_negligible() {
    // ln((1 − γ) 1e-14) / ln γ.
    for (gamma, steps) in [(0.0, 1), (0.9, 328), (0.99, 3_666), (1.0, 5_000)] {
        assert_eq!(PathwiseSettings::new(gamma).horizon(), steps, "{gamma}");
    }
}
