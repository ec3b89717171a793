//! What odometry makes of a true step.

use nalgebra::Vector3;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::walker::Step;
use crate::reading::{Reading, ReadingBody};

/// Over how many steps a bias is counted as if it were independent noise when a reading states
/// its noise. Errors of a bias add up with the number of steps, independent ones with its root; so
/// counted, the stated noise covers the bias for about 100 steps.
const BIAS_STEPS: f64 = 100.0;
/// Smallest deviation that a reading states along an axis \[m\]: a turn on the spot slips too.
const STATED_SD_M_MIN: f64 = 1e-4;
/// Smallest deviation that a reading states about an axis \[rad\].
const STATED_SD_RAD_MIN: f64 = 1e-5;

/// How bad odometry is, per step.
///
/// A true step of translation `t` and rotation `r` (body frame, screw coordinates) is read as
/// `(1 + s) t + ‖t‖ a n₁` and `r + b + c n₂`, with `n₁`, `n₂` fresh standard normal vectors in
/// every step, and `s` and the vector `b` drawn once per robot. The defaults are those of a modest
/// robot: after 100 m in 1000 steps about 0.16 m of random and 0.5 m of systematic error of
/// distance, and 0.13 rad of random and 0.1 rad of systematic error about each axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OdometryNoise {
    /// `a`: standard deviation along each axis, as a share of the step's length.
    pub translation_share: f64,
    /// Standard deviation from which a robot's constant scale error `s` is drawn.
    pub scale_bias: f64,
    /// `c`: standard deviation about each axis \[rad per step\].
    pub rotation_sd_rad: f64,
    /// Standard deviation from which each axis of a robot's constant `b` is drawn
    /// \[rad per step\].
    pub gyro_bias_rad: f64,
}

impl Default for OdometryNoise {
    fn default() -> Self {
        Self {
            translation_share: 0.05,
            scale_bias: 0.005,
            rotation_sd_rad: 0.004,
            gyro_bias_rad: 0.0001,
        }
    }
}

/// A deviation is negative or not finite.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("odometry noise must be finite and not negative")]
pub struct InvalidNoise;

impl OdometryNoise {
    /// Perfect odometry.
    pub fn none() -> Self {
        Self {
            translation_share: 0.0,
            scale_bias: 0.0,
            rotation_sd_rad: 0.0,
            gyro_bias_rad: 0.0,
        }
    }

    /// # Errors
    /// A deviation is negative, not finite or larger than one.
    pub fn check(&self) -> Result<(), InvalidNoise> {
        let all = [
            self.translation_share,
            self.scale_bias,
            self.rotation_sd_rad,
            self.gyro_bias_rad,
        ];
        if all.iter().all(|sd| (0.0..=1.0).contains(sd)) {
            Ok(())
        } else {
            Err(InvalidNoise)
        }
    }
}

/// The odometry of one robot.
#[derive(Clone, Debug)]
pub struct Odometer {
    noise: OdometryNoise,
    scale: f64,
    gyro_bias_rad: Vector3<f64>,
    random: ChaCha8Rng,
}

impl Odometer {
    /// Draws the robot's biases.
    ///
    /// # Errors
    /// A deviation is negative, not finite or larger than one.
    pub fn new(noise: OdometryNoise, mut random: ChaCha8Rng) -> Result<Self, InvalidNoise> {
        noise.check()?;
        let scale = 1.0 + noise.scale_bias * random.sample::<f64, _>(StandardNormal);
        let gyro_bias_rad = normal(&mut random) * noise.gyro_bias_rad;
        Ok(Self {
            noise,
            scale,
            gyro_bias_rad,
            random,
        })
    }

    /// Reads a true step which took `duration_s` and ended at the stamp, as a velocity.
    pub fn read(&mut self, step: &Step, stamp_ns: i64, duration_s: f64) -> Reading {
        let noise = &self.noise;
        let length_m = step.translation_m.norm();
        let slip = normal(&mut self.random) * (length_m * noise.translation_share);
        let jitter = normal(&mut self.random) * noise.rotation_sd_rad;
        let translation_m = step.translation_m * self.scale + slip;
        let rotation_rad = step.rotation_rad + self.gyro_bias_rad + jitter;
        let body = ReadingBody::Velocity {
            linear_m_s: (translation_m / duration_s).into(),
            angular_rad_s: (rotation_rad / duration_s).into(),
            duration_s,
            noise: Some(self.stated(length_m)),
        };
        Reading { stamp_ns, body }
    }

