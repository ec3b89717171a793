//! An eye in a room.

use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::Scenery;

/// An eye that looks to every side, and sees what the scenery of a room shows, with noise.
#[derive(Clone, Debug)]
pub struct Eye {
    scenery: Scenery,
    noise: f64,
    random: ChaCha8Rng,
}

impl Eye {
    /// `noise` is the length of a view's noise, as a share of the view's own. `seed` is that of the
    /// noise alone.
    pub fn new(scenery: Scenery, noise: f64, seed: u64) -> Self {
        Self {
            scenery,
            noise,
            random: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    /// The view from a position \[m\].
    pub fn look(&mut self, from_m: &Vector3<f64>) -> Vec<f32> {
        self.scenery.view(from_m, self.noise, &mut self.random)
    }
}
