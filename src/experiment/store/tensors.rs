//! The safetensors format: how long the header is (8 bytes, little-endian), the header, the numbers.
//! The header is JSON: each tensor's name, type, shape and place, and a map of texts.
//!
//! What is written depends on what it says alone: names are sorted. The format's own crate writes
//! the map in the order of a hash, so that it only reads here.

use std::collections::BTreeMap;

use safetensors::Dtype;
use safetensors::tensor::{Metadata, TensorInfo};
use serde::Serialize;

use crate::nn::Tensor;

/// Bytes that say how long the header is; the header is padded to a multiple of it.
const LENGTH: usize = size_of::<u64>();

/// Texts by name.
pub(super) type Texts = BTreeMap<String, String>;

#[derive(Serialize)]
struct Header<'a> {
    #[serde(rename = "__metadata__")]
    texts: &'a Texts,
    #[serde(flatten)]
    tensors: BTreeMap<&'a str, TensorInfo>,
}

/// The file that holds `tensors`, each bit of them, and `texts`.
pub(super) fn encode(tensors: &[Tensor<f32>], texts: &Texts) -> Vec<u8> {
    let mut sorted: Vec<&Tensor<f32>> = tensors.iter().collect();
    sorted.sort_by_key(|tensor| &tensor.name);
    let mut end = 0;
    let info = |tensor: &Tensor<f32>| {
        let start = end;
        end += size_of_val(&tensor.values[..]);
        TensorInfo { dtype: Dtype::F32, shape: tensor.shape.clone(), data_offsets: (start, end) }
    };
    let infos: Vec<TensorInfo> = sorted.iter().copied().map(info).collect();
    let names = sorted.iter().map(|tensor| tensor.name.as_str());
    let header = Header { texts, tensors: names.zip(infos).collect() };
    let mut header = serde_json::to_vec(&header).expect("plain data");
    header.resize(header.len().next_multiple_of(LENGTH), b' ');
    let mut bytes = (header.len() as u64).to_le_bytes().to_vec();
    bytes.extend(header);
    bytes.extend(sorted.iter().flat_map(|tensor| &tensor.values).flat_map(|x| x.to_le_bytes()));
    bytes
}

