//! Against NumPy's own numbers (`tests/data/numpy_rng.py`), and by hand.

use serde_json::Value;

use super::{NumpyRng, Seed};

fn vectors() -> Vec<Value> {
    serde_json::from_str(include_str!("../../../tests/data/numpy_rng.json")).unwrap()
}

fn seed_of(vector: &Value) -> Seed {
    vector["seed"].as_str().unwrap().parse().unwrap()
}

fn words(value: &Value) -> Vec<u32> {
    value.as_array().unwrap().iter().map(|w| w.as_u64().unwrap() as u32).collect()
}

fn number<T: std::str::FromStr<Err: std::fmt::Debug>>(value: &Value) -> T {
    value.as_str().unwrap().parse().unwrap()
}

/// A double as the vectors hold it: its bits in hexadecimal.
fn hex(x: f64) -> Value {
    format!("{:016x}", x.to_bits()).into()
}

#[test]
fn seed_sequence_and_initial_state() {
    for vector in vectors() {
        let seed = seed_of(&vector);
        assert_eq!(seed.to_string(), vector["seed"].as_str().unwrap());
        assert_eq!(seed.pool().to_vec(), words(&vector["pool"]), "{seed}");
        assert_eq!(seed.generate_state().to_vec(), words(&vector["generate_state"]), "{seed}");
        let rng = NumpyRng::from_seed(&seed);
        assert_eq!(rng.state, number::<u128>(&vector["state"]), "{seed}");
        assert_eq!(rng.increment, number::<u128>(&vector["inc"]), "{seed}");
    }
}

#[test]
fn every_kind_of_draw() {
    let mut kinds = 0;
    for vector in vectors() {
        let fresh = NumpyRng::from_seed(&seed_of(&vector));
        for (name, expected) in vector.as_object().unwrap() {
            let mut parts = name.split(' ');
            let (kind, bounds) = (parts.next().unwrap(), parts.collect::<Vec<_>>());
            let mut rng = fresh.clone();
            let mut draw = || -> Option<Value> {
                Some(match kind {
                    "u64" => rng.next_u64().to_string().into(),
                    "random" => hex(rng.random()),
                    "uniform" => {
                        hex(rng.uniform(bounds[0].parse().unwrap(), bounds[1].parse().unwrap()))
                    }
                    "integers" => rng
                        .integers(bounds[0].parse().unwrap(), bounds[1].parse().unwrap())
                        .to_string()
                        .into(),
                    "choice_p" => rng.choice_weighted(&[0.8, 0.2]).into(),
                    "discrete6" => rng.choice_index(6).into(),
                    _ => return None,
                })
            };
            let Some(first) = draw() else { continue };
            let expected = expected.as_array().unwrap();
            assert_eq!(first, expected[0], "seed {} {name}", vector["seed"]);
            for (i, value) in expected.iter().enumerate().skip(1) {
                assert_eq!(draw().as_ref(), Some(value), "seed {} {name} [{i}]", vector["seed"]);
            }
            kinds += 1;
        }
    }
    assert_eq!(kinds, 16 * 21);
}

#[test]
fn interleaved_draws_and_the_buffered_half() {
    for vector in vectors() {
        let mut rng = NumpyRng::from_seed(&seed_of(&vector));
        for (i, step) in vector["script"].as_array().unwrap().iter().enumerate() {
            let value: Value = match step["op"].as_str().unwrap() {
                "i13" => rng.integers(0, 13).into(),
                "i20k" => rng.integers(-9999, 9999).into(),
                "i1" => rng.integers(0, 1).into(),
                "i64" => rng.integers(0, 1 << 40).to_string().into(),
                "c4" => rng.choice_index(4).into(),
                "c3" => rng.choice_index(3).into(),
                "p" => rng.choice_weighted(&[0.5, 0.2, 0.3]).into(),
                "d" => hex(rng.random()),
                "u" => hex(rng.uniform(-1.0, 1.0)),
                other => panic!("unknown operation {other}"),
            };
            assert_eq!(value, step["value"], "seed {} step {i}", vector["seed"]);
            let half = step["uinteger"].as_u64().map(|half| half as u32);
            assert_eq!(rng.buffered, half, "seed {} step {i}", vector["seed"]);
        }
        assert_eq!(rng.state, number::<u128>(&vector["final_state"]), "seed {}", vector["seed"]);
    }
}

