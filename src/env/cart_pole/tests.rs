use super::*;

fn rng() -> NumpyRng {
    NumpyRng::from_u64(0)
}

fn upright() -> CartPole {
    CartPole::new(false)
}

#[test]
fn one_step_by_hand() {
    // Upright and at rest: sin = 0, cos = 1, temp = 10 / 1.1.
    let mut env = upright();
    let step = env.step(1, &mut rng());
    let temp = 10.0 / 1.1;
    let theta_acc = -temp / (0.5 * (4.0 / 3.0 - 0.1 / 1.1));
    let x_acc = temp - 0.05 * theta_acc / 1.1;
    // The explicit scheme moves positions by the old velocities, which are 0.
    assert_eq!(step.obs, [0.0, (0.02 * x_acc) as f32, 0.0, (0.02 * theta_acc) as f32]);
    assert!((env.x_dot - 0.195_121_951_219_512_2).abs() < 1e-15, "{}", env.x_dot);
    assert!((env.theta_dot + 0.292_682_926_829_268_3).abs() < 1e-15, "{}", env.theta_dot);
    assert_eq!((step.reward, step.terminated), (1.0, false));

    let mut env = upright();
    env.set_semi_implicit(true);
    env.step(1, &mut rng());
    assert_eq!(env.x, 0.02 * env.x_dot);
    assert_eq!(env.theta, 0.02 * env.theta_dot);
}

#[test]
fn a_mirrored_push_gives_the_mirrored_state() {
    let (mut left, mut right) = (upright(), upright());
    for t in 0..20 {
        let a = t % 3 / 2;
        let (l, r) = (left.step(a, &mut rng()), right.step(1 - a, &mut rng()));
        assert_eq!(l.obs.map(|x| -x), r.obs);
    }
}

#[test]
fn falling_pays_once() {
    let rewards = |sutton_barto_reward| {
        let mut env = CartPole::new(sutton_barto_reward);
        let mut fell = Vec::new();
        while fell.len() < 3 {
            let step = env.step(1, &mut rng());
            if step.terminated {
                fell.push(step.reward);
            }
        }
        fell
    };
    assert_eq!(rewards(false), [1.0, 0.0, 0.0]);
    assert_eq!(rewards(true), [-1.0, -1.0, -1.0]);
}

#[test]
fn float64_states_are_gymnasiums() {
    // One step of Gymnasium from fast and tilted states, where every rounding counts: the float32
    // observations would hide most of them, and each product that could be taken in another order
    // shows in some row. (semi-implicit, action, state, bits of the next state)
    #[rustfmt::skip]
    let steps = [
        (false, 1, [1.4912, -0.0935, 0.0361, 3.3063], [0x3ff7_d44b_b1af_3a15, 0x3fb9_fa01_1a73_ee14, 0x3fba_2b7b_aecd_0784, 0x4008_3279_241e_8570]),
        (false, 0, [0.9114, -0.2907, 0.1833, -0.5639], [0x3fec_fa8f_7db6_e504, 0xbfdf_390a_179d_5ed2, 0x3fc6_04d1_2018_a43b, 0xbfcc_1995_49c9_5c90]),
        (false, 1, [-1.6996, -0.2251, 0.1539, -0.4653], [0xbffb_4400_7570_c565, 0xbfa0_9d34_99ef_8648, 0x3fc2_820e_6299_524c, 0xbfe6_95d9_a054_4962]),
        (false, 0, [0.9323, -0.2251, 0.1954, 5.4038], [0x3fed_b085_6e69_6a27, 0xbfda_ae60_586b_839b, 0x3fd3_6c26_99c7_bcc2, 0x4016_f8ee_9723_d37f]),
        (true, 1, [1.0015, -1.3175, -0.0059, 5.7688], [0x3fef_5461_4633_c791, 0xbff1_f5b3_5824_b619, 0x3fba_84f0_2883_1098, 0x4015_e5f0_1a87_aca5]),
        (true, 0, [1.8466, 1.3487, 0.0165, -2.6773], [0x3ffd_ea2a_442d_63cf, 0x3ff2_7493_3c62_9d18, 0xbf9f_d6bd_4d0f_7d14, 0xc003_097b_8bb3_a675]),
        (true, 1, [-1.3574, 2.8196, 0.0064, -4.6096], [0xbff4_c0f0_ea5b_bca9, 0x4008_1e3b_ac66_bc76, 0xbfb7_73b1_ed4e_4efe, 0xc013_9a11_15e0_0efe]),
        (false, 0, [0.0473, 2.7028, -0.1423, 5.3838], [0x3fb9_f277_8140_dd40, 0x4004_0c3a_544c_c52e, 0xbfa1_ba3c_a750_3b84, 0x4016_8996_e6b5_067e]),
        (false, 1, [-0.7527, -0.46, 0.1311, -1.0896], [0xbfe8_617c_1bda_511a, 0xbfd1_13b1_0939_2175, 0x3fbb_fb9b_ed30_f062, 0xbff5_6a40_2613_264e]),
    ];
    for (semi_implicit, action, [x, x_dot, theta, theta_dot], bits) in steps {
        let mut env = CartPole { x, x_dot, theta, theta_dot, semi_implicit, ..upright() };
        env.step(action, &mut rng());
        assert_eq!([env.x, env.x_dot, env.theta, env.theta_dot].map(f64::to_bits), bits);
    }
}

#[test]
fn a_state_back_inside_pays_again_but_a_second_fall_does_not() {
    let mut env = upright();
    let rewards = [3.0, 0.0, 3.0].map(|x| {
        env.x = x;
        let step = env.step(1, &mut rng());
        (step.reward, step.terminated)
    });
    assert_eq!(rewards, [(1.0, true), (1.0, false), (0.0, true)]);
}

#[test]
fn the_limits_are_exclusive_and_tested_in_float64() {
    assert_eq!(THETA_LIMIT, 0.209_439_510_239_319_53);
    for (x, terminated) in [(2.4, false), (2.4_f64.next_up(), true), (-2.4, false)] {
        let mut env = upright();
        env.x = x;
        assert_eq!(env.step(1, &mut rng()).terminated, terminated, "{x}");
    }
    for (theta, terminated) in [(THETA_LIMIT, false), (-THETA_LIMIT.next_up(), true)] {
        let mut env = upright();
        env.theta = theta;
        assert_eq!(env.step(1, &mut rng()).terminated, terminated, "{theta}");
    }
}

#[test]
fn the_integrator_is_one_of_two() {
    let mut env = upright();
    env.set_attribute("kinematics_integrator", &"semi-implicit euler".into()).unwrap();
    assert!(env.semi_implicit);
    let error = env.set_attribute("kinematics_integrator", &"Eular".into()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "`kinematics_integrator` must be `euler` or `semi-implicit euler`, not \"Eular\" \
         (did you mean `euler`?)"
    );
}
