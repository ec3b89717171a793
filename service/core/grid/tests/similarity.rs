//! Similarities, distances and confidences.
#![expect(clippy::float_cmp, reason = "special values are exact")]

use grid::GridSettings;
use grid::similarity::{cosine, exponential_confidence, frobenius, gaussian_confidence, kernel};
use grid::{GridModules, InvalidCode, PartialCode};
use nalgebra::{DVector, Point3};
use proptest::prelude::*;

fn activations() -> impl Strategy<Value = (Vec<f64>, Vec<f64>)> {
    (1_usize..40).prop_flat_map(|len| {
        (
            prop::collection::vec(-2.0..2.0, len),
            prop::collection::vec(-2.0..2.0, len),
        )
    })
}

fn point(range: f64) -> impl Strategy<Value = Point3<f64>> {
    prop::array::uniform3(-range..range).prop_map(Point3::from)
}

fn modules() -> GridModules {
    GridModules::new(&GridSettings::default())
}

#[test]
fn cosine_of_special_vectors() {
    assert_eq!(cosine(&[3.0, 4.0], &[6.0, 8.0]), 1.0);
    assert_eq!(cosine(&[1.0, 0.0], &[-2.0, 0.0]), -1.0);
    assert_eq!(cosine(&[1.0, 0.0], &[0.0, 5.0]), 0.0);
    assert_eq!(cosine(&[0.0, 0.0], &[1.0, 1.0]), 0.0);
    assert_eq!(cosine(&[], &[]), 0.0);
}

#[test]
fn frobenius_keeps_its_digits_for_nearly_equal_patterns() {
    // The difference of squares of Eq. 7's closed form would round to nothing here: to first order
    // ‖a aᵀ − b bᵀ‖ is √2 |a| |δ| for a δ across a.
    let a = [1.0, 0.0, 0.0];
    let b = [1.0, 1e-10, 0.0];
    assert!((frobenius(&a, &b) / (2.0_f64.sqrt() * 1e-10) - 1.0).abs() < 1e-12);
    assert_eq!(frobenius(&a, &a), 0.0);
    assert_eq!(frobenius(&a, &[-1.0, 0.0, 0.0]), 0.0);
    assert_eq!(frobenius(&[0.0, 0.0], &[3.0, 4.0]), 25.0);
    assert_eq!(frobenius(&[3.0, 4.0], &[0.0, 0.0]), 25.0);
}

#[test]
fn confidences_are_equations_8_and_9() {
    assert_eq!(gaussian_confidence(0.0, 0.3), 1.0);
    assert!((gaussian_confidence(0.6, 0.3) - (-2.0_f64).exp()).abs() < 1e-15);
    assert_eq!(exponential_confidence(0.0, 0.3), 1.0);
    assert!((exponential_confidence(0.6, 0.3) - (-2.0_f64).exp()).abs() < 1e-15);
    assert_eq!(gaussian_confidence(1e300, 1e-3), 0.0);
}

#[test]
fn a_partial_code_fits_its_space() {
    let modules = modules();
    let phase = modules.code_at(&Point3::origin()).phases()[0];
    let wrong = PartialCode::new(&modules, vec![Some(phase); 4]);
    assert_eq!(
        wrong,
        Err(InvalidCode::WrongModuleCount {
            expected: 6,
            given: 4
        })
    );
    assert_eq!(
        PartialCode::new(&modules, vec![None; 6]),
        Err(InvalidCode::Empty)
    );
    assert!(PartialCode::new(&modules, vec![None, None, Some(phase), None, None, None]).is_ok());
}

proptest! {
    #[test]
    fn frobenius_is_the_norm_of_the_explicit_matrices((a, b) in activations()) {
        let (x, y) = (DVector::from_vec(a.clone()), DVector::from_vec(b.clone()));
        let expected = (&x * x.transpose() - &y * y.transpose()).norm();
        prop_assert!((frobenius(&a, &b) - expected).abs() < 1e-12 * (1.0 + expected));
        prop_assert!((frobenius(&b, &a) - expected).abs() < 1e-12 * (1.0 + expected));
    }

    #[test]
    fn cosine_ignores_size_but_not_sign((a, b) in activations(), scale in 0.01..100.0) {
        let larger: Vec<f64> = a.iter().map(|x| x * scale).collect();
        let opposite: Vec<f64> = a.iter().map(|x| -x).collect();
        prop_assert!((cosine(&larger, &b) - cosine(&a, &b)).abs() < 1e-12);
        prop_assert!((cosine(&opposite, &b) + cosine(&a, &b)).abs() < 1e-15);
        prop_assert!((-1.0..=1.0).contains(&cosine(&a, &b)));
    }

    #[test]
    fn the_kernel_is_one_at_home_and_falls_with_distance(
        position in point(100.0),
        direction in point(1.0),
    ) {
        prop_assume!(direction.coords.norm() > 0.1);
        let modules = modules();
        let cue = PartialCode::from(&modules.code_at(&position));
        let mut last = 1.0;
        // Up to a third of the finest spacing no other image of a field is nearer.
        for step in 0..=10 {
            let away = direction.coords.normalize() * (f64::from(step) / 30.0);
            let similarity = kernel(&modules, &cue, &modules.code_at(&(position + away)));
            prop_assert!((0.0..=1.0).contains(&similarity));
            prop_assert!(similarity <= last + 1e-9);
            last = similarity;
        }
        prop_assert!((kernel(&modules, &cue, &modules.code_at(&position)) - 1.0).abs() < 1e-12);
        prop_assert!(last < 0.9);
    }

    #[test]
    fn erased_modules_do_not_count(a in point(10.0), b in point(10.0), known in 0_usize..6) {
        let modules = modules();
        let (a, b) = (modules.code_at(&a), modules.code_at(&b));
        let mut phases = vec![None; 6];
        phases[known] = Some(a.phases()[known]);
        let cue = PartialCode::new(&modules, phases).unwrap();
        let lattice = &modules.lattices()[known];
        let distance = lattice.torus_distance_m(&a.phases()[known], &b.phases()[known]);
        let expected = gaussian_confidence(distance, lattice.spacing_m() * 2.0_f64.sqrt() / 6.0);
        prop_assert!((kernel(&modules, &cue, &b) - expected).abs() < 1e-12);
    }
}