/// What a file holds.
pub(super) fn decode(bytes: &[u8]) -> Result<(Vec<Tensor<f32>>, Texts), String> {
    let none = || "is no safetensors file, or only its beginning".to_string();
    let (length, rest) = bytes.split_first_chunk::<LENGTH>().ok_or_else(none)?;
    let length = usize::try_from(u64::from_le_bytes(*length)).map_err(|_| none())?;
    let (header, data) = rest.split_at_checked(length).ok_or_else(none)?;
    let header: Metadata = serde_json::from_slice(header)
        .map_err(|e| format!("is no safetensors file, or damaged: {e}"))?;
    if header.data_len() != data.len() {
        return Err(format!(
            "is damaged: there are {} bytes of weights, by its header {}",
            data.len(),
            header.data_len()
        ));
    }
    let mut tensors = Vec::new();
    for name in header.offset_keys() {
        let info = header.info(&name).expect("it has just been named");
        if info.dtype != Dtype::F32 {
            return Err(format!("`{name}` is of the type {}, weights are F32", info.dtype));
        }
        let (start, end) = info.data_offsets;
        let (numbers, _) = data[start..end].as_chunks();
        let values: Vec<f32> = numbers.iter().map(|x| f32::from_le_bytes(*x)).collect();
        if let Some(x) = values.iter().find(|x| !x.is_finite()) {
            return Err(format!("`{name}` holds {x}, which is no finite number"));
        }
        tensors.push(Tensor { name, shape: info.shape.clone(), values });
    }
    let texts = header.metadata().iter().flatten();
    Ok((tensors, texts.map(|(name, text)| (name.clone(), text.clone())).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tensors() -> Vec<Tensor<f32>> {
        let tensor = |name: &str, shape: &[usize], values: &[f32]| Tensor {
            name: name.into(),
            shape: shape.to_vec(),
            values: values.to_vec(),
        };
        vec![
            tensor("q_net.0.weight", &[2, 1], &[f32::MIN_POSITIVE / 2.0, -0.0]),
            tensor("q_net.0.bias", &[2], &[0.1, -f32::MAX]),
        ]
    }

    fn texts() -> Texts {
        let text = |name: &str, text: &str| (name.to_string(), text.to_string());
        [text("env", "CartPole-v1"), text("config", "{\"a\":\"ü\"}")].into()
    }

    fn bits(tensors: &[Tensor<f32>], name: &str) -> Vec<u32> {
        let tensor = tensors.iter().find(|t| t.name == name).unwrap();
        tensor.values.iter().map(|x| x.to_bits()).collect()
    }

    /// The file byte by byte, from the format's description.
    #[test]
    fn the_file_is_laid_out_as_described() {
        let mut bytes = encode(&tensors(), &texts());
        let header = concat!(
            r#"{"__metadata__":{"config":"{\"a\":\"ü\"}","env":"CartPole-v1"},"#,
            r#""q_net.0.bias":{"dtype":"F32","shape":[2],"data_offsets":[0,8]},"#,
            r#""q_net.0.weight":{"dtype":"F32","shape":[2,1],"data_offsets":[8,16]}}"#,
        );
        assert!(header.len() <= 200, "{}", header.len());
        assert_eq!(bytes[..8], [200, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(std::str::from_utf8(&bytes[8..208]).unwrap().trim_end_matches(' '), header);
        let values = [0.1, -f32::MAX, f32::MIN_POSITIVE / 2.0, -0.0].map(f32::to_le_bytes);
        assert_eq!(bytes.split_off(208), values.as_flattened());
    }

    #[test]
    fn every_bit_comes_back() {
        let bytes = encode(&tensors(), &texts());
        let (read, said) = decode(&bytes).unwrap();
        assert_eq!(said, texts());
        assert_eq!(read.len(), 2);
        for tensor in tensors() {
            assert_eq!(bits(&read, &tensor.name), bits(&tensors(), &tensor.name));
        }
        let mut reversed = tensors();
        reversed.reverse();
        assert_eq!(encode(&reversed, &texts()), bytes);
    }

    #[test]
    fn what_is_no_file_of_ours_is_refused() {
        let bytes = encode(&tensors(), &texts());
        for end in 0..bytes.len() {
            decode(&bytes[..end]).unwrap_err();
        }
        let refused = |bytes: &[u8], message: &str| {
            let error = decode(bytes).unwrap_err();
            assert!(error.contains(message), "{error}");
        };
        refused(b"", "is no safetensors file, or only its beginning");
        refused(b"state,greedy,q_0,q_1\n0,0,1.0,0.0\n", "is no safetensors file, or only its");
        refused(&[&8u64.to_le_bytes()[..], b"no json!"].concat(), "is no safetensors file, or dam");
        refused(&u64::MAX.to_le_bytes(), "is no safetensors file, or only its beginning");
        refused(&[&bytes[..], b"\0"].concat(), "there are 17 bytes of weights, by its header 16");
        refused(&bytes[..bytes.len() - 1], "there are 15 bytes of weights, by its header 16");
        let mut nan = tensors();
        nan[1].values[0] = f32::NAN;
        refused(&encode(&nan, &texts()), "`q_net.0.bias` holds NaN, which is no finite number");
        let file = |header: &str, data: &[u8]| {
            [&(header.len() as u64).to_le_bytes()[..], header.as_bytes(), data].concat()
        };
        let halves = r#"{"w":{"dtype":"F16","shape":[2],"data_offsets":[0,4]}}"#;
        refused(&file(halves, &[0; 4]), "`w` is of the type F16, weights are F32");
        // Places that no file has: their sum overflows.
        let huge: Vec<String> = (0..8u64)
            .map(|i| {
                let size = (1 << 61) - 4;
                format!(
                    r#""w{i}":{{"dtype":"F32","shape":[{}],"data_offsets":[{},{}]}}"#,
                    size / 4,
                    i * size,
                    (i + 1) * size
                )
            })
            .collect();
        refused(&file(&format!("{{{}}}", huge.join(",")), &[]), "is damaged: there are 0 bytes");
    }
}
