//! A motion as odometry read it.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::calibration::Calibration;
use crate::input::Motion;
use geometry::se3;
use pose_graph::scaled_angles;

/// A motion as odometry read it.
pub(super) struct OdometryReading {
    rotation: UnitQuaternion<f64>,
    /// Translation \[m\].
    pub(super) lengths: Vector3<f64>,
    /// Rotation vector \[rad\].
    pub(super) angles: Vector3<f64>,
    /// The axes about which odometry has a bias, as ones: none at rest, and in the plane z alone.
    pub(super) free: Vector3<f64>,
    duration_s: f64,
    /// How long it turned about each free axis \[s\].
    pub(super) time_s: Vector3<f64>,
}

impl OdometryReading {
    #[inline]
    pub(super) fn new(motion: &Motion, duration_s: f64) -> Self {
        let read = motion.increment();
        let lengths = read.translation.vector;
        let angles = rotation_vector(&read.rotation);
        let mut reading = Self {
            rotation: read.rotation,
            lengths,
            angles,
            free: Vector3::repeat(1.0),
            duration_s,
            time_s: Vector3::zeros(),
        };
        if reading.is_rest() {
            reading.free = Vector3::zeros();
        } else if reading.is_planar() {
            reading.free = Vector3::z();
        }
        reading.time_s = reading.free * duration_s;
        reading
    }

    #[inline]
    fn is_rest(&self) -> bool {
        self.lengths == Vector3::zeros() && self.angles == Vector3::zeros()
    }

    #[inline]
    pub(super) fn is_planar(&self) -> bool {
        self.lengths.z == 0.0 && self.angles.x == 0.0 && self.angles.y == 0.0
    }

    /// How long it moved \[s\].
    #[inline]
    pub(super) fn moving_s(&self) -> f64 {
        if self.is_rest() { 0.0 } else { self.duration_s }
    }

    /// The motion without the lasting errors of odometry.
    #[inline]
    pub(super) fn corrected_by(&self, calibration: &Calibration) -> Isometry3<f64> {
        let by_bias = self.time_s.component_mul(&calibration.bias_rad_s);
        let veered = Vector3::z() * (calibration.veer_rad_m * self.lengths.norm());
        let correction = veered - (scaled_angles(&self.angles) * calibration.angle + by_bias);
        let rotation = self.rotation * UnitQuaternion::from_scaled_axis(correction);
        let lengths = self.lengths * (1.0 - calibration.length);
        Isometry3::from_parts(lengths.into(), rotation)
    }
}

/// Axis times angle, exactly zero for no rotation and exactly along z for one about z.
fn rotation_vector(rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
    se3::log(&Isometry3::from_parts(Vector3::zeros().into(), *rotation)).1
}
