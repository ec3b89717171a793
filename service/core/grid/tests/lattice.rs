//! The lattice, phases and torus distance.
#![expect(clippy::float_cmp, reason = "special values are exact")]

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use grid::{Lattice, Phase};
use nalgebra::{Matrix3, Point3, UnitQuaternion, Vector3};
use proptest::prelude::*;

fn turns(range: f64) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-range..range).prop_map(Vector3::from)
}

fn lattice() -> impl Strategy<Value = Lattice> {
    (1e-3..1e3, turns(PI)).prop_map(|(spacing_m, axis)| {
        Lattice::new(spacing_m, UnitQuaternion::from_scaled_axis(axis))
    })
}

/// The shortest distance over 5×5×5 images.
fn brute_force_m(lattice: &Lattice, a: &Phase, b: &Phase) -> f64 {
    let mut shortest = f64::INFINITY;
    for i in -2..=2 {
        for j in -2..=2 {
            for k in -2..=2 {
                let image = Vector3::new(f64::from(i), f64::from(j), f64::from(k));
                let away = lattice.basis() * (a.turns() - b.turns() + image);
                shortest = shortest.min(away.norm());
            }
        }
    }
    shortest
}

#[test]
fn every_point_has_twelve_neighbours_at_the_spacing() {
    let lattice = Lattice::new(2.0, UnitQuaternion::from_euler_angles(0.3, -1.0, 2.0));
    let mut at_spacing = 0;
    for i in -2..=2 {
        for j in -2..=2 {
            for k in -2..=2 {
                let cell = Vector3::new(f64::from(i), f64::from(j), f64::from(k));
                let distance_m = (lattice.basis() * cell).norm();
                assert!(cell == Vector3::zeros() || distance_m > 2.0 - 1e-12);
                at_spacing += usize::from((distance_m - 2.0).abs() < 1e-12);
            }
        }
    }
    assert_eq!(at_spacing, 12);
}

#[test]
fn tiny_negative_turns_wrap_to_zero_and_not_to_one() {
    for tiny in [-1e-17, -f64::MIN_POSITIVE, -1e-300, -0.0] {
        assert_eq!(Phase::wrap(Vector3::repeat(tiny)), Phase::zero());
    }
    let just_below = Phase::wrap(Vector3::repeat(-1e-16));
    assert!(
        just_below
            .turns()
            .iter()
            .all(|turns| (0.0..1.0).contains(turns))
    );
    let (reference, phase) =
        Lattice::new(1.0, UnitQuaternion::identity()).locate(&Point3::new(-1e-18, 0.0, 0.0));
    assert_eq!((reference, phase), ([0, 0, 0], Phase::zero()));
}

#[test]
fn turns_that_are_no_numbers_give_a_legal_phase() {
    for strange in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300] {
        let phase = Phase::wrap(Vector3::repeat(strange));
        assert!(phase.turns().iter().all(|turns| (0.0..1.0).contains(turns)));
    }
}

#[test]
fn far_positions_at_a_millimetre_come_back() {
    let lattice = Lattice::new(1e-3, UnitQuaternion::from_euler_angles(0.1, 0.2, 0.3));
    for far in [Point3::new(1e8, -1e8, 1e8), Point3::new(-1e8, 1e8, 0.5)] {
        let (reference, phase) = lattice.locate(&far);
        assert!((lattice.position(reference, &phase) - far).norm() < 1e-6);
    }
}

#[test]
fn the_deepest_hole_is_the_covering_radius_away() {
    let lattice = Lattice::new(1.0, UnitQuaternion::identity());
    let mut deepest = 0.0_f64;
    for i in 0..24 {
        for j in 0..24 {
            for k in 0..24 {
                let turns = Vector3::new(f64::from(i), f64::from(j), f64::from(k)) / 24.0;
                deepest =
                    deepest.max(lattice.torus_distance_m(&Phase::wrap(turns), &Phase::zero()));
            }
        }
    }
    assert!((deepest - FRAC_1_SQRT_2).abs() < 1e-12, "{deepest}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn the_inverse_inverts_the_basis(lattice in lattice()) {
        let product = lattice.basis() * lattice.inverse();
        prop_assert!((product - Matrix3::identity()).norm() < 1e-13);
        prop_assert!((lattice.basis().column(0).norm() / lattice.spacing_m() - 1.0).abs() < 1e-13);
    }

    #[test]
    fn wrapping_drops_whole_turns_only(turns in turns(1e6)) {
        let phase = Phase::wrap(turns);
        prop_assert!(phase.turns().iter().all(|turns| (0.0..1.0).contains(turns)));
        let whole = turns - phase.turns();
        prop_assert!((whole - whole.map(f64::round)).norm() < 1e-9);
        prop_assert_eq!(Phase::wrap(*phase.turns()), phase);
    }

    #[test]
    fn position_undoes_locate(lattice in lattice(), position in turns(1e4)) {
        let (reference, phase) = lattice.locate(&position.into());
        let error = (lattice.position(reference, &phase).coords - position).norm();
        prop_assert!(error < 1e-11 * (1.0 + position.norm()), "{error}");
    }

    #[test]
    fn torus_distance_is_the_brute_force_minimum(
        lattice in lattice(),
        a in turns(3.0),
        b in turns(3.0),
    ) {
        let (a, b) = (Phase::wrap(a), Phase::wrap(b));
        let distance = lattice.torus_distance_m(&a, &b) / lattice.spacing_m();
        let expected = brute_force_m(&lattice, &a, &b) / lattice.spacing_m();
        prop_assert!((distance - expected).abs() < 1e-12, "{} {}", distance, expected);
    }

    #[test]
    fn torus_distance_is_a_metric(
        lattice in lattice(),
        a in turns(1.0),
        b in turns(1.0),
        c in turns(1.0),
    ) {
        let [a, b, c] = [a, b, c].map(Phase::wrap);
        let distance = |a, b| lattice.torus_distance_m(a, b) / lattice.spacing_m();
        prop_assert_eq!(distance(&a, &a), 0.0);
        prop_assert!((distance(&a, &b) - distance(&b, &a)).abs() < 1e-15);
        prop_assert!(distance(&a, &c) <= distance(&a, &b) + distance(&b, &c) + 1e-12);
        prop_assert!(distance(&a, &b) <= FRAC_1_SQRT_2 + 1e-12);
    }

    #[test]
    fn ties_of_the_rounding_are_right_too(
        lattice in lattice(),
        a in prop::array::uniform3(0_i32..4),
        b in prop::array::uniform3(0_i32..4),
    ) {
        let quarter = |steps: [i32; 3]| Phase::wrap(Vector3::from(steps.map(f64::from)) / 4.0);
        let (a, b) = (quarter(a), quarter(b));
        let distance = lattice.torus_distance_m(&a, &b) / lattice.spacing_m();
        let expected = brute_force_m(&lattice, &a, &b) / lattice.spacing_m();
        prop_assert!((distance - expected).abs() < 1e-12);
    }
}
