//! How far away anything may be.

use nalgebra::Vector3;

/// Farthest that anything is from the origin of a frame, along an axis \[m\]: as far as a sample
/// may say.
const FARTHEST_M: f64 = 1e8;

/// Whether a position \[m\] lies where something may be. One with a number that is none does not.
pub fn is_somewhere(position: &Vector3<f64>) -> bool {
    position.iter().all(|x| x.abs() <= FARTHEST_M)
}
