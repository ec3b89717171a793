//! Pose covariance: the 6×6 formula, and sampled poses as the oracle.
#![expect(clippy::float_cmp, reason = "special values are exact")]

use geometry::{PoseCovariance, se3, upper_triangle};
use nalgebra::{Isometry3, Matrix6, SymmetricEigen, UnitQuaternion, Vector3, Vector6};
use proptest::prelude::*;
use random::Seeded;

fn vector(range: f64) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-range..range).prop_map(Vector3::from)
}

fn motion() -> impl Strategy<Value = Isometry3<f64>> {
    (vector(3.0), vector(3.0)).prop_map(|(linear, angular)| se3::exp(&linear, &angular))
}

fn deviations() -> impl Strategy<Value = Vector6<f64>> {
    prop::array::uniform6(0.0..0.5).prop_map(Vector6::from)
}

/// A covariance with correlations in every block.
fn covariance() -> impl Strategy<Value = PoseCovariance> {
    (deviations(), motion(), deviations()).prop_map(|(start, motion, noise)| {
        PoseCovariance::from_sd(&start).after_motion(&motion, &noise)
    })
}

/// The error of one noisy pose: `exp` of normal numbers with these deviations.
fn disturbance(random: &mut Seeded, sd: &Vector6<f64>) -> Isometry3<f64> {
    let xi = sd.map(|sd| sd * random.normal());
    se3::exp(
        &Vector3::new(xi[0], xi[1], xi[2]),
        &Vector3::new(xi[3], xi[4], xi[5]),
    )
}

/// The right perturbation that leads from one pose to another.
fn perturbation(from: &Isometry3<f64>, to: &Isometry3<f64>) -> Vector6<f64> {
    let (linear, angular) = se3::log(&(from.inverse() * to));
    Vector6::new(
        linear.x, linear.y, linear.z, angular.x, angular.y, angular.z,
    )
}

#[test]
fn sampled_trajectories_scatter_as_the_covariance_says() {
    let start_sd = Vector6::new(0.02, 0.01, 0.03, 0.01, 0.02, 0.005);
    let step_sd = Vector6::new(0.01, 0.02, 0.005, 0.004, 0.008, 0.01);
    let steps = [
        se3::exp(&Vector3::new(1.0, 0.2, -0.3), &Vector3::new(0.3, -0.2, 2.8)),
        se3::exp(&Vector3::new(-0.5, 2.0, 0.4), &Vector3::new(-2.0, 1.0, 0.1)),
        se3::exp(&Vector3::new(0.3, -0.1, 1.5), &Vector3::new(0.0, 3.1, 0.0)),
    ];
    let start = se3::exp(
        &Vector3::new(10.0, -5.0, 2.0),
        &Vector3::new(0.5, 1.0, -2.0),
    );
    let mut expected = PoseCovariance::from_sd(&start_sd);
    let mut mean = start;
    for step in &steps {
        expected = expected.after_motion(step, &step_sd);
        mean *= step;
    }

    let mut random = Seeded(7);
    let samples = 40_000;
    let mut scatter = Matrix6::zeros();
    let mut in_map = Matrix6::zeros();
    for _ in 0..samples {
        let mut pose = start * disturbance(&mut random, &start_sd);
        for step in &steps {
            pose = pose * step * disturbance(&mut random, &step_sd);
        }
        let error = perturbation(&mean, &pose);
        scatter += error * error.transpose() / f64::from(samples);
        // About map axes: where the body is, and by what turn in map it is off.
        let away = pose.translation.vector - mean.translation.vector;
        let turn = (pose.rotation * mean.rotation.inverse()).scaled_axis();
        let error = Vector6::new(away.x, away.y, away.z, turn.x, turn.y, turn.z);
        in_map += error * error.transpose() / f64::from(samples);
    }
    // Each entry is compared on the scale of its row's and column's deviations. Sampling leaves
    // about 1/√40000 = 0.005, and what first order leaves out is of the order of the angles'
    // variance.
    let compare = |expected: &Matrix6<f64>, scatter: &Matrix6<f64>| {
        for row in 0..6 {
            for column in 0..6 {
                let scale = (expected[(row, row)] * expected[(column, column)]).sqrt();
                let error = (expected[(row, column)] - scatter[(row, column)]).abs() / scale;
                assert!(error < 0.03, "({row}, {column}): {error}");
            }
        }
    };
    compare(expected.matrix(), &scatter);
    compare(&expected.in_map_axes(&mean.rotation), &in_map);
}

