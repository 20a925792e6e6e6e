//! The network: layers of weights, and what they make of an input.

use nalgebra::{DMatrixView, Dyn};

use super::kernels::{Affine, Gate, Kernels};
use super::{Buffer, Real};
use crate::mdp::streams::Stream;

/// What a network looks like.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Shape {
    /// Numbers that it sees.
    pub n_inputs: usize,
    /// Units of each hidden layer, all rectified.
    pub hidden: Vec<usize>,
    /// Action values that it gives.
    pub n_actions: usize,
    /// Whether it gives them as a state's value and the advantages of actions (Wang et al. 2016).
    pub dueling: bool,
}

impl Shape {
    /// Number of outputs of the last layer of weights.
    fn n_outputs(&self) -> usize {
        self.n_actions + usize::from(self.dueling)
    }

    /// Multiplications with an addition that a forward pass of one input takes.
    pub fn n_weights(&self) -> usize {
        let mut n_inputs = self.n_inputs;
        let mut n_weights = 0;
        for width in self.hidden.iter().copied().chain([self.n_outputs()]) {
            n_weights += n_inputs * width;
            n_inputs = width;
        }
        n_weights
    }
}

/// A layer of weights and where they are among the parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layer {
    pub(super) n_inputs: usize,
    pub(super) n_outputs: usize,
    /// `n_outputs`, padded to whole vectors. Padding is 0 and stays 0: nothing flows into it.
    pub(super) width: usize,
    /// Where the weights are, shape `[n_inputs, width]`; the bias, `[width]`, comes after them.
    at: usize,
}

impl Layer {
    pub(super) fn weights(&self) -> std::ops::Range<usize> {
        self.at..self.at + self.n_inputs * self.width
    }

    pub(super) fn bias(&self) -> std::ops::Range<usize> {
        let start = self.at + self.n_inputs * self.width;
        start..start + self.width
    }
}

/// A multilayer perceptron: `x ← max(0, W x + b)` for every hidden layer, `W x + b` for the last.
///
/// With dueling heads the last layer gives advantages A and a value V, and the action values are
/// `Q(s, a) = V + A(a) − mean A` (Wang et al. 2016, equation 9). Deviation: both heads read the last
/// hidden layer; they have no hidden layers of their own.
#[derive(Debug, Clone, PartialEq)]
pub struct Mlp<T: Real> {
    shape: Shape,
    pub(super) layers: Vec<Layer>,
    pub(super) params: Buffer<T>,
}

/// A named array: the name as a state dictionary of PyTorch has it, the shape, and the numbers in
/// the order of the last axis first.
#[derive(Debug, Clone, PartialEq)]
pub struct Tensor<T> {
    /// `q_net.0.weight`.
    pub name: String,
    /// `[n_outputs, n_inputs]` for weights, `[n_outputs]` for biases.
    pub shape: Vec<usize>,
    /// The numbers.
    pub values: Vec<T>,
}

impl<T: Real> Mlp<T> {
    /// All parameters 0.
    ///
    /// # Panics
    /// If there are no inputs, actions or hidden layers, or one of them has no units.
    pub fn zeros(shape: Shape) -> Self {
        assert!(shape.n_inputs > 0 && shape.n_actions > 0, "{shape:?}");
        assert!(!shape.hidden.is_empty() && shape.hidden.iter().all(|n| *n > 0), "{shape:?}");
        let mut layers = Vec::new();
        let (mut n_inputs, mut at) = (shape.n_inputs, 0);
        for n_outputs in shape.hidden.iter().copied().chain([shape.n_outputs()]) {
            let width = n_outputs.next_multiple_of(T::LANES);
            let layer = Layer { n_inputs, n_outputs, width, at };
            at = layer.bias().end;
            n_inputs = n_outputs;
            layers.push(layer);
        }
        Self { shape, layers, params: Buffer::zeros(at) }
    }

    /// Weights and biases drawn uniformly from ±1/√n for a layer of n inputs, as PyTorch's `Linear`
    /// begins.
    ///
    /// # Panics
    /// As [`Self::zeros`].
    pub fn new(shape: Shape, stream: &mut Stream) -> Self {
        let mut mlp = Self::zeros(shape);
        for layer in mlp.layers.clone() {
            let bound = 1.0 / (layer.n_inputs as f64).sqrt();
            let mut draw = || T::of(bound * (2.0 * stream.uniform() - 1.0));
            let rows = mlp.params[layer.at..layer.bias().end].chunks_exact_mut(layer.width);
            for row in rows {
                row[..layer.n_outputs].fill_with(&mut draw);
            }
        }
        mlp
    }

