//! Head-direction cells.
#![expect(clippy::float_cmp, reason = "special values are exact")]

use std::f64::consts::PI;

use grid::heading::{heading_cells, heading_rad};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use proptest::prelude::*;

#[test]
fn heading_of_turns_about_the_vertical() {
    for yaw in [0.0, 0.1, -0.1, 1.5, -3.0, 3.0] {
        let orientation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw);
        assert!((heading_rad(&orientation) - yaw).abs() < 1e-15);
    }
    let backwards = UnitQuaternion::new_unchecked(Quaternion::new(0.0, 0.0, 0.0, 1.0));
    assert_eq!(heading_rad(&backwards), PI);
    let other_sign = UnitQuaternion::new_unchecked(Quaternion::new(0.0, 0.0, 0.0, -1.0));
    assert_eq!(heading_rad(&other_sign), PI);
}

#[test]
fn a_cell_fires_fully_at_its_preferred_heading_and_least_opposite() {
    let cells = heading_cells(PI / 2.0, 8);
    assert!((cells[2] - 1.0).abs() < 1e-15);
    assert!(
        cells
            .iter()
            .all(|activation| *activation >= cells[6] && *activation <= cells[2])
    );
    assert!((cells[1] - cells[3]).abs() < 1e-15);
}

proptest! {
    #[test]
    fn roll_does_not_turn_the_head(yaw in -3.1..3.1, pitch in -1.5..1.5, roll in -3.1..3.1) {
        let orientation = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
        prop_assert!((heading_rad(&orientation) - yaw).abs() < 1e-12);
    }

    #[test]
    fn the_population_tells_the_heading(heading in -3.1..3.1, cells in 8_usize..64) {
        let activations = heading_cells(heading, cells);
        let (mut x, mut y) = (0.0, 0.0);
        for (cell, activation) in activations.iter().enumerate() {
            let preferred = 2.0 * PI * cell as f64 / cells as f64;
            x += activation * preferred.cos();
            y += activation * preferred.sin();
        }
        prop_assert!((f64::atan2(y, x) - heading).abs() < 0.01);
    }
}
