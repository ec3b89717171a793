//! What odometry reads of its bias while the body stands.
//!
//! A gyroscope of a body that stands reads its bias. A body that really turned so slowly on one
//! spot would read the same, but hardly any does. How slow is standing depends on the body: nothing
//! is taken for it before the body has gone many times faster, so a body that always creeps is
//! never taken to stand.
//!
//! ```text
//! second     |v| ≤ v_max and |mean ω_k| ≤ min(m σ_bias, ω_max)
//! bias       mean ω over all seconds of a stand      variance    max(d²/T, spread/n) + s²/T²
//! ```

use nalgebra::Vector3;

use super::odometry_reading::OdometryReading;
use super::tuning::{
    STANDING_CONTRAST, STANDING_CREEP_M_S, STANDING_INTERVAL_S_MAX, STANDING_RATE_MAX_RAD_S,
    STANDING_RATE_SD, STANDING_RATE_SD_RAD_SQRT_S, STANDING_S_MAX, STANDING_SPEED_MAX_M_S,
    STANDING_TURN_SD_RAD, STANDING_WAY_MAX_M, STANDING_WINDOW_S,
};

/// What was read over some time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Read {
    /// Rotation \[rad\].
    pub(super) turned: Vector3<f64>,
    /// Length of the way \[m\].
    pub(super) went_m: f64,
    /// How long \[s\].
    pub(super) time_s: f64,
    /// Of that, how long a rotation was read that is not zero \[s\].
    pub(super) turning_s: f64,
}

/// What was read while a body seemed to stand.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Standing {
    /// In the second under way.
    pub(super) window: Read,
    /// In the whole seconds before it.
    pub(super) stood: Read,
    /// Their number, and the sum of the squares of their rates \[rad²/s²\].
    pub(super) windows: f64,
    pub(super) squares: Vector3<f64>,
    /// The way since \[m\].
    pub(super) since_m: f64,
}

/// The bias of a gyroscope about the axes about which it was read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MeasuredBias {
    pub(super) rate_rad_s: Vector3<f64>,
    /// Variance about each axis \[rad²/s²\]; infinite where none was read.
    pub(super) variance: Vector3<f64>,
}

impl Read {
    fn add(&mut self, next: &Self) {
        self.turned += next.turned;
        self.went_m += next.went_m;
        self.time_s += next.time_s;
        self.turning_s += next.turning_s;
    }

    fn halve(&mut self) {
        self.turned *= 0.5;
        self.went_m *= 0.5;
        self.time_s *= 0.5;
        self.turning_s *= 0.5;
    }
}

impl Standing {
    /// Takes in a motion that lasted so long, of odometry whose bias has this deviation; answers
    /// what has been read of the bias, once the body is seen to have stood.
    #[inline]
    pub(super) fn take_in(
        &mut self,
        reading: &OdometryReading,
        duration_s: f64,
        bias_sd_rad_s: f64,
    ) -> Option<MeasuredBias> {
        let length_m = reading.lengths.norm();
        if length_m <= STANDING_SPEED_MAX_M_S * duration_s {
            self.stay(reading, length_m, duration_s, bias_sd_rad_s);
            return None;
        }
        self.window = Read::default();
        if self.windows == 0.0 {
            return None;
        }
        let crept_m_s = (self.stood.went_m / self.stood.time_s).max(STANDING_CREEP_M_S);
        if duration_s > 0.0 && length_m >= STANDING_CONTRAST * crept_m_s * duration_s {
            return std::mem::take(self).measured();
        }
        self.since_m += length_m;
        if self.since_m > STANDING_WAY_MAX_M {
            *self = Self::default();
        }
        None
    }

    /// A motion that is next to none.
    fn stay(
        &mut self,
        reading: &OdometryReading,
        length_m: f64,
        duration_s: f64,
        bias_sd_rad_s: f64,
    ) {
        if duration_s > STANDING_INTERVAL_S_MAX {
            self.window = Read::default(); // motions may be missing
            return;
        }
        let is_turning = reading.angles != Vector3::zeros();
        self.window.add(&Read {
            turned: reading.angles,
            went_m: length_m,
            time_s: duration_s,
            turning_s: if is_turning { duration_s } else { 0.0 },
        });
        if self.window.time_s < STANDING_WINDOW_S {
            return;
        }
        let window = std::mem::take(&mut self.window);
        let rate = window.turned / window.time_s;
        let most = (STANDING_RATE_SD * bias_sd_rad_s).min(STANDING_RATE_MAX_RAD_S);
        if rate.iter().any(|rate| rate.abs() > most) {
            *self = Self::default(); // it turns
            return;
        }
        self.stood.add(&window);
        self.windows += 1.0;
        self.squares += rate.component_mul(&rate);
        self.since_m = 0.0;
        if self.stood.time_s > STANDING_S_MAX {
            // What was read lately counts for more.
            self.stood.halve();
            self.windows *= 0.5;
            self.squares *= 0.5;
        }
    }

