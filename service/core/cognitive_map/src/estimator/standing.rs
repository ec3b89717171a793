//! What odometry reads of its bias while the body stands.
//!
//! A gyroscope of a body that stands reads its bias. A body that really turned so slowly on one
//! spot would read the same, but hardly any does. How slow is standing depends on the body: nothing
//! is taken for it before the body has gone many times faster, so who always creeps never stands.
//!
//! ```text
//! stands    |v| ≤ v_max and |ω_k| ≤ m σ_bias      reads    ω = bias + n      n ~ N(0, d²/T + s²/T²)
//! ```

use nalgebra::{SMatrix, SVector, Vector3};

use super::calibration::LASTING_DIM;
use super::effect::Effect;
use super::frame::Frame;
use super::jacobian::Block;
use super::joint::Estimator;
use super::odometry_reading::OdometryReading;
use super::parameters::Parameters;
use super::tuning::{
    STANDING_CONTRAST, STANDING_RATE_SD, STANDING_RATE_SD_RAD_SQRT_S, STANDING_S_MAX,
    STANDING_S_MIN, STANDING_SPEED_MAX_M_S, STANDING_TURN_SD_RAD,
};

/// What was read while a body seemed to stand.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Standing {
    /// Rotation \[rad\].
    pub(super) turned: Vector3<f64>,
    /// Length of the way \[m\].
    pub(super) went_m: f64,
    /// How long \[s\].
    pub(super) time_s: f64,
}

/// The bias of a gyroscope about each axis about which it was read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MeasuredBias {
    pub(super) rate_rad_s: Vector3<f64>,
    /// Ones for the axes about which it was read.
    pub(super) axes: Vector3<f64>,
    /// Variance about each axis \[rad²/s²\].
    pub(super) variance: f64,
}

impl Standing {
    /// Takes in a motion, of odometry whose bias has this deviation; answers what it has read of
    /// the bias before, once the body is seen to have stood.
    #[inline]
    pub(super) fn take_in(
        &mut self,
        reading: &OdometryReading,
        bias_sd_rad_s: f64,
    ) -> Option<MeasuredBias> {
        let time_s = reading.moving_s();
        if time_s == 0.0 {
            return None; // at rest without any bias, or of no duration
        }
        let length_m = reading.lengths.norm();
        if length_m <= STANDING_SPEED_MAX_M_S * time_s {
            let most = STANDING_RATE_SD * bias_sd_rad_s * time_s;
            if reading.angles.iter().all(|angle| angle.abs() <= most)
                && reading.angles != Vector3::zeros()
                && self.time_s < STANDING_S_MAX
            {
                self.turned += reading.angles;
                self.went_m += length_m;
                self.time_s += time_s;
            }
            return None;
        }
        if self.time_s == 0.0 || length_m * self.time_s < STANDING_CONTRAST * self.went_m * time_s {
            return None;
        }
        let stood = std::mem::take(self);
        (stood.time_s >= STANDING_S_MIN).then(|| MeasuredBias {
            rate_rad_s: stood.turned / stood.time_s,
            axes: stood.turned.map(|angle| f64::from(u8::from(angle != 0.0))),
            variance: STANDING_RATE_SD_RAD_SQRT_S.powi(2) / stood.time_s
                + (STANDING_TURN_SD_RAD / stood.time_s).powi(2),
        })
    }
}

impl Estimator {
    /// Takes in what an agent that stood has read of the bias of its gyroscope.
    pub(super) fn learn_bias(
        &mut self,
        agent: u32,
        measured: &MeasuredBias,
        effects: &mut Vec<Effect>,
    ) {
        self.alter(agent, effects, |frame, index, parameters| {
            frame.learn_bias(index, measured, parameters);
            true
        });
    }
}

impl Frame {
    /// A measurement of the bias of a member's odometry. What it has turned by meanwhile, and what
    /// was seen since, follow.
    fn learn_bias(&mut self, index: usize, measured: &MeasuredBias, parameters: &Parameters) {
        self.flush();
        for axis in (0..3).filter(|axis| measured.axes[*axis] > 0.0) {
            let member = &self.members[index];
            let mut jacobian = SMatrix::<f64, 1, 6>::zeros();
            jacobian[2 + axis] = 1.0;
            let block = Block {
                offset: member.offset + 6,
                width: LASTING_DIM,
                jacobian,
            };
            let own = member.filter().calibration.bias_rad_s[axis];
            let residual = SVector::<f64, 1>::new(measured.rate_rad_s[axis] - own);
            let projection = self.covariance.project(&[block]);
            let s = projection.spread + SMatrix::<f64, 1, 1>::new(measured.variance);
            let all = self.covariance.all();
            if let Some(correction) = self.covariance.update(projection, &residual, &s, &all) {
                self.correct(index, &correction, parameters);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::Motion;
    use nalgebra::UnitQuaternion;

    /// What is read of the bias where a body stands for so long, turning so fast and drifting so
    /// fast by its odometry, and then goes at a speed.
    fn read(time_s: f64, rate_rad_s: f64, drift_m_s: f64, speed_m_s: f64) -> Option<MeasuredBias> {
        let (mut standing, step_s) = (Standing::default(), 0.1);
        let mut go = |speed_m_s: f64, rate_rad_s: f64| {
            let ahead = Vector3::new(speed_m_s * step_s, 0.0, 0.0);
            let turn = UnitQuaternion::new(Vector3::z() * (rate_rad_s * step_s))
                .coords
                .into();
            let motion = Motion::from_increment(ahead.into(), turn, None).unwrap();
            standing.take_in(&OdometryReading::new(&motion, step_s), 0.004)
        };
        let mut stood_s = 0.0;
        while stood_s < time_s - 0.5 * step_s {
            assert_eq!(go(drift_m_s, rate_rad_s), None, "it may creep");
            stood_s += step_s;
        }
        go(speed_m_s, 0.1)
    }

    #[test]
    fn a_standing_body_reads_its_bias_of_either_sign() {
        for rate in [0.006, -0.006] {
            for drift in [0.0, 0.008] {
                let bias = read(20.0, rate, drift, 0.5).unwrap();
                assert!((bias.rate_rad_s.z - rate).abs() < 1e-12);
                assert_eq!(bias.axes, Vector3::z());
                assert!((0.001..0.0011).contains(&bias.variance.sqrt()));
            }
        }
    }

    #[test]
    fn who_creeps_or_turns_or_reads_no_turn_does_not_stand() {
        assert_eq!(read(20.0, 0.006, 0.008, 0.1), None, "it creeps");
        assert_eq!(read(20.0, 0.006, 0.03, 3.0), None, "it goes");
        assert_eq!(read(20.0, 0.02, 0.0, 0.5), None, "it turns");
        assert_eq!(read(20.0, 0.0, 0.0, 0.5), None, "it reads nothing at rest");
        assert_eq!(read(0.5, 0.006, 0.0, 0.5), None, "it hardly stopped");
    }

    #[test]
    fn a_short_stop_says_little() {
        let sd = |time_s| read(time_s, 0.006, 0.0, 0.5).unwrap().variance.sqrt();
        assert!(sd(2.0) > 0.01 && sd(5.0) > 0.004 && sd(50.0) < 0.0005);
    }
}
