//! What was never learned.

use super::*;
use crate::numeric::floor_u32;

#[test]
fn what_was_not_learned_is_unknown() {
    let library = library(&[BOX, CUBE, BALL]);
    let posterior = recognise(&library, &episode(LARGE_BALL, 40, &frame()));
    assert!(posterior.unknown > 0.9, "{posterior:?}");
    assert!(posterior.fit < -3.0, "{posterior:?}");
    let posterior = recognise(&library, &episode(BALL, 40, &frame()));
    assert!(
        posterior.unknown < 0.1 && posterior.fit > -3.0,
        "{posterior:?}"
    );
}

#[test]
fn a_ball_of_another_size_is_not_taken_for_the_known_one() {
    // Of the same level all over: it tells nothing, and takes nothing away.
    let felt = |radius_m: f64, key: u64| {
        let contact = touch(on_ball(radius_m, key), &Isometry3::identity(), key);
        contact.with_level(0, 2.0 + 0.05 * normal(40_000_000 + key), 0.1)
    };
    let mut model = ObjectModel::new(ModelSettings::default());
    for key in 0..500 {
        model.learn(&felt(0.05, key));
    }
    let mut library = ObjectLibrary::default();
    library.put(ObjectId(0), model);
    for (radius_m, is_known) in [(0.05, true), (0.03, false), (0.0375, false), (0.065, false)] {
        for trial in 1..=12_u64 {
            let mut recognition = Recognition::new(&Orientation::Known);
            for count in 1..=30 {
                recognition.touch(&library, felt(radius_m, 1_000 * trial + count));
                let verdict = recognition.posterior(&library).verdict();
                let about = format!("{radius_m}, {trial}: {verdict:?} after {count}");
                if is_known {
                    assert_ne!(verdict, Verdict::Unknown, "{about}");
                    let is_named = verdict == Verdict::Object(ObjectId(0));
                    assert!(is_named || count < 12, "{about}");
                } else {
                    // Five points of a ball may lie on another by chance.
                    let is_named = matches!(verdict, Verdict::Object(_));
                    assert!(!is_named || count < 8, "{about}");
                    assert!(verdict == Verdict::Unknown || count < 30, "{about}");
                }
            }
        }
    }
}

#[test]
fn what_lies_on_a_part_of_something_learned_is_another_thing() {
    /// A third of the ball's surface.
    const CAP: Shape = |key| {
        let points = (0..64).map(|k| BALL(64 * key + k));
        let mut caps = points.filter(|point| point.1.z > 1.0 / 3.0);
        caps.next().expect("one of 64 is on a third of it")
    };
    let library = library(&[BOX, BALL]);
    let contacts = episode(CAP, 60, &frame());
    let drawn: Vec<_> = contacts.iter().cloned().map(Contact::drawn).collect();
    let posterior = recognise(&library, &drawn);
    assert!(posterior.unknown > 0.9, "{posterior:?}");
    // A finger that was led there may have been on the whole ball.
    let posterior = recognise(&library, &contacts);
    assert_eq!(posterior.verdict(), Verdict::Object(ObjectId(1)));
    // And drawn from all of it, they are the ball's.
    let ball: Vec<_> = { episode(BALL, 60, &frame()).into_iter() }
        .map(Contact::drawn)
        .collect();
    let posterior = recognise(&library, &ball);
    assert_eq!(posterior.verdict(), Verdict::Object(ObjectId(1)));
}

/// Sides of a box \[m\].
fn sides_m(box_number: u64) -> [f64; 3] {
    [0, 1, 2].map(|axis| 0.05 + 0.06 * uniform(900_000 + 8 * box_number + axis))
}

/// The level at a point of a box.
pub(super) type LevelAt = fn(u64, &Point3<f64>) -> f64;

/// Levels in waves over all faces: between contacts they follow from their neighbours.
pub(super) const WAVES: LevelAt = |box_number, point| {
    let wave = |axis: u64| 100.0 * (uniform(910_000 + 8 * box_number + axis) - 0.5);
    let phase = wave(0) * point.x + wave(1) * point.y + wave(2) * point.z;
    (phase + 6.0 * uniform(920_000 + box_number)).sin()
};

/// Levels in bands of 15 mm: neighbours tell nothing of what lies between them.
const BANDS: LevelAt = |box_number, point| {
    let band = floor_u32((point.x + point.y + 1.0) / 0.015);
    2.0 * uniform(930_000 + 1_000 * box_number + u64::from(band)) - 1.0
};

/// A point of such a box with its level.
fn drawn(level_at: LevelAt, box_number: u64, key: u64) -> (Point3<f64>, f64) {
    let point = on_box(sides_m(box_number), key).0;
    (point, level_at(box_number, &point))
}

