//! `<hash>.partial`: a unit under way, beside the place where it will lie when it is finished.
//!
//! One line of JSON that says of which unit it is, with the SHA-256 of all that follows: a header of
//! JSON, its length (8 bytes, little-endian) before it, and the arrays that it names.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::experiment::hex;
use crate::learn::dqn::Snapshot;

/// Version of the format and of what is in it.
const VERSION: u32 = 1;

#[derive(Serialize, Deserialize)]
struct Seal {
    version: u32,
    unit: String,
    sha256: String,
}

#[derive(Serialize, Deserialize)]
struct Header {
    values: BTreeMap<String, String>,
    /// Lengths of arrays.
    singles: BTreeMap<String, usize>,
    doubles: BTreeMap<String, usize>,
}

/// The file of what a unit has come to.
pub(super) fn encode(unit: &str, snapshot: &Snapshot) -> Vec<u8> {
    let header = Header {
        values: snapshot.values.clone(),
        singles: snapshot.singles.iter().map(|(k, v)| (k.clone(), v.len())).collect(),
        doubles: snapshot.doubles.iter().map(|(k, v)| (k.clone(), v.len())).collect(),
    };
    let header = serde_json::to_vec(&header).expect("plain data");
    let mut body = (header.len() as u64).to_le_bytes().to_vec();
    body.extend(header);
    for array in snapshot.singles.values() {
        body.extend(array.iter().flat_map(|x| x.to_le_bytes()));
    }
    for array in snapshot.doubles.values() {
        body.extend(array.iter().flat_map(|x| x.to_le_bytes()));
    }
    let seal = Seal { version: VERSION, unit: unit.into(), sha256: hex(&Sha256::digest(&body)) };
    let mut bytes = serde_json::to_vec(&seal).expect("plain data");
    bytes.push(b'\n');
    bytes.extend(body);
    bytes
}

/// What `unit` has come to; `None` if the file is another unit's or version's, or not whole.
pub(super) fn decode(unit: &str, bytes: &[u8]) -> Option<Snapshot> {
    let line = bytes.iter().position(|b| *b == b'\n')?;
    let (seal, body) = (&bytes[..line], &bytes[line + 1..]);
    let seal: Seal = serde_json::from_slice(seal).ok()?;
    let whole = seal.version == VERSION && seal.unit == unit;
    if !whole || seal.sha256 != hex(&Sha256::digest(body)) {
        return None;
    }
    let (length, rest) = body.split_first_chunk::<8>()?;
    let (header, mut data) = rest.split_at_checked(u64::from_le_bytes(*length) as usize)?;
    let header: Header = serde_json::from_slice(header).ok()?;
    let mut snapshot = Snapshot { values: header.values, ..Snapshot::default() };
    for (name, n) in header.singles {
        let (array, rest) = data.split_at_checked(n.checked_mul(4)?)?;
        let array = array.as_chunks().0.iter().map(|x| f32::from_le_bytes(*x));
        snapshot.singles.insert(name, array.collect());
        data = rest;
    }
    for (name, n) in header.doubles {
        let (array, rest) = data.split_at_checked(n.checked_mul(8)?)?;
        let array = array.as_chunks().0.iter().map(|x| f64::from_le_bytes(*x));
        snapshot.doubles.insert(name, array.collect());
        data = rest;
    }
    Some(snapshot)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bit_comes_back_or_nothing() {
        let mut snapshot = Snapshot::default();
        snapshot.put("counts", &[1u64, u64::MAX]);
        let stamp = f32::from_bits(0x7f80_0001);
        snapshot.singles.insert("replay".into(), vec![0.1, -0.0, stamp]);
        snapshot.singles.insert("a".into(), vec![]);
        snapshot.doubles.insert("log".into(), vec![f64::NAN, 0.1]);
        let bytes = encode("abc", &snapshot);
        let read = decode("abc", &bytes).unwrap();
        assert_eq!(read.values, snapshot.values);
        assert_eq!(read.get::<[u64; 2]>("counts"), Some([1, u64::MAX]));
        let bits = |s: &Snapshot| -> Vec<u32> {
            s.singles.values().flatten().map(|x| x.to_bits()).collect()
        };
        assert_eq!(bits(&read), bits(&snapshot));
        assert_eq!(read.doubles["log"][1], 0.1);
        assert!(decode("abd", &bytes).is_none());
        for end in 0..bytes.len() {
            assert!(decode("abc", &bytes[..end]).is_none());
            let mut changed = bytes.clone();
            changed[end] ^= 1;
            assert!(decode("abc", &changed).is_none(), "byte {end}");
        }
    }
}
