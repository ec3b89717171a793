//! From grid codes back to positions.
#![expect(clippy::float_cmp, reason = "special values are exact")]

use grid::GridSettings;
use grid::{Decoded, GridModules, InvalidCode, PartialCode, Phase, decode, unique_range_m};
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use random::Seeded;

fn modules_of(modules: usize, ratio: f64) -> GridModules {
    let settings = GridSettings {
        modules,
        ratio,
        ..GridSettings::default()
    };
    GridModules::new(&settings)
}

fn modules() -> GridModules {
    GridModules::new(&GridSettings::default())
}

fn point(range: f64) -> impl Strategy<Value = Point3<f64>> {
    prop::array::uniform3(-range..range).prop_map(Point3::from)
}

fn random_vector(random: &mut Seeded) -> Vector3<f64> {
    Vector3::from([(); 3].map(|()| random.normal()))
}

/// The code at a position with noisy phases, without the modules in `erased`.
fn noisy_code(
    modules: &GridModules,
    position: &Point3<f64>,
    noise_turns: f64,
    erased: &[usize],
    random: &mut Seeded,
) -> Result<PartialCode, InvalidCode> {
    let code = modules.code_at(position);
    let phases = code.phases().iter().enumerate().map(|(module, phase)| {
        let noise = random_vector(random) * noise_turns;
        (!erased.contains(&module)).then(|| Phase::wrap(phase.turns() + noise))
    });
    PartialCode::new(modules, phases.collect())
}

/// Σ over known modules of torus distance² / spacing²: what decoding makes least.
fn cost(modules: &GridModules, code: &PartialCode, position: &Point3<f64>) -> f64 {
    let known = modules.lattices().iter().zip(code.phases());
    known
        .filter_map(|(lattice, phase)| {
            let here = lattice.locate(position).1;
            phase.map(|phase| {
                (lattice.torus_distance_m(&here, &phase) / lattice.spacing_m()).powi(2)
            })
        })
        .sum()
}

#[test]
fn noisy_codes_give_the_position_to_a_tenth_of_the_spacing() {
    let modules = modules();
    let mut random = Seeded(11);
    let mut sum_squared = 0.0;
    for _ in 0..100 {
        let near = Point3::from(random_vector(&mut random) * 50.0);
        let position = near + random_vector(&mut random).normalize() * (8.0 * random.uniform());
        let code = noisy_code(&modules, &position, 0.02, &[], &mut random).unwrap();
        let found = decode(&modules, &code, Some(near), 8.0);
        assert!(!found.ambiguous);
        assert!((found.position - position).norm() < 0.1);
        // √3 · 0.02 turns at 15 of 18 degrees of freedom, on the scale of √(6/Σ 1/spacing²) = 2.31
        // m.
        assert!(
            found.residual_m > 0.015 && found.residual_m < 0.15,
            "{}",
            found.residual_m
        );
        sum_squared += (found.position - position).norm_squared();
    }
    // Least squares leaves 0.02 √(3 / Σ 1/spacing²) = 0.033 m if all is well.
    assert!((sum_squared / 100.0_f64).sqrt() < 0.038);
}

#[test]
fn any_two_modules_can_be_missing() {
    let modules = modules();
    let mut random = Seeded(12);
    for first in 0..6 {
        for second in first + 1..6 {
            for _ in 0..10 {
                let near = Point3::from(random_vector(&mut random) * 50.0);
                let away = random_vector(&mut random).normalize() * (5.0 * random.uniform());
                let position = near + away;
                let code =
                    noisy_code(&modules, &position, 0.02, &[first, second], &mut random).unwrap();
                let found = decode(&modules, &code, Some(near), 5.0);
                let right = (found.position - position).norm() < 0.25;
                assert!(
                    right || found.ambiguous,
                    "{first}, {second}: {found:?} for {position}"
                );
            }
        }
    }
}

#[test]
fn nothing_on_a_fine_grid_explains_the_code_better() {
    let modules = modules();
    let mut random = Seeded(13);
    for erased in [&[][..], &[5], &[0, 2], &[2, 3, 4, 5], &[0, 1, 2, 3, 4]] {
        let position = Point3::from(random_vector(&mut random) * 0.3);
        let code = noisy_code(&modules, &position, 0.02, erased, &mut random).unwrap();
        let found = decode(&modules, &code, None, 1.5);
        let least = cost(&modules, &code, &found.position);
        let mut best_on_grid = f64::INFINITY;
        for i in -30..=30 {
            for j in -30..=30 {
                for k in -30..=30 {
                    let step = Vector3::new(f64::from(i), f64::from(j), f64::from(k)) * 0.05;
                    if step.norm() <= 1.5 {
                        best_on_grid = best_on_grid.min(cost(&modules, &code, &step.into()));
                    }
                }
            }
        }
        assert!(
            least <= best_on_grid + 1e-12,
            "{erased:?}: {least} {best_on_grid}"
        );
        assert!(
            best_on_grid < least + 0.02,
            "the grid is fine enough to see the minimum"
        );
    }
}