    /// What a stand that is over says of the bias. Where mostly no rotation was read, as by wheels,
    /// it says nothing.
    fn measured(&self) -> Option<MeasuredBias> {
        let time_s = self.stood.time_s;
        if 2.0 * self.stood.turning_s < time_s {
            return None;
        }
        let rate_rad_s = self.stood.turned / time_s;
        let density = STANDING_RATE_SD_RAD_SQRT_S.powi(2) / time_s;
        let settled = (STANDING_TURN_SD_RAD / time_s).powi(2);
        let variance = self.squares.zip_map(&rate_rad_s, |square, rate| {
            if square == 0.0 {
                return f64::INFINITY;
            }
            let spread = (square / self.windows - rate * rate).max(0.0);
            density.max(spread / self.windows) + settled
        });
        Some(MeasuredBias {
            rate_rad_s,
            variance,
        })
    }
}

impl MeasuredBias {
    /// The axes about which it was read.
    pub(super) fn axes(&self) -> impl Iterator<Item = usize> + '_ {
        (0..3).filter(|&axis| self.variance[axis].is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::Motion;
    use nalgebra::UnitQuaternion;

    const STEP_S: f64 = 0.1;

    fn go(standing: &mut Standing, speed_m_s: f64, rate_rad_s: f64) -> Option<MeasuredBias> {
        let ahead = Vector3::new(speed_m_s * STEP_S, 0.0, 0.0);
        let turn = UnitQuaternion::new(Vector3::z() * (rate_rad_s * STEP_S));
        let motion = Motion::from_increment(ahead.into(), turn.coords.into(), None).unwrap();
        standing.take_in(&OdometryReading::new(&motion, STEP_S), STEP_S, 0.004)
    }

    /// What is read of the bias where a body stands for so many tenths of a second, reading such
    /// rates and drifting so fast, and then goes at a speed.
    fn read(
        tenths: u32,
        rate_rad_s: impl Fn(u32) -> f64,
        drift_m_s: f64,
        speed_m_s: f64,
    ) -> Option<MeasuredBias> {
        let mut standing = Standing::default();
        for k in 0..tenths {
            assert_eq!(go(&mut standing, drift_m_s, rate_rad_s(k)), None);
        }
        go(&mut standing, speed_m_s, 0.1)
    }

    #[test]
    fn a_standing_body_reads_its_bias_of_either_sign() {
        for rate in [0.006, -0.006] {
            for drift in [0.0, 0.008] {
                let bias = read(200, |_| rate, drift, 0.5).unwrap();
                assert!((bias.rate_rad_s.z - rate).abs() < 1e-12);
                assert_eq!(bias.axes().collect::<Vec<_>>(), [2]);
                assert!((0.001..0.0011).contains(&bias.variance.z.sqrt()));
            }
        }
    }

    /// Single readings may be far beyond any bias.
    #[test]
    fn a_noisy_gyroscope_reads_its_bias_as_well_as_its_noise_lets_it() {
        let noisy = |k: u32| 0.008 + 0.03 * (f64::from(k) * 2.399_963).sin();
        let bias = read(600, noisy, 0.0, 0.5).unwrap();
        let off = (bias.rate_rad_s.z - 0.008).abs();
        assert!(
            off < 3.0 * bias.variance.z.sqrt() && off < 0.001,
            "{bias:?}"
        );
    }

    #[test]
    fn who_creeps_or_turns_or_reads_no_turn_does_not_stand() {
        assert_eq!(read(200, |_| 0.006, 0.008, 0.1), None, "it creeps");
        assert_eq!(read(200, |_| 0.006, 0.0, 0.05), None, "it may creep");
        assert_eq!(read(200, |_| 0.006, 0.03, 3.0), None, "it goes");
        assert_eq!(read(200, |_| 0.03, 0.0, 0.5), None, "it turns");
        assert_eq!(read(200, |_| 0.0, 0.0, 0.5), None, "it reads nothing");
        let rarely = |k: u32| if k.is_multiple_of(10) { 0.01 } else { 0.0 };
        assert_eq!(
            read(200, rarely, 0.0, 0.5),
            None,
            "it reads next to nothing"
        );
        assert_eq!(read(5, |_| 0.006, 0.0, 0.5), None, "it hardly stopped");
        // Of a motion of no duration nobody knows how fast it was.
        let mut standing = Standing::default();
        for _ in 0..200 {
            assert_eq!(go(&mut standing, 0.0, 0.006), None);
        }
        let step = Motion::from_increment([0.5, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], None).unwrap();
        let step = OdometryReading::new(&step, 0.0);
        assert_eq!(standing.take_in(&step, 0.0, 0.004), None);
        // One turn among the seconds ends the stand before it.
        let once = |k: u32| if (100..120).contains(&k) { 0.2 } else { 0.006 };
        let bias = read(200, once, 0.0, 0.5).unwrap();
        assert!(bias.variance.z.sqrt() > 0.002, "{bias:?}");
    }

    #[test]
    fn a_short_stop_says_little() {
        let sd = |tenths| read(tenths, |_| 0.006, 0.0, 0.5).unwrap().variance.z.sqrt();
        assert!(sd(21) > 0.009 && sd(51) > 0.003 && sd(501) < 0.0006);
    }
}