/// The same at the points of a raster over all faces, a centimetre apart.
fn raster(box_number: u64) -> Vec<(Point3<f64>, f64)> {
    let sides_m = Vector3::from(sides_m(box_number));
    let along = |side_m: f64| {
        let from_m = 0.005 - side_m / 2.0;
        { (0..20).map(move |k| from_m + 0.01 * f64::from(k)) }.filter(move |at| *at < side_m / 2.0)
    };
    let mut points = Vec::new();
    for axis in 0..3 {
        let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
        for at_u in along(sides_m[u]) {
            for at_v in along(sides_m[v]) {
                for sign in [-0.5, 0.5] {
                    let mut at = Point3::origin();
                    (at[axis], at[u], at[v]) = (sign * sides_m[axis], at_u, at_v);
                    points.push((at, WAVES(box_number, &at)));
                }
            }
        }
    }
    points
}

/// A noisy contact with it.
pub(super) fn felt((point, level): (Point3<f64>, f64), key: u64) -> Contact {
    let noise = Vector3::from_fn(|axis, _| normal(2_000_000 + 16 * key + axis as u64));
    let level = level + 0.03 * normal(2_000_000 + 16 * key + 8);
    Contact::at(point + noise * NOISE_M, NOISE_M).with_level(0, level, 0.03)
}

/// A run of touches over such a box, a centimetre apart or so.
pub(super) fn run_over(level_at: LevelAt, box_number: u64, count: u64) -> Vec<Contact> {
    let drawn: Vec<_> = (0..600)
        .map(|key| drawn(level_at, box_number, 5_000 + key))
        .collect();
    let mut at = drawn[0].0;
    let mut ahead = Vector3::x();
    let run = (0..count).map(|number| {
        let turn = Vector3::from_fn(|axis, _| normal(3_000_000 + 4 * number + axis as u64));
        let target = at + 0.01 * (ahead + 0.4 * turn).normalize();
        let apart = |own: &&(Point3<f64>, f64)| (own.0 - target).norm();
        let next = { drawn.iter() }.min_by(|a, b| apart(a).total_cmp(&apart(b)));
        let next = *next.expect("there are some");
        ahead = (next.0 - at).try_normalize(1e-9).unwrap_or(-ahead);
        at = next.0;
        felt(next, 10_000 * box_number + number)
    });
    run.collect()
}

/// Boxes that were taught by so many contacts each.
pub(super) fn taught(
    level_at: LevelAt,
    boxes: std::ops::Range<u64>,
    contacts: u64,
) -> ObjectLibrary {
    let mut library = ObjectLibrary::default();
    for (id, box_number) in (0u32..).zip(boxes) {
        let mut model = ObjectModel::new(ModelSettings::default());
        for key in 0..contacts {
            let key = 1_000_000 + 1_000 * box_number + key;
            model.learn(&felt(drawn(level_at, box_number, key), key));
        }
        library.put(ObjectId(id), model);
    }
    library
}

#[test]
fn what_was_taught_by_few_contacts_is_never_called_unknown() {
    let library = taught(WAVES, 0..3, 20);
    for own in 0..3 {
        let mut recognition = Recognition::new(&Orientation::Known);
        for (count, contact) in (1..).zip(run_over(WAVES, own, 200)) {
            recognition.touch(&library, contact);
            let posterior = recognition.posterior(&library);
            let verdict = posterior.verdict();
            assert_ne!(verdict, Verdict::Unknown, "{own} after {count} touches");
        }
    }
    // Of strangers most are rather unknown than any of these, and none is named.
    let mut unknown = 0;
    for stranger in 1000..1003 {
        let mut recognition = Recognition::new(&Orientation::Known);
        for contact in run_over(WAVES, stranger, 100) {
            recognition.touch(&library, contact);
        }
        let posterior = recognition.posterior(&library);
        let verdict = posterior.verdict();
        assert!(
            !matches!(verdict, Verdict::Object(_)),
            "{stranger}: {posterior:?}"
        );
        unknown += u32::from(posterior.unknown > posterior.objects[0].1);
    }
    assert!(unknown >= 2, "{unknown} of three");
}

#[test]
fn gaps_of_which_neighbours_tell_nothing_call_nothing_unknown() {
    let library = taught(BANDS, 0..5, 20);
    for own in 0..5 {
        let mut recognition = Recognition::new(&Orientation::Known);
        for (count, contact) in (1..).zip(run_over(BANDS, own, 200)) {
            recognition.touch(&library, contact);
            let verdict = recognition.posterior(&library).verdict();
            assert_ne!(verdict, Verdict::Unknown, "{own} after {count} touches");
        }
    }
}

