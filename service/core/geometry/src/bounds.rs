//! Bounds of positions and motions.

use nalgebra::{Isometry3, Vector3};

/// Farthest that anything is from the origin of a frame, along an axis \[m\]: as far as a sample
/// may say.
const FARTHEST_M: f64 = 1e8;

/// Whether a position \[m\] lies where something may be. One with a number that is none does not.
pub fn is_somewhere(position: &Vector3<f64>) -> bool {
    position.iter().all(|x| x.abs() <= FARTHEST_M)
}

/// Whether a motion is no longer than these \[m, rad\].
#[inline]
pub fn is_within(motion: &Isometry3<f64>, length_m: f64, angle_rad: f64) -> bool {
    motion.translation.vector.norm_squared() <= length_m * length_m
        && motion.rotation.angle() <= angle_rad
}
