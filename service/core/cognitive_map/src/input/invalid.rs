//! Checks of samples: constructors refuse what could not have been sensed.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

/// Largest coordinate, length or speed \[m, m/s\].
pub(super) const METRES_MAX: f64 = 1e8;
/// Farthest a unit vector's or quaternion's norm may be from one.
pub(super) const UNIT_TOLERANCE: f64 = 1e-3;

/// Why a sample is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidSample {
    /// A number is NaN, infinite or beyond its limit.
    #[error("a number is not finite or beyond its limit")]
    NumberOutOfRange,
    /// A quaternion's norm is not one.
    #[error("a quaternion is not a unit quaternion")]
    NonUnitQuaternion,
    /// A standard deviation is negative.
    #[error("a standard deviation is negative")]
    NegativeNoise,
    /// A descriptor has a wrong length or no direction.
    #[error("a descriptor has a wrong length or no direction")]
    InvalidDescriptor,
    /// A label is empty, too long or has control characters.
    #[error("a label is empty, too long or has control characters")]
    InvalidLabel,
    /// A surface normal is not a unit vector.
    #[error("a surface normal is not a unit vector")]
    InvalidNormal,
}

/// A vector of finite numbers not larger than `limit`.
pub(super) fn bounded(numbers: [f64; 3], limit: f64) -> Result<Vector3<f64>, InvalidSample> {
    if numbers.iter().all(|x| x.abs() <= limit) {
        Ok(numbers.into())
    } else {
        Err(InvalidSample::NumberOutOfRange) // NaN too: no comparison with it holds
    }
}

/// A vector of finite standard deviations.
pub(super) fn deviations(sd: [f64; 3]) -> Result<Vector3<f64>, InvalidSample> {
    let sd = bounded(sd, METRES_MAX)?;
    if sd.iter().any(|&x| x < 0.0) {
        Err(InvalidSample::NegativeNoise)
    } else {
        Ok(sd)
    }
}

/// A pose from a translation \[m\] and a unit quaternion `[x, y, z, w]`.
pub(super) fn pose(
    translation_m: [f64; 3],
    rotation_xyzw: [f64; 4],
) -> Result<Isometry3<f64>, InvalidSample> {
    let translation = Translation3::from(bounded(translation_m, METRES_MAX)?);
    let [x, y, z, w] = rotation_xyzw;
    let quaternion = Quaternion::new(w, x, y, z);
    let norm = quaternion.norm();
    if !norm.is_finite() {
        return Err(InvalidSample::NumberOutOfRange);
    }
    if (norm - 1.0).abs() > UNIT_TOLERANCE {
        return Err(InvalidSample::NonUnitQuaternion);
    }
    let rotation = UnitQuaternion::new_normalize(quaternion);
    Ok(Isometry3::from_parts(translation, rotation))
}
