//! A stream of random numbers from a seed.

use crate::{GAMMA, fraction, split_mix};

/// A source of random numbers that is the same on every run (`SplitMix64`): for statistical tests.
#[derive(Clone, Debug)]
pub struct Seeded(pub u64);

impl Seeded {
    /// Uniform in \[0, 1).
    pub fn uniform(&mut self) -> f64 {
        let bits = split_mix(self.0);
        self.0 = self.0.wrapping_add(GAMMA);
        fraction(bits)
    }

    /// Standard normal (Box & Muller 1958).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}
