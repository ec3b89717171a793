//! Objects that were felt along one run, and touched elsewhere.

use super::unknown::felt;
use super::*;

/// Contacts of a run along a ring, a step of 5 mm apart, from an angle on: where on it, and a level
/// that varies smoothly.
fn run_along(ring: u64, from_rad: f64, count: u64) -> impl Iterator<Item = Contact> {
    let radius_m = [0.05, 0.06, 0.07][usize::try_from(ring % 3).unwrap_or_default()];
    (0..count).map(move |number| {
        let angle_rad = from_rad + 0.005 / radius_m * number as f64;
        let point = Point3::new(radius_m * angle_rad.cos(), radius_m * angle_rad.sin(), 0.0);
        let level = (angle_rad + 2.0 * ring as f64).sin();
        felt((point, level), 1_000 * ring + number)
    })
}

/// Rings of which a quarter was felt, to a third.
fn felt_in_part() -> ObjectLibrary {
    let mut library = ObjectLibrary::default();
    for (id, ring) in (0u32..).zip(0..3) {
        let mut model = ObjectModel::new(ModelSettings::default());
        run_along(ring, 0.0, 20).for_each(|contact| model.learn(&contact));
        library.put(ObjectId(id), model);
    }
    library
}

/// What was never felt of an object is no evidence against it: its levels may be any, and it may be
/// long. Once the walk has come to what was felt, it is the likeliest of the known ones.
#[test]
fn what_lies_beyond_a_run_calls_nothing_unknown() {
    let library = felt_in_part();
    let mut first = 0;
    for (id, ring) in (0u32..).zip(0..3) {
        for from_rad in [2.0, 3.0, 4.0] {
            let mut recognition = Recognition::new(&Orientation::Known);
            for (count, contact) in (1..).zip(run_along(ring, from_rad, 100)) {
                recognition.touch(&library, contact);
                let verdict = recognition.posterior(&library).verdict();
                let about = format!("{ring} from {from_rad}: {verdict:?} after {count}");
                assert_ne!(verdict, Verdict::Unknown, "{about}");
            }
            let posterior = recognition.posterior(&library);
            first += usize::from(posterior.objects[0].0 == ObjectId(id));
        }
    }
    assert!(first >= 8, "{first} of nine");
}