#[test]
fn lemire_rejects_just_below_the_threshold() {
    // Of n = 13, 2^32 mod 13 = 9: a product whose low half is 8 is drawn again, 9 is not. Random
    // vectors never meet these. (NumPy gives 11 and 12 from these buffered halves and seed 0.)
    for (half, value, next_half) in [(660_764_200, 11, true), (3_964_585_197, 12, false)] {
        let mut rng = NumpyRng { buffered: Some(half), ..NumpyRng::from_u64(0) };
        assert_eq!(rng.integers(0, 13), value);
        assert_eq!(rng.buffered.is_some(), next_half, "a rejected half draws 64 new bits");
    }
    // Of n = 2^33 + 1, 2^64 mod n = 6442450945, and the same for 64 bits.
    let last = 1 << 33;
    for (bits, value) in
        [(6_442_450_944_u64, 4_839_722_573), (18_446_744_071_562_067_969, 8_589_934_592)]
    {
        // A state with an empty upper half is put out as it is: go to the one before it.
        let fresh = NumpyRng::from_u64(0);
        let before = u128::from(bits).wrapping_sub(fresh.increment).wrapping_mul(inverse());
        let mut rng = NumpyRng { state: before, ..fresh };
        assert_eq!(rng.clone().next_u64(), bits);
        assert_eq!(rng.integers(0, last + 1), value);
    }
}

/// The inverse of the multiplier modulo 2^128 (Newton's iteration doubles the correct bits).
fn inverse() -> u128 {
    (0..7)
        .fold(1_u128, |x, _| x.wrapping_mul(2_u128.wrapping_sub(super::MULTIPLIER.wrapping_mul(x))))
}

#[test]
fn seeds_of_any_size() {
    let text = "1361129467683753853853498429727072845923";
    assert_eq!(text.parse::<Seed>().unwrap().words(), [99, 0, 0, 0, 4]);
    assert_eq!("000042".parse::<Seed>().unwrap(), Seed::from(42));
    assert_eq!(Seed::from_words(&[7, 0, 0]), Seed::from(7));
    assert_eq!(Seed::from_words(&[]), Seed::from(0));
    assert_eq!(Seed::from(u64::MAX).to_string(), "18446744073709551615");
    assert_eq!(Seed::from(1_000_000_000).to_string(), "1000000000");
    assert_eq!(Seed::from(0).to_string(), "0");
    for bad in ["", "-1", "1.5", "1e3", " 1", "0x10"] {
        let message = bad.parse::<Seed>().unwrap_err().to_string();
        assert_eq!(message, format!("a seed is an integer of 0 or more, not `{bad}`"));
    }
}

#[test]
fn the_saved_state_resumes_on_the_next_draw() {
    let mut rng = NumpyRng::from_u64(42);
    rng.next_u32();
    let text = serde_json::to_string(&rng).unwrap();
    let mut resumed: NumpyRng = serde_json::from_str(&text).unwrap();
    assert_eq!(resumed, rng);
    // The buffered half comes first, then a new output.
    for _ in 0..5 {
        assert_eq!(resumed.next_u32(), rng.next_u32());
    }
    let even = r#"{"state":"1","inc":"2","uinteger":null}"#;
    let message = serde_json::from_str::<NumpyRng>(even).unwrap_err().to_string();
    assert!(message.contains("`inc` must be odd: `2`"), "{message}");
    let text = r#"{"state":"x","inc":"3","uinteger":null}"#;
    let message = serde_json::from_str::<NumpyRng>(text).unwrap_err().to_string();
    assert!(message.contains("`state` must be a 128-bit integer: `x`"), "{message}");
}

#[test]
#[should_panic(expected = "integers(3, 3): the range is empty")]
fn an_empty_range_is_refused() {
    NumpyRng::from_u64(0).integers(3, 3);
}
