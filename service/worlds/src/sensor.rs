//! What a robot sees of beacons and of other robots.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::{Isometry3, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::obstacle::ObstacleWorld;
use crate::reading::{ReadingBody, ReadingTarget};

/// A sensor of range and bearing which looks to every side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensor {
    /// How far it sees \[m\].
    pub range_max_m: f64,
    /// With what probability a visible target is reported at a tick.
    pub report_probability: f64,
    /// Standard deviation of the range \[m\].
    pub range_sd_m: f64,
    /// Standard deviation of azimuth and elevation \[rad\].
    pub bearing_sd_rad: f64,
}

impl Default for Sensor {
    fn default() -> Self {
        Self {
            range_max_m: 5.0,
            report_probability: 0.1,
            range_sd_m: 0.05,
            bearing_sd_rad: 0.02,
        }
    }
}

/// A sensor's range, probability or noise makes no sense.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a sensor needs a finite range and noise from zero on and a probability from 0 to 1")]
pub struct InvalidSensor;

impl Sensor {
    /// # Errors
    /// A number is negative, not finite, or a probability above one.
    pub(super) fn check(&self) -> Result<(), InvalidSensor> {
        let lengths = [self.range_max_m, self.range_sd_m, self.bearing_sd_rad];
        let sound = lengths.iter().all(|x| x.is_finite() && *x >= 0.0);
        let probable = (0.0..=1.0).contains(&self.report_probability);
        if sound && probable {
            Ok(())
        } else {
            Err(InvalidSensor)
        }
    }

    /// A sighting of a target from a true pose, if the target is near enough, not hidden by a
    /// cube, and reported this time.
    pub(super) fn look(
        &self,
        world: &ObstacleWorld,
        pose: &Isometry3<f64>,
        target: impl FnOnce() -> ReadingTarget,
        target_m: &Vector3<f64>,
        random: &mut ChaCha8Rng,
    ) -> Option<ReadingBody> {
        let eye = pose.translation.vector;
        let range_m = (target_m - eye).norm();
        let in_reach = range_m <= self.range_max_m && range_m > 0.0;
        if !in_reach || !world.sees(&eye, target_m) || !random.random_bool(self.report_probability)
        {
            return None;
        }
        Some(self.read(pose, target(), target_m, random))
    }

    /// What is read of a target from a true pose, noise and all, wherever it is.
    pub fn read(
        &self,
        pose: &Isometry3<f64>,
        target: ReadingTarget,
        target_m: &Vector3<f64>,
        random: &mut ChaCha8Rng,
    ) -> ReadingBody {
        let line = target_m - pose.translation.vector;
        let seen = pose.rotation.inverse() * line;
        let mut noisy = |value: f64, sd: f64| value + sd * random.sample::<f64, _>(StandardNormal);
        let range_m = noisy(line.norm(), self.range_sd_m).max(0.0);
        let azimuth = noisy(seen.y.atan2(seen.x), self.bearing_sd_rad);
        let elevation = noisy(seen.z.atan2(seen.x.hypot(seen.y)), self.bearing_sd_rad);
        let (azimuth_rad, elevation_rad) = folded(azimuth, elevation);
        ReadingBody::Sighting {
            target,
            range_m,
            azimuth_rad,
            elevation_rad,
            range_sd_m: self.range_sd_m,
            bearing_sd_rad: self.bearing_sd_rad,
        }
    }
}

/// The same direction with azimuth in ±π and elevation in ±π/2: noise may carry a direction over
/// the pole or round the back.
fn folded(azimuth_rad: f64, elevation_rad: f64) -> (f64, f64) {
    let elevation = (elevation_rad + PI).rem_euclid(TAU) - PI;
    let (azimuth, elevation) = if elevation.abs() > FRAC_PI_2 {
        (azimuth_rad + PI, elevation.signum() * PI - elevation)
    } else {
        (azimuth_rad, elevation)
    };
    ((azimuth + PI).rem_euclid(TAU) - PI, elevation)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use rand::SeedableRng;

    use super::*;

    fn direction(azimuth: f64, elevation: f64) -> Vector3<f64> {
        let (sin, cos) = azimuth.sin_cos();
        Vector3::new(
            cos * elevation.cos(),
            sin * elevation.cos(),
            elevation.sin(),
        )
    }

    proptest! {
        #[test]
        fn folding_keeps_the_direction(azimuth in -9.0..9.0_f64, elevation in -9.0..9.0_f64) {
            let (a, e) = folded(azimuth, elevation);
            prop_assert!(a.abs() <= PI && e.abs() <= FRAC_PI_2 + 1e-12);
            prop_assert!((direction(a, e) - direction(azimuth, elevation)).norm() < 1e-9);
        }

        #[test]
        fn an_exact_sighting_points_at_its_target(
            turn in prop::array::uniform3(-2.0..2.0_f64),
            offset in prop::array::uniform3(-0.5..0.5_f64),
        ) {
            let world = ObstacleWorld::new(1);
            let eye = world.centre_m(); // 1 m around it is free
            let pose = Isometry3::new(eye, Vector3::from(turn));
            let target = eye + Vector3::from(offset);
            let sensor =
                Sensor {
                    report_probability: 1.0,
                    range_sd_m: 0.0,
                    bearing_sd_rad: 0.0,
                    ..Sensor::default()
                };
            let mut random = ChaCha8Rng::seed_from_u64(1);
            let seen = sensor
                .look(&world, &pose, || ReadingTarget::Robot("a".into()), &target, &mut random)
                .unwrap();
            let ReadingBody::Sighting { range_m, azimuth_rad, elevation_rad, .. } = seen else {
                panic!("not a sighting")
            };
            let seen = direction(azimuth_rad, elevation_rad) * range_m;
            let found = pose * nalgebra::Point3::from(seen);
            prop_assert!((found.coords - target).norm() < 1e-9);
        }
    }

    #[test]
    fn reports_come_as_often_and_as_noisy_as_stated() {
        let world = ObstacleWorld::new(1);
        let pose = Isometry3::translation(7.5, 7.5, 7.5);
        let target = Vector3::new(8.0, 7.5, 7.5);
        let mut random = ChaCha8Rng::seed_from_u64(2);
        let sensor = Sensor::default();
        let mut look = |at: &Vector3<f64>| {
            sensor.look(
                &world,
                &pose,
                || ReadingTarget::Robot("a".into()),
                at,
                &mut random,
            )
        };
        let errors: Vec<Vector3<f64>> = (0..100_000)
            .filter_map(|_| match look(&target)? {
                ReadingBody::Sighting {
                    range_m,
                    azimuth_rad,
                    elevation_rad,
                    ..
                } => Some(Vector3::new(range_m - 0.5, azimuth_rad, elevation_rad)),
                _ => None,
            })
            .collect();
        assert!((9_500..10_500).contains(&errors.len()));
        let squares: Vector3<f64> = errors.iter().map(|e| e.component_mul(e)).sum();
        let sd = (squares / errors.len() as f64).map(f64::sqrt);
        assert!(
            sd.component_div(&Vector3::new(0.05, 0.02, 0.02))
                .add_scalar(-1.0)
                .amax()
                < 0.04
        );
        assert!(
            (0..1000).all(|_| look(&Vector3::new(7.5, 7.5, 13.0)).is_none()),
            "5.5 m away"
        );
    }
}
