//! How an object lies when it is to be recognised.

use std::f64::consts::PI;

use nalgebra::{Quaternion, UnitQuaternion};
use object_recognition::Orientation;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// Which turns an object may have made since it was learned. The recogniser is told which are
/// possible, and not which one it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rotate {
    /// None: only the translation is unknown.
    None,
    /// One of the 24 that take a cube into itself.
    Cube,
    /// Any rotation about the vertical.
    Yaw,
    /// Any rotation.
    Free,
}

impl Rotate {
    /// Its short name: `none`, `24`, `yaw` or `so3`.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Cube => "24",
            Self::Yaw => "yaw",
            Self::Free => "so3",
        }
    }

    /// What the recogniser is told.
    pub fn orientation(self) -> Orientation {
        match self {
            Self::None => Orientation::Known,
            Self::Cube => Orientation::cube(),
            Self::Yaw => Orientation::Yaw,
            Self::Free => Orientation::Free,
        }
    }

    /// One of the turns, all equally likely.
    pub fn draw(self, random: &mut ChaCha8Rng) -> UnitQuaternion<f64> {
        match self.orientation() {
            Orientation::Known => UnitQuaternion::identity(),
            Orientation::Finite(turns) => turns[random.random_range(0..turns.len())],
            Orientation::Yaw => {
                UnitQuaternion::from_euler_angles(0.0, 0.0, random.random_range(-PI..PI))
            }
            // Four independent normal numbers have no preferred direction.
            Orientation::Free => {
                let [i, j, k, w]: [f64; 4] = std::array::from_fn(|_| random.sample(StandardNormal));
                UnitQuaternion::new_normalize(Quaternion::new(w, i, j, k))
            }
        }
    }
}
