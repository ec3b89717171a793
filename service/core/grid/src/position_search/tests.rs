//! The search against known positions.

use nalgebra::{Point3, Vector3};

use super::*;
use crate::GridSettings;
use crate::Phase;
use crate::joint_lattice::MODULES_MIN;
use proptest::prelude::*;

fn modules_of(modules: usize, ratio: f64) -> GridModules {
    let settings = GridSettings {
        modules,
        ratio,
        ..GridSettings::default()
    };
    GridModules::new(&settings)
}

/// Boxes of all shapes, some far from the origin, and a position in each.
fn boxes() -> impl Strategy<Value = (Extent, Point3<f64>)> {
    let centre = prop_oneof![Just(0.0), -1e3..1e3f64, -1e5..1e5f64];
    let half = prop_oneof![Just(0.0), 0.01..1.0f64, 1.0..40.0f64, 40.0..2000.0f64];
    let axis = (centre, half, -1.0..1.0f64);
    prop::array::uniform3(axis).prop_map(|axes| {
        let centre = Point3::from(axes.map(|axis| axis.0));
        let half = Vector3::from(axes.map(|axis| axis.1));
        let mut extent = Extent::of(&(centre - half));
        extent.include(&(centre + half));
        let at = centre + half.component_mul(&Vector3::from(axes.map(|axis| axis.2)));
        (extent, at)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Whatever the box, the modules that are known and the noise: the position that a code was
    /// made at lies in one of the balls, at the very tolerance that it needs.
    #[test]
    fn no_match_is_missed(
        (extent, position) in boxes(),
        grid_modules in 2usize..10,
        grid_ratio in 1.1..2.5f64,
        known in prop::collection::vec(prop::bool::weighted(0.7), 10),
        noise in prop::collection::vec(prop::array::uniform3(-1.0..1.0f64), 10),
        scale in prop::sample::select(vec![0.0, 0.01, 0.05, 0.1]),
    ) {
        let modules = modules_of(grid_modules, grid_ratio);
        let spacing_m = modules.lattices()[0].spacing_m();
        let code = modules.code_at(&position);
        let mut misfit = 0.0;
        let mut phases = Vec::new();
        for (module, phase) in code.phases().iter().enumerate() {
            let noisy = Phase::wrap(phase.turns() + Vector3::from(noise[module]) * scale);
            if known[module] {
                let lattice = &modules.lattices()[module];
                let off = lattice.torus_distance_m(phase, &noisy) / lattice.spacing_m();
                misfit += off * off;
            }
            phases.push(known[module].then_some(noisy));
        }
        let n_known = phases.iter().take(CANDIDATES_MAX).flatten().count();
        prop_assume!(n_known >= MODULES_MIN);
        let code = PartialCode::new(&modules, phases).unwrap();
        let search = PositionSearch::new(&extent, spacing_m, grid_modules);
        let mut found = false;
        let outcome = search.run(&modules, &code, &extent, misfit, 100_000, |ball| {
            let squared = (ball.centre - position).norm_squared();
            found |= squared <= ball.squared_radius_m2(ball.tolerance);
            ball.tolerance
        });
        prop_assert!(found || outcome == Search::GivenUp);
        // Codes that say enough are never given up.
        let tells = n_known >= 5 && scale < 0.06;
        let world_is_small = extent.levels(spacing_m).into_iter().all(|level| level <= 6);
        prop_assert!(found || !(tells && world_is_small));
    }
}

#[test]
fn what_cannot_be_searched_is_given_up() {
    let modules = modules_of(5, 1.5);
    let code = modules.code_at(&Point3::origin());
    let one = vec![None, None, Some(code.phases()[2]), None, None];
    let one = PartialCode::new(&modules, one).unwrap();
    let code = PartialCode::from(&code);
    let near = Extent::of(&Point3::origin());
    let mut far = near;
    far.include(&Point3::new(1e9, f64::INFINITY, 0.0));
    let run = |extent: &Extent, code: &PartialCode, steps_max| {
        let search = PositionSearch::new(extent, 1.0, 5);
        search.run(&modules, code, extent, 0.01, steps_max, |ball| {
            ball.tolerance
        })
    };
    assert_eq!(run(&near, &code, 1000), Search::Complete);
    assert_eq!(run(&near, &code, 3), Search::GivenUp, "too few steps");
    assert_eq!(run(&near, &one, 1000), Search::GivenUp, "one module");
    assert_eq!(run(&far, &code, 1000), Search::GivenUp, "too far away");
}
