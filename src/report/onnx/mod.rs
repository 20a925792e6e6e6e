//! A network as an ONNX model, for any program that runs such.
//!
//! Float32 `observation`, shape `[batch, n_inputs]`, to `q_values`, shape `[batch, n_actions]`. An
//! observation is the state's numbers in physical units: if the network sees some of them as
//! [-1, 1], the model begins with that. Of environments whose states have an index, it has an input
//! for every state, 1 at the index and 0 elsewhere.
//!
//! ```text
//! x = (observation − centre) · factor          if numbers are scaled
//! x = Relu(Gemm(x, weight, bias))              for every hidden layer
//! q_values = Gemm(x, weight, bias)             or of dueling heads V + (A − ReduceMean(A))
//! ```
//!
//! Everything that the model's file says of it stands in the model's metadata.

mod messages;

use prost::Message;

use self::messages::{
    Attribute, Dimension, Entry, FLOAT, Graph, Model as OnnxModel, Node, OperatorSet, Tensor,
    TensorShape, TensorType, Type, ValueInfo,
};
use crate::experiment::Model;
use crate::nn;
use crate::shaping::{Inputs, Scale};

/// The version of the file format, of the year of [`OPERATORS`].
const FORMAT: i64 = 8;

/// The version of the operators: the last whose `ReduceMean` takes its axes as an attribute.
const OPERATORS: i64 = 17;

const INPUT: &str = "observation";
const OUTPUT: &str = "q_values";

/// The ONNX model of a network, as the bytes of a file.
pub fn onnx(model: &Model) -> Vec<u8> {
    let shape = model.net.shape();
    let value = |name: &str, width: usize, doc: String| ValueInfo {
        name: name.into(),
        r#type: Some(Type { tensor_type: Some(batch_of(width)) }),
        doc_string: doc,
    };
    let mut graph = Graph {
        name: "q_network".into(),
        input: vec![value(INPUT, shape.n_inputs, seen(model))],
        output: vec![value(OUTPUT, shape.n_actions, model.actions.join(", "))],
        ..Graph::default()
    };
    graph.network(model);
    let entry = |(key, value): (&String, &String)| Entry { key: key.clone(), value: value.clone() };
    let model = OnnxModel {
        ir_version: FORMAT,
        producer_name: "runner".into(),
        producer_version: env!("CARGO_PKG_VERSION").into(),
        graph: Some(graph),
        opset_import: vec![OperatorSet { version: OPERATORS }],
        metadata_props: model.manifest.iter().map(entry).collect(),
    };
    model.encode_to_vec()
}

/// The type of any number of rows of `width` numbers.
fn batch_of(width: usize) -> TensorType {
    let batch = Dimension { dim_value: None, dim_param: Some("batch".into()) };
    let row = Dimension { dim_value: Some(width as i64), dim_param: None };
    TensorType { elem_type: FLOAT, shape: Some(TensorShape { dim: vec![batch, row] }) }
}

/// What an observation is, in words.
fn seen(model: &Model) -> String {
    match &model.inputs {
        Inputs::OneHot(n) => format!("1 at the index of the state, one of {n}, 0 elsewhere"),
        Inputs::Fields(_) => format!("{}, in physical units", model.fields.join(", ")),
    }
}

/// What is taken away from a number, and what it is then multiplied by, to show it as `scale` does.
fn centre_and_factor(scale: Option<&Scale>) -> (f32, f32) {
    let Some(Scale { low, high, .. }) = scale else { return (0.0, 1.0) };
    (f64::midpoint(*low, *high) as f32, (2.0 / (high - low)) as f32)
}

impl Graph {
    fn network(&mut self, model: &Model) {
        let (net, shape) = (&model.net, model.net.shape());
        for tensor in net.tensors() {
            self.constant(tensor);
        }
        let mut x = INPUT.to_string();
        if let Inputs::Fields(scales) = &model.inputs
            && scales.iter().any(Option::is_some)
        {
            let (centres, factors) = scales.iter().map(|s| centre_and_factor(s.as_ref())).unzip();
            x = self.scaled(&x, "scaling.centre", "Sub", centres);
            x = self.scaled(&x, "scaling.factor", "Mul", factors);
        }
        let n_hidden = shape.hidden.len();
        for i in 0..n_hidden {
            let layer = format!("q_net.{}", 2 * i);
            self.gemm(&x, &layer, &layer);
            x = format!("q_net.{}", 2 * i + 1);
            self.node("Relu", &[&layer], &x, &[]);
        }
        if !shape.dueling {
            self.gemm(&x, &format!("q_net.{}", 2 * n_hidden), OUTPUT);
            return;
        }
        self.gemm(&x, "value", "value");
        self.gemm(&x, "advantage", "advantage");
        let rows = [Attribute::ints("axes", &[1]), Attribute::int("keepdims", 1)];
        self.node("ReduceMean", &["advantage"], "mean", &rows);
        self.node("Sub", &["advantage", "mean"], "centred", &[]);
        self.node("Add", &["value", "centred"], OUTPUT, &[]);
    }

    /// `x` and one constant per column, put together by `operator`.
    fn scaled(&mut self, x: &str, name: &str, operator: &str, values: Vec<f32>) -> String {
        let shape = vec![values.len()];
        self.constant(nn::Tensor { name: name.into(), shape, values });
        let output = format!("{name}.output");
        self.node(operator, &[x, name], &output, &[]);
        output
    }

    /// `x` times the weights of `layer`, shape `[n_outputs, n_inputs]`, plus its bias.
    fn gemm(&mut self, x: &str, layer: &str, output: &str) {
        let (weight, bias) = (format!("{layer}.weight"), format!("{layer}.bias"));
        self.node("Gemm", &[x, &weight, &bias], output, &[Attribute::int("transB", 1)]);
    }

    fn node(&mut self, operator: &str, inputs: &[&str], output: &str, attributes: &[Attribute]) {
        self.node.push(Node {
            input: inputs.iter().map(ToString::to_string).collect(),
            output: vec![output.into()],
            name: format!("{operator} {output}"),
            op_type: operator.into(),
            attribute: attributes.to_vec(),
        });
    }

    fn constant(&mut self, tensor: nn::Tensor<f32>) {
        self.initializer.push(Tensor {
            dims: tensor.shape.iter().map(|n| *n as i64).collect(),
            data_type: FLOAT,
            name: tensor.name,
            raw_data: tensor.values.iter().flat_map(|x| x.to_le_bytes()).collect(),
        });
    }
}

#[cfg(test)]
mod tests;
