//! What is felt in a room: a number that changes smoothly from place to place.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// Waves that a field is the sum of.
const WAVES: usize = 60;
/// Stream of the first field of a seed; obstacles, agents and scenery have others.
const STREAM: u64 = 1 << 40;

/// A field of mean 0 and variance 1 whose values at a distance d have the covariance exp(−d²/2ℓ²):
/// random Fourier features of a Gaussian kernel (Rahimi & Recht 2007).
#[derive(Clone, Debug)]
pub struct LevelField {
    waves: Vec<(Vector3<f64>, f64)>,
}

impl LevelField {
    /// The field of a channel of a seed, with its correlation length ℓ \[m\].
    pub fn new(seed: u64, channel: u64, length_m: f64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(STREAM + channel);
        let waves = (0..WAVES).map(|_| {
            let wave: Vector3<f64> = Vector3::from_fn(|_, _| random.sample(StandardNormal));
            (wave / length_m, random.random_range(0.0..TAU))
        });
        Self {
            waves: waves.collect(),
        }
    }

    /// The same field along so many axes of the room alone: along the others it is the same
    /// everywhere.
    #[must_use]
    pub fn along(mut self, axes: usize) -> Self {
        for (wave, _) in &mut self.waves {
            wave.iter_mut().skip(axes).for_each(|rate| *rate = 0.0);
        }
        self
    }

    /// The level at a position \[m\].
    pub fn level(&self, at_m: &Vector3<f64>) -> f64 {
        let waves = self.waves.iter();
        let sum: f64 = waves
            .map(|(wave, shift)| (wave.dot(at_m) + shift).cos())
            .sum();
        sum * (2.0 / WAVES as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_fade_over_the_correlation_length() {
        let fields = (0..400).map(|seed| LevelField::new(seed, 0, 2.0));
        let at = |x: f64| Vector3::new(x, 1.0, -3.0);
        let products = fields.map(|field| {
            let here = field.level(&at(0.0));
            [0.0, 2.0, 8.0].map(|x| here * field.level(&at(x)))
        });
        let sums = products.fold([0.0; 3], |sums, each| {
            std::array::from_fn(|k| sums[k] + each[k] / 400.0)
        });
        for (found, expected) in sums.into_iter().zip([1.0, 0.607, 0.0]) {
            assert!((found - expected).abs() < 0.15, "{sums:?}");
        }
    }
}
