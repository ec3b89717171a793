//! Lessons: objects that are taught at once, and forgotten by name.

use cognitive_map::{CognitiveMap, Lesson, Record, Settings, Spacing, Touch, TouchLevel};
use object_recognition::{Orientation, Verdict};

use crate::journal::{label, run};
use crate::objects::{PITCH_M, RODS, noise};

/// A lesson of a rod.
fn lesson(rod: &[f64]) -> Lesson {
    let touches = rod.iter().zip(0..).map(|(value, k)| {
        let felt = TouchLevel::new(label("touch"), *value, 0.2).unwrap();
        let at = [f64::from(k) * PITCH_M, 0.0, 0.0];
        Touch::new(at, noise()).unwrap().with_levels(vec![felt])
    });
    Lesson::new(Spacing::new(0.01).unwrap(), touches.collect())
}

/// Touches of the knife in a frame of its own.
fn asked() -> Vec<Touch> {
    let order = [2, 3, 4, 5, 6, 7, 8, 9, 10, 11];
    let felt = order.map(|k: u8| (k, RODS[1].1[usize::from(k)]));
    felt.map(|(k, value)| {
        let felt = TouchLevel::new(label("touch"), value, 0.2).unwrap();
        let at = [f64::from(k) * PITCH_M - 7.0, 1.0, 2.0];
        Touch::new(at, noise()).unwrap().with_levels(vec![felt])
    })
    .to_vec()
}

/// Teaches all rods.
fn teach(map: &mut CognitiveMap) {
    for ((name, rod), number) in RODS.iter().zip(0..) {
        let (name, lesson) = (label(name), lesson(rod));
        let record = Record::TeachObject {
            number,
            name,
            lesson,
        };
        run(map, &[record]);
    }
}

#[test]
fn a_lesson_waits_for_no_index_and_who_builds_it_makes_no_difference() {
    let [mut beside, mut alone] = [(); 2].map(|()| CognitiveMap::new(Settings::default()));
    assert!(beside.indexing(None).is_none());
    for map in [&mut beside, &mut alone] {
        teach(map);
        let job = map.indexing(None).expect("nothing is indexed");
        assert_eq!((job.left(), job.revision()), (RODS.len(), map.revision()));
        assert!(map.indexing(Some(map.revision())).is_none());
    }
    let job = beside.indexing(None).unwrap();
    std::thread::scope(|threads| {
        for _ in 0..2 {
            threads.spawn(|| job.run());
        }
    });
    assert_eq!(job.left(), 0);
    assert_eq!(alone.indexing(None).unwrap().left(), RODS.len());
    let [own, other] = [&beside, &alone].map(|map| map.identify(&Orientation::Known, &asked()));
    assert_eq!(format!("{own:?}"), format!("{other:?}"));
    assert_eq!(alone.indexing(None).unwrap().left(), 0);
    // One lesson more is one more index to build.
    let (name, lesson) = (label("spoon"), lesson(&RODS[0].1));
    let record = Record::TeachObject {
        number: 3,
        name,
        lesson,
    };
    let before = beside.revision();
    run(&mut beside, &[record]);
    assert_eq!(beside.indexing(Some(before)).map(|job| job.left()), Some(1));
}

#[test]
fn a_lesson_teaches_at_once_and_what_is_forgotten_is_unknown() {
    let mut map = CognitiveMap::new(Settings::default());
    teach(&mut map);
    let asked = asked();
    let knife = map.object_by_name(&label("knife")).unwrap();
    let posterior = map.identify(&Orientation::Known, &asked).posterior;
    assert_eq!(posterior.verdict(), Verdict::Object(knife));
    let name = label("knife");
    let forgetting = Record::ForgetObject {
        number: 3,
        name: name.clone(),
    };
    run(&mut map, std::slice::from_ref(&forgetting));
    assert!(map.object_by_name(&name).is_none() && map.object_count() == 2);
    let posterior = map.identify(&Orientation::Known, &asked).posterior;
    assert_ne!(posterior.verdict(), Verdict::Object(knife));
    // The name may be given again; the number is another one.
    let lesson = lesson(&RODS[1].1);
    let teaching = Record::TeachObject {
        number: 4,
        name: name.clone(),
        lesson,
    };
    // What comes again has been heard.
    run(&mut map, &[teaching, forgetting]);
    assert_ne!(map.object_by_name(&name), Some(knife));
}
