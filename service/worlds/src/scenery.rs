//! What a room looks like from each of its points.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// How far one must go for a view to be another: at this distance two have a cosine of 0.6 \[m\].
const CORRELATION_M: f64 = 1.0;

/// Views of a room: unit vectors that change smoothly with the position.
///
/// A view has cos(wᵢ·x + bᵢ) as its numbers, with wᵢ normal of deviation 1/ℓ along each axis and bᵢ
/// uniform, so that the cosine of two views is exp(−|Δx|²/2ℓ²) on average over the features: random
/// Fourier features of a Gaussian kernel (Rahimi & Recht 2007). Views of places far apart are
/// unrelated, up to a cosine of 1/√n by chance, where n is the number of numbers. They do not
/// depend on the direction of looking, as those of an eye that looks to every side.
#[derive(Clone, Debug)]
pub struct Scenery {
    features: Vec<(Vector3<f64>, f64)>,
}

impl Scenery {
    /// The scenery of a seed, in views of so many numbers.
    pub fn new(seed: u64, dimension: usize) -> Self {
        // Obstacles have stream 0 of the same seed, and agents have theirs.
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(u64::MAX);
        let features = (0..dimension).map(|_| {
            let wave = normal(&mut random) / CORRELATION_M;
            (wave, random.random_range(0.0..TAU))
        });
        Self {
            features: features.collect(),
        }
    }

    /// The view from a position \[m\], with noise of a length that is on average `noise` of the
    /// view's.
    pub fn view(&self, from_m: &Vector3<f64>, noise: f64, random: &mut impl Rng) -> Vec<f32> {
        // Half of the squares of cosines is their mean, so a view of n numbers is about √(n/2)
        // long.
        let sd = noise / std::f64::consts::SQRT_2;
        let feature = |(wave, shift): &(Vector3<f64>, f64)| (wave.dot(from_m) + shift).cos();
        let seen = self.features.iter().map(|each| {
            let error: f64 = random.sample(StandardNormal);
            feature(each) + sd * error
        });
        #[expect(clippy::cast_possible_truncation, reason = "views need no more digits")]
        seen.map(|number| number as f32).collect()
    }
}

fn normal(random: &mut ChaCha8Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| random.sample(StandardNormal))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cosine(a: &[f32], b: &[f32]) -> f32 {
        let dot = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f32>();
        dot(a, b) / (dot(a, a) * dot(b, b)).sqrt()
    }

    #[test]
    fn views_fade_with_distance_and_differ_between_seeds() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut mean = |apart_m: f64, noise: f64, other: bool| {
            let cosines = (0..400).map(|seed| {
                let (here, there) = (
                    Scenery::new(seed, 64),
                    Scenery::new(seed + u64::from(other), 64),
                );
                let from = normal(&mut random) * 5.0;
                let to = from + normal(&mut random).normalize() * apart_m;
                let view = here.view(&from, 0.0, &mut random);
                cosine(&view, &there.view(&to, noise, &mut random))
            });
            cosines.sum::<f32>() / 400.0
        };
        assert!((mean(0.0, 0.0, false) - 1.0).abs() < 1e-6);
        for (apart_m, expected) in [(0.25, 0.969), (1.0, 0.607), (2.0, 0.135), (6.0, 0.0)] {
            let found = mean(apart_m, 0.0, false);
            assert!((found - expected).abs() < 0.03, "{apart_m} m: {found}");
        }
        // Noise a tenth as long as the view turns it by about 1/(1 + 0.01)^½.
        assert!((mean(0.0, 0.1, false) - 0.995).abs() < 0.003);
        assert!(mean(0.0, 0.0, true).abs() < 0.03);
    }
}
