use super::*;
use crate::mdp::Env;
use serde_json::{Map, json};

fn lander(mission: Mission) -> (LunarLander, NumpyRng) {
    (LunarLander::new(mission).unwrap(), NumpyRng::from_u64(5))
}

#[test]
fn a_reset_draws_sixteen_doubles_and_with_wind_two_halves() {
    for (enable_wind, words) in [(false, 16), (true, 17)] {
        let (mut env, mut rng) = lander(Mission { enable_wind, ..Mission::default() });
        let mut plain = rng.clone();
        env.reset(&mut rng);
        for _ in 0..words {
            plain.next_u64();
        }
        assert_eq!(rng.next_u64(), plain.next_u64());
        assert_eq!(env.has_wind(), enable_wind);
        assert_eq!(env.wind() != [0.0; 2], enable_wind);
    }
}

#[test]
fn hills_are_smoothed_and_the_pad_is_level() {
    let (mut env, mut rng) = lander(Mission::default());
    let mut draws = rng.clone();
    let heights: [f64; 12] = std::array::from_fn(|_| draws.uniform(0.0, HEIGHT / 2.0));
    env.reset(&mut rng);
    let points = env.terrain();
    // A third of three neighbours, nearly; the first one's left neighbour is the last height.
    assert_eq!(points[0], [0.0, 0.33 * (heights[11] + heights[0] + heights[1])]);
    assert_eq!(points[10], [20.0, 0.33 * (heights[9] + heights[10] + heights[11])]);
    let ([left, right], y) = env.helipad();
    assert_eq!((left, right), (8.0, 12.0));
    for [x, height] in points {
        assert!(!(left..=right).contains(&x) || (height - 0.99 * y).abs() < 1e-12);
    }
}

#[test]
fn the_main_engine_lifts_and_side_engines_turn() {
    let free = |action| {
        let (mut env, mut rng) = lander(Mission::default());
        env.reset(&mut rng);
        let hull = env.world.bodies[HULL].velocity();
        let spin = env.world.bodies[HULL].angular_velocity();
        for _ in 0..5 {
            env.step_discrete(action, &mut rng);
        }
        let body = &env.world.bodies[HULL];
        (body.velocity().y - hull.y, body.angular_velocity() - spin, env.jets())
    };
    let (fall, _, jets) = free(0);
    assert_eq!(jets, Jets::default());
    let (lift, _, jets) = free(2);
    assert!(lift > fall + 1.0, "{lift} {fall}");
    // The exhaust goes down.
    assert!(jets.main.unwrap().impulse[1] < 0.0 && jets.side.is_none());
    let (_, left, jets) = free(1);
    assert_eq!((jets.direction, jets.main), (-1.0, None));
    let (_, right, _) = free(3);
    assert!(left > 0.0 && right < 0.0, "{left} {right}");
}

#[test]
fn continuous_actions_have_thresholds_and_are_clipped() {
    let throttle = |main, lateral| {
        let Throttle { main, side, direction } = Throttle::continuous([main, lateral]);
        [main, side, direction]
    };
    assert_eq!(throttle(0.0, 0.5), [0.0, 0.0, 0.0]);
    assert_eq!(throttle(0.5, -0.75), [0.75, 0.75, -1.0]);
    assert_eq!(throttle(7.0, 9.0), [1.0, 1.0, 1.0]);
    assert_eq!(Throttle::continuous([1.0, 0.0]), Throttle::discrete(2));
    assert_eq!(Throttle::continuous([-1.0, -1.0]), Throttle::discrete(1));
}

#[test]
fn the_default_table_of_actions_is_the_discrete_lander() {
    let (mut discrete, mut rng) = lander(Mission::default());
    let (mut table, mut other) = lander(Mission { continuous: true, ..Mission::default() });
    assert_eq!(discrete.reset(&mut rng), table.reset(&mut other));
    for t in 0..60 {
        let action = [2, 0, 3, 1][t % 4];
        assert_eq!(
            Env::step(&mut discrete, action, &mut rng),
            Env::step(&mut table, action, &mut other)
        );
    }
}

fn potential(s: &[f64; 8]) -> f64 {
    let length = |x: f64, y: f64| (x * x + y * y).sqrt();
    -100.0 * (length(s[0], s[1]) + length(s[2], s[3]) + s[4].abs()) + 10.0 * (s[6] + s[7])
}

#[test]
fn native_rewards_are_differences_of_the_potential_less_fuel() {
    let play = |native_shaping, fuel_cost| {
        let (mut env, mut rng) =
            lander(Mission { native_shaping, fuel_cost, ..Mission::default() });
        let mut obs = env.reset(&mut rng).map(f64::from);
        let mut rewards = Vec::new();
        for t in 0.. {
            let before = potential(&obs);
            let step = env.step_discrete([2, 0, 1][t % 3], &mut rng);
            obs = step.obs.map(f64::from);
            rewards.push((step.reward, potential(&obs) - before));
            if step.terminated {
                return rewards;
            }
        }
        unreachable!("it comes down");
    };
    let fuel = [0.3, 0.0, 0.03];
    let native = play(true, 1.0);
    let (last, before) = native.split_last().unwrap();
    assert_eq!(last.0, -100.0);
    for (t, (reward, difference)) in before.iter().enumerate() {
        // Observations are rounded to float32, the potential is not.
        assert!((reward - (difference - fuel[t % 3])).abs() < 1e-4, "{t}");
    }
    let strict = play(false, 2.0);
    assert_eq!(strict.len(), native.len());
    let (last, before) = strict.split_last().unwrap();
    assert_eq!(last.0, -100.0);
    for (t, (reward, _)) in before.iter().enumerate() {
        assert_eq!(*reward, -2.0 * fuel[t % 3]);
    }
}

#[test]
fn the_legs_hang_where_they_are_drawn() {
    let (mut env, mut rng) = lander(Mission::default());
    env.reset(&mut rng);
    let [x, _] = env.position();
    let middle = |leg: [[f32; 2]; 4]| leg.iter().map(|corner| corner[0]).sum::<f32>() / 4.0;
    let [first, second] = env.legs().map(middle);
    assert!(second < x && x < first, "the first leg is the one on the right");
    // The hull keeps its size.
    let hull = env.hull();
    let width = (hull[0][0] - hull[5][0]).hypot(hull[0][1] - hull[5][1]);
    assert!(hull.iter().all(|corner| corner[1] > 10.0) && width > 0.0);
    assert_eq!(env.leg_contacts(), [false; 2]);
}

#[test]
fn arguments_outside_their_ranges_are_named() {
    for (kwargs, message) in [
        (json!({"gravity": 0.0}), "`gravity` must be between -12 and 0 (excluded), not 0"),
        (json!({"gravity": -12}), "`gravity` must be between -12 and 0 (excluded), not -12"),
        (json!({"wind_power": 25.0}), "`wind_power` must be between 0 and 20, not 25"),
        (json!({"turbulence_power": -1}), "`turbulence_power` must be between 0 and 2, not -1"),
        (json!({"fuel_cost": -1}), "`fuel_cost` must be 0 or more, not -1"),
        (json!({"shaping": null}), "`shaping` must be one of `native`, `none`, not null"),
    ] {
        let kwargs: &Map<_, _> = kwargs.as_object().unwrap();
        let error = crate::env::make("LunarLander-v3", kwargs).unwrap_err();
        assert_eq!(error.message, message);
    }
}
