//! What lies between few contacts without normals.

use super::unknown::{WAVES, run_over, taught};
use super::*;

/// A hand that rests, and says that it is exact, learns nothing by it.
#[test]
fn a_hand_that_rests_on_a_known_box_calls_it_nothing_else() {
    let library = taught(WAVES, 0..4, 60);
    for position_sd_m in [0.0, NOISE_M] {
        let mut recognition = Recognition::new(&Orientation::Known);
        let run = run_over(WAVES, 2, 30);
        let still = std::iter::repeat_n(run[29].clone(), 40);
        for (count, contact) in (1..).zip(run.iter().cloned().chain(still)) {
            let position_sd_m = position_sd_m.min(contact.position_sd_m);
            recognition.touch(
                &library,
                Contact {
                    position_sd_m,
                    ..contact
                },
            );
            let posterior = recognition.posterior(&library);
            let all: f64 = posterior.objects.iter().map(|own| own.1).sum();
            let sum = all + posterior.unknown;
            assert!((sum - 1.0).abs() < 1e-9, "{sum} after {count} touches");
            let verdict = posterior.verdict();
            assert_ne!(verdict, Verdict::Unknown, "after {count} touches");
        }
    }
}

/// The verdicts of walks over such boxes, of so many contacts each.
fn verdicts(library: &ObjectLibrary, boxes: std::ops::Range<u64>, contacts: u64) -> Vec<Verdict> {
    let verdict = |box_number| {
        let mut recognition = Recognition::new(&Orientation::Known);
        for contact in run_over(WAVES, box_number, contacts) {
            recognition.touch(library, contact);
        }
        recognition.posterior(library).verdict()
    };
    boxes.map(verdict).collect()
}

#[test]
fn boxes_of_sixty_contacts_are_named_by_a_walk() {
    let library = taught(WAVES, 0..4, 60);
    let own = verdicts(&library, 0..4, 100);
    let others = verdicts(&library, 1000..1004, 100);
    for (id, verdict) in (0..).zip(&own) {
        assert_eq!(*verdict, Verdict::Object(ObjectId(id)), "{own:?}");
    }
    let named = |verdict: &Verdict| matches!(verdict, Verdict::Object(_));
    assert!(!others.iter().any(named), "{others:?}");
}

/// By twenty contacts a box is known to a millimetre or so, though its levels tell little.
#[test]
fn most_boxes_of_twenty_contacts_are_named_by_a_long_walk() {
    let library = taught(WAVES, 0..6, 20);
    let own = verdicts(&library, 0..6, 150);
    let mut right = 0;
    for (id, verdict) in (0..).zip(&own) {
        right += u32::from(*verdict == Verdict::Object(ObjectId(id)));
    }
    let others = verdicts(&library, 1000..1006, 150);
    let named = |verdict: &Verdict| matches!(verdict, Verdict::Object(_));
    let wrong = own.iter().filter(|own| named(own)).count() - right as usize;
    assert!(right >= 5 && wrong == 0, "{own:?}");
    assert!(!others.iter().any(named), "{others:?}");
}

/// What others teach meanwhile changes nothing of what an episode has found.
#[test]
fn an_episode_keeps_its_evidence_when_its_library_changes() {
    let mut library = taught(WAVES, 0..6, 20);
    let before = library.variants().count();
    assert!(before > library.len(), "{before} variants");
    let mut recognition = Recognition::new(&Orientation::Known);
    for contact in run_over(WAVES, 2, 40) {
        recognition.touch(&library, contact);
    }
    let logs = recognition.object_logs(&library);
    // Balls that were touched at a pattern of points.
    for id in 10..30 {
        let mut model = ObjectModel::new(ModelSettings::default());
        for number in 0..24 {
            let z = (f64::from(number) + 0.5) / 12.0 - 1.0;
            let (sin, cos) = (2.4 * f64::from(number)).sin_cos();
            let across = (1.0 - z * z).sqrt();
            let at = Point3::new(0.05 * across * cos, 0.05 * across * sin, 0.05 * z);
            let level = z + 0.4 * normal(u64::from(100 * id + number));
            model.learn(&Contact::at(at, NOISE_M).with_level(0, level, 0.03));
        }
        library.put(ObjectId(id), model);
    }
    assert_eq!(
        library.variants().count(),
        library.len(),
        "all are lists now"
    );
    assert_eq!(recognition.object_logs(&library)[..6], logs[..]);
    // One that is known better meanwhile stays what it was taken for.
    let known = taught(WAVES, 2..3, 240);
    let known = known.get(ObjectId(0)).expect("one was taught");
    library.put(ObjectId(2), known.clone());
    for contact in run_over(WAVES, 2, 100).split_off(40) {
        recognition.touch(&library, contact);
    }
    let verdict = recognition.posterior(&library).verdict();
    assert_eq!(verdict, Verdict::Object(ObjectId(2)));
}
