//! Environments put into a given state go on from there as if they had come there themselves.

use runner::env::{EnvVisitor, specs};
use runner::mdp::numpy::NumpyRng;
use runner::mdp::{Env, MAX_FIELDS};
use serde_json::{Map, Value, json};

fn fields_of<E: Env>(env: &E, obs: &E::Obs) -> Vec<f64> {
    let mut fields = [0.0; MAX_FIELDS];
    env.fields(obs, &mut fields);
    fields[..env.schema().fields.len()].to_vec()
}

/// Ids whose observation is the state.
const PLACED: [&str; 6] = [
    "CartPole-v0",
    "CartPole-v1",
    "MountainCar-v0",
    "MountainCarContinuous-v0",
    "Pendulum-v1",
    "Acrobot-v1",
];

/// Plays along and puts a copy into every state that comes up.
struct Follow {
    id: &'static str,
}

impl EnvVisitor for Follow {
    /// How many steps the copies took.
    type Out = usize;

    fn visit<E: Env + Clone + 'static>(self, mut env: E) -> usize {
        let mut rng = NumpyRng::from_u64(5);
        let mut obs = env.reset(&mut rng);
        let (mut copy, mut steps) = (env.clone(), 0);
        for t in 0..4_000usize {
            let fields = fields_of(&env, &obs);
            let action = (t / 7 + t / 40) % env.n_actions();
            // The state itself is known to float32 only: at its very limits a state may be taken
            // for a terminal one.
            if let Some(placed) = copy.set_state(&fields) {
                let difference = |a: &[f64], b: &[f64]| {
                    a.iter().zip(b).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()))
                };
                let same = difference(&fields_of(&copy, &placed), &fields);
                assert!(same <= 2e-7 * scale(&fields), "{}: {fields:?} became {placed:?}", self.id);
                let step = copy.step(action, &mut rng.clone());
                let next = env.step(action, &mut rng);
                let (got, expected) = (fields_of(&copy, &step.obs), fields_of(&env, &next.obs));
                // A time step carries an error on, hardly larger.
                let off = difference(&got, &expected);
                assert!(
                    off <= 4e-6 * scale(&expected),
                    "{}: from {fields:?} by {action} to {got:?}, not {expected:?}",
                    self.id
                );
                assert!((step.reward - next.reward).abs() < 1e-4 * next.reward.abs().max(1.0));
                assert_eq!(step.terminated, next.terminated, "{}: {fields:?}", self.id);
                steps += 1;
                obs = next.obs;
                if next.terminated {
                    obs = env.reset(&mut rng);
                }
            } else {
                obs = env.reset(&mut rng);
            }
        }
        steps
    }
}

fn scale(fields: &[f64]) -> f64 {
    fields.iter().fold(1.0f64, |m, x| m.max(x.abs()))
}

#[test]
fn a_continuous_state_goes_on_as_the_one_it_was_taken_from() {
    for spec in specs() {
        let steps = spec.make(&Map::new()).unwrap().visit(Follow { id: spec.id });
        if PLACED.contains(&spec.id) {
            // All but a few: the resets that follow them take steps too.
            assert!(steps > 3_900, "{}: {steps}", spec.id);
        } else {
            assert_eq!(steps, 0, "{}: its observation is not all of its state", spec.id);
        }
    }
}

/// Puts the environment into each of these states: which of them it takes.
struct Try(Vec<Vec<f64>>);

impl EnvVisitor for Try {
    type Out = Vec<bool>;

    fn visit<E: Env + Clone + 'static>(self, mut env: E) -> Vec<bool> {
        let mut rng = NumpyRng::from_u64(0);
        env.reset(&mut rng);
        let twin = env.clone();
        let mut take = |fields: &Vec<f64>| {
            let taken = env.set_state(fields).is_some();
            if !taken {
                // Nothing has changed.
                let (mut a, mut b) = (env.clone(), twin.clone());
                let (a, b) = (a.step(0, &mut rng.clone()), b.step(0, &mut rng.clone()));
                assert_eq!(format!("{a:?}"), format!("{b:?}"), "{fields:?}");
            }
            env = twin.clone();
            taken
        };
        self.0.iter().map(&mut take).collect()
    }
}

fn taken(id: &str, kwargs: &Value, states: &[&[f64]]) -> Vec<bool> {
    let spec = specs().iter().find(|spec| spec.id == id).unwrap();
    let env = spec.make(kwargs.as_object().unwrap()).unwrap();
    env.visit(Try(states.iter().map(|s| s.to_vec()).collect()))
}

