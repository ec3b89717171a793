//! What odometry gets wrong all the time.

use nalgebra::{Isometry3, SVector, Vector3};

use super::tuning::CALIBRATION_FACTOR_MIN;
use ::state::state_of_struct;
use pose_graph::Reading;

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
    moving_s
});

impl Calibrated {
    /// The same odometry, and no motion yet.
    pub(crate) fn without_motion(&self) -> Self {
        Self {
            wander: LastingErrors::zeros(),
            moving_s: 0.0,
            ..*self
        }
    }

    /// This motion, then the `next` one.
    pub(crate) fn then(&self, next: &Self) -> Self {
        Self {
            wander: self.wander + next.wander,
            moving_s: self.moving_s + next.moving_s,
            ..*next
        }
    }

    /// What odometry read of a motion that was corrected so, as if it had been an even one.
    pub(crate) fn reading(&self, motion: &Isometry3<f64>) -> Reading {
        let by = self.calibration.in_graph();
        Reading::corrected_to(motion, &by, self.moving_s, CALIBRATION_FACTOR_MIN)
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
