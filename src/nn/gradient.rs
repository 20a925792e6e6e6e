//! Backpropagation (Rumelhart, Hinton & Williams 1986).

use super::kernels::{Affine, Gate, Kernels};
use super::mlp::mean;
use super::{Activations, Buffer, Mlp, Real};

/// The gradient of a loss in the parameters of a network, and room to compute it in.
#[derive(Debug, Clone)]
pub struct Gradient<T: Real> {
    /// As the parameters lie in memory.
    values: Buffer<T>,
    /// The gradient in the outputs of the last layer, shape `[rows, width]`.
    outputs: Buffer<T>,
    /// The same of a hidden layer, and of the one before it.
    hidden: [Buffer<T>; 2],
    /// Weights, shape `[n_outputs, width of the layer before]`.
    transposed: Buffer<T>,
    /// The width of the last layer.
    width: usize,
}

impl<T: Real> Gradient<T> {
    /// Room for `rows` inputs of `mlp`.
    pub fn new(mlp: &Mlp<T>, rows: usize) -> Self {
        let pairs = mlp.layers.windows(2);
        let transposed = pairs.map(|l| l[0].width * l[1].n_outputs).max().unwrap_or(0);
        let widest = mlp.layers.iter().map(|l| l.width).max().unwrap_or(0);
        let width = mlp.layers[mlp.layers.len() - 1].width;
        let hidden = || Buffer::zeros(rows * widest);
        Self {
            values: Buffer::zeros(mlp.params.len()),
            outputs: Buffer::zeros(rows * width),
            hidden: [hidden(), hidden()],
            transposed: Buffer::zeros(transposed),
            width,
        }
    }

    /// The gradient in the parameters, as these lie in memory.
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// The loss changes by `gradient` for a change of `Q(s, action)` in one row, and not at all for
    /// changes of the other action values. Every row is to be set before [`Self::backward`].
    #[inline]
    pub fn set_row(&mut self, row: usize, action: usize, gradient: T) {
        let row = &mut self.outputs[row * self.width..][..self.width];
        row.fill(T::default());
        row[action] = gradient;
    }

    /// From the rows that were set to the gradient in the parameters: `x` has rows of `n_inputs`
    /// numbers, `stride` apart, of which `mlp` made `activations`.
    ///
    /// # Panics
    /// If numbers of rows differ.
    pub fn backward(
        &mut self,
        kernels: Kernels,
        mlp: &Mlp<T>,
        (x, stride): (&[T], usize),
        activations: &Activations<T>,
    ) {
        if mlp.shape().dueling {
            self.through_heads(mlp.shape().n_actions);
        }
        let Self { values, outputs, hidden: [after, before], transposed, .. } = self;
        let rows = outputs.len() / self.width;
        let last = mlp.layers.len() - 1;
        for (i, layer) in mlp.layers.iter().enumerate().rev() {
            let dy: &[T] = if i == last { outputs } else { &after[..rows * layer.width] };
            let (x, stride) = match i {
                0 => (x, stride),
                _ => (&*activations.layers[i - 1], mlp.layers[i - 1].width),
            };
            let (dw, db) =
                values[layer.weights().start..layer.bias().end].split_at_mut(layer.weights().len());
            kernels.outer((x, stride, layer.n_inputs), dy, layer.width, (dw, db));
            if i == 0 {
                break;
            }
            let width = mlp.layers[i - 1].width;
            let transposed = &mut transposed[..layer.n_outputs * width];
            transpose(&mlp.params[layer.weights()], layer.width, transposed, width);
            let affine = Affine {
                x: dy,
                stride: layer.width,
                n_inputs: layer.n_outputs,
                w: transposed,
                bias: None,
                gate: Gate::Passed(x),
            };
            kernels.affine(&affine, width, &mut before[..rows * width]);
            std::mem::swap(after, before);
        }
    }

    /// From the gradient in action values to that in advantages and the value.
    fn through_heads(&mut self, n_actions: usize) {
        for row in self.outputs.chunks_exact_mut(self.width) {
            let mean = mean(&row[..n_actions]);
            row[n_actions] = mean * T::of(n_actions as f64);
            for d in &mut row[..n_actions] {
                *d -= mean;
            }
        }
    }

    /// Shortens the gradient to the length `max_norm` if it is longer, as PyTorch's
    /// `clip_grad_norm_` does: by `max_norm / (length + 1e-6)`. Returns the length it had.
    pub fn clip(&mut self, kernels: Kernels, max_norm: T) -> T {
        let norm = kernels.sum_of_squares(&self.values).sqrt();
        let factor = max_norm / (norm + T::of(1e-6));
        if factor < T::of(1.0) {
            kernels.scale(factor, &mut self.values);
        }
        norm
    }
}

/// `to[j, k] = from[k, j]`, for rows of `from_width` and of `to_width` numbers.
fn transpose<T: Real>(from: &[T], from_width: usize, to: &mut [T], to_width: usize) {
    // In square blocks, so that the lines of both stay in the cache.
    const BLOCK: usize = 16;
    let (rows, columns) = (from.len() / from_width, to.len() / to_width);
    for k0 in (0..rows).step_by(BLOCK) {
        for j0 in (0..columns).step_by(BLOCK) {
            if k0 + BLOCK <= rows && j0 + BLOCK <= columns {
                // Arrays of known length, so that nothing is checked within.
                let row = |k| from[(k0 + k) * from_width + j0..].first_chunk::<BLOCK>();
                let rows: [&[T; BLOCK]; BLOCK] =
                    std::array::from_fn(|k| row(k).expect("rows are wider than blocks"));
                for j in 0..BLOCK {
                    let to = to[(j0 + j) * to_width + k0..].first_chunk_mut::<BLOCK>();
                    *to.expect("rows are wider than blocks") = rows.map(|row| row[j]);
                }
            } else {
                for j in j0..(j0 + BLOCK).min(columns) {
                    let to = &mut to[j * to_width + k0..][..BLOCK.min(rows - k0)];
                    for (k, to) in to.iter_mut().enumerate() {
                        *to = from[(k0 + k) * from_width + j];
                    }
                }
            }
        }
    }
}