/// Of twenty boxes of twenty contacts, between which no level follows from the others, most are
/// named by what all contacts of a walk tell together, and strangers are rather unknown.
#[test]
fn boxes_of_few_contacts_are_told_from_strangers() {
    let posterior = |library: &ObjectLibrary, box_number: u64, contacts| {
        let mut recognition = Recognition::new(&Orientation::Known);
        for contact in run_over(BANDS, box_number, contacts) {
            recognition.touch(library, contact);
        }
        recognition.posterior(library)
    };
    let (mut right, mut named, mut unknown) = (0, 0, 0);
    for first in [0, 10, 20, 30] {
        let library = taught(BANDS, first..first + 5, 20);
        for (id, own) in (0u32..).zip(first..first + 5) {
            let verdict = posterior(&library, own, 200).verdict();
            right += u32::from(verdict == Verdict::Object(ObjectId(id)));
            let is_own = verdict == Verdict::Object(ObjectId(id));
            assert!(
                is_own || verdict == Verdict::Undecided,
                "{own}: {verdict:?}"
            );
            let stranger = posterior(&library, 5000 + own, 100);
            named += u32::from(matches!(stranger.verdict(), Verdict::Object(_)));
            unknown += u32::from(stranger.unknown > stranger.objects[0].1);
        }
    }
    assert!(right >= 15, "{right} of twenty");
    assert_eq!(named, 0, "strangers");
    assert!(unknown >= 18, "{unknown} of twenty strangers");
}

#[test]
fn one_object_of_few_contacts_among_others_of_many_is_not_called_unknown() {
    let mut library = taught(BANDS, 1..5, 600);
    let sparse = taught(BANDS, 0..1, 20);
    let sparse = sparse.get(ObjectId(0)).expect("one was taught");
    library.put(ObjectId(9), sparse.clone());
    let mut recognition = Recognition::new(&Orientation::Known);
    for (count, contact) in (1..).zip(run_over(BANDS, 0, 200)) {
        recognition.touch(&library, contact);
        let verdict = recognition.posterior(&library).verdict();
        assert_ne!(verdict, Verdict::Unknown, "after {count} touches");
    }
    // Another one is not taken for it.
    let mut recognition = Recognition::new(&Orientation::Known);
    for contact in run_over(BANDS, 1000, 100) {
        recognition.touch(&library, contact);
    }
    let posterior = recognition.posterior(&library);
    assert!(posterior.unknown > posterior.objects[0].1, "{posterior:?}");
}

#[test]
fn what_was_taught_at_the_same_points_again_may_be_felt_between_them() {
    let mut library = ObjectLibrary::default();
    for (id, box_number) in (0u32..).zip(0..3) {
        let mut model = ObjectModel::new(ModelSettings::default());
        let visits = std::iter::repeat_n(raster(box_number), 4).flatten();
        for (key, point) in (0..).zip(visits) {
            model.learn(&felt(point, 7_000_000 + 100_000 * box_number + key));
        }
        library.put(ObjectId(id), model);
    }
    for own in 0..3 {
        let mut recognition = Recognition::new(&Orientation::Known);
        for (count, contact) in (1..).zip(run_over(WAVES, own, 100)) {
            recognition.touch(&library, contact);
            let verdict = recognition.posterior(&library).verdict();
            assert_ne!(verdict, Verdict::Unknown, "{own} after {count} touches");
        }
        let id = ObjectId(u32::try_from(own).expect("there are three"));
        let verdict = recognition.posterior(&library).verdict();
        assert_eq!(verdict, Verdict::Object(id));
    }
}

/// Waves in a range of levels that every fourth box has alone.
pub(super) const WAVES_APART: LevelAt =
    |box_number, point| 3.0 * (box_number % 4) as f64 + 0.5 * WAVES(box_number, point);

#[test]
fn another_thing_with_levels_like_those_of_one_object_alone_is_not_taken_for_it() {
    let library = taught(WAVES_APART, 0..4, 600);
    let touched = |box_number, contacts: &[u64]| {
        let mut recognition = Recognition::new(&Orientation::Known);
        let run = run_over(WAVES_APART, box_number, 100);
        let verdicts = (1..).zip(run).filter_map(|(count, contact)| {
            recognition.touch(&library, contact);
            { contacts.contains(&count) }.then(|| recognition.posterior(&library).verdict())
        });
        verdicts.collect::<Vec<_>>()
    };
    let mut unknown = 0;
    for own in 0..4 {
        let id = ObjectId(u32::try_from(own).expect("there are four"));
        assert_eq!(touched(own, &[60]), [Verdict::Object(id)]);
        for stranger in [40, 80, 120, 160].map(|more| own + more) {
            let verdicts = touched(stranger, &[60, 80, 100]);
            let named = |verdict: &Verdict| matches!(verdict, Verdict::Object(_));
            assert!(!verdicts.iter().any(named), "{stranger}: {verdicts:?}");
            unknown += u32::from(verdicts[2] == Verdict::Unknown);
        }
    }
    assert!(unknown >= 12, "{unknown} of 16");
}
