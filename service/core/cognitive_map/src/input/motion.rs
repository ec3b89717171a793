//! Motion: displacements of the body, and where an agent starts.

use nalgebra::Isometry3;

use super::invalid::{METRES_MAX, bounded, pose};
use super::{InvalidSample, NoisyPose, PoseNoise};
use geometry::se3;

/// Largest angular rate \[rad/s\].
const RADIANS_PER_SECOND_MAX: f64 = 1e3;
/// Longest interval of one velocity sample \[s\].
const DURATION_S_MAX: f64 = 3600.0;

/// A displacement of the body, in the body frame at its start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    increment: Isometry3<f64>,
    noise: Option<PoseNoise>,
}

impl Motion {
    /// From a finished displacement \[m\] and a unit quaternion `[x, y, z, w]`.
    ///
    /// # Errors
    /// A number is out of range or the quaternion is not of unit norm.
    pub fn from_increment(
        translation_m: [f64; 3],
        rotation_xyzw: [f64; 4],
        noise: Option<PoseNoise>,
    ) -> Result<Self, InvalidSample> {
        Ok(Self {
            increment: pose(translation_m, rotation_xyzw)?,
            noise,
        })
    }

    /// From a body twist \[m/s, rad/s\] held for `duration_s`: the exact screw motion `exp(ξ Δt)`.
    ///
    /// # Errors
    /// A number is out of range or the duration is negative.
    pub fn from_velocity(
        linear_m_s: [f64; 3],
        angular_rad_s: [f64; 3],
        duration_s: f64,
        noise: Option<PoseNoise>,
    ) -> Result<Self, InvalidSample> {
        let linear = bounded(linear_m_s, METRES_MAX)?;
        let angular = bounded(angular_rad_s, RADIANS_PER_SECOND_MAX)?;
        if !(0.0..=DURATION_S_MAX).contains(&duration_s) {
            return Err(InvalidSample::NumberOutOfRange);
        }
        let increment = se3::exp(&(linear * duration_s), &(angular * duration_s));
        Ok(Self { increment, noise })
    }

    /// The displacement.
    pub fn increment(&self) -> &Isometry3<f64> {
        &self.increment
    }

    /// Its noise; the settings' odometry noise when absent.
    pub fn noise(&self) -> Option<&PoseNoise> {
        self.noise.as_ref()
    }
}

/// Pose of an agent in `map`, with its noise along and about the body axes.
pub type StartPose = NoisyPose;