#[test]
fn no_motion_and_no_noise_change_nothing() {
    let covariance = PoseCovariance::from_sd(&Vector6::new(1.0, 2.0, 3.0, 0.1, 0.2, 0.3));
    assert_eq!(
        covariance.after_motion(&Isometry3::identity(), &Vector6::zeros()),
        covariance
    );
    assert_eq!(PoseCovariance::zero().position_sd_m(), 0.0);
}

#[test]
fn a_turning_error_swings_a_long_lever() {
    // One milliradian of yaw, then a kilometre ahead: a metre to the side.
    let mut covariance = PoseCovariance::zero();
    covariance.inflate(&Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 1e-3));
    let ahead = Isometry3::translation(1000.0, 0.0, 0.0);
    let covariance = covariance.after_motion(&ahead, &Vector6::zeros());
    assert!((covariance.matrix()[(1, 1)] - 1.0).abs() < 1e-12);
    assert!((covariance.matrix()[(1, 5)] - 1e-3).abs() < 1e-15);
    assert_eq!(covariance.matrix()[(0, 0)], 0.0);
    assert!((covariance.position_sd_m() - 1.0).abs() < 1e-12);
}

#[test]
fn the_upper_triangle_runs_row_by_row_and_comes_back() {
    let matrix = Matrix6::from_fn(|row, column| (10 * row.min(column) + row.max(column)) as f64);
    let entries = upper_triangle(&matrix);
    assert_eq!(entries[..8], [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 11.0, 12.0]);
    assert_eq!(entries[20], 55.0);
    assert_eq!(
        PoseCovariance::from_upper_triangle(&entries).matrix(),
        &matrix
    );
}

proptest! {
    #[test]
    fn blocks_give_what_six_by_six_matrices_give(
        covariance in covariance(),
        increment in motion(),
        noise in deviations(),
    ) {
        let adjoint = se3::adjoint(&increment.inverse());
        let expected = adjoint * covariance.matrix() * adjoint.transpose()
            + Matrix6::from_diagonal(&noise.component_mul(&noise));
        let moved = covariance.after_motion(&increment, &noise);
        prop_assert!((moved.matrix() - expected).norm() < 1e-12 * (1.0 + expected.norm()));
        prop_assert_eq!(moved.matrix(), &moved.matrix().transpose());
    }

    #[test]
    fn two_motions_are_their_product(
        covariance in covariance(),
        first in motion(),
        second in motion(),
    ) {
        let none = Vector6::zeros();
        let stepwise = covariance.after_motion(&first, &none).after_motion(&second, &none);
        let at_once = covariance.after_motion(&(first * second), &none);
        let error = (stepwise.matrix() - at_once.matrix()).norm();
        prop_assert!(error < 1e-12 * (1.0 + at_once.matrix().norm()), "{}", error);
    }

    #[test]
    fn covariances_stay_positive_over_many_motions(
        noise in deviations(),
        steps in prop::collection::vec(motion(), 1..50),
    ) {
        let mut covariance = PoseCovariance::zero();
        for step in &steps {
            covariance = covariance.after_motion(step, &noise);
        }
        let eigenvalues = SymmetricEigen::new(*covariance.matrix()).eigenvalues;
        prop_assert!(eigenvalues.min() > -1e-12 * eigenvalues.max());
    }

    #[test]
    fn position_deviation_bounds_the_worst_axis(covariance in covariance(), axis in vector(3.0)) {
        let rotation = UnitQuaternion::from_scaled_axis(axis);
        let in_map = covariance.in_map_axes(&rotation);
        let worst = SymmetricEigen::new(in_map.fixed_view::<3, 3>(0, 0).into_owned());
        let worst = worst.eigenvalues.max().max(0.0).sqrt();
        let sd = covariance.position_sd_m();
        prop_assert!(worst <= sd * (1.0 + 1e-9) && sd <= worst * 3.0_f64.sqrt() * (1.0 + 1e-9));
        prop_assert_eq!(in_map, in_map.transpose());
    }
}
