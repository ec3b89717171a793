//! Objects of different sizes.

use super::*;
use crate::numeric::floor_u32;

/// Distance of places [m].
const APART_M: f64 = 0.01;

/// Level of a place, by its column and row.
type LevelOf = fn(u32, u32) -> f64;

/// Tiles of four by four places: no level follows from its neighbours, so that nothing is supposed
/// beyond the edges of a plate.
const TILES: LevelOf = |column, row| normal(7_000_000 + u64::from(column % 4 + 4 * (row % 4)));

/// The same level all over: a plate may go on where it was not felt.
const SAME: LevelOf = |_, _| 1.0;

/// A square plate with these levels, of so many places along a side.
fn plate(level_at: LevelOf, side: u32) -> ObjectModel {
    let mut model = ObjectModel::new(ModelSettings {
        spacing_m: 0.9 * APART_M,
        ..ModelSettings::default()
    });
    for place in 0..side * side {
        let (column, row) = (place % side, place / side);
        let at = Point3::new(f64::from(column), f64::from(row), 0.0) * APART_M;
        model.learn(&Contact::at(at, NOISE_M).with_level(0, level_at(column, row), 0.1));
    }
    model
}

/// A walk from place to place of a square of so many along a side.
fn walk(level_at: LevelOf, seed: u64, side: f64, count: u64) -> Vec<Contact> {
    let mut at = Vector3::zeros();
    let contacts = (0..count).map(|number| {
        let key = 6_000_000 + 1_000 * seed + 8 * number;
        let axis = usize::from(uniform(key) < 0.5);
        let step = if uniform(key + 1) < 0.5 { -1.0 } else { 1.0 };
        // It turns around where the square ends.
        let is_within = (0.0..side).contains(&(at[axis] + step));
        at[axis] += if is_within { step } else { -step };
        let noise = Vector3::from_fn(|axis, _| normal(key + 2 + axis as u64));
        let [column, row] = [at.x, at.y].map(floor_u32);
        let level = level_at(column, row) + 0.1 * normal(key + 5);
        let at = Point3::from(at * APART_M + noise * NOISE_M);
        Contact::at(at, NOISE_M).with_level(0, level, 0.1)
    });
    contacts.collect()
}

/// Log mass of an object after each of these contacts, among others.
fn logs(library: &ObjectLibrary, object: ObjectId, contacts: &[Contact]) -> Vec<f64> {
    let mut recognition = Recognition::new(&Orientation::Known);
    let log = |contact: &Contact| {
        recognition.touch(library, contact.clone());
        let logs = recognition.object_logs(library);
        let own = logs.iter().find(|(other, _)| *other == object);
        own.expect("it is in the library").1
    };
    contacts.iter().map(log).collect()
}

#[test]
fn a_large_object_loses_nothing_beside_a_small_one() {
    let [large, small] = [ObjectId(0), ObjectId(1)];
    // What lies beyond an edge is as likely as of an unknown object, which the small one tells of.
    for (level_at, most) in [(TILES, 0.1), (SAME, 0.4)] {
        let mut alone = ObjectLibrary::default();
        alone.put(large, plate(level_at, 24));
        let mut both = alone.clone();
        both.put(small, plate(level_at, 4));
        for seed in 0..12 {
            let contacts = walk(level_at, seed, 3.0, 16);
            let expected = logs(&alone, large, &contacts);
            let found = logs(&both, large, &contacts);
            for (count, (expected, found)) in (1..).zip(expected.iter().zip(&found)) {
                let about = format!("{seed}: {found} instead of {expected} after {count}");
                assert!((found - expected).abs() < most, "{about}");
            }
        }
    }
}
