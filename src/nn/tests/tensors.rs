//! Networks as named arrays, where numbers lie, and target networks.

use super::{Learner, random, shape};
use crate::mdp::streams::Stream;
use crate::nn::{Buffer, Kernels, Mlp, Real, Shape, Tensor, blend};

fn network(layers: &[usize], dueling: bool) -> Mlp<f32> {
    Mlp::new(shape(layers, dueling), &mut Stream::new(5, "network"))
}

#[test]
fn a_network_is_its_tensors_in_any_order() {
    for (layers, dueling) in [(&[4, 24, 24, 2][..], false), (&[3, 17, 4], true), (&[1, 1, 1], true)]
    {
        let mlp = network(layers, dueling);
        let mut tensors = mlp.tensors();
        let n: usize = tensors.iter().map(|t| t.values.len()).sum();
        let biases = layers[1..].iter().sum::<usize>() + usize::from(dueling);
        assert_eq!(n, mlp.shape().n_weights() + biases);
        assert!(tensors.iter().all(|t| t.shape.iter().product::<usize>() == t.values.len()));
        tensors.reverse();
        let again = Mlp::from_tensors(&tensors).unwrap();
        assert_eq!((again.shape(), again.params()), (mlp.shape(), mlp.params()));
    }
    let names = |mlp: &Mlp<f32>| mlp.tensors().into_iter().map(|t| t.name).collect::<Vec<_>>();
    let layer = |i| [format!("q_net.{i}.weight"), format!("q_net.{i}.bias")];
    assert_eq!(names(&network(&[4, 8, 8, 2], false)), [layer(0), layer(2), layer(4)].concat());
    let heads = ["advantage.weight", "advantage.bias", "value.weight", "value.bias"];
    let heads = heads.map(String::from).to_vec();
    assert_eq!(names(&network(&[4, 8, 2], true)), [&layer(0)[..], &heads].concat());
}

#[test]
fn weights_begin_uniform_within_one_over_the_root_of_the_inputs() {
    let mlp = network(&[16, 400, 3], false);
    for (tensor, bound) in mlp.tensors().iter().zip([0.25f32, 0.25, 0.05, 0.05]) {
        let largest = tensor.values.iter().fold(0.0f32, |m, x| m.max(x.abs()));
        assert!(largest <= bound, "{}: {largest}", tensor.name);
        if tensor.values.len() > 100 {
            let n = tensor.values.len() as f64;
            let mean = tensor.values.iter().map(|x| x.to_f64()).sum::<f64>() / n;
            let square = tensor.values.iter().map(|x| x.to_f64() * x.to_f64()).sum::<f64>() / n;
            // The variance of a uniform number in ±b is b²/3, and its square's (2b²/3)²/5.
            let b = f64::from(bound);
            assert!(f64::from(largest) > 0.98 * b, "{}: {largest}", tensor.name);
            assert!(mean.abs() < 5.0 * b / (3.0 * n).sqrt(), "{}: {mean}", tensor.name);
            let error = square - b * b / 3.0;
            assert!(error.abs() < 5.0 * 0.3 * b * b / n.sqrt(), "{}: {square}", tensor.name);
        }
    }
    let other = Mlp::<f32>::new(mlp.shape().clone(), &mut Stream::new(6, "network"));
    assert_ne!(mlp.params(), other.params());
}

#[test]
fn what_is_no_network_is_refused() {
    let (plain, dueling) = (network(&[4, 8, 5, 2], false), network(&[4, 8, 2], true));
    let refused = |mlp: &Mlp<f32>, change: &dyn Fn(&mut Vec<Tensor<f32>>)| {
        let mut tensors = mlp.tensors();
        change(&mut tensors);
        Mlp::from_tensors(&tensors).map(|_| ()).unwrap_err()
    };
    let without = |i: usize| move |t: &mut Vec<Tensor<f32>>| drop(t.remove(i));
    assert_eq!(
        Mlp::<f32>::from_tensors(&[]).map(|_| ()),
        Err("there is no `q_net.0.weight`".into())
    );
    assert_eq!(refused(&plain, &without(0)), "there is no `q_net.0.weight`");
    assert_eq!(refused(&plain, &without(1)), "there is no `q_net.0.bias`");
    // Without the middle layer there is no knowing that there is a last.
    assert_eq!(refused(&plain, &without(2)), "there is no hidden layer");
    assert_eq!(refused(&dueling, &without(4)), "there are heads for advantages or for values only");
    assert_eq!(refused(&dueling, &without(5)), "there is no `value.bias`");
    assert_eq!(refused(&plain, &|t| t[0].shape = vec![32]), "`q_net.0.weight` has the shape [32]");
    assert_eq!(
        refused(&plain, &|t| t[0].shape = vec![0, 4]),
        "`q_net.0.weight` has the shape [0, 4]"
    );
    assert_eq!(
        refused(&plain, &|t| t[0].shape = vec![4, 8]),
        "layer 1 takes 8 numbers, the layer before it gives 4"
    );
    assert_eq!(
        refused(&plain, &|t| t[1].shape = vec![7]),
        "`q_net.0.bias` has the shape [7], the layer before it gives [8]"
    );
    assert!(refused(&plain, &|t| t[1].values.truncate(7)).starts_with("`q_net.0.bias` has"));
    assert_eq!(
        refused(&plain, &|t| t[1].name = "q_net.0.gain".into()),
        "`q_net.0.gain` belongs to no layer"
    );
}

