//! Every random stream that is not an environment's: agents, resampling, tests.

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// A stream of random numbers: xoshiro256++ (Blackman & Vigna 2019), portable and fast.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Stream(Xoshiro256PlusPlus);

impl Stream {
    /// The stream of `(seed, purpose)`: the generator's state is SHA-256 of both, so that streams
    /// of different purposes are independent and no thread, shard or clock can reach one.
    pub fn new(seed: u64, purpose: &str) -> Self {
        let mut hash = Sha256::new();
        hash.update(b"runner-stream-1\0");
        hash.update(seed.to_le_bytes());
        hash.update(purpose.as_bytes());
        Self(Xoshiro256PlusPlus::from_seed(hash.finalize().into()))
    }

    /// The next 64 bits.
    #[inline]
    pub fn next_u64(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// A double in [0, 1) with 53 random bits.
    #[inline]
    pub fn uniform(&mut self) -> f64 {
        (self.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// An integer in `0..n`, without bias (Lemire 2019, multiply and reject).
    #[inline]
    pub fn below(&mut self, n: usize) -> usize {
        let n = n as u64;
        loop {
            let product = u128::from(self.next_u64()) * u128::from(n);
            let low = product as u64;
            if low >= n || low >= n.wrapping_neg() % n {
                return (product >> 64) as usize;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_depend_on_seed_and_purpose_only() {
        let draws = |seed, purpose: &str| {
            let mut stream = Stream::new(seed, purpose);
            [stream.next_u64(), stream.next_u64()]
        };
        assert_eq!(draws(1, "agent"), draws(1, "agent"));
        assert_ne!(draws(1, "agent"), draws(2, "agent"));
        assert_ne!(draws(1, "agent"), draws(1, "resample"));
    }

    #[test]
    fn below_is_uniform_and_in_range() {
        let mut stream = Stream::new(7, "test");
        let mut counts = [0u32; 6];
        for _ in 0..60_000 {
            counts[stream.below(6)] += 1;
        }
        // Standard deviation of a count is 91: six of them leave one false alarm in 10^8.
        assert!(counts.iter().all(|&c| (9_450..10_550).contains(&c)), "{counts:?}");
    }
}