    /// What it looks like.
    pub fn shape(&self) -> &Shape {
        &self.shape
    }

    /// All parameters as they lie in memory, padding included: weights of a layer
    /// `[n_inputs, width]`, its bias `[width]`, the next layer.
    pub fn params(&self) -> &[T] {
        &self.params
    }

    /// The same, to be replaced by those of a network of the same shape.
    pub fn params_mut(&mut self) -> &mut [T] {
        &mut self.params
    }

    /// The weights of a layer, shape `[n_outputs, n_inputs]`.
    pub fn weight(&self, layer: usize) -> DMatrixView<'_, T, Dyn, Dyn> {
        let layer = self.layers[layer];
        let (n_out, n_in) = (layer.n_outputs, layer.n_inputs);
        let weights = &self.params[layer.weights()];
        DMatrixView::from_slice_with_strides_generic(
            weights,
            Dyn(n_out),
            Dyn(n_in),
            Dyn(1),
            Dyn(layer.width),
        )
    }

    /// The bias of a layer, shape `[n_outputs]`.
    pub fn bias(&self, layer: usize) -> &[T] {
        let layer = self.layers[layer];
        &self.params[layer.bias()][..layer.n_outputs]
    }

    /// Gives the action values of every input: `x` has rows of `n_inputs` numbers, `stride` apart.
    ///
    /// # Panics
    /// If `x` has fewer rows than `out`.
    #[inline]
    pub fn forward(&self, kernels: Kernels, x: &[T], stride: usize, out: &mut Activations<T>) {
        let last = self.layers.len() - 1;
        for (i, layer) in self.layers.iter().enumerate() {
            let (before, after) = out.layers.split_at_mut(i);
            let (x, stride) = match before.last() {
                Some(hidden) => (&**hidden, self.layers[i - 1].width),
                None => (x, stride),
            };
            let affine = Affine {
                x,
                stride,
                n_inputs: layer.n_inputs,
                w: &self.params[layer.weights()],
                bias: Some(&self.params[layer.bias()]),
                gate: if i == last { Gate::Open } else { Gate::Relu },
            };
            kernels.affine(&affine, layer.width, &mut after[0]);
        }
        if self.shape.dueling {
            let n = self.shape.n_actions;
            for row in out.layers[last].chunks_exact_mut(out.width) {
                let mean = mean(&row[..n]);
                let value = row[n];
                for q in &mut row[..n] {
                    *q = value + (*q - mean);
                }
            }
        }
    }

    /// Weights and biases by name.
    pub fn tensors(&self) -> Vec<Tensor<T>> {
        let last = self.layers.len() - 1;
        let mut tensors = Vec::new();
        for i in 0..=last {
            let rows = 0..self.layers[i].n_outputs;
            if i == last && self.shape.dueling {
                let n = self.shape.n_actions;
                self.push(&mut tensors, i, "advantage", 0..n);
                self.push(&mut tensors, i, "value", n..n + 1);
            } else {
                self.push(&mut tensors, i, &format!("q_net.{}", 2 * i), rows);
            }
        }
        tensors
    }

    fn push(
        &self,
        to: &mut Vec<Tensor<T>>,
        layer: usize,
        name: &str,
        rows: std::ops::Range<usize>,
    ) {
        let weight = self.weight(layer);
        let n_inputs = self.layers[layer].n_inputs;
        let values = rows.clone().flat_map(|j| (0..n_inputs).map(move |k| (j, k)));
        to.push(Tensor {
            name: format!("{name}.weight"),
            shape: vec![rows.len(), n_inputs],
            values: values.map(|at| weight[at]).collect(),
        });
        to.push(Tensor {
            name: format!("{name}.bias"),
            shape: vec![rows.len()],
            values: self.bias(layer)[rows].to_vec(),
        });
    }

    /// The network of these weights and biases, in any order.
    ///
    /// # Errors
    /// If they are not those of a network, or do not fit together.
    pub fn from_tensors(tensors: &[Tensor<T>]) -> Result<Self, String> {
        let find = |name: &str| tensors.iter().find(|t| t.name == name);
        let matrix = |name: &str| -> Result<Option<(usize, usize)>, String> {
            match find(name).map(|t| t.shape.as_slice()) {
                None => Ok(None),
                Some(&[n, m]) if n > 0 && m > 0 => Ok(Some((n, m))),
                Some(shape) => Err(format!("`{name}` has the shape {shape:?}")),
            }
        };
        let mut layers = Vec::new();
        while let Some(layer) = matrix(&format!("q_net.{}.weight", 2 * layers.len()))? {
            layers.push(layer);
        }
        let dueling = match (matrix("advantage.weight")?, matrix("value.weight")?) {
            (Some(advantage), Some((1, _))) => {
                layers.push(advantage);
                true
            }
            (None, None) => false,
            _ => return Err("there are heads for advantages or for values only".into()),
        };
        let (Some(first), Some(last)) = (layers.first(), layers.last()) else {
            return Err("there is no `q_net.0.weight`".into());
        };
        if layers.len() < 2 {
            return Err("there is no hidden layer".into());
        }
        // Before room is made for them: a file may be of any size.
        for (i, pair) in layers.windows(2).enumerate() {
            if pair[1].1 != pair[0].0 {
                return Err(format!(
                    "layer {} takes {} numbers, the layer before it gives {}",
                    i + 1,
                    pair[1].1,
                    pair[0].0
                ));
            }
        }
        let hidden = layers[..layers.len() - 1].iter().map(|layer| layer.0).collect();
        let shape = Shape { n_inputs: first.1, hidden, n_actions: last.0, dueling };
        let mut mlp = Self::zeros(shape);
        let wanted = mlp.tensors();
        if let Some(extra) = tensors.iter().find(|t| wanted.iter().all(|w| w.name != t.name)) {
            return Err(format!("`{}` belongs to no layer", extra.name));
        }
        for wanted in wanted {
            let Some(found) = find(&wanted.name) else {
                return Err(format!("there is no `{}`", wanted.name));
            };
            if found.shape != wanted.shape || found.values.len() != wanted.values.len() {
                return Err(format!(
                    "`{}` has the shape {:?}, the layer before it gives {:?}",
                    found.name, found.shape, wanted.shape
                ));
            }
            mlp.set(found);
        }
        Ok(mlp)
    }

    /// Puts a tensor that fits into its place.
    fn set(&mut self, tensor: &Tensor<T>) {
        let last = self.layers.len() - 1;
        let (name, kind) = tensor.name.rsplit_once('.').expect("one of `tensors`");
        let (layer, first) = match name {
            "advantage" => (last, 0),
            "value" => (last, self.shape.n_actions),
            _ => (name["q_net.".len()..].parse::<usize>().expect("one of `tensors`") / 2, 0),
        };
        let layer = self.layers[layer];
        if kind == "bias" {
            let bias = &mut self.params[layer.bias()][first..];
            bias[..tensor.values.len()].copy_from_slice(&tensor.values);
            return;
        }
        for (j, row) in tensor.values.chunks_exact(layer.n_inputs).enumerate() {
            for (k, value) in row.iter().enumerate() {
                self.params[layer.at + k * layer.width + first + j] = *value;
            }
        }
    }
}

/// The mean, summed in order.
pub(super) fn mean<T: Real>(x: &[T]) -> T {
    let mut sum = T::default();
    for x in x {
        sum += *x;
    }
    sum / T::of(x.len() as f64)
}

/// What the layers of a network make of a number of inputs.
#[derive(Debug, Clone)]
pub struct Activations<T: Real> {
    /// Of every layer, shape `[rows, width]`; the last holds the action values.
    pub(super) layers: Vec<Buffer<T>>,
    /// The width of the last.
    width: usize,
    n_actions: usize,
}

impl<T: Real> Activations<T> {
    /// Room for `rows` inputs of `mlp`.
    pub fn new(mlp: &Mlp<T>, rows: usize) -> Self {
        let layers = mlp.layers.iter().map(|layer| Buffer::zeros(rows * layer.width)).collect();
        let width = mlp.layers[mlp.layers.len() - 1].width;
        Self { layers, width, n_actions: mlp.shape.n_actions }
    }

    /// The action values of one input, shape `[n_actions]`.
    #[inline]
    pub fn q(&self, row: usize) -> &[T] {
        &self.layers[self.layers.len() - 1][row * self.width..][..self.n_actions]
    }
}
