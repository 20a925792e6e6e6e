//! The equations one number at a time, each sum in the order of its index and each product that is
//! added rounded with it: what every machine must come to.

use super::Minibatch;
use crate::nn::kernels::{AdamStep, Affine, Gate};
use crate::nn::{Loss, Mlp, Real};

/// `y = x w + b`, or what of it passes the gate.
pub(super) fn affine<T: Real>(a: &Affine<'_, T>, width: usize, rows: usize) -> Vec<T> {
    let mut y = Vec::new();
    for row in 0..rows {
        for j in 0..width {
            let mut sum = a.bias.map_or(T::default(), |bias| bias[j]);
            for k in 0..a.n_inputs {
                sum = a.x[row * a.stride + k].mul_add(a.w[k * width + j], sum);
            }
            let shut = match a.gate {
                Gate::Open => false,
                Gate::Relu => sum < T::default(),
                // Not positive, or NaN.
                Gate::Passed(x) => {
                    x[row * width + j].partial_cmp(&T::default())
                        != Some(std::cmp::Ordering::Greater)
                }
            };
            y.push(if shut { T::default() } else { sum });
        }
    }
    y
}

/// `xᵀ dy` and `Σ dy`.
pub(super) fn outer<T: Real>(
    (x, stride, n_inputs): (&[T], usize, usize),
    dy: &[T],
    width: usize,
) -> (Vec<T>, Vec<T>) {
    let rows = dy.len() / width;
    let (mut dw, mut db) = (vec![T::default(); n_inputs * width], vec![T::default(); width]);
    for row in 0..rows {
        for j in 0..width {
            let dy = dy[row * width + j];
            for k in 0..n_inputs {
                let sum = &mut dw[k * width + j];
                *sum = x[row * stride + k].mul_add(dy, *sum);
            }
            db[j] += dy;
        }
    }
    (dw, db)
}

pub(super) fn adam<T: Real>(
    step: &AdamStep<T>,
    gradient: &[T],
    m: &mut [T],
    v: &mut [T],
    params: &mut [T],
) {
    // 2⁻¹²⁰.
    let tiny = T::of(1.0 / (1u128 << 120) as f64);
    let flushed = |x: T| if x < tiny && -x < tiny { T::default() } else { x };
    for (i, &g) in gradient.iter().enumerate() {
        m[i] = flushed((g - m[i]).mul_add(step.rest_1, m[i]));
        v[i] = flushed(v[i].mul_add(step.beta_2, g * g * step.rest_2));
        let root = v[i].sqrt().mul_add(step.scale, step.epsilon);
        params[i] = (m[i] / root).mul_add(-step.size, params[i]);
    }
}

pub(super) fn blend<T: Real>(rate: T, from: &[T], to: &mut [T]) {
    for (from, to) in from.iter().zip(to) {
        *to = (*from - *to).mul_add(rate, *to);
    }
}

/// As many sums as a vector has numbers, then the sum of those.
pub(super) fn sum_of_squares<T: Real>(x: &[T]) -> T {
    let mut sums = vec![T::default(); T::LANES];
    for (i, x) in x.iter().enumerate() {
        let sum = &mut sums[i % T::LANES];
        *sum = x.mul_add(*x, *sum);
    }
    let mut total = T::default();
    for sum in sums {
        total += sum;
    }
    total
}

fn mean<T: Real>(x: &[T]) -> T {
    let mut sum = T::default();
    for x in x {
        sum += *x;
    }
    sum / T::of(x.len() as f64)
}

/// The outputs of every layer, the last as action values.
pub(super) fn forward<T: Real>(mlp: &Mlp<T>, x: &[T], rows: usize) -> Vec<Vec<T>> {
    let n = mlp.shape().n_actions;
    let (mut outputs, last): (Vec<Vec<T>>, _) = (Vec::new(), mlp.layers.len() - 1);
    for (i, layer) in mlp.layers.iter().enumerate() {
        let (x, stride) = match i {
            0 => (x, layer.n_inputs),
            _ => (&*outputs[i - 1], mlp.layers[i - 1].width),
        };
        let affine_layer = Affine {
            x,
            stride,
            n_inputs: layer.n_inputs,
            w: &mlp.params()[layer.weights()],
            bias: Some(&mlp.params()[layer.bias()]),
            gate: if i == last { Gate::Open } else { Gate::Relu },
        };
        outputs.push(affine(&affine_layer, layer.width, rows));
    }
    if mlp.shape().dueling {
        for row in outputs[last].chunks_exact_mut(mlp.layers[last].width) {
            let (mean, value) = (mean(&row[..n]), row[n]);
            row[..n].iter_mut().for_each(|q| *q = value + (*q - mean));
        }
    }
    outputs
}

/// The gradient of the mean loss, as the parameters lie in memory.
pub(super) fn gradient<T: Real>(mlp: &Mlp<T>, loss: Loss, batch: &Minibatch<T>) -> Vec<T> {
    let (rows, n) = (batch.rows(), mlp.shape().n_actions);
    let outputs = forward(mlp, &batch.x, rows);
    let last = mlp.layers.len() - 1;
    let width = mlp.layers[last].width;
    let share = T::of(1.0 / rows as f64);
    let mut dy = vec![T::default(); rows * width];
    for (row, dy) in dy.chunks_exact_mut(width).enumerate() {
        let a = batch.actions[row];
        let (_, slope) = loss.of(outputs[last][row * width + a] - batch.targets[row]);
        dy[a] = slope * share;
        if mlp.shape().dueling {
            let mean = mean(&dy[..n]);
            dy[n] = mean * T::of(n as f64);
            dy[..n].iter_mut().for_each(|d| *d -= mean);
        }
    }
    let mut all = vec![T::default(); mlp.params().len()];
    for (i, layer) in mlp.layers.iter().enumerate().rev() {
        let (x, stride) = match i {
            0 => (&*batch.x, layer.n_inputs),
            _ => (&*outputs[i - 1], mlp.layers[i - 1].width),
        };
        let (dw, db) = outer((x, stride, layer.n_inputs), &dy, layer.width);
        all[layer.weights()].copy_from_slice(&dw);
        all[layer.bias()].copy_from_slice(&db);
        if i == 0 {
            break;
        }
        let w = &mlp.params()[layer.weights()];
        let mut before = vec![T::default(); rows * stride];
        for row in 0..rows {
            for k in (0..layer.n_inputs).filter(|k| x[row * stride + k] > T::default()) {
                let sum = &mut before[row * stride + k];
                for j in 0..layer.n_outputs {
                    *sum = dy[row * layer.width + j].mul_add(w[k * layer.width + j], *sum);
                }
            }
        }
        dy = before;
    }
    all
}
