//! PyTorch's numbers, recorded by `tests/data/nn/generate.py`.

use serde_json::Value;

use super::{Learner, Minibatch};
use crate::nn::{Activations, Adam, Kernels, Loss, Mlp, Real, Tensor};

fn recorded() -> Value {
    serde_json::from_str(include_str!("../../../tests/data/nn/pytorch.json")).unwrap()
}

/// All numbers of nested lists, in order.
fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(list) => list.iter().flat_map(numbers).collect(),
        number => vec![number.as_f64().unwrap()],
    }
}

fn read<T: Real>(value: &Value) -> Vec<T> {
    numbers(value).into_iter().map(T::of).collect()
}

/// The name here of what is called `name` there.
fn named(name: &str) -> String {
    if name.starts_with(|c: char| c.is_ascii_digit()) {
        format!("q_net.{name}")
    } else {
        name.into()
    }
}

fn network<T: Real>(parameters: &Value) -> Mlp<T> {
    let tensors = parameters.as_object().unwrap().iter().map(|(name, value)| {
        let rows = value.as_array().unwrap();
        let mut shape = vec![rows.len()];
        shape.extend(rows[0].as_array().map(Vec::len));
        Tensor { name: named(name), shape, values: read(value) }
    });
    Mlp::from_tensors(&tensors.collect::<Vec<_>>()).unwrap()
}

/// Within `tolerance` of the largest number there.
#[track_caller]
fn close<T: Real>(what: &str, got: &[T], wanted: &Value, tolerance: f64) {
    let wanted = numbers(wanted);
    assert_eq!(got.len(), wanted.len(), "{what}");
    let size = wanted.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    for (got, wanted) in got.iter().zip(&wanted) {
        let error = (got.to_f64() - wanted).abs();
        assert!(error <= tolerance * size, "{what}: {got:?}, not {wanted}: off by {error:e}");
    }
}

/// As [`close`], of what lies in memory as the parameters of `mlp` do.
#[track_caller]
fn all_close<T: Real>(what: &str, mlp: &Mlp<T>, values: &[T], wanted: &Value, tolerance: f64) {
    let mut mlp = mlp.clone();
    mlp.params_mut().copy_from_slice(values);
    let tensors = mlp.tensors();
    let wanted = wanted.as_object().unwrap();
    assert_eq!(tensors.len(), wanted.len());
    for (name, wanted) in wanted {
        let tensor = tensors.iter().find(|t| t.name == named(name)).unwrap();
        close(&format!("{what} {name}"), &tensor.values, wanted, tolerance);
    }
}

fn q_values<T: Real>(mlp: &Mlp<T>, x: &[T]) -> Vec<T> {
    let n = mlp.shape().n_inputs;
    let mut out = Activations::new(mlp, x.len() / n);
    mlp.forward(Kernels::detect(), x, n, &mut out);
    (0..x.len() / n).flat_map(|row| out.q(row).to_vec()).collect()
}

/// Everything recorded of one network in one precision.
fn agrees<T: Real>(given: &Value, wanted: &Value, tolerance: f64) {
    let mlp = network::<T>(&given["online"]);
    let target = network::<T>(&given["target"]);
    let x = read::<T>(&given["observations"]);
    let after = read::<T>(&given["next_observations"]);
    close("q", &q_values(&mlp, &x), &wanted["q"], tolerance);
    close("next_q", &q_values(&mlp, &after), &wanted["next_q"], tolerance);
    close("next_q_target", &q_values(&target, &after), &wanted["next_q_target"], tolerance);

    let actions = numbers(&given["actions"]).iter().map(|a| *a as usize).collect();
    let batch = Minibatch { x, actions, targets: read(&wanted["targets"]["dqn"]) };
    let kernels = Kernels::detect();
    for (name, loss) in [("mse", Loss::SquaredError), ("huber", Loss::Huber)] {
        let mut learner = Learner::new(kernels, mlp.clone(), batch.rows());
        let l = learner.learn(loss, &batch);
        let wanted = &wanted[name];
        close(name, &[l], &wanted["loss"], tolerance);
        all_close(name, &mlp, learner.gradient.values(), &wanted["gradients"], tolerance);
        let norm = learner.gradient.clip(kernels, T::of(0.5));
        close("norm", &[norm], &wanted["norm"], tolerance);
        if loss == Loss::Huber {
            all_close("clipped", &mlp, learner.gradient.values(), &wanted["clipped"], tolerance);
            continue;
        }
        let mut adam = Adam::new(&mlp);
        for step in 1..=5 {
            learner.learn(loss, &batch);
            adam.step(kernels, 0.001, &learner.gradient, &mut learner.mlp);
            if let Some(wanted) = wanted["adam"].get(step.to_string()) {
                let what = format!("Adam, step {step},");
                all_close(&what, &mlp, learner.mlp.params(), wanted, tolerance);
            }
        }
    }
}

/// Of sums of up to 24 numbers, in whatever order PyTorch takes them.
#[test]
fn the_numbers_are_pytorchs() {
    let all = recorded();
    for kind in ["plain", "dueling"] {
        agrees::<f64>(&all[kind], &all[kind]["float64"], 1e-14);
        agrees::<f32>(&all[kind], &all[kind]["float32"], 1e-6);
    }
}
