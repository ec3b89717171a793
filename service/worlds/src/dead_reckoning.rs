//! Where a robot would believe itself from its motion alone: what any estimate has to beat.

use cognitive_map::{InvalidSample, Sample, SampleBody};
use nalgebra::Isometry3;

use crate::reading::{Reading, ReadingBody};
use trajectory::StampedPose;

/// A pose carried along by motion readings only.
#[derive(Clone, Debug)]
pub struct DeadReckoning {
    pose: Isometry3<f64>,
}

impl Default for DeadReckoning {
    fn default() -> Self {
        Self {
            pose: Isometry3::identity(),
        }
    }
}

impl From<Isometry3<f64>> for DeadReckoning {
    /// Begins at a pose.
    fn from(pose: Isometry3<f64>) -> Self {
        Self { pose }
    }
}

impl DeadReckoning {
    /// Takes in one reading: a velocity composes its exact screw motion, a start pose replaces the
    /// pose, anything else changes nothing. Answers with the pose when it was touched.
    ///
    /// # Errors
    /// The reading is one that the core refuses.
    pub fn apply(&mut self, reading: &Reading) -> Result<Option<StampedPose>, InvalidSample> {
        match Sample::try_from(reading)?.body {
            SampleBody::Motion(motion) => {
                self.pose *= motion.increment();
                // Rounding would otherwise stretch the quaternion over hours of motion.
                self.pose.rotation.renormalize();
            }
            SampleBody::StartPose(start) => self.pose = *start.pose(),
            _ => return Ok(None),
        }
        Ok(Some(StampedPose {
            stamp_ns: reading.stamp_ns,
            pose: self.pose,
        }))
    }

    /// The pose now.
    pub fn pose(&self) -> &Isometry3<f64> {
        &self.pose
    }
}

/// All poses of a stream: at each start pose and at the end of each velocity. A stream which opens
/// with a velocity starts in the identity pose, at the velocity's beginning.
///
/// # Errors
/// A reading is one that the core refuses.
pub fn dead_reckoned(readings: &[Reading]) -> Result<Vec<StampedPose>, InvalidSample> {
    let mut reckoning = DeadReckoning::default();
    let mut poses = Vec::with_capacity(readings.len() + 1);
    for reading in readings {
        if let (true, ReadingBody::Velocity { duration_s, .. }) = (poses.is_empty(), &reading.body)
        {
            #[expect(
                clippy::cast_possible_truncation,
                reason = "`as` saturates, and so do stamps"
            )]
            let duration_ns = (duration_s * 1e9).round() as i64;
            let stamp_ns = reading.stamp_ns.saturating_sub(duration_ns);
            poses.push(StampedPose {
                stamp_ns,
                pose: *reckoning.pose(),
            });
        }
        poses.extend(reckoning.apply(reading)?);
    }
    Ok(poses)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, TAU};

    use nalgebra::Vector3;

    use super::*;

    fn velocity(stamp_ns: i64, turn_rad_s: f64) -> Reading {
        let body = ReadingBody::Velocity {
            linear_m_s: [1.0, 0.0, 0.0],
            angular_rad_s: [0.0, 0.0, turn_rad_s],
            duration_s: 1.0,
            noise: None,
        };
        Reading { stamp_ns, body }
    }

    #[test]
    fn quarter_circles_close_in_either_sense() {
        for turn in [FRAC_PI_2, -FRAC_PI_2] {
            let stream: Vec<_> = (1..=4).map(|k| velocity(k * 1_000_000_000, turn)).collect();
            let poses = dead_reckoned(&stream).unwrap();
            assert_eq!(poses.len(), 5);
            assert_eq!(poses[0].stamp_ns, 0);
            let radius = 1.0 / turn; // to the right when negative
            let half_way = poses[2].pose.translation.vector;
            assert!((half_way - Vector3::new(0.0, 2.0 * radius, 0.0)).norm() < 1e-12);
            assert!(poses[4].pose.translation.vector.norm() < 1e-12);
            assert!((poses[4].pose.rotation.angle() % TAU).abs() < 1e-7);
        }
    }

    #[test]
    fn a_start_pose_moves_the_whole_path() {
        let start = ReadingBody::StartPose {
            translation_m: [5.0, 6.0, 0.0],
            rotation_xyzw: [0.0, 0.0, (FRAC_PI_2 / 2.0).sin(), (FRAC_PI_2 / 2.0).cos()],
        };
        let level = ReadingBody::Level {
            channel: "light".into(),
            value: 1.0,
        };
        let stream = [
            Reading {
                stamp_ns: 0,
                body: start,
            },
            Reading {
                stamp_ns: 1,
                body: level,
            },
            velocity(1_000_000_000, 0.0),
        ];
        let poses = dead_reckoned(&stream).unwrap();
        assert_eq!(poses.len(), 2);
        let end = poses[1].pose.translation.vector;
        assert!((end - Vector3::new(5.0, 7.0, 0.0)).norm() < 1e-12);
    }

    #[test]
    fn an_unusable_reading_is_an_error() {
        assert!(dead_reckoned(&[velocity(0, f64::NAN)]).is_err());
    }
}
