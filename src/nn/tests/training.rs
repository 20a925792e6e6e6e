//! Whole trainings: the same bits on every machine.

use proptest::prelude::*;

use super::{Learner, Minibatch, assert_same, reference, shape};
use crate::mdp::streams::Stream;
use crate::nn::kernels::AdamStep;
use crate::nn::{Adam, Kernels, Loss, Mlp, Real, Shape, blend};

const STEPS: i32 = 200;
const RATE: f64 = 0.003;
const MAX_NORM: f64 = 0.7;

/// A network and its target after training on four minibatches by turns.
fn trained<T: Real>(kernels: Kernels, shape: &Shape, loss: Loss, rows: usize) -> [Vec<T>; 2] {
    let mut stream = Stream::new(3, "training");
    let mlp = Mlp::<T>::new(shape.clone(), &mut stream);
    let batches = [(); 4].map(|()| Minibatch::random(&mut stream, rows, shape));
    let mut adam = Adam::new(&mlp);
    let mut target = mlp.clone();
    let mut learner = Learner::new(kernels, mlp, rows);
    let mut losses = Vec::new();
    for step in 0..STEPS {
        losses.push(learner.learn(loss, &batches[step as usize % 4]).to_f64());
        learner.gradient.clip(kernels, T::of(MAX_NORM));
        adam.step(kernels, RATE, &learner.gradient, &mut learner.mlp);
        blend(kernels, 0.05, &learner.mlp, &mut target);
    }
    let (first, last) = (losses[..4].iter().sum::<f64>(), losses[196..].iter().sum::<f64>());
    assert!(last < 0.75 * first, "{shape:?}: {first} {last}: it learns");
    // Padding is still 0: without it nothing is lost.
    let again = Mlp::from_tensors(&learner.mlp.tensors()).unwrap();
    assert_same("padding", again.params(), learner.mlp.params());
    [learner.mlp.params().to_vec(), target.params().to_vec()]
}

/// The same by plain loops.
fn trained_plainly<T: Real>(shape: &Shape, loss: Loss, rows: usize) -> [Vec<T>; 2] {
    let mut stream = Stream::new(3, "training");
    let mut mlp = Mlp::<T>::new(shape.clone(), &mut stream);
    let batches = [(); 4].map(|()| Minibatch::random(&mut stream, rows, shape));
    let zeros = vec![T::default(); mlp.params().len()];
    let (mut m, mut v, mut target) = (zeros.clone(), zeros, mlp.params().to_vec());
    let mut powers = [1.0, 1.0];
    for step in 0..STEPS {
        let mut g = reference::gradient(&mlp, loss, &batches[step as usize % 4]);
        let norm = reference::sum_of_squares(&g).sqrt();
        let factor = T::of(MAX_NORM) / (norm + T::of(1e-6));
        if factor < T::of(1.0) {
            g.iter_mut().for_each(|g| *g = *g * factor);
        }
        powers = [powers[0] * 0.9, powers[1] * 0.999];
        let step = AdamStep {
            rest_1: T::of(1.0 - 0.9),
            beta_2: T::of(0.999),
            rest_2: T::of(1.0 - 0.999),
            size: T::of(RATE / (1.0 - powers[0])),
            scale: T::of(1.0 / (1.0 - powers[1]).sqrt()),
            epsilon: T::of(1e-8),
        };
        reference::adam(&step, &g, &mut m, &mut v, mlp.params_mut());
        reference::blend(T::of(0.05), mlp.params(), &mut target);
    }
    [mlp.params().to_vec(), target]
}

/// The number that FNV-1a makes of the bits of `values`.
fn fingerprint(values: &[f32]) -> u64 {
    let bytes = values.iter().flat_map(|x| x.to_bits().to_le_bytes());
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

#[test]
fn training_has_the_same_bits_on_every_machine() {
    let cases = [
        (shape(&[4, 24, 24, 2], false), Loss::SquaredError, 8, 0xaff3_30fe_9ccb_5c39),
        (shape(&[3, 17, 33, 5], true), Loss::Huber, 7, 0xdb8b_322c_953d_902a),
    ];
    for (shape, loss, rows, bits) in &cases {
        let wanted = trained_plainly::<f32>(shape, *loss, *rows);
        assert_eq!(
            fingerprint(&wanted.concat()),
            *bits,
            "{shape:?} {:#x}",
            fingerprint(&wanted.concat())
        );
        let wanted_double = trained_plainly::<f64>(shape, *loss, *rows);
        for kernels in Kernels::all() {
            let what = format!("{kernels:?} {shape:?}");
            assert_same(&what, &trained(kernels, shape, *loss, *rows).concat(), &wanted.concat());
            let double = trained(kernels, shape, *loss, *rows);
            assert_same(&what, &double.concat(), &wanted_double.concat());
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    /// Of whatever shape: blocks of rows, of columns and of transposed weights, and what is left.
    #[test]
    fn gradients_of_any_shape_are_those_of_the_plain_loops(
        layers in prop::collection::vec(1usize..50, 3..5),
        dueling: bool,
        rows in 1usize..10,
        seed in 0u64..1000,
    ) {
        let shape = shape(&layers, dueling);
        let mut stream = Stream::new(seed, "shapes");
        let mlp = Mlp::<f32>::new(shape.clone(), &mut stream);
        let batch = Minibatch::random(&mut stream, rows, &shape);
        let wanted = reference::gradient(&mlp, Loss::Huber, &batch);
        for kernels in Kernels::all() {
            let mut learner = Learner::new(kernels, mlp.clone(), rows);
            // Twice: what is left of the first changes nothing.
            for _ in 0..2 {
                learner.learn(Loss::Huber, &batch);
            }
            assert_same(&format!("{kernels:?}"), learner.gradient.values(), &wanted);
        }
    }
}
