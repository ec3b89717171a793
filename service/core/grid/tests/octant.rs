//! Algorithm 1 against an independent implementation; octants, displacement and turning angle.
#![expect(clippy::float_cmp, reason = "special values are exact")]

use std::f64::consts::{FRAC_PI_2, PI};

use grid::octant::{displacement_m, octant_activation, octant_of, turning_angle_rad};
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;

/// Written by `golden/octant.py`.
const GOLDEN: &str = include_str!("golden/octant.csv");

#[test]
fn algorithm_1_agrees_with_the_independent_implementation() {
    let mut rows = 0;
    for line in GOLDEN.lines() {
        let row: Vec<f64> = line
            .split(',')
            .map(|field| field.parse().unwrap())
            .collect();
        let position = Point3::new(row[0], row[1], row[2]);
        let size = Vector3::new(row[3], row[4], row[5]);
        let result = octant_activation(&position, &size, row[6], row[7]);
        let index = result.index.map(|index| index as f64);
        assert_eq!(index, [row[8], row[9], row[10]], "{line}");
        assert!(
            (result.activation - row[11]).abs() < 1e-14,
            "{line}: {}",
            result.activation
        );
        rows += 1;
    }
    assert_eq!(rows, 416);
}

#[test]
fn centres_are_half_a_cell_from_the_grid_point_in_the_order_of_the_loops() {
    let result = octant_activation(
        &Point3::new(2.1, 2.1, 2.1),
        &Vector3::new(1.0, 2.0, 4.0),
        1.0,
        9.0,
    );
    assert_eq!(result.index, [2, 1, 0]);
    assert_eq!(result.centres[0], Point3::new(1.5, 1.0, -2.0));
    assert_eq!(result.centres[1], Point3::new(1.5, 1.0, 2.0));
    assert_eq!(result.centres[2], Point3::new(1.5, 3.0, -2.0));
    assert_eq!(result.centres[7], Point3::new(2.5, 3.0, 2.0));
}

#[test]
fn beyond_the_cutoff_nothing_fires() {
    let size = Vector3::repeat(1.0);
    let position = Point3::new(0.0, 1.0, 0.0);
    let nearest_m = displacement_m(&position, &Point3::new(0.5, 0.5, 0.5));
    assert_eq!(
        octant_activation(&position, &size, 1.0, nearest_m).activation,
        0.0
    );
    assert!(octant_activation(&position, &size, 1.0, nearest_m + 1e-9).activation > 0.0);
}

#[test]
fn octants_are_numbered_as_the_seed_lists_them_and_zero_counts_as_plus() {
    let signs = [
        (1.0, 1.0, 1.0),
        (-1.0, 1.0, 1.0),
        (-1.0, -1.0, 1.0),
        (1.0, -1.0, 1.0),
        (1.0, 1.0, -1.0),
        (-1.0, 1.0, -1.0),
        (-1.0, -1.0, -1.0),
        (1.0, -1.0, -1.0),
    ];
    for (octant, (x, y, z)) in (1..).zip(signs) {
        assert_eq!(octant_of(&Vector3::new(x, y, z)), octant);
    }
    assert_eq!(octant_of(&Vector3::zeros()), 1);
    assert_eq!(octant_of(&-Vector3::zeros()), 1);
    assert_eq!(octant_of(&Vector3::new(0.0, -2.0, 0.0)), 4);
}

#[test]
fn turning_angles_of_special_movements() {
    let x = Vector3::x();
    assert_eq!(turning_angle_rad(&x, &(x * 3.0)), 0.0);
    assert_eq!(turning_angle_rad(&x, &(x * -2.0)), PI);
    assert_eq!(turning_angle_rad(&x, &Vector3::y()), FRAC_PI_2);
    assert_eq!(turning_angle_rad(&x, &Vector3::zeros()), 0.0);
    assert_eq!(turning_angle_rad(&Vector3::zeros(), &x), 0.0);
    // The arccos of Eq. 3 would give 0 here.
    let slight = turning_angle_rad(&x, &Vector3::new(1.0, 1e-9, 0.0));
    assert!((slight - 1e-9).abs() < 1e-20);
}

fn vector() -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-10.0..10.0).prop_map(Vector3::from)
}

proptest! {
    #[test]
    fn turning_angle_is_the_arccos_of_equation_3(before in vector(), after in vector()) {
        prop_assume!(before.norm() > 0.1 && after.norm() > 0.1);
        let cosine = before.dot(&after) / (before.norm() * after.norm());
        prop_assume!(cosine.abs() < 0.999);
        let angle = turning_angle_rad(&before, &after);
        prop_assert!((angle - cosine.acos()).abs() < 1e-12);
        prop_assert!((turning_angle_rad(&after, &before) - angle).abs() < 1e-15);
    }

    #[test]
    fn activation_is_that_of_the_nearest_odd_half(position in vector(), size in vector()) {
        let size = size.abs().add_scalar(0.1);
        let nearest = position.zip_map(&size, |x, size| ((x / size).floor() + 0.5) * size);
        let expected = (-(position - nearest).norm_squared() / (2.0 * 0.16)).exp();
        let result = octant_activation(&position.into(), &size, 0.4, f64::INFINITY);
        prop_assert!((result.activation - expected).abs() < 1e-12);
    }

    #[test]
    fn activation_repeats_with_the_lattice(
        position in vector(),
        cells in prop::array::uniform3(-5_i32..5),
    ) {
        // A power of two as size, so that shifting is exact and no rounding changes an index.
        let size = Vector3::new(0.5, 1.0, 2.0);
        let position = position.map(|x| (x * 1024.0).round() / 1024.0);
        let shifted = position + Vector3::from(cells.map(f64::from)).component_mul(&size);
        let here = octant_activation(&position.into(), &size, 0.4, 1.0);
        let there = octant_activation(&shifted.into(), &size, 0.4, 1.0);
        // ROUND sends halves away from zero, so exactly between two planes the sides differ.
        prop_assume!((position.x / size.x).fract().abs() != 0.5);
        prop_assert!((here.activation - there.activation).abs() < 1e-12);
        prop_assert_eq!(there.index, [0, 1, 2].map(|k| here.index[k] + i64::from(cells[k])));
    }
}
