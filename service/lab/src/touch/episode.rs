//! One noisy exploration of a touched object.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rand::seq::SliceRandom;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::data_set::{Touch, TouchedObject};

/// How far an episode may begin from the object's own origin, along each axis \[m\].
const OFFSET_MAX_M: f64 = 1.0;

/// What is not exact about touching again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchNoise {
    /// Standard deviation of a position along each axis \[m\].
    pub position_sd_m: f64,
    /// Standard deviation of a level, in its own unit.
    pub level_sd: f64,
}

/// Some of an object's touches again, in random order and with noise, in a frame of their own.
#[derive(Clone, Debug, PartialEq)]
pub struct Episode {
    /// What was felt, and where in the episode's frame.
    pub touches: Vec<Touch>,
    /// The object's frame in that of the episode.
    pub episode_from_object: Isometry3<f64>,
}

impl Episode {
    /// Draws an episode of at most `touches_max` touches, no two of the same place. The object is
    /// turned as given and moved by up to a metre along each axis. Equal seeds and streams give
    /// equal episodes, and less noise leaves the order of the touches as it is.
    pub fn draw(
        object: &TouchedObject,
        rotation: UnitQuaternion<f64>,
        noise: &TouchNoise,
        touches_max: usize,
        random: &mut ChaCha8Rng,
    ) -> Self {
        let offset_m = Vector3::from_fn(|_, _| random.random_range(-OFFSET_MAX_M..OFFSET_MAX_M));
        let episode_from_object = Isometry3::from_parts(Translation3::from(offset_m), rotation);
        let mut order: Vec<usize> = (0..object.touches.len()).collect();
        order.shuffle(random);
        order.truncate(touches_max);
        let touches = order.into_iter().map(|index| {
            let touch = &object.touches[index];
            let error_m = Vector3::from_fn(|_, _| normal(random)) * noise.position_sd_m;
            Touch {
                position_m: Point3::from((episode_from_object * touch.position_m).coords + error_m),
                level: touch.level + noise.level_sd * normal(random),
            }
        });
        Self {
            touches: touches.collect(),
            episode_from_object,
        }
    }
}

/// The generator of one episode: unrelated to those of all other streams of the seed.
pub fn episode_random(seed: u64, stream: u64) -> ChaCha8Rng {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(stream);
    random
}

fn normal(random: &mut impl Rng) -> f64 {
    random.sample(StandardNormal)
}
