//! `SeedSequence`: how a non-negative integer of any size becomes a generator's state.

use std::fmt;
use std::str::FromStr;

/// Words in the entropy pool.
const POOL: usize = 4;

/// A seed: a non-negative integer of any size, as `SeedSequence(entropy=…)` takes it.
///
/// It is held as its little-endian 32-bit words without leading zeros; 0 is the single word 0.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Seed(Vec<u32>);

impl Seed {
    /// The integer whose little-endian 32-bit words are `words` (leading zeros are dropped, as
    /// they are no part of an integer).
    pub fn from_words(words: &[u32]) -> Self {
        let mut words = words.to_vec();
        while words.len() > 1 && words.last() == Some(&0) {
            words.pop();
        }
        if words.is_empty() {
            words.push(0);
        }
        Self(words)
    }

    /// The little-endian 32-bit words, at least one.
    pub fn words(&self) -> &[u32] {
        &self.0
    }

    /// `generate_state(8, uint32)`: the words that seed PCG64.
    pub(super) fn generate_state(&self) -> [u32; 8] {
        const INIT: u32 = 0x8b51_f9dd;
        const MULT: u32 = 0x58f3_8ded;
        let pool = self.pool();
        let mut hash = INIT;
        std::array::from_fn(|i| {
            let mut value = pool[i % POOL] ^ hash;
            hash = hash.wrapping_mul(MULT);
            value = value.wrapping_mul(hash);
            value ^ (value >> 16)
        })
    }

    /// The mixed entropy pool.
    pub(super) fn pool(&self) -> [u32; POOL] {
        const INIT: u32 = 0x43b0_d7e5;
        const MULT: u32 = 0x931e_8875;
        // One running constant goes through all the hashes: their order is part of the result.
        let mut hash = INIT;
        let mut hashmix = |value: u32| {
            let mut value = value ^ hash;
            hash = hash.wrapping_mul(MULT);
            value = value.wrapping_mul(hash);
            value ^ (value >> 16)
        };
        let mut pool = [0; POOL];
        for (i, slot) in pool.iter_mut().enumerate() {
            *slot = hashmix(self.0.get(i).copied().unwrap_or(0));
        }
        for source in 0..POOL {
            for target in 0..POOL {
                if source != target {
                    pool[target] = mix(pool[target], hashmix(pool[source]));
                }
            }
        }
        for &word in self.0.iter().skip(POOL) {
            for slot in &mut pool {
                *slot = mix(*slot, hashmix(word));
            }
        }
        pool
    }
}

/// Joins two words of the pool.
fn mix(x: u32, y: u32) -> u32 {
    let r = 0xca01_f9dd_u32.wrapping_mul(x).wrapping_sub(0x4973_f715_u32.wrapping_mul(y));
    r ^ (r >> 16)
}

impl From<u64> for Seed {
    fn from(seed: u64) -> Self {
        Self::from_words(&[seed as u32, (seed >> 32) as u32])
    }
}

/// Why a text is not a [`Seed`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SeedError(String);

impl fmt::Display for SeedError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for SeedError {}

impl FromStr for Seed {
    type Err = SeedError;

    /// Reads decimal digits, however many.
    fn from_str(text: &str) -> Result<Self, SeedError> {
        if text.is_empty() || !text.bytes().all(|b| b.is_ascii_digit()) {
            return Err(SeedError(format!("a seed is an integer of 0 or more, not `{text}`")));
        }
        let mut words = vec![0_u32];
        for digit in text.bytes() {
            let mut carry = u64::from(digit - b'0');
            for word in &mut words {
                let value = u64::from(*word) * 10 + carry;
                *word = value as u32;
                carry = value >> 32;
            }
            if carry > 0 {
                words.push(carry as u32);
            }
        }
        Ok(Self::from_words(&words))
    }
}

impl fmt::Display for Seed {
    /// Writes the integer in decimal.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut words = self.0.clone();
        let mut chunks = Vec::new();
        // Nine digits at a time: the largest power of ten below 2^32.
        while words.iter().any(|&word| word > 0) {
            let mut rest = 0_u64;
            for word in words.iter_mut().rev() {
                let value = (rest << 32) | u64::from(*word);
                *word = (value / 1_000_000_000) as u32;
                rest = value % 1_000_000_000;
            }
            chunks.push(rest);
        }
        write!(f, "{}", chunks.pop().unwrap_or(0))?;
        chunks.iter().rev().try_for_each(|chunk| write!(f, "{chunk:09}"))
    }
}
