//! What the estimation takes for granted about robots and sensors.

use nalgebra::{Isometry3, SVector, Vector6};

use super::calibration::{LastingErrors, VEER};
use super::tuning::{
    ANY_TURN_SD_RAD, CALIBRATION_RENEWAL, LASTING_DEVIATIONS_MAX, LASTING_RATIO_MAX,
    VEER_ACCEPTED_RAD_M, VEER_PER_ANGLE_ERROR_RAD_M, WANDERED_MAX,
};
use crate::input::Motion;
use crate::settings::Settings;

/// Physical parameters of the estimation, the same for every robot and every sensor.
///
/// They are those of a modest wheeled robot with a camera. What a sample states about its own noise
/// goes before them, and what the sightings show is learned on top: the noise of odometry is where
/// learning begins.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameters {
    /// Deviation of odometry's lasting relative error of lengths, e.g. of a wheel's radius.
    pub length_error_sd: f64,
    /// Deviation of odometry's lasting relative error of angles, e.g. of a wheel base; 0.3 of it is
    /// that of the veer \[rad/m\].
    pub angle_error_sd: f64,
    /// Deviation of odometry's lasting bias about each axis \[rad/s\], e.g. of a gyroscope.
    pub bias_sd_rad_s: f64,
    /// Part of its variance that a lasting error renews on 100 m, in 100 rad, or in 1000 s.
    pub calibration_renewal: f64,
    /// Translation noise of motion that states none \[m/√m\].
    pub translation_sd_per_sqrt_m: f64,
    /// Rotation noise of motion that states none, by path \[rad/√m\].
    pub rotation_sd_per_sqrt_m: f64,
    /// Rotation noise of motion that states none, by rotation \[rad/√rad\].
    pub rotation_sd_per_sqrt_rad: f64,
    /// Part of a distance by which a seen distance is off, again and again, as long as the
    /// sightings do not show that their errors change from one to the next.
    pub lasting_range_error: f64,
    /// Normalised innovation from which a component of a sighting loses weight (Huber 1964).
    pub soft: f64,
    /// Normalised innovation from which the whole sighting is refused.
    pub gate: f64,
}

impl Default for Parameters {
    fn default() -> Self {
        Self::of(&Settings::default())
    }
}

impl Parameters {
    /// Those of a space.
    pub(crate) fn of(settings: &Settings) -> Self {
        Self {
            length_error_sd: settings.length_error_sd,
            angle_error_sd: settings.angle_error_sd,
            bias_sd_rad_s: settings.bias_sd_rad_s,
            calibration_renewal: CALIBRATION_RENEWAL,
            translation_sd_per_sqrt_m: settings.translation_sd_per_sqrt_m,
            rotation_sd_per_sqrt_m: settings.rotation_sd_per_sqrt_m,
            rotation_sd_per_sqrt_rad: settings.rotation_sd_per_sqrt_rad,
            lasting_range_error: settings.lasting_range_error,
            soft: settings.sighting_huber_sd,
            gate: settings.sighting_gate_sd,
        }
    }

    /// Deviations of the calibration, in the order of the body's error.
    pub(crate) fn calibration_sd(&self) -> LastingErrors {
        let bias = self.bias_sd_rad_s;
        let veer = VEER_PER_ANGLE_ERROR_RAD_M * self.angle_error_sd;
        SVector::from([
            self.length_error_sd,
            self.angle_error_sd,
            bias,
            bias,
            bias,
            veer,
        ])
    }

    /// Largest lasting errors that are accepted.
    pub(super) fn calibration_max(&self) -> LastingErrors {
        let mut most = self.calibration_sd() * LASTING_DEVIATIONS_MAX;
        // The graph, which tells the veer where views are matched, has a prior of its own.
        most[VEER] = most[VEER].max(VEER_ACCEPTED_RAD_M);
        SVector::from_fn(|k, _| {
            if k < 2 {
                most[k].min(LASTING_RATIO_MAX)
            } else {
                most[k]
            }
        })
    }

    /// Largest variances of the calibration that its wandering leads to.
    pub(super) fn calibration_variance_max(&self) -> LastingErrors {
        let sd = self.calibration_sd() * WANDERED_MAX;
        sd.component_mul(&sd)
    }

    /// Variances that a motion adds to those of the calibration.
    pub(super) fn calibration_wander(
        &self,
        path_m: f64,
        angle_rad: f64,
        duration_s: f64,
    ) -> LastingErrors {
        let sd = self.calibration_sd();
        let time = duration_s / 1000.0;
        let renewed = SVector::from([
            path_m / 100.0,
            angle_rad / 100.0,
            time,
            time,
            time,
            path_m / 100.0,
        ]);
        sd.component_mul(&sd).component_mul(&renewed) * self.calibration_renewal
    }

    /// Factors of the variances of components whose innovations have these squares: an outlying
    /// component loses weight.
    pub(super) fn loss_of_weight<const M: usize>(
        &self,
        squares: &SVector<f64, M>,
    ) -> SVector<f64, M> {
        squares.map(|square| (square / self.soft.powi(2)).max(1.0))
    }

    /// Standard deviations of a motion's noise \[m, m, m, rad, rad, rad\].
    ///
    /// A random walk in translation and rotation, unless the motion states its own:
    ///
    /// ```text
    /// σ_t² = s_t² · path      σ_r² = r_m² · path + r_rad² · angle
    /// ```
    ///
    /// Motion that lies exactly in the body's x-y plane has no noise out of it.
    pub(crate) fn motion_noise_sd(&self, motion: &Motion) -> Vector6<f64> {
        if let Some(noise) = motion.noise() {
            let sd = noise.sd();
            return Vector6::from_fn(|k, _| {
                if k < 3 {
                    sd[k]
                } else {
                    sd[k].min(ANY_TURN_SD_RAD)
                }
            });
        }
        self.assumed_noise_sd(motion.increment())
    }

    /// The same of a motion that states none.
    pub(super) fn assumed_noise_sd(&self, increment: &Isometry3<f64>) -> Vector6<f64> {
        let lengths = increment.translation.vector;
        let (path_m, angle_rad) = (lengths.norm(), increment.rotation.angle());
        let across = self.translation_sd_per_sqrt_m * path_m.sqrt();
        let about = (self.rotation_sd_per_sqrt_m.powi(2) * path_m
            + self.rotation_sd_per_sqrt_rad.powi(2) * angle_rad)
            .sqrt();
        let axis = increment.rotation.imag();
        if lengths.z == 0.0 && axis.x == 0.0 && axis.y == 0.0 {
            Vector6::new(across, across, 0.0, 0.0, 0.0, about)
        } else {
            Vector6::new(across, across, across, about, about, about)
        }
    }
}
