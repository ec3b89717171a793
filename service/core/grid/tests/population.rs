//! Cells, activations and the interference pattern.

use std::collections::BTreeSet;

use grid::GridSettings;
use grid::population::{
    CELLS_PER_MODULE, TUNING_WIDTH, activation, interference_pattern, population_vector,
    preferred_phase,
};
use grid::similarity::{cosine, kernel};
use grid::{GridModules, PartialCode, Phase};
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use random::Seeded;

fn modules() -> GridModules {
    GridModules::new(&GridSettings::default())
}

fn point(range: f64) -> impl Strategy<Value = Point3<f64>> {
    prop::array::uniform3(-range..range).prop_map(Point3::from)
}

fn random_point(random: &mut Seeded) -> Point3<f64> {
    Point3::from([(); 3].map(|()| random.uniform() * 20.0 - 10.0))
}

fn random_direction(random: &mut Seeded) -> Vector3<f64> {
    Vector3::from([(); 3].map(|()| random.normal())).normalize()
}

#[test]
fn preferred_phases_tile_the_cell_in_thirds() {
    let thirds = |cell: usize| {
        preferred_phase(cell)
            .turns()
            .map(|turns| (turns * 3.0).round())
    };
    let distinct: BTreeSet<String> = (0..CELLS_PER_MODULE)
        .map(|cell| format!("{:?}", thirds(cell)))
        .collect();
    assert_eq!(distinct.len(), CELLS_PER_MODULE);
    assert_eq!(thirds(0), Vector3::zeros());
    assert_eq!(thirds(1), Vector3::new(0.0, 0.0, 1.0));
    assert_eq!(thirds(3), Vector3::new(0.0, 1.0, 0.0));
    assert_eq!(thirds(9), Vector3::new(1.0, 0.0, 0.0));
}

#[test]
fn a_cell_fires_fully_at_its_preferred_phase_and_by_equation_1_beside_it() {
    let modules = modules();
    for lattice in modules.lattices() {
        for cell in 0..CELLS_PER_MODULE {
            assert!((activation(lattice, &preferred_phase(cell))[cell] - 1.0).abs() < 1e-15);
        }
        let sigma_m = TUNING_WIDTH * lattice.spacing_m();
        let beside = lattice.locate(&Point3::new(0.0, 0.0, sigma_m)).1;
        assert!((activation(lattice, &beside)[0] - (-0.5_f64).exp()).abs() < 1e-12);
    }
}

#[test]
fn the_kernel_is_the_cosine_of_activations_to_a_tenth() {
    // Documented at `kernel`.
    let modules = modules();
    let mut random = Seeded(3);
    let mut worst = 0.0_f64;
    for _ in 0..5000 {
        let here = random_point(&mut random);
        let there = here + random_direction(&mut random) * (4.0 * random.uniform().powi(2));
        let (a, b) = (modules.code_at(&here), modules.code_at(&there));
        let materialised = cosine(
            &population_vector(&modules, &a),
            &population_vector(&modules, &b),
        );
        let continuum = kernel(&modules, &PartialCode::from(&a), &b);
        worst = worst.max((materialised - continuum).abs());
    }
    assert!(worst < 0.1, "{worst}");
    assert!(
        worst > 0.01,
        "the documented bound is far too wide: {worst}"
    );
}

#[test]
fn the_normalised_interference_pattern_tells_the_position() {
    let modules = modules();
    let mut random = Seeded(5);
    for _ in 0..1000 {
        let position = random_point(&mut random);
        let code = modules.code_at(&position);
        let exact_belief = interference_pattern(&modules, &code, &position)
            .normalised()
            .unwrap();
        assert!((exact_belief - position).norm() < 0.04);
        // A belief that is a sixth of the finest spacing off is drawn to less than half of its
        // error.
        let belief = position + random_direction(&mut random) * 0.2;
        let corrected = interference_pattern(&modules, &code, &belief)
            .normalised()
            .unwrap();
        assert!((corrected - position).norm() < 0.09);
    }
}

#[test]
fn the_pattern_is_the_weighted_sum_of_equation_4() {
    // At the origin all cells at thirds are placed symmetrically, so I = 0 while Σ a is not.
    let modules = modules();
    let code = modules.code_at(&Point3::origin());
    let interference = interference_pattern(&modules, &code, &Point3::origin());
    let total: f64 = population_vector(&modules, &code).iter().sum();
    assert!((interference.total - total).abs() < 1e-12);
    let normalised = interference.normalised().unwrap();
    assert!((normalised.coords * total - interference.pattern).norm() < 1e-12);
}

proptest! {
    #[test]
    fn activations_are_rates(position in point(100.0)) {
        let modules = modules();
        let population = population_vector(&modules, &modules.code_at(&position));
        prop_assert_eq!(population.len(), 6 * CELLS_PER_MODULE);
        prop_assert!(population.iter().all(|rate| (0.0..=1.0).contains(rate)));
        for module in population.chunks(CELLS_PER_MODULE) {
            // The deepest hole between preferred phases is √2 σ from the nearest ones.
            prop_assert!(module.iter().any(|rate| *rate > (-1.0_f64).exp() - 1e-9));
        }
    }

    #[test]
    fn activation_repeats_with_the_lattice(
        position in point(10.0),
        cells in prop::array::uniform3(-5_i32..5),
    ) {
        let modules = modules();
        let lattice = &modules.lattices()[1];
        let shift = lattice.basis() * Vector3::from(cells.map(f64::from));
        let here = activation(lattice, &lattice.locate(&position).1);
        let there = activation(lattice, &lattice.locate(&(position + shift)).1);
        for (here, there) in here.iter().zip(there) {
            prop_assert!((here - there).abs() < 1e-11);
        }
    }

    #[test]
    fn a_wrapped_phase_is_the_same_phase(turns in prop::array::uniform3(0.0..1.0)) {
        let modules = modules();
        let lattice = &modules.lattices()[0];
        let turns = Vector3::from(turns);
        let a = activation(lattice, &Phase::wrap(turns));
        let b = activation(lattice, &Phase::wrap(turns.add_scalar(-3.0)));
        for (a, b) in a.iter().zip(b) {
            prop_assert!((a - b).abs() < 1e-12);
        }
    }
}
