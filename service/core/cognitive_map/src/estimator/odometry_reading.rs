//! A motion as odometry read it.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::calibration::Calibration;
use crate::input::Motion;
use geometry::se3;

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

    /// The part of its rotation that an error of angles counts for \[rad\].
    #[inline]
    pub(super) fn scaled_angles(&self) -> Vector3<f64> {
        scaled_angles(&self.angles)
    }

    /// The motion without the lasting errors of odometry.
    #[inline]
    pub(super) fn corrected_by(&self, calibration: &Calibration) -> Isometry3<f64> {
        let by_bias = self.time_s.component_mul(&calibration.bias_rad_s);
        let veered = Vector3::z() * (calibration.veer_rad_m * self.lengths.norm());
        let correction = veered - (self.scaled_angles() * calibration.angle + by_bias);
        let rotation = self.rotation * UnitQuaternion::from_scaled_axis(correction);
        let lengths = self.lengths * (1.0 - calibration.length);
        Isometry3::from_parts(lengths.into(), rotation)
    }
}

/// Axis times angle, exactly zero for no rotation and exactly along z for one about z.
fn rotation_vector(rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
    se3::log(&Isometry3::from_parts(Vector3::zeros().into(), *rotation)).1
}

/// The part of the rotation vector of one step that a relative error of angles counts for \[rad\]:
/// all of it up to a quarter turn, and beyond that less again, down to nothing of half a turn. That
/// one reads the same to the left and to the right, so that nobody knows which way it was misread.
///
/// ```text
/// f(ω) = ω                   |ω| ≤ π/2
///        (π − |ω|) ω / |ω|   beyond
/// ```
#[inline]
fn scaled_angles(read_rad: &Vector3<f64>) -> Vector3<f64> {
    let squared = read_rad.norm_squared();
    if squared <= FRAC_PI_2 * FRAC_PI_2 {
        return *read_rad;
    }
    let angle_rad = squared.sqrt();
    read_rad * ((PI - angle_rad) / angle_rad)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// The part that counts has the sign of the rotation, is no more than it, and hardly
        /// differs where rotations hardly do.
        #[test]
        fn what_counts_of_an_angle_is_even(angle_rad in -PI..PI, more_rad in 0.0..0.1f64) {
            let counted = |angle_rad: f64| scaled_angles(&Vector3::new(0.0, angle_rad, 0.0)).y;
            let counts = counted(angle_rad);
            prop_assert!(counts * angle_rad >= 0.0);
            prop_assert!(counts.abs() <= angle_rad.abs().min(FRAC_PI_2) + 1e-12);
            prop_assert!((counts + counted(-angle_rad)).abs() < 1e-12);
            let beyond = angle_rad + more_rad;
            let wrapped = if beyond > PI { beyond - 2.0 * PI } else { beyond };
            prop_assert!((counted(wrapped) - counts).abs() <= more_rad + 1e-9);
        }
    }

    #[test]
    fn a_small_angle_counts_in_full_and_half_a_turn_not_at_all() {
        for angle_rad in [0.0, 1e-9, -0.3, FRAC_PI_2, -FRAC_PI_2] {
            let read = Vector3::new(0.0, 0.0, angle_rad);
            assert_eq!(scaled_angles(&read), read);
        }
        for angle_rad in [PI, -PI] {
            assert!(scaled_angles(&Vector3::new(0.0, 0.0, angle_rad)).norm() < 1e-12);
        }
    }
}
