//! What networks must agree with: PyTorch's numbers, finite differences, and the equations written
//! out one number at a time.

mod differences;
mod kernels;
mod pytorch;
mod reference;
mod tensors;
mod training;

use super::{Activations, Gradient, Kernels, Loss, Mlp, Real, Shape};
use crate::mdp::streams::Stream;

/// Layers as `[inputs, hidden.., actions]`.
fn shape(layers: &[usize], dueling: bool) -> Shape {
    let [n_inputs, hidden @ .., n_actions] = layers else { panic!("inputs and actions") };
    Shape { n_inputs: *n_inputs, hidden: hidden.to_vec(), n_actions: *n_actions, dueling }
}

/// Numbers from -1 to 1.
fn random<T: Real>(stream: &mut Stream, n: usize) -> Vec<T> {
    (0..n).map(|_| T::of(2.0 * stream.uniform() - 1.0)).collect()
}

/// What is learned from: a row each.
#[derive(Debug, Clone)]
struct Minibatch<T> {
    /// Shape `[rows, n_inputs]`.
    x: Vec<T>,
    actions: Vec<usize>,
    targets: Vec<T>,
}

impl<T: Real> Minibatch<T> {
    fn random(stream: &mut Stream, rows: usize, shape: &Shape) -> Self {
        let x = random(stream, rows * shape.n_inputs);
        let actions = (0..rows).map(|_| stream.below(shape.n_actions)).collect();
        // Far enough for both branches of Huber's loss.
        let targets = random::<T>(stream, rows).iter().map(|y| T::of(3.0) * *y).collect();
        Self { x, actions, targets }
    }

    fn rows(&self) -> usize {
        self.actions.len()
    }
}

/// A network and room to learn in.
#[derive(Debug, Clone)]
struct Learner<T: Real> {
    kernels: Kernels,
    mlp: Mlp<T>,
    activations: Activations<T>,
    gradient: Gradient<T>,
}

impl<T: Real> Learner<T> {
    fn new(kernels: Kernels, mlp: Mlp<T>, rows: usize) -> Self {
        let (activations, gradient) = (Activations::new(&mlp, rows), Gradient::new(&mlp, rows));
        Self { kernels, mlp, activations, gradient }
    }

    fn forward(&mut self, x: &[T]) {
        let n = self.mlp.shape().n_inputs;
        self.mlp.forward(self.kernels, x, n, &mut self.activations);
    }

    /// The mean loss, with its gradient.
    fn learn(&mut self, loss: Loss, batch: &Minibatch<T>) -> T {
        self.forward(&batch.x);
        let share = T::of(1.0 / batch.rows() as f64);
        let mut sum = T::default();
        for (row, (&a, &target)) in batch.actions.iter().zip(&batch.targets).enumerate() {
            let (l, slope) = loss.of(self.activations.q(row)[a] - target);
            sum += l * share;
            self.gradient.set_row(row, a, slope * share);
        }
        let n = self.mlp.shape().n_inputs;
        self.gradient.backward(self.kernels, &self.mlp, (&batch.x, n), &self.activations);
        sum
    }
}

/// The same bits; one NaN is like another.
fn same<T: Real>(a: T, b: T) -> bool {
    let (a, b) = (a.to_f64(), b.to_f64());
    a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
}

#[track_caller]
fn assert_same<T: Real>(what: &str, got: &[T], wanted: &[T]) {
    assert_eq!(got.len(), wanted.len(), "{what}");
    for (i, (&a, &b)) in got.iter().zip(wanted).enumerate() {
        assert!(same(a, b), "{what}, number {i}: {a:?}, not {b:?}");
    }
}