#[test]
fn where_no_episode_goes_on_there_is_no_state() {
    let none = json!({});
    let nan = f64::NAN;
    let cart: [&[f64]; 7] = [
        &[0.0, 0.0, 0.0, 0.0],
        &[-2.4, 9.0, 0.2, -9.0],
        &[2.5, 0.0, 0.0, 0.0],
        &[0.0, 0.0, -0.3, 0.0],
        &[0.0, nan, 0.0, 0.0],
        &[0.0, 0.0, 0.0, f64::INFINITY],
        &[0.0, 0.0, 0.0],
    ];
    assert_eq!(taken("CartPole-v1", &none, &cart), [true, true, false, false, false, false, false]);
    // The bounds as float32 are further out than as float64.
    let (left, fast) = (f64::from(-1.2f32), f64::from(0.07f32));
    assert!(left < -1.2 && fast > 0.07);
    let car: [&[f64]; 6] =
        [&[left, fast], &[-1.3, 0.0], &[-0.5, 0.08], &[0.5, 0.0], &[0.55, -0.01], &[nan, 0.0]];
    for id in ["MountainCar-v0", "MountainCarContinuous-v0"] {
        assert_eq!(taken(id, &none, &car), [true, false, false, false, true, false], "{id}");
    }
    let demanding = json!({"goal_velocity": 0.01});
    assert_eq!(taken("MountainCar-v0", &demanding, &[&[0.5, 0.0], &[0.5, 0.02]]), [true, false]);
    let swing: [&[f64]; 4] = [&[0.3, -0.4, 8.0], &[0.0, 0.0, 0.0], &[1.0, 0.0, 8.1], &[nan; 3]];
    assert_eq!(taken("Pendulum-v1", &none, &swing), [true, false, false, false]);
    // Hanging; upright, which is terminal; a second link without direction; too fast.
    let links: [&[f64]; 4] = [
        &[1.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        &[-1.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        &[1.0, 0.0, 1.0, 0.0, 13.0, 0.0],
    ];
    assert_eq!(taken("Acrobot-v1", &none, &links), [true, false, false, false]);
}

/// Plays every action in every state often, and compares with the model.
struct EveryState;

impl EnvVisitor for EveryState {
    type Out = ();

    fn visit<E: Env + Clone + 'static>(self, mut env: E) {
        let mdp = env.finite().unwrap().clone();
        let mut rng = NumpyRng::from_u64(2);
        let reachable = mdp.reachable();
        // χ², summed over everything that can be played.
        let (mut chi_square, mut freedom) = (0.0, 0usize);
        for (s, &reachable) in reachable.iter().enumerate() {
            for a in 0..mdp.n_actions() {
                let range = mdp.range(s, a);
                let mut counts = vec![0u32; range.len()];
                let n = if range.len() == 1 { 1 } else { 200 };
                for _ in 0..n {
                    let Some(obs) = env.set_index(s) else {
                        assert!(!reachable, "state {s}");
                        break;
                    };
                    assert_eq!((env.state_index(&obs), env.outcome_index(&obs)), (Some(s), None));
                    let step = env.step(a, &mut rng);
                    let outcome = env.outcome_index(&step.obs).unwrap();
                    assert!(range.contains(&outcome), "state {s}, action {a}");
                    let o = mdp.outcomes()[outcome];
                    assert_eq!(env.state_index(&step.obs), Some(o.next_state as usize));
                    assert_eq!((o.reward, o.terminated), (step.reward, step.terminated));
                    counts[outcome - range.start] += 1;
                }
                if counts.iter().all(|&c| c == 0) {
                    continue;
                }
                let mut possible = 0;
                for (o, &count) in mdp.of(s, a).iter().zip(&counts) {
                    if o.probability == 0.0 {
                        assert_eq!(count, 0);
                        continue;
                    }
                    let expected = o.probability * f64::from(n);
                    chi_square += {
                        let d = f64::from(count) - expected;
                        d * d / expected
                    };
                    possible += 1;
                }
                freedom += possible - 1;
            }
        }
        // Mean k, variance 2k and a little more for rare outcomes: six standard deviations.
        let freedom = freedom as f64;
        assert!((chi_square - freedom).abs() <= 6.0 * (3.0 * freedom).sqrt(), "{chi_square}");
        let n = mdp.n_states();
        assert_eq!(env.set_index(n).map(|obs| format!("{obs:?}")), None);
    }
}

#[test]
fn a_finite_state_goes_on_as_the_model_says() {
    let slippery = json!({"is_slippery": true});
    for (id, kwargs) in [
        ("FrozenLake-v1", json!({})),
        ("CliffWalking-v1", slippery),
        ("Taxi-v4", json!({"is_rainy": true})),
        ("Blackjack-v1", json!({})),
        ("Blackjack-v1", json!({"sab": false, "natural": true})),
    ] {
        let spec = specs().iter().find(|spec| spec.id == id).unwrap();
        spec.make(kwargs.as_object().unwrap()).unwrap().visit(EveryState);
    }
}

/// Starts in one state, and tells how often the passenger's destination changes on the way.
struct Ride(usize);

impl EnvVisitor for Ride {
    type Out = usize;

    fn visit<E: Env + Clone + 'static>(self, mut env: E) -> usize {
        let mut rng = NumpyRng::from_u64(1);
        let change = |_| {
            env.reset(&mut rng);
            let start = env.set_index(self.0).unwrap();
            let destination = fields_of(&env, &start)[3];
            let step = env.step(1, &mut rng);
            fields_of(&env, &step.obs)[3] != destination
        };
        (0..1_000).map(change).filter(|&changed| changed).count()
    }
}

#[test]
fn what_the_observation_hides_is_the_last_resets() {
    // A passenger who rides from the middle, fickle in 30 % of the episodes.
    let riding = ((2 * 5 + 2) * 5 + 4) * 4;
    let spec = specs().iter().find(|spec| spec.id == "Taxi-v4").unwrap();
    let kwargs = json!({"fickle_passenger": true});
    let changes = spec.make(kwargs.as_object().unwrap()).unwrap().visit(Ride(riding));
    // Standard deviation 14.5.
    assert!((220..=380).contains(&changes), "{changes}");
}
