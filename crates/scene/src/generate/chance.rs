//! Counter-based random numbers: the n-th number of a stream is a hash of (seed, stream, n).

use serde::{Deserialize, Serialize};
use vastlight_math::{Vec3, real};

/// A bijective mixer of 64 bits: two rounds of xor-shift and odd multiplication.
pub(super) const fn mix(mut x: u64) -> u64 {
    x ^= x >> 32;
    x = x.wrapping_mul(0xd6e8_feb8_6659_fd93);
    x ^= x >> 32;
    x = x.wrapping_mul(0xd6e8_feb8_6659_fd93);
    x ^ x >> 32
}

/// One stream of random numbers. Streams with different names are independent.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Chance {
    key: u64,
    counter: u64,
}

impl Chance {
    /// The stream `stream` of `seed`.
    pub(super) const fn new(seed: u64, stream: u64) -> Self {
        let key = mix(mix(seed ^ 0x9e37_79b9_7f4a_7c15) ^ stream.wrapping_mul(0xa24b_aed4_963e_e407));
        Self { key, counter: 0 }
    }

    /// A stream of its own for part `part` of what this stream describes.
    pub(super) const fn part(&self, part: u64) -> Self {
        Self::new(self.key, part)
    }

    /// The next 64 random bits.
    pub(super) const fn bits(&mut self) -> u64 {
        self.counter += 1;
        mix(self.key.wrapping_add(self.counter.wrapping_mul(0x9e37_79b9_7f4a_7c15)))
    }

    /// Uniform in [0, 1).
    pub(super) const fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 * (1.0 / 16_777_216.0)
    }

    /// Uniform in [low, high).
    pub(super) fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// Uniform in 0..n; 0 for n = 0.
    pub(super) const fn below(&mut self, n: u32) -> u32 {
        (((self.bits() >> 32) * n as u64) >> 32) as u32
    }

    /// True with this probability.
    pub(super) fn happens(&mut self, probability: f32) -> bool {
        self.unit() < probability
    }

    /// Uniform on the unit sphere.
    pub(super) fn direction(&mut self) -> Vec3 {
        let z = self.range(-1.0, 1.0);
        let (s, c) = real::sin_cos(self.unit() * std::f32::consts::TAU);
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * c, r * s, z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_uniform_and_streams_differ() {
        let mut a = Chance::new(1, 0);
        let mean = (0..100_000).map(|_| f64::from(a.unit())).sum::<f64>() / 1e5;
        assert!((mean - 0.5).abs() < 4.0 / (12.0_f64 * 1e5).sqrt(), "{mean}");
        let mut b = Chance::new(1, 1);
        let mut c = Chance::new(2, 0);
        let mut a = Chance::new(1, 0);
        let (x, y, z) = (a.bits(), b.bits(), c.bits());
        assert!(x != y && y != z && x != z);
        assert_eq!(Chance::new(1, 0).bits(), x);
    }

    #[test]
    fn ranges_hold() {
        let mut chance = Chance::new(3, 3);
        for _ in 0..10_000 {
            assert!((2.0..5.0).contains(&chance.range(2.0, 5.0)));
            assert!(chance.below(7) < 7);
            assert!((chance.direction().length() - 1.0).abs() < 1e-5);
        }
        assert_eq!(chance.below(0), 0);
    }
}
