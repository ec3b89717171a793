//! An end effector that feels its way over an object.

use nalgebra::{Point3, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::voxel_object::{Face, VoxelObject};

/// Faces of one exploratory move, at most.
const STRIDE_MAX: usize = 3;

/// What is not exact about exploring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExplorationNoise {
    /// Standard deviation of a felt level; levels go from 0 to 1.
    pub value: f64,
    /// Standard deviation of a move's measured displacement along each axis, as a share of its
    /// length.
    pub motion: f64,
}

/// A contact as the end effector knows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Felt {
    /// Position by path integration, from where the exploration began, along the object's axes
    /// \[m\].
    pub position_m: Vector3<f64>,
    /// Standard deviation that path integration has gathered along each axis \[m\].
    pub drift_sd_m: f64,
    /// Unit vector out of the surface.
    pub normal: Vector3<f64>,
    /// The level.
    pub level: f64,
}

/// A walk over the surface: each move goes one to three faces straight on in a random direction,
/// and ends in a contact.
#[derive(Debug)]
pub struct Explorer<'a> {
    object: &'a VoxelObject,
    noise: ExplorationNoise,
    random: ChaCha8Rng,
    pub(super) face: usize,
    position_m: Vector3<f64>,
    drift_variance_m2: f64,
}

impl<'a> Explorer<'a> {
    /// An exploration that begins on a random face.
    pub fn new(object: &'a VoxelObject, noise: ExplorationNoise, mut random: ChaCha8Rng) -> Self {
        let face = random.random_range(0..object.faces().len());
        Self::from(object, noise, face, random)
    }

    /// An exploration that begins on the face of this number.
    pub fn from(
        object: &'a VoxelObject,
        noise: ExplorationNoise,
        face: usize,
        random: ChaCha8Rng,
    ) -> Self {
        Self {
            object,
            noise,
            random,
            face,
            position_m: Vector3::zeros(),
            drift_variance_m2: 0.0,
        }
    }

    /// The face that is touched, as it is.
    pub fn face(&self) -> &Face {
        &self.object.faces()[self.face]
    }

    /// Where the exploration stands, truly, in the object's own frame \[m\].
    pub fn true_position_m(&self) -> Point3<f64> {
        self.face().position_m
    }

    /// Feels the face under the end effector.
    pub fn feel(&mut self) -> Felt {
        let Face { normal, level, .. } = *self.face();
        Felt {
            position_m: self.position_m,
            drift_sd_m: self.drift_variance_m2.sqrt(),
            normal,
            level: level + self.noise.value * self.normal_number(),
        }
    }

    /// Makes a move.
    pub fn advance(&mut self) {
        let before_m = self.face().position_m;
        let stride = self.random.random_range(1..=STRIDE_MAX);
        let mut heading = self.object.random_heading(self.face, &mut self.random);
        for _ in 0..stride {
            heading = self.object.step(heading);
        }
        self.face = heading.face;
        let moved_m = self.face().position_m - before_m;
        let sd_m = self.noise.motion * moved_m.norm();
        let error_m = Vector3::from_fn(|_, _| self.normal_number()) * sd_m;
        self.position_m += moved_m + error_m;
        self.drift_variance_m2 += sd_m * sd_m;
    }

    /// The generator, for the next exploration.
    pub fn into_random(self) -> ChaCha8Rng {
        self.random
    }

    fn normal_number(&mut self) -> f64 {
        self.random.sample(StandardNormal)
    }
}
