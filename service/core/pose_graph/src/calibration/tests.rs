use std::f64::consts::PI;

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
        let linear_m = Vector3::new(length_m, 0.1, 0.0);
        let exposure = Exposure {
            moving_s: duration_s,
            turned_rad: Vector3::new(0.0, 0.0, angle_rad),
        };
        let read = Reading {
            linear_m,
            angular_rad: exposure.turned_rad,
            turned_rad: exposure.turned_rad,
            moving_s: duration_s,
        };
        let again = Reading::corrected_to(&read.motion(&by), &by, &exposure, 0.1);
        let off = |by: &Calibration| se3::twist(&read.motion(by).inv_mul(&again.motion(by))).norm();
        prop_assert!(off(&by) < 1e-9);
        // What goes on beyond half a turn has another even motion.
        let (_, turned) = read.corrected(&by);
        prop_assert!(turned.norm() > PI || off(&Calibration::default()) < 1e-9);
    }
}
