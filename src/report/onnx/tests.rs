//! The model's bytes are read again and calculated by the definitions of the operators.

use std::collections::BTreeMap;

use super::*;
use crate::mdp::streams::Stream;
use crate::nn::{Activations, Kernels, Mlp, Shape};

/// Rows of numbers.
type Matrix = Vec<Vec<f32>>;

/// What `bytes` makes of `observation`, by the definitions of the operators, summed in float64.
fn evaluate(bytes: &[u8], observation: &Matrix) -> Matrix {
    let model = OnnxModel::decode(bytes).unwrap();
    let graph = model.graph.unwrap();
    let mut known = BTreeMap::from([(graph.input[0].name.clone(), observation.clone())]);
    for tensor in graph.initializer {
        assert_eq!(tensor.data_type, FLOAT);
        let (numbers, rest) = tensor.raw_data.as_chunks();
        assert!(rest.is_empty());
        let numbers: Vec<f32> = numbers.iter().map(|x| f32::from_le_bytes(*x)).collect();
        let width = *tensor.dims.last().unwrap() as usize;
        assert_eq!(tensor.dims.iter().product::<i64>(), numbers.len() as i64);
        let rows = numbers.chunks_exact(width).map(<[f32]>::to_vec).collect();
        known.insert(tensor.name, rows);
    }
    for node in graph.node {
        let inputs: Vec<&Matrix> = node.input.iter().map(|name| &known[name]).collect();
        let int = |name: &str| node.attribute.iter().find(|a| a.name == name).and_then(|a| a.i);
        let each = |f: fn(f32, f32) -> f32| {
            let at = |m: &Matrix, i: usize, j: usize| {
                let row = if m.len() == 1 { &m[0] } else { &m[i] };
                if row.len() == 1 { row[0] } else { row[j] }
            };
            let (n, m) = (inputs[0].len(), inputs[0][0].len().max(inputs[1][0].len()));
            let row = |i| (0..m).map(|j| f(at(inputs[0], i, j), at(inputs[1], i, j))).collect();
            (0..n).map(row).collect::<Matrix>()
        };
        let output = match node.op_type.as_str() {
            "Gemm" => {
                assert_eq!(int("transB"), Some(1));
                let of = |x: &Vec<f32>, w: &Vec<f32>, b: f32| {
                    assert_eq!(x.len(), w.len());
                    let terms = x.iter().zip(w).map(|(x, w)| f64::from(*x) * f64::from(*w));
                    (terms.sum::<f64>() + f64::from(b)) as f32
                };
                let row =
                    |x| inputs[1].iter().zip(&inputs[2][0]).map(|(w, b)| of(x, w, *b)).collect();
                inputs[0].iter().map(row).collect()
            }
            "Relu" => {
                let row = |x: &Vec<f32>| x.iter().map(|x| x.max(0.0)).collect();
                inputs[0].iter().map(row).collect()
            }
            "ReduceMean" => {
                let axes = node.attribute.iter().find(|a| a.name == "axes").unwrap();
                assert_eq!((axes.ints.as_slice(), int("keepdims")), (&[1][..], Some(1)));
                let mean = |x: &Vec<f32>| vec![x.iter().sum::<f32>() / x.len() as f32];
                inputs[0].iter().map(mean).collect()
            }
            "Sub" => each(|x, y| x - y),
            "Mul" => each(|x, y| x * y),
            "Add" => each(|x, y| x + y),
            other => panic!("{other}"),
        };
        known.insert(node.output[0].clone(), output);
    }
    known[&graph.output[0].name].clone()
}

fn model(inputs: Inputs, dueling: bool) -> Model {
    let shape = Shape { n_inputs: inputs.n_inputs(), hidden: vec![9, 17], n_actions: 3, dueling };
    let entry = |name: &str, text: &str| (name.to_string(), text.to_string());
    Model {
        net: Mlp::new(shape, &mut Stream::new(3, "network")),
        fields: (0..inputs.n_inputs()).map(|i| format!("x{i}")).collect(),
        inputs,
        actions: ["left", "none", "right"].map(Into::into).to_vec(),
        frame_skip: 1,
        manifest: [entry("env", "Somewhere-v0"), entry("inputs", "{}")].into(),
    }
}

#[test]
fn the_model_gives_the_networks_values() {
    let scale = |field, low, high| Some(Scale { field, low, high });
    let scaled = Inputs::Fields(vec![scale(0, -1.2, 0.6), None, scale(2, 1000.0, 1001.0), None]);
    let plain = Inputs::Fields(vec![None; 4]);
    let observation = vec![
        vec![-0.5f32, 0.03, 1000.25, 7.0],
        vec![0.6, -2.0, 1001.0, 0.0],
        vec![-1.2, 1e-3, 999.5, -7.0],
    ];
    for (inputs, dueling) in [(&plain, false), (&plain, true), (&scaled, false), (&scaled, true)] {
        let model = model(inputs.clone(), dueling);
        let got = evaluate(&onnx(&model), &observation);
        let mut values = Activations::new(&model.net, 1);
        for (row, got) in observation.iter().zip(got) {
            let shown = |(scale, x): (&Option<Scale>, &f32)| {
                scale.map_or(f64::from(*x), |s| s.shown(f64::from(*x))) as f32
            };
            let Inputs::Fields(scales) = inputs else { unreachable!() };
            let x: Vec<f32> = scales.iter().zip(row).map(shown).collect();
            model.net.forward(Kernels::detect(), &x, 4, &mut values);
            for (got, wanted) in got.iter().zip(values.q(0)) {
                let close = (got - wanted).abs() <= 1e-5 * wanted.abs().max(1.0);
                assert!(close, "{inputs:?} {dueling}: {got}, not {wanted}");
            }
        }
    }
}

#[test]
fn the_model_says_what_it_is() {
    let decoded = OnnxModel::decode(onnx(&model(Inputs::OneHot(5), false)).as_slice()).unwrap();
    assert_eq!((decoded.ir_version, decoded.opset_import[0].version), (8, 17));
    let keys: Vec<&str> = decoded.metadata_props.iter().map(|e| e.key.as_str()).collect();
    assert_eq!(keys, ["env", "inputs"]);
    let graph = decoded.graph.unwrap();
    let shape = |value: &ValueInfo| {
        let tensor = value.r#type.clone().unwrap().tensor_type.unwrap();
        let dims = tensor.shape.unwrap().dim.into_iter();
        dims.map(|d| d.dim_param.unwrap_or_else(|| d.dim_value.unwrap().to_string()))
            .collect::<Vec<_>>()
    };
    assert_eq!(shape(&graph.input[0]), ["batch", "5"]);
    assert_eq!(shape(&graph.output[0]), ["batch", "3"]);
    assert_eq!(graph.output[0].doc_string, "left, none, right");
    assert!(graph.input[0].doc_string.contains("index of the state, one of 5"));
}
