use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::Vector3;
use proptest::prelude::*;

use super::*;

fn calibration() -> impl Strategy<Value = Calibration> {
    let errors = [-0.3..0.3f64, -0.3..0.3, -0.1..0.1, -0.01..0.01];
    errors.prop_map(|[length, angle, veer_rad_m, bias]| Calibration {
        length,
        angle,
        veer_rad_m,
        bias_rad_s: Vector3::new(0.0, 0.0, bias),
    })
}

proptest! {
    /// What was read is found again in what it was corrected to, also of turns that come out as
    /// more than half a turn to the other side.
    #[test]
    fn a_reading_is_found_again(
        length_m in -2.0..2.0f64,
        angle_rad in -PI..PI,
        by in calibration(),
        duration_s in 0.0..10.0f64,
    ) {
        let read = Reading {
            linear_m: Vector3::new(length_m, 0.1, 0.0),
            angular_rad: Vector3::new(0.0, 0.0, angle_rad),
            moving_s: duration_s,
        };
        let again = Reading::corrected_to(&read.motion(&by), &by, duration_s, 0.1);
        let off = |by: &Calibration| se3::twist(&read.motion(by).inv_mul(&again.motion(by))).norm();
        prop_assert!(off(&by) < 1e-9);
        // What goes on beyond half a turn has another even motion.
        let (_, turned) = read.corrected(&by);
        prop_assert!(turned.norm() > PI || off(&Calibration::default()) < 1e-9);
    }

    /// The part that counts has the sign of the rotation, is no more than it, and hardly differs
    /// where rotations hardly do.
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