#[test]
fn one_module_alone_is_ambiguous_beyond_its_cell() {
    let modules = modules();
    let position = Point3::new(0.2, -0.1, 0.3);
    let mut random = Seeded(14);
    let code = noisy_code(&modules, &position, 0.0, &[0, 1, 2, 3, 4], &mut random).unwrap();
    let inside = decode(&modules, &code, None, 1.0);
    assert!(!inside.ambiguous);
    assert!((inside.position - position).norm() < 1e-12);
    let beyond = decode(&modules, &code, None, 15.0);
    assert!(beyond.ambiguous);
    assert_eq!(beyond.residual_m, 0.0);
}

#[test]
fn a_ball_of_no_size_gives_the_nearest_explanation() {
    let modules = modules();
    let position = Point3::new(7.0, -3.0, 2.0);
    let code = PartialCode::from(&modules.code_at(&position));
    let found = decode(&modules, &code, Some(position + Vector3::repeat(0.05)), 0.0);
    assert!((found.position - position).norm() < 1e-12);
    assert_eq!(found.searched_m, 0.0);
}

#[test]
fn a_ball_too_large_is_searched_as_far_as_told() {
    let modules = modules_of(2, 1.2);
    let code = PartialCode::from(&modules.code_at(&Point3::origin()));
    let found = decode(&modules, &code, None, 1e9);
    assert!(
        found.searched_m > 25.0 && found.searched_m < 100.0,
        "{}",
        found.searched_m
    );
    assert!(found.ambiguous);
}

#[test]
fn numbers_that_are_none_find_nothing_and_say_so() {
    let modules = modules();
    let code = PartialCode::from(&modules.code_at(&Point3::origin()));
    let nowhere = Point3::new(f64::NAN, 0.0, 0.0);
    assert!(decode(&modules, &code, Some(nowhere), 1.0).ambiguous);
    assert!(decode(&modules, &code, None, f64::NAN).ambiguous);
}

#[test]
fn codes_are_unique_about_as_far_as_estimated() {
    // Where the first false match lies is a matter of the lattices, so many ratios are tried.
    let ratios = [1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.7, 1.8, 2.0, 2.2, 2.5, 3.0];
    let mut shares: Vec<f64> = ratios
        .iter()
        .map(|ratio| {
            let modules = modules_of(2, *ratio);
            let range_m = unique_range_m(&modules, 0.02);
            let code = PartialCode::from(&modules.code_at(&Point3::new(3.0, 4.0, -5.0)));
            let near = Some(Point3::new(3.0, 4.0, -5.0));
            let radii = (1_u32..80).map(|step| f64::from(step) * 0.05 * range_m);
            let mut ambiguous =
                radii.filter(|radius| decode(&modules, &code, near, *radius).ambiguous);
            ambiguous
                .next()
                .expect("two modules repeat within four ranges")
                / range_m
        })
        .collect();
    shares.sort_by(f64::total_cmp);
    assert!(shares[0] > 0.25, "{shares:?}");
    assert!(shares[6] > 0.6 && shares[6] < 1.4, "{shares:?}");
}

#[test]
fn range_grows_with_modules_and_falls_with_noise() {
    let ranges = [1, 2, 3, 4, 5].map(|count| unique_range_m(&modules_of(count, 1.5), 0.02));
    assert!(
        ranges.windows(2).all(|pair| pair[1] > 2.0 * pair[0]),
        "{ranges:?}"
    );
    let modules = modules();
    assert!(unique_range_m(&modules, 0.01) > unique_range_m(&modules, 0.02));
    assert_eq!(unique_range_m(&modules, 0.0), f64::INFINITY);
    assert_eq!(
        unique_range_m(&modules, 1.0),
        0.5 * modules.lattices()[5].spacing_m()
    );
    // One module repeats at its spacing, whatever the noise.
    let alone = unique_range_m(&modules_of(1, 1.5), 0.0);
    assert!((0.5..1.0).contains(&alone));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn exact_codes_give_exact_positions(near in point(1e4), away in point(4.0)) {
        let modules = modules();
        let position = near + away.coords;
        let code = PartialCode::from(&modules.code_at(&position));
        let found: Decoded = decode(&modules, &code, Some(near), 7.0);
        prop_assert!((found.position - position).norm() < 1e-9);
        prop_assert!(found.residual_m < 1e-9 && !found.ambiguous);
        prop_assert_eq!(found.searched_m, 7.0);
    }

    #[test]
    fn positions_beside_a_cell_wall_are_no_exception(
        cells in prop::array::uniform3(-2_i32..2),
        module in 0_usize..6,
        side in -1e-9..1e-9,
    ) {
        let modules = modules();
        let corner = modules.lattices()[module].basis() * Vector3::from(cells.map(f64::from));
        let position = Point3::from(corner.add_scalar(side));
        let code = PartialCode::from(&modules.code_at(&position));
        let near = position + Vector3::new(7.0, -5.0, 3.0);
        let found = decode(&modules, &code, Some(near), 20.0);
        prop_assert!((found.position - position).norm() < 1e-9);
    }
}
