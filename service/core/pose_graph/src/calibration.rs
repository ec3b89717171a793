//! Lasting errors of odometry, and motion as odometry read it.

use nalgebra::{Isometry3, Matrix6, UnitQuaternion, Vector3, Vector6};

use geometry::{exp_jacobian, log_jacobian, se3};

/// Lasting errors of a robot's odometry: readings are wrong by them again and again.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Calibration {
    /// Part of a reading by which its length is too large.
    pub length: f64,
    /// Part of a reading by which its angle is too large.
    pub angle: f64,
    /// Rotation about the body's z axis for each metre that it goes, which is not read \[rad/m\]:
    /// wheels of unequal diameters drive in a circle.
    pub veer_rad_m: f64,
    /// Rotation about the body axes that is read where there is none \[rad/s\].
    pub bias_rad_s: Vector3<f64>,
}

/// Where the components of a calibration stand in a twist: length, angle, veer, bias.
pub(super) const CALIBRATION_AXES: [usize; 6] = [0, 1, 2, 3, 4, 5];

/// The same of a robot in the plane, whose bias is that about its z axis.
pub(super) const PLANAR_CALIBRATION_AXES: [usize; 4] = [0, 1, 2, 5];

impl Calibration {
    /// Its components in their places in a twist.
    pub(super) fn components(&self) -> Vector6<f64> {
        se3::join(
            &Vector3::new(self.length, self.angle, self.veer_rad_m),
            &self.bias_rad_s,
        )
    }

    /// Of components in their places in a twist.
    pub(super) fn of_components(components: &Vector6<f64>) -> Self {
        let (ratios, bias_rad_s) = se3::split(components);
        Self {
            length: ratios.x,
            angle: ratios.y,
            veer_rad_m: ratios.z,
            bias_rad_s,
        }
    }

    /// As the place of a node: the ratios as a translation, the bias as a rotation vector.
    pub(super) fn place(&self) -> Isometry3<f64> {
        Isometry3::from_parts(
            Vector3::new(self.length, self.angle, self.veer_rad_m).into(),
            UnitQuaternion::from_scaled_axis(self.bias_rad_s),
        )
    }

    /// Of the place of a node.
    pub(super) fn of_place(place: &Isometry3<f64>) -> Self {
        Self {
            length: place.translation.x,
            angle: place.translation.y,
            veer_rad_m: place.translation.z,
            bias_rad_s: place.rotation.scaled_axis(),
        }
    }
}

/// How much of each lasting error a motion is exposed to, added up over its steps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Exposure {
    /// How long the body moved, and the bias with it \[s\].
    pub moving_s: f64,
    /// Rotation that was read, which an error of angles counts for, about the body axes of the
    /// end \[rad\].
    pub turned_rad: Vector3<f64>,
}

/// An even motion between two poses as odometry read it.
///
/// With the errors of lengths and angles c and d, the veer e, the bias b, the length v and the
/// rotation vector ω that were read, and of its [`Exposure`] the rotation f and the time T, it
/// is
///
/// ```text
/// exp((1 − c) v, ω − d Jᵣ⁻¹(ω) f + |v| e ẑ − T b)
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    linear_m: Vector3<f64>,
    angular_rad: Vector3<f64>,
    /// How the rotation vector changes with an error of angles \[rad\].
    turned_rad: Vector3<f64>,
    moving_s: f64,
}

impl Reading {
    /// The reading that a calibration corrects to a motion.
    ///
    /// A correction of lengths by a factor of less than `factor_min` counts as one by that.
    pub fn corrected_to(
        motion: &Isometry3<f64>,
        by: &Calibration,
        exposure: &Exposure,
        factor_min: f64,
    ) -> Self {
        let &Exposure {
            moving_s,
            turned_rad,
        } = exposure;
        let (linear, angular) = se3::log(motion);
        let right = log_jacobian(&linear, &angular);
        let turned_rad = right.fixed_view::<3, 3>(3, 3) * turned_rad;
        let linear_m = linear / (1.0 - by.length).max(factor_min);
        let lasting = by.bias_rad_s * moving_s - Vector3::z() * (by.veer_rad_m * linear_m.norm());
        Self {
            linear_m,
            angular_rad: angular + lasting + turned_rad * by.angle,
            turned_rad,
            moving_s,
        }
    }

    /// The motion, corrected by a calibration.
    pub fn motion(&self, calibration: &Calibration) -> Isometry3<f64> {
        let (linear, angular) = self.corrected(calibration);
        se3::exp(&linear, &angular)
    }

    /// Length and rotation vector of the motion.
    fn corrected(&self, calibration: &Calibration) -> (Vector3<f64>, Vector3<f64>) {
        let linear = self.linear_m * (1.0 - calibration.length);
        let veered = Vector3::z() * (calibration.veer_rad_m * self.linear_m.norm());
        let misread = self.turned_rad * calibration.angle;
        let angular = self.angular_rad - misread + veered - calibration.bias_rad_s * self.moving_s;
        (linear, angular)
    }

    /// How the logarithm of M⁻¹ D changes with the calibration of the motion M, as if D moved on
    /// its right: D exp(C c). `error` is M⁻¹ D. The columns are those of [`CALIBRATION_AXES`].
    ///
    /// ```text
    /// C = Ad(error⁻¹) Jᵣ(ξ) | v      0        0    0 |      ξ = log M
    ///                       | 0  Jᵣ⁻¹(ω) f  −|v| ẑ  T |
    /// ```
    pub(super) fn jacobian(
        &self,
        calibration: &Calibration,
        error: &Isometry3<f64>,
    ) -> Matrix6<f64> {
        let (linear, angular) = self.corrected(calibration);
        let mut by_twist = Matrix6::zeros();
        by_twist
            .fixed_view_mut::<3, 1>(0, 0)
            .copy_from(&self.linear_m);
        by_twist
            .fixed_view_mut::<3, 1>(3, 1)
            .copy_from(&self.turned_rad);
        by_twist[(5, 2)] = -self.linear_m.norm();
        for k in 3..6 {
            by_twist[(k, k)] = self.moving_s;
        }
        se3::adjoint(&error.inverse()) * (exp_jacobian(&linear, &angular) * by_twist)
    }
}

#[cfg(test)]
mod tests;
