//! Laws of surfaces and walks over them.

use std::collections::BTreeSet;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::{EDGE_M, ExplorationNoise, Explorer, VoxelObject};

const EXACT: ExplorationNoise = ExplorationNoise {
    value: 0.0,
    motion: 0.0,
};

fn random(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

#[test]
fn objects_are_of_the_size_of_things_and_differ() {
    let mut kinds = BTreeSet::new();
    for number in 0..100 {
        let object = VoxelObject::new(1, number);
        let faces = object.faces();
        assert!((20..2000).contains(&faces.len()), "{}", faces.len());
        // What goes out of a closed surface on one side comes in on the other.
        let flux = faces.iter().map(|face| face.normal.sum()).sum::<f64>();
        assert!(flux.abs() < 1e-9);
        assert!(faces.iter().all(|face| (0.0..=1.0).contains(&face.level)));
        kinds.insert(faces.len());
    }
    assert!(kinds.len() > 50, "{} sizes", kinds.len());
}

#[test]
fn shapes_and_colours_are_functions_of_seed_and_number() {
    let faces = |seed, number| VoxelObject::new(seed, number).faces().to_vec();
    assert_eq!(faces(3, 7), faces(3, 7));
    assert_ne!(faces(3, 7), faces(3, 8));
    assert_ne!(faces(3, 7), faces(4, 7));
}

/// A step leads to a face that shares an edge, and turning round leads back.
#[test]
fn steps_lead_to_neighbours() {
    for number in 0..20 {
        let object = VoxelObject::new(2, number);
        let mut random = random(number);
        for face in 0..object.faces().len() {
            let heading = object.random_heading(face, &mut random);
            let next = object.step(heading);
            let apart_m = object.faces()[face].position_m - object.faces()[next.face].position_m;
            assert!(apart_m.norm() <= EDGE_M * (1.0 + 1e-9));
            assert_ne!(next.face, face);
        }
    }
}

#[test]
fn a_long_walk_feels_the_whole_surface() {
    let object = VoxelObject::new(5, 0);
    let mut explorer = Explorer::new(&object, EXACT, random(1));
    let origin_m = explorer.true_position_m();
    let mut felt = BTreeSet::new();
    for _ in 0..100 * object.faces().len() {
        let contact = explorer.feel();
        let face = explorer.face();
        assert_eq!((contact.level, contact.normal), (face.level, face.normal));
        let apart_m = (origin_m + contact.position_m) - face.position_m;
        assert!(apart_m.norm() < 1e-9);
        felt.insert(explorer.face);
        explorer.advance();
    }
    assert_eq!(felt.len(), object.faces().len());
}

#[test]
fn noise_is_as_large_as_told() {
    let object = VoxelObject::new(5, 1);
    let noise = ExplorationNoise {
        value: 0.1,
        motion: 0.05,
    };
    let (mut normalised, mut levels, n) = (0.0, 0.0, 2000);
    for seed in 0..n {
        let mut explorer = Explorer::new(&object, noise, random(seed));
        let origin_m = explorer.true_position_m();
        for _ in 0..20 {
            explorer.advance();
        }
        let contact = explorer.feel();
        let error_m = (origin_m + contact.position_m) - explorer.true_position_m();
        normalised += error_m.norm_squared() / contact.drift_sd_m.powi(2) / 3.0;
        levels += (contact.level - explorer.face().level).powi(2) / 0.01;
    }
    assert!((normalised / n as f64 - 1.0).abs() < 0.1, "{normalised}");
    assert!((levels / n as f64 - 1.0).abs() < 0.15, "{levels}");
}
