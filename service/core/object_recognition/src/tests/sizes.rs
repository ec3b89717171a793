//! Objects of different sizes.

use super::*;

/// Distance of places [m].
const APART_M: f64 = 0.01;

/// A square plate of the same level all over, of so many places along a side.
fn plate(side: u32) -> ObjectModel {
    let mut model = ObjectModel::new(ModelSettings {
        spacing_m: 0.9 * APART_M,
        ..ModelSettings::default()
    });
    for place in 0..side * side {
        let at = Point3::new(f64::from(place % side), f64::from(place / side), 0.0);
        model.learn(
            &Contact::at(Point3::from(at.coords * APART_M), NOISE_M).with_level(0, 1.0, 0.1),
        );
    }
    model
}

/// A walk from place to place of a square of so many along a side, all of the same level.
fn walk(seed: u64, side: f64, count: u64) -> Vec<Contact> {
    let mut at = Vector3::zeros();
    let contacts = (0..count).map(|number| {
        let key = 6_000_000 + 1_000 * seed + 8 * number;
        let axis = usize::from(uniform(key) < 0.5);
        let step = if uniform(key + 1) < 0.5 { -1.0 } else { 1.0 };
        // It turns around where the square ends.
        let is_within = (0.0..side).contains(&(at[axis] + step));
        at[axis] += if is_within { step } else { -step };
        let noise = Vector3::from_fn(|axis, _| normal(key + 2 + axis as u64));
        let level = 1.0 + 0.1 * normal(key + 5);
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
    let mut alone = ObjectLibrary::default();
    alone.put(large, plate(24));
    let mut both = alone.clone();
    both.put(small, plate(4));
    for seed in 0..12 {
        let contacts = walk(seed, 3.0, 16);
        let expected = logs(&alone, large, &contacts);
        let found = logs(&both, large, &contacts);
        for (count, (expected, found)) in (1..).zip(expected.iter().zip(&found)) {
            let about = format!("{seed}: {found} instead of {expected} after {count}");
            assert!((found - expected).abs() < 0.1, "{about}");
        }
    }
}
