//! SE(3): laws, and the matrix exponential as the oracle.

use std::f64::consts::PI;

use geometry::{exp_jacobian, log_jacobian, se3};
use nalgebra::{Isometry3, Matrix4, Vector3};
use proptest::prelude::*;

fn vector(range: f64) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-range..range).prop_map(Vector3::from)
}

/// Rotation vectors from far below the seam of the series up to nearly half a turn.
fn angular() -> impl Strategy<Value = Vector3<f64>> {
    let angle = prop_oneof![
        Just(0.0),
        (-300.0..-1.0_f64).prop_map(f64::exp2),
        0.499..0.501,
        0.0..3.1,
        (1.0..12.0_f64).prop_map(|digits| PI - 10.0_f64.powf(-digits)),
    ];
    (vector(1.0), angle).prop_filter_map("an axis has a direction", |(axis, angle)| {
        axis.try_normalize(1e-3).map(|axis| axis * angle)
    })
}

/// exp of the 4×4 matrix of a twist, computed without any of the closed forms.
fn matrix_exponential(linear: &Vector3<f64>, angular: &Vector3<f64>) -> Matrix4<f64> {
    let mut generator = Matrix4::zeros();
    generator
        .fixed_view_mut::<3, 3>(0, 0)
        .copy_from(&angular.cross_matrix());
    generator.fixed_view_mut::<3, 1>(0, 3).copy_from(linear);
    generator.exp()
}

fn difference(a: &Isometry3<f64>, b: &Isometry3<f64>) -> f64 {
    (a.to_homogeneous() - b.to_homogeneous()).norm()
}

#[test]
fn zero_is_the_identity_both_ways() {
    let zero = Vector3::zeros();
    assert_eq!(se3::exp(&zero, &zero), Isometry3::identity());
    assert_eq!(se3::log(&Isometry3::identity()), (zero, zero));
}

#[test]
fn a_quarter_circle_ends_where_it_must() {
    // One metre radius to the left: forward π/2 m while turning π/2.
    let motion = se3::exp(&(Vector3::x() * PI / 2.0), &(Vector3::z() * PI / 2.0));
    assert!((motion.translation.vector - Vector3::new(1.0, 1.0, 0.0)).norm() < 1e-15);
}

#[test]
fn half_a_turn_has_a_logarithm_of_length_pi() {
    for axis in [
        Vector3::x(),
        -Vector3::y(),
        Vector3::new(1.0, -2.0, 2.0) / 3.0,
    ] {
        let motion = se3::exp(&Vector3::new(1.0, 2.0, 3.0), &(axis * PI));
        let (linear, angular) = se3::log(&motion);
        assert!((angular.norm() - PI).abs() < 1e-12);
        assert!(difference(&se3::exp(&linear, &angular), &motion) < 1e-13);
    }
}

#[test]
fn the_series_meets_the_closed_forms_at_the_seam() {
    let linear = Vector3::new(1.0, -2.0, 0.5);
    let axis = Vector3::new(2.0, -1.0, 2.0) / 3.0;
    for seam in [0.5, 2e-4] {
        for side in [1.0, -1.0] {
            let below = se3::exp(&linear, &(axis * side * seam * (1.0 - 1e-15)));
            let above = se3::exp(&linear, &(axis * side * seam * (1.0 + 1e-15)));
            assert!(difference(&below, &above) < 1e-14);
            let (below, above) = (se3::log(&below).0, se3::log(&above).0);
            assert!((below - above).norm() < 1e-14);
        }
    }
}

