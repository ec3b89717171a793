//! A pose with its noise.

use nalgebra::{Isometry3, Vector6};

use super::InvalidSample;
use super::invalid::{deviations, pose};

/// Standard deviations of a relative pose in right-perturbation coordinates (translation along,
/// then rotation about, the body axes x, y, z at its end) \[m, rad\]. Finite and not negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseNoise(Vector6<f64>);

impl PoseNoise {
    /// # Errors
    /// A number is not finite, too large or negative.
    pub fn new(
        translation_sd_m: [f64; 3],
        rotation_sd_rad: [f64; 3],
    ) -> Result<Self, InvalidSample> {
        let [a, b, c] = deviations(translation_sd_m)?.into();
        let [d, e, f] = deviations(rotation_sd_rad)?.into();
        Ok(Self(Vector6::new(a, b, c, d, e, f)))
    }

    /// No noise at all.
    pub fn none() -> Self {
        Self(Vector6::zeros())
    }

    /// The standard deviations.
    pub fn sd(&self) -> &Vector6<f64> {
        &self.0
    }
}

/// A pose, with the noise of its error in the frame of the pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoisyPose {
    pose: Isometry3<f64>,
    noise: PoseNoise,
}

impl NoisyPose {
    /// # Errors
    /// A number is out of range or the quaternion is not of unit norm.
    pub fn new(
        translation_m: [f64; 3],
        rotation_xyzw: [f64; 4],
        noise: PoseNoise,
    ) -> Result<Self, InvalidSample> {
        Ok(Self {
            pose: pose(translation_m, rotation_xyzw)?,
            noise,
        })
    }

    /// The same with a pose that was read back as it was: normalising anew might change its last
    /// bit.
    pub(super) fn exactly(self, pose: Isometry3<f64>) -> Self {
        Self { pose, ..self }
    }

    /// The pose.
    pub fn pose(&self) -> &Isometry3<f64> {
        &self.pose
    }

    /// Its noise, along and about the axes of the pose.
    pub fn noise(&self) -> &PoseNoise {
        &self.noise
    }
}
