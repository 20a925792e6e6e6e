//! NumPy's default generator, bit for bit (NumPy 2.4.6): what Gymnasium calls `np_random`.
//!
//! - [`NumpyRng`]: PCG64 XSL-RR 128/64 (O'Neill 2014) with the buffered 32-bit half, and the draws
//!   of `Generator` that environments and action spaces use
//! - [`sin_cos_f32`]: NumPy's float32 sine and cosine
//! - [`Seed`], [`SeedError`]: a non-negative integer of any size, spread by `SeedSequence`
//!
//! No environment draws from a normal or exponential distribution, shuffles or permutes, so those
//! are left out.

mod seed;
#[cfg(test)]
mod tests;
mod trig;

use serde::{Deserialize, Serialize};

pub use seed::{Seed, SeedError};
pub use trig::sin_cos_f32;

const MULTIPLIER: u128 = 0x2360_ed05_1fc6_5da4_4385_df64_9fcc_f645;

/// `np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed)))`.
///
/// Serialises to its full state (with the 128-bit numbers as decimal text, which is what NumPy
/// prints), so that an interrupted run resumes on the very next draw.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "SavedState", into = "SavedState")]
pub struct NumpyRng {
    state: u128,
    /// Always odd.
    increment: u128,
    /// The high half of the last 64 bits of which [`Self::next_u32`] gave out the low one.
    buffered: Option<u32>,
}

impl NumpyRng {
    /// The generator of a seed below 2^64.
    pub fn from_u64(seed: u64) -> Self {
        Self::from_seed(&Seed::from(seed))
    }

    /// The generator of any seed.
    pub fn from_seed(seed: &Seed) -> Self {
        let words = seed.generate_state();
        let word = |i: usize| u128::from(words[2 * i]) | (u128::from(words[2 * i + 1]) << 32);
        let initial_state = (word(0) << 64) | word(1);
        let sequence = (word(2) << 64) | word(3);
        let mut rng = Self { state: 0, increment: (sequence << 1) | 1, buffered: None };
        rng.advance();
        rng.state = rng.state.wrapping_add(initial_state);
        rng.advance();
        rng
    }

    #[inline]
    fn advance(&mut self) {
        self.state = self.state.wrapping_mul(MULTIPLIER).wrapping_add(self.increment);
    }

    /// The next 64 bits. Neither uses nor clears the buffered half.
    #[inline]
    pub fn next_u64(&mut self) -> u64 {
        self.advance();
        let folded = (self.state >> 64) as u64 ^ self.state as u64;
        folded.rotate_right((self.state >> 122) as u32)
    }

    /// The next 32 bits: the buffered half if there is one, else the low half of 64 new bits.
    #[inline]
    pub fn next_u32(&mut self) -> u32 {
        if let Some(half) = self.buffered.take() {
            return half;
        }
        let bits = self.next_u64();
        self.buffered = Some((bits >> 32) as u32);
        bits as u32
    }

    /// `random()`: a double in [0, 1), a multiple of 2^-53.
    #[inline]
    pub fn random(&mut self) -> f64 {
        const UNIT: f64 = 1.0 / (1_u64 << 53) as f64;
        (self.next_u64() >> 11) as f64 * UNIT
    }

    /// `uniform(low, high)`: one draw, also when both are equal.
    #[inline]
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.random()
    }

    /// `integers(low, high)`: an int64 in `low..high` by Lemire's method (2019), from 32-bit halves
    /// while the width allows it. A width of one draws nothing.
    ///
    /// # Panics
    /// If `low >= high`, which NumPy refuses too.
    #[inline]
    pub fn integers(&mut self, low: i64, high: i64) -> i64 {
        assert!(low < high, "integers({low}, {high}): the range is empty");
        // The largest offset; the subtraction wraps around correctly for every pair.
        let last = (high as u64).wrapping_sub(low as u64) - 1;
        low.wrapping_add(self.bounded(last) as i64)
    }

    /// An integer in `0..=last`.
    #[inline]
    fn bounded(&mut self, last: u64) -> u64 {
        const HALF: u64 = u32::MAX as u64;
        if last == 0 {
            return 0;
        }
        if last == HALF {
            return u64::from(self.next_u32());
        }
        if last < HALF {
            let n = last + 1;
            let mut product = u64::from(self.next_u32()) * n;
            if (product & HALF) < n {
                let threshold = (HALF - last) % n;
                while (product & HALF) < threshold {
                    product = u64::from(self.next_u32()) * n;
                }
            }
            return product >> 32;
        }
        if last == u64::MAX {
            return self.next_u64();
        }
        let n = last + 1;
        let mut product = u128::from(self.next_u64()) * u128::from(n);
        if (product as u64) < n {
            let threshold = (u64::MAX - last) % n;
            while (product as u64) < threshold {
                product = u128::from(self.next_u64()) * u128::from(n);
            }
        }
        (product >> 64) as u64
    }

    /// The index drawn by `choice` on a list of length `n`, and by `Discrete(n).sample()`.
    ///
    /// # Panics
    /// If `n` is 0.
    #[inline]
    pub fn choice_index(&mut self, n: usize) -> usize {
        self.integers(0, n as i64) as usize
    }

    /// The index drawn by `choice(…, p=probabilities)`: one draw, and the number of entries of
    /// `cumsum(p) / sum(p)` that do not exceed it.
    ///
    /// The probabilities are for the caller to check: NumPy wants them at least 0, with a sum of 1.
    ///
    /// # Panics
    /// If `probabilities` is empty.
    pub fn choice_weighted(&mut self, probabilities: &[f64]) -> usize {
        assert!(!probabilities.is_empty(), "choice: there is nothing to choose from");
        let total = probabilities.iter().fold(0.0, |sum, p| sum + p);
        let u = self.random();
        let mut sum = 0.0;
        let below = probabilities.iter().take_while(|&&p| {
            sum += p;
            sum / total <= u
        });
        below.count().min(probabilities.len() - 1)
    }
}

/// [`NumpyRng`] as it is stored: NumPy's `bit_generator.state`, flattened.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SavedState {
    state: String,
    inc: String,
    /// NumPy's `uinteger`, if `has_uint32`.
    uinteger: Option<u32>,
}

impl From<NumpyRng> for SavedState {
    fn from(rng: NumpyRng) -> Self {
        Self {
            state: rng.state.to_string(),
            inc: rng.increment.to_string(),
            uinteger: rng.buffered,
        }
    }
}

impl TryFrom<SavedState> for NumpyRng {
    type Error = String;

    fn try_from(saved: SavedState) -> Result<Self, String> {
        let number = |name: &str, text: &str| {
            text.parse::<u128>()
                .map_err(|_| format!("a generator's `{name}` must be a 128-bit integer: `{text}`"))
        };
        let state = number("state", &saved.state)?;
        let increment = number("inc", &saved.inc)?;
        if increment % 2 == 0 {
            return Err(format!("a generator's `inc` must be odd: `{increment}`"));
        }
        Ok(Self { state, increment, buffered: saved.uinteger })
    }
}