#[test]
fn more_than_half_a_turn_comes_back_the_short_way() {
    let motion = se3::exp(&Vector3::zeros(), &(Vector3::z() * 1.5 * PI));
    assert!((se3::log(&motion).1 + Vector3::z() * PI / 2.0).norm() < 1e-14);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn log_undoes_exp(linear in vector(100.0), angular in angular()) {
        let (linear_back, angular_back) = se3::log(&se3::exp(&linear, &angular));
        let off_rad = (angular_back - angular).norm();
        prop_assert!(off_rad < 1e-13, "{}", off_rad);
        prop_assert!((linear_back - linear).norm() < 1e-12 * (1.0 + linear.norm()));
    }

    #[test]
    fn the_negative_twist_is_the_inverse(linear in vector(10.0), angular in vector(8.0)) {
        let product = se3::exp(&linear, &angular) * se3::exp(&-linear, &-angular);
        prop_assert!(difference(&product, &Isometry3::identity()) < 1e-13);
    }

    #[test]
    fn exp_is_the_matrix_exponential(linear in vector(10.0), angular in angular()) {
        let motion = se3::exp(&linear, &angular).to_homogeneous();
        let expected = matrix_exponential(&linear, &angular);
        prop_assert!((motion - expected).norm() < 1e-12, "{}", (motion - expected).norm());
    }

    #[test]
    fn exp_is_the_matrix_exponential_beyond_half_a_turn(
        linear in vector(10.0),
        angular in vector(8.0),
    ) {
        let motion = se3::exp(&linear, &angular).to_homogeneous();
        let expected = matrix_exponential(&linear, &angular);
        prop_assert!((motion - expected).norm() < 1e-10, "{}", (motion - expected).norm());
    }

    #[test]
    fn many_small_steps_are_one_large_one(
        linear in vector(10.0),
        angular in vector(3.0),
        steps in 1_u32..200,
    ) {
        let share = 1.0 / f64::from(steps);
        let step = se3::exp(&(linear * share), &(angular * share));
        let walked = (0..steps).fold(Isometry3::identity(), |pose, _| pose * step);
        prop_assert!(difference(&walked, &se3::exp(&linear, &angular)) < 1e-11);
    }

    #[test]
    fn the_adjoint_moves_twists_between_frames(
        linear in vector(3.0),
        angular in vector(2.0),
        place in vector(5.0),
        turn in vector(3.0),
    ) {
        let frame = se3::exp(&place, &turn);
        let moved = frame * se3::exp(&linear, &angular) * frame.inverse();
        let twist = nalgebra::Vector6::new(
            linear.x, linear.y, linear.z, angular.x, angular.y, angular.z,
        );
        let twist = se3::adjoint(&frame) * twist;
        let direct = se3::exp(&twist.fixed_rows::<3>(0).into(), &twist.fixed_rows::<3>(3).into());
        prop_assert!(difference(&moved, &direct) < 1e-11);
    }

    #[test]
    fn the_adjoint_is_a_homomorphism(
        a in vector(3.0),
        b in vector(3.0),
        c in vector(3.0),
        d in vector(3.0),
    ) {
        let (first, second) = (se3::exp(&a, &b), se3::exp(&c, &d));
        let product = se3::adjoint(&first) * se3::adjoint(&second);
        prop_assert!((se3::adjoint(&(first * second)) - product).norm() < 1e-11);
    }

    #[test]
    fn the_jacobian_of_log_is_its_difference_quotient(
        linear in vector(10.0),
        angular in angular().prop_filter("log jumps at half a turn", |turn| turn.norm() < 3.1),
    ) {
        let motion = se3::exp(&linear, &angular);
        let jacobian = log_jacobian(&linear, &angular);
        for axis in 0..6 {
            let step = 1e-5;
            let logarithm = |share: f64| {
                let mut twist = nalgebra::Vector6::zeros();
                twist[axis] = share;
                let turn = twist.fixed_rows::<3>(3).into_owned();
                let step = se3::exp(&twist.fixed_rows::<3>(0).into(), &turn);
                let (rho, phi) = se3::log(&(motion * step));
                nalgebra::Vector6::new(rho.x, rho.y, rho.z, phi.x, phi.y, phi.z)
            };
            let quotient = (logarithm(step) - logarithm(-step)) / (2.0 * step);
            let error = (quotient - jacobian.column(axis)).norm();
            prop_assert!(error < 1e-7 * (1.0 + quotient.norm()), "{axis}: {error}");
        }
    }

    /// Also beyond half a turn, where the logarithm is another twist.
    #[test]
    fn the_jacobian_of_exp_is_its_difference_quotient(
        linear in vector(10.0),
        angular in vector(5.0),
    ) {
        let jacobian = exp_jacobian(&linear, &angular);
        let back = se3::exp(&linear, &angular).inverse();
        for axis in 0..6 {
            let step = 1e-5;
            let moved = |share: f64| {
                let mut twist = se3::join(&linear, &angular);
                twist[axis] += share;
                let (linear, angular) = se3::split(&twist);
                se3::twist(&(back * se3::exp(&linear, &angular)))
            };
            let quotient = (moved(step) - moved(-step)) / (2.0 * step);
            let error = (quotient - jacobian.column(axis)).norm();
            prop_assert!(error < 1e-7 * (1.0 + quotient.norm()), "{axis}: {error}");
        }
    }

    #[test]
    fn the_jacobians_of_log_and_exp_are_inverse(linear in vector(10.0), angular in angular()) {
        let product = log_jacobian(&linear, &angular) * exp_jacobian(&linear, &angular);
        let error = (product - nalgebra::Matrix6::identity()).norm();
        prop_assert!(error < 1e-11 * (1.0 + linear.norm()), "{error}");
    }
}