    /// The standard deviations that a reading states for a step of a length, along the axes \[m\]
    /// and about them \[rad\].
    fn stated(&self, length_m: f64) -> ([f64; 3], [f64; 3]) {
        let noise = &self.noise;
        let with_bias = |white: f64, bias: f64| white.hypot(bias * BIAS_STEPS.sqrt());
        let across = (length_m * noise.translation_share).max(STATED_SD_M_MIN);
        let along = length_m * with_bias(noise.translation_share, noise.scale_bias);
        let about = with_bias(noise.rotation_sd_rad, noise.gyro_bias_rad).max(STATED_SD_RAD_MIN);
        ([along.max(STATED_SD_M_MIN), across, across], [about; 3])
    }
}

/// Three independent standard normal numbers.
fn normal(random: &mut ChaCha8Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| random.sample(StandardNormal))
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    const STEP: Step = Step {
        translation_m: Vector3::new(0.1, 0.0, 0.0),
        rotation_rad: Vector3::new(0.0, -0.2, 0.1),
    };

    /// The displacement which a reading tells: translation \[m\] and rotation \[rad\].
    fn told(reading: &Reading) -> (Vector3<f64>, Vector3<f64>) {
        let ReadingBody::Velocity {
            linear_m_s,
            angular_rad_s,
            duration_s,
            ..
        } = &reading.body
        else {
            panic!("not a velocity")
        };
        let scaled = |v: &[f64; 3]| Vector3::from(*v) * *duration_s;
        (scaled(linear_m_s), scaled(angular_rad_s))
    }

    /// Mean and standard deviation of each component.
    fn statistics(values: &[Vector3<f64>]) -> (Vector3<f64>, Vector3<f64>) {
        let n = values.len() as f64;
        let mean = values.iter().sum::<Vector3<f64>>() / n;
        let squares: Vector3<f64> = values.iter().map(|v| (v - mean).map(|x| x * x)).sum();
        (mean, (squares / n).map(f64::sqrt))
    }

    #[test]
    fn white_noise_has_the_stated_size_about_the_biased_mean() {
        let noise = OdometryNoise::default();
        let mut odometer = Odometer::new(noise, ChaCha8Rng::seed_from_u64(4)).unwrap();
        let n = 40_000;
        let (translations, rotations): (Vec<_>, Vec<_>) =
            (0..n).map(|k| told(&odometer.read(&STEP, k, 0.1))).unzip();
        // Five standard errors of a mean and of a deviation over n draws.
        let of_mean = 5.0 / f64::from(u32::try_from(n).unwrap()).sqrt();
        let (mean, sd) = statistics(&translations);
        let expected_sd = 0.1 * noise.translation_share;
        let expected = STEP.translation_m * odometer.scale;
        assert!((mean - expected).amax() < of_mean * expected_sd);
        assert!(
            (sd / expected_sd)
                .iter()
                .all(|ratio| (ratio - 1.0).abs() < of_mean)
        );
        let (mean, sd) = statistics(&rotations);
        let expected = STEP.rotation_rad + odometer.gyro_bias_rad;
        assert!((mean - expected).amax() < of_mean * noise.rotation_sd_rad);
        assert!(
            (sd / noise.rotation_sd_rad)
                .iter()
                .all(|ratio| (ratio - 1.0).abs() < of_mean)
        );
    }

    #[test]
    fn biases_spread_over_robots_as_stated() {
        let noise = OdometryNoise {
            translation_share: 0.0,
            rotation_sd_rad: 0.0,
            scale_bias: 0.02,
            gyro_bias_rad: 0.003,
        };
        let (translations, rotations): (Vec<_>, Vec<_>) = (0..10_000)
            .map(|seed| {
                let random = ChaCha8Rng::seed_from_u64(seed);
                told(&Odometer::new(noise, random).unwrap().read(&STEP, 0, 0.1))
            })
            .unzip();
        let (mean, sd) = statistics(&translations);
        assert!((mean - STEP.translation_m).amax() < 1e-4);
        assert!((sd.x / 0.002 - 1.0).abs() < 0.05 && sd.y < 1e-15);
        let (mean, sd) = statistics(&rotations);
        assert!((mean - STEP.rotation_rad).amax() < 1.5e-4);
        assert!((sd / 0.003).iter().all(|ratio| (ratio - 1.0).abs() < 0.05));
    }

    #[test]
    fn perfect_odometry_tells_the_step() {
        let mut odometer =
            Odometer::new(OdometryNoise::none(), ChaCha8Rng::seed_from_u64(1)).unwrap();
        let (translation, rotation) = told(&odometer.read(&STEP, 0, 0.1));
        assert!((translation - STEP.translation_m).amax() < 1e-15);
        assert!((rotation - STEP.rotation_rad).amax() < 1e-15);
    }

    #[test]
    fn senseless_noise_is_refused() {
        for bad in [-0.1, f64::NAN, f64::INFINITY] {
            let noise = OdometryNoise {
                gyro_bias_rad: bad,
                ..OdometryNoise::default()
            };
            assert_eq!(
                Odometer::new(noise, ChaCha8Rng::seed_from_u64(1)).err(),
                Some(InvalidNoise)
            );
        }
    }
}
