//! Modules of a space and path integration.

use grid::GridSettings;
use grid::{GridModules, GridState, Lattice, ModuleState, Phase};
use nalgebra::{Point3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use random::Seeded;

fn modules_of(count: usize) -> GridModules {
    let settings = GridSettings {
        modules: count,
        ..GridSettings::default()
    };
    GridModules::new(&settings)
}

fn vector(range: f64) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-range..range).prop_map(Vector3::from)
}

/// Smallest angle between directions to nearest lattice points of different modules \[degrees\].
fn smallest_angle_deg(modules: &GridModules) -> f64 {
    let axes = |lattice: &Lattice| {
        let basis = lattice.basis() / lattice.spacing_m();
        let [a, b, c] = [0, 1, 2].map(|k| basis.column(k).into_owned());
        [a, b, c, a - b, a - c, b - c]
    };
    let lattices = modules.lattices();
    let mut closest = 0.0_f64;
    for (index, first) in lattices.iter().enumerate() {
        for second in &lattices[index + 1..] {
            for a in axes(first) {
                for b in axes(second) {
                    closest = closest.max(a.dot(&b).abs());
                }
            }
        }
    }
    closest.acos().to_degrees()
}

#[test]
fn spacings_grow_by_the_ratio() {
    let spacings = modules_of(5)
        .lattices()
        .iter()
        .map(Lattice::spacing_m)
        .collect::<Vec<_>>();
    for (spacing, expected) in spacings.iter().zip([
        1.2,
        1.9416,
        3.141_508_8,
        5.082_961_238_4,
        8.224_231_283_731_2,
    ]) {
        assert!((spacing - expected).abs() < 1e-14);
    }
}

#[test]
fn no_two_modules_share_an_axis() {
    assert!(smallest_angle_deg(&modules_of(5)) > 15.0);
    assert!(smallest_angle_deg(&modules_of(16)) > 3.7);
}

#[test]
fn a_million_random_steps_end_where_they_lead() {
    let modules = modules_of(5);
    let start = Point3::new(-3.0, 8.0, 0.5);
    let mut state = modules.locate(&start);
    let mut random = Seeded(42);
    let mut position = start;
    let mut entered_cells = 0_u32;
    for step in 0..1_000_000 {
        // Now and then a jump of kilometres, there and later back.
        let scale = if step % 10_000 == 0 { 1000.0 } else { 0.05 };
        let step = Vector3::new(random.normal(), random.normal(), random.normal()) * scale;
        position += step;
        state.advance(&modules, &step, |_, _| entered_cells += 1);
    }
    assert!((state.decode(&modules) - position).norm() < 1e-6);
    assert!(entered_cells > 10_000);
}

#[test]
fn entering_a_cell_moves_the_reference_point() {
    let lattice = Lattice::new(0.5, UnitQuaternion::identity());
    let mut module = ModuleState {
        reference: [0, 0, 0],
        phase: Phase::zero(),
    };
    assert!(!module.advance(&lattice, &Vector3::new(0.4, 0.0, 0.0)));
    assert!(module.advance(&lattice, &Vector3::new(0.2, 0.0, 0.0)));
    assert_eq!(module.reference, [1, 0, 0]);
    assert!(module.advance(&lattice, &Vector3::new(-0.7, 0.0, 0.0)));
    assert_eq!(module.reference, [-1, 0, 0]);
    assert!((module.phase.turns().x - 0.8).abs() < 1e-15);
}

#[test]
fn a_step_too_small_to_see_enters_no_cell() {
    let lattice = Lattice::new(1.0, UnitQuaternion::identity());
    let mut module = ModuleState {
        reference: [0, 0, 0],
        phase: Phase::zero(),
    };
    assert!(!module.advance(&lattice, &Vector3::new(-1e-18, 0.0, 0.0)));
    assert_eq!(
        module,
        ModuleState {
            reference: [0, 0, 0],
            phase: Phase::zero()
        }
    );
}

#[test]
fn each_module_reports_its_own_cells() {
    let modules = modules_of(5);
    let mut state = modules.locate(&Point3::origin());
    let mut events = Vec::new();
    state.advance(
        &modules,
        &Vector3::new(100.0, 50.0, -20.0),
        |module, reference| {
            events.push((module, reference));
        },
    );
    let expected = state
        .modules()
        .iter()
        .map(|module| module.reference)
        .enumerate();
    assert_eq!(events, expected.collect::<Vec<_>>());
}

proptest! {
    #[test]
    fn moving_is_locating_anew(start in vector(1e3), step in vector(1e4)) {
        let modules = modules_of(5);
        let mut state = modules.locate(&start.into());
        state.advance(&modules, &step, |_, _| {});
        prop_assert!((state.decode(&modules).coords - start - step).norm() < 1e-9);
        let code = modules.code_at(&(start + step).into());
        for (lattice, (a, b)) in
            modules.lattices().iter().zip(state.code().phases().iter().zip(code.phases()))
        {
            prop_assert!(lattice.torus_distance_m(a, b) < 1e-9);
        }
    }

    #[test]
    fn far_positions_stay_exact_at_a_millimetre(start in vector(1e8), step in vector(1e-3)) {
        let settings = GridSettings { spacing_m: 1e-3, ..GridSettings::default()};
        let modules = GridModules::new(&settings);
        let mut state = modules.locate(&start.into());
        let before = state.clone();
        for _ in 0..100 {
            state.advance(&modules, &step, |_, _| {});
        }
        for _ in 0..100 {
            state.advance(&modules, &-step, |_, _| {});
        }
        for (lattice, (a, b)) in
            modules.lattices().iter().zip(state.modules().iter().zip(before.modules()))
        {
            // However far out, a hundred small steps lose nothing but the rounding of turns.
            let cells = Vector3::from([0, 1, 2].map(|k| (a.reference[k] - b.reference[k]) as f64));
            let turns = cells + a.phase.turns() - b.phase.turns();
            prop_assert!((lattice.basis() * turns).norm() < 1e-15);
        }
        prop_assert!((state.decode(&modules).coords - start).norm() < 1e-6);
    }

    #[test]
    fn a_state_is_rebuilt_from_its_modules(position in vector(1e4)) {
        let state = modules_of(5).locate(&position.into());
        prop_assert_eq!(GridState::from_modules(state.modules().to_vec()), state);
    }
}
