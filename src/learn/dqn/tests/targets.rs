//! What action values are moved towards.

use serde_json::Value;

use crate::learn::dqn::{best, bootstrap, td_error};
use crate::nn::Real;
use crate::shaping::ActionSet;

fn numbers<T: Real>(value: &Value) -> Vec<T> {
    value.as_array().unwrap().iter().map(|x| T::of(x.as_f64().unwrap())).collect()
}

fn rows<T: Real>(value: &Value) -> Vec<Vec<T>> {
    value.as_array().unwrap().iter().map(numbers).collect()
}

fn agrees<T: Real>(given: &Value, recorded: &Value, tolerance: f64) {
    let (q, target) = (rows::<T>(&recorded["next_q"]), rows::<T>(&recorded["next_q_target"]));
    let (rewards, discounts) = (numbers::<T>(&given["rewards"]), numbers::<T>(&given["discounts"]));
    for (name, double) in [("dqn", false), ("double_dqn", true)] {
        let wanted = numbers::<T>(&recorded["targets"][name]);
        assert_eq!(wanted.len(), 8);
        for i in 0..8 {
            let value = bootstrap(&target[i], double.then_some(&*q[i]), ActionSet::ALL);
            let y = -td_error(T::default(), rewards[i], discounts[i], value);
            let error = (y.to_f64() - wanted[i].to_f64()).abs();
            assert!(error <= tolerance * wanted[i].to_f64().abs(), "{name} {i}: {y:?} {wanted:?}");
        }
    }
}

/// Of one product and one sum.
#[test]
fn targets_are_pytorchs() {
    let all: Value =
        serde_json::from_str(include_str!("../../../../tests/data/nn/pytorch.json")).unwrap();
    for kind in ["plain", "dueling"] {
        agrees::<f64>(&all[kind], &all[kind]["float64"], 1e-15);
        agrees::<f32>(&all[kind], &all[kind]["float32"], 2e-7);
    }
}

#[test]
fn targets_by_hand() {
    let (q, target) = ([1.0, 5.0, 3.0], [4.0, 2.0, 6.0]);
    assert_eq!(bootstrap(&target, None, ActionSet::ALL), 6.0);
    assert_eq!(bootstrap(&target, Some(&q), ActionSet::ALL), 2.0);
    // Without the last action, without the middle one, with the first only.
    assert_eq!(bootstrap(&target, None, ActionSet(0b011)), 4.0);
    assert_eq!(bootstrap(&target, Some(&q), ActionSet(0b101)), 6.0);
    assert_eq!(bootstrap(&target, Some(&q), ActionSet(0b001)), 4.0);
    assert_eq!(best(&[2.0, 7.0, 7.0], ActionSet::ALL), 1);
    assert_eq!(best(&[-1.0, f64::NEG_INFINITY], ActionSet(0b10)), 1);

    assert_eq!(td_error(10.0, 1.0, 0.5, 4.0), 7.0);
    // Of a terminal state nothing matters, not even a value that is none.
    for value in [3.0, f64::NAN, f64::INFINITY] {
        assert_eq!(td_error(10.0, 1.0, 0.0, value), 9.0);
    }
}
