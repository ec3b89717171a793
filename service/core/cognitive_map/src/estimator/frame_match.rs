//! A rigid motion that was found between two frames and is not accepted yet.

use nalgebra::Isometry3;

/// How a frame seems to lie in another one.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FrameMatch {
    /// The older one and the newer one.
    pub(super) frames: [usize; 2],
    /// Pose of the newer one in the older one, as found last.
    pub(super) pose: Isometry3<f64>,
    /// Attempts in a row that found it.
    pub(super) n_found: u32,
}
