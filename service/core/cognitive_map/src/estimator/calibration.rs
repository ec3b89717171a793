//! What odometry gets wrong all the time.

use nalgebra::{Isometry3, SVector, UnitQuaternion, Vector3};

use super::tuning::CALIBRATION_FACTOR_MIN;
use ::state::state_of_struct;
use pose_graph::{Exposure, Reading};

/// Components of what odometry gets wrong all the time.
pub const LASTING_DIM: usize = 6;
/// Of each component a number: relative errors of lengths and of angles, bias about the body axes
/// \[rad/s\], veer \[rad/m\].
pub type LastingErrors = SVector<f64, LASTING_DIM>;
/// Where the veer is among them.
pub(crate) const VEER: usize = 5;

/// What odometry gets wrong all the time: reading = true · (1 + error) + bias.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Calibration {
    /// Relative error of lengths.
    pub length: f64,
    /// Relative error of angles.
    pub angle: f64,
    /// Rotation about the body's z axis for each metre that it goes, which is not read \[rad/m\]:
    /// wheels of unequal diameters drive in a circle.
    pub veer_rad_m: f64,
    /// Bias about the body axes \[rad/s\].
    pub bias_rad_s: Vector3<f64>,
}

/// How a motion was corrected by what was known of its odometry then.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Calibrated {
    /// What it was corrected by.
    pub calibration: Calibration,
    /// Whether odometry stated its noise.
    pub states_noise: bool,
    /// Variances by which the true errors may have changed with the motion.
    pub wander: LastingErrors,
    /// How long the body moved, and the bias with it \[s\].
    pub moving_s: f64,
    /// Rotation that was read, which the error of angles counts for, about the body axes of the
    /// end \[rad\].
    pub turned_rad: Vector3<f64>,
}

state_of_struct!(Calibration {
    length,
    angle,
    veer_rad_m,
    bias_rad_s
});
state_of_struct!(Calibrated {
    calibration,
    states_noise,
    wander,
    moving_s,
    turned_rad
});

impl Calibrated {
    /// The same odometry, and no motion yet.
    pub(crate) fn without_motion(&self) -> Self {
        Self {
            calibration: self.calibration,
            states_noise: self.states_noise,
            ..Self::default()
        }
    }

    /// This motion, then the `next` one, with its rotation.
    pub(crate) fn then(&self, next: &Self, rotation: &UnitQuaternion<f64>) -> Self {
        let before = rotation.inverse_transform_vector(&self.turned_rad);
        Self {
            wander: self.wander + next.wander,
            moving_s: self.moving_s + next.moving_s,
            turned_rad: before + next.turned_rad,
            ..*next
        }
    }

    /// What odometry read of a motion that was corrected so, as if it had been an even one.
    pub(crate) fn reading(&self, motion: &Isometry3<f64>) -> Reading {
        let by = self.calibration.in_graph();
        let exposure = Exposure {
            moving_s: self.moving_s,
            turned_rad: self.turned_rad,
        };
        Reading::corrected_to(motion, &by, &exposure, CALIBRATION_FACTOR_MIN)
    }

    /// A motion that was corrected so, as it would have been corrected by another calibration.
    pub(crate) fn corrected_by(
        &self,
        motion: &Isometry3<f64>,
        calibration: &Calibration,
    ) -> Isometry3<f64> {
        self.reading(motion).motion(&calibration.in_graph())
    }
}

impl Calibration {
    /// As the solver of pose graphs has it.
    pub(crate) fn in_graph(&self) -> pose_graph::Calibration {
        pose_graph::Calibration {
            length: self.length,
            angle: self.angle,
            veer_rad_m: self.veer_rad_m,
            bias_rad_s: self.bias_rad_s,
        }
    }

    /// Of the solver of pose graphs.
    pub(crate) fn of_graph(calibration: &pose_graph::Calibration) -> Self {
        Self {
            length: calibration.length,
            angle: calibration.angle,
            veer_rad_m: calibration.veer_rad_m,
            bias_rad_s: calibration.bias_rad_s,
        }
    }

    /// Of these components.
    pub(crate) fn of_components(components: &LastingErrors) -> Self {
        Self {
            length: components[0],
            angle: components[1],
            bias_rad_s: components.fixed_rows::<3>(2).into_owned(),
            veer_rad_m: components[VEER],
        }
    }

    /// Its components.
    pub(crate) fn components(&self) -> LastingErrors {
        let (bias, veer) = (&self.bias_rad_s, self.veer_rad_m);
        SVector::from([self.length, self.angle, bias.x, bias.y, bias.z, veer])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::se3;

    /// Many small turns, corrected together by what was found out later, come out as if each had
    /// been corrected so: in the plane, and about one axis after another.
    #[test]
    fn turns_together_are_corrected_as_each_of_them_is() {
        let planar = Calibration {
            angle: 0.02,
            veer_rad_m: 0.03,
            bias_rad_s: Vector3::new(0.0, 0.0, -0.004),
            ..Calibration::default()
        };
        let angle = Calibration {
            angle: 0.02,
            ..Calibration::default()
        };
        let axes = [Vector3::z(), Vector3::x()];
        for (found, first, most) in [(planar, axes[0], 1e-9), (angle, axes[1], 0.002)] {
            for sense in [1.0, -1.0] {
                let mut together = (Isometry3::identity(), Calibrated::default());
                let mut each = Isometry3::identity();
                for step in 0..36 {
                    let about = if step < 18 { first } else { axes[0] };
                    let linear = Vector3::new(0.1, 0.0, 0.0);
                    let turn = about * (sense * 4.9_f64.to_radians());
                    let read = se3::exp(&linear, &turn);
                    let calibrated = Calibrated {
                        moving_s: 0.1,
                        turned_rad: turn,
                        ..Calibrated::default()
                    };
                    each *= calibrated.corrected_by(&read, &found);
                    together.0 *= read;
                    together.1 = together.1.then(&calibrated, &read.rotation);
                }
                let (motion, calibrated) = together;
                let corrected = calibrated.corrected_by(&motion, &found);
                let off = corrected.rotation.angle_to(&each.rotation);
                let uncorrected = motion.rotation.angle_to(&each.rotation);
                assert!(uncorrected > 0.03, "{uncorrected} rad are to be corrected");
                assert!(off < most, "{off} rad off of {uncorrected}");
            }
        }
    }
}
