//! What one robot recorded.

use std::f64::consts::{PI, TAU};

use nalgebra::{Isometry3, Vector3};

use trajectory::{StampedPose, Trajectory, fraction};

/// A velocity command; it holds until the next one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command {
    /// From when \[ns\].
    pub stamp_ns: i64,
    /// Forward velocity \[m/s\].
    pub forward_m_s: f64,
    /// Angular velocity, left positive \[rad/s\].
    pub turn_rad_s: f64,
}

/// A subject seen by a robot's camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement {
    /// When \[ns\].
    pub stamp_ns: i64,
    /// Subject number: 1 to 5 robots, from 6 on landmarks.
    pub subject: u32,
    /// Distance \[m\].
    pub range_m: f64,
    /// Direction, left positive \[rad\].
    pub bearing_rad: f64,
}

/// A true pose in the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarPose {
    /// When \[ns\].
    pub stamp_ns: i64,
    /// Position \[m\].
    pub x_m: f64,
    /// Position \[m\].
    pub y_m: f64,
    /// Heading, from x to y \[rad\].
    pub heading_rad: f64,
}

impl PlanarPose {
    /// The same pose in space: at z = 0, rotation `[0, 0, sin(θ/2), cos(θ/2)]`.
    pub fn in_space(&self) -> StampedPose {
        let turn = Vector3::new(0.0, 0.0, self.heading_rad);
        let pose = Isometry3::new(Vector3::new(self.x_m, self.y_m, 0.0), turn);
        StampedPose {
            stamp_ns: self.stamp_ns,
            pose,
        }
    }
}

/// What one robot recorded, each table in order of time.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotLog {
    pub(super) odometry: Vec<Command>,
    pub(super) measurements: Vec<Measurement>,
    pub(super) truth: Vec<PlanarPose>,
}

impl RobotLog {
    /// Odometry, at least one row.
    pub fn odometry(&self) -> &[Command] {
        &self.odometry
    }

    /// Sightings of known subjects.
    pub fn measurements(&self) -> &[Measurement] {
        &self.measurements
    }

    /// Motion-capture truth, at least one row.
    pub fn truth(&self) -> &[PlanarPose] {
        &self.truth
    }

    /// The true positions.
    ///
    /// # Panics
    /// Never: the reader has seen to it that the truth has rows and its numbers are finite.
    pub fn truth_trajectory(&self) -> Trajectory {
        let poses: Vec<StampedPose> = self.truth.iter().map(PlanarPose::in_space).collect();
        Trajectory::from_poses(&poses).expect("the truth has rows, and its numbers are finite")
    }

    /// The true pose at an instant, linearly interpolated, the heading on the shorter way round;
    /// `None` outside the recorded truth.
    pub fn truth_at(&self, stamp_ns: i64) -> Option<PlanarPose> {
        let after = self.truth.partition_point(|pose| pose.stamp_ns <= stamp_ns);
        let before = self.truth.get(after.checked_sub(1)?)?;
        if before.stamp_ns == stamp_ns {
            return Some(*before);
        }
        let next = self.truth.get(after)?;
        let share = fraction(before.stamp_ns, next.stamp_ns, stamp_ns);
        let mut turn = next.heading_rad - before.heading_rad;
        if turn.abs() > PI {
            turn = (turn + PI).rem_euclid(TAU) - PI;
        }
        Some(PlanarPose {
            stamp_ns,
            x_m: before.x_m + share * (next.x_m - before.x_m),
            y_m: before.y_m + share * (next.y_m - before.y_m),
            heading_rad: before.heading_rad + share * turn,
        })
    }
}