#[test]
fn weights_and_biases_are_where_the_tensors_say() {
    let mlp = network(&[3, 17, 2], false);
    for (layer, pair) in mlp.tensors().chunks(2).enumerate() {
        let n = pair[0].shape[1];
        for (i, value) in pair[0].values.iter().enumerate() {
            assert_eq!(mlp.weight(layer)[(i / n, i % n)], *value);
        }
        assert_eq!(mlp.bias(layer), pair[1].values);
    }
}

/// Inputs at whatever place in memory, and apart from each other or not, have the same values.
#[test]
fn where_numbers_lie_changes_nothing() {
    let mlp = network(&[5, 17, 33, 4], true);
    let x = random::<f32>(&mut Stream::new(2, "x"), 6 * 5);
    let mut learner = Learner::new(Kernels::detect(), mlp.clone(), 6);
    learner.forward(&x);
    for at in 0..17 {
        let mut moved = vec![9.0; at];
        moved.extend(x.chunks(5).flat_map(|row| [row, &vec![9.0; at]].concat()));
        let mut out = learner.activations.clone();
        mlp.clone().forward(Kernels::detect(), &moved[at..], 5 + at, &mut out);
        for row in 0..6 {
            assert_eq!(learner.activations.q(row), out.q(row), "{at}");
        }
    }
    for len in [0, 1, 15, 16, 100] {
        let values = random::<f32>(&mut Stream::new(3, "buffer"), len);
        let buffer = Buffer::of(&values);
        assert_eq!(&*buffer, &*values);
        assert_eq!(&*buffer.clone(), &*values);
        assert_eq!(buffer.as_ptr().align_offset(64), 0, "{len}");
    }
}

/// Of one row alone and among others, the values are the same: what an agent acts by is what it
/// learns.
#[test]
fn a_row_has_the_same_values_alone_and_among_others() {
    for dueling in [false, true] {
        let mlp = network(&[4, 48, 130, 3], dueling);
        let x = random::<f32>(&mut Stream::new(2, "x"), 13 * 4);
        let mut together = Learner::new(Kernels::detect(), mlp.clone(), 13);
        let mut alone = Learner::new(Kernels::detect(), mlp, 1);
        together.forward(&x);
        for row in 0..13 {
            alone.forward(&x[row * 4..][..4]);
            assert_eq!(together.activations.q(row), alone.activations.q(0));
        }
    }
}

#[test]
fn dueling_values_by_hand() {
    // One hidden unit that passes its input on: A = x (1, 2, 6), V = 10 x, mean A = 3 x.
    let shape = Shape { n_inputs: 1, hidden: vec![1], n_actions: 3, dueling: true };
    let mut tensors = Mlp::<f64>::zeros(shape).tensors();
    let weights = [vec![1.0], vec![0.0], vec![1.0, 2.0, 6.0], vec![0.0; 3], vec![10.0], vec![0.0]];
    for (tensor, values) in tensors.iter_mut().zip(weights) {
        tensor.values = values;
    }
    let mut learner = Learner::new(Kernels::detect(), Mlp::from_tensors(&tensors).unwrap(), 1);
    learner.forward(&[2.0]);
    assert_eq!(learner.activations.q(0), [16.0, 18.0, 26.0]);
    learner.forward(&[-2.0]);
    assert_eq!(learner.activations.q(0), [0.0; 3]);
}

#[test]
fn blending_moves_a_part_of_the_way() {
    let from = network(&[4, 9, 2], false);
    for kernels in Kernels::all() {
        let mut to = Mlp::zeros(from.shape().clone());
        blend(kernels, 0.25, &from, &mut to);
        for (to, from) in to.params().iter().zip(from.params()) {
            assert_eq!(*to, 0.25 * from);
        }
        blend(kernels, 0.25, &from, &mut to);
        for (to, from) in to.params().iter().zip(from.params()) {
            assert!((to - 0.4375 * from).abs() <= 1e-7 * from.abs());
        }
        blend(kernels, 1.0, &from, &mut to);
        assert_eq!(to.params(), from.params());
    }
}
