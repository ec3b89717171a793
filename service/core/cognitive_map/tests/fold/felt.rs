//! What was felt near a point, and whether anybody was there to feel it.

use cognitive_map::{CognitiveMap, Felt, FeltCue, Looked};
use nalgebra::Point3;

use crate::journal::{Robot, descriptor, label, level, settings};

const S: i64 = 1_000_000_000;

fn felt(map: &CognitiveMap, x: f64, since_ns: Option<i64>, channels: &[&str]) -> Felt {
    map.felt(&FeltCue {
        position: Point3::new(x, 0.0, 0.0),
        radius_m: 0.3,
        since_ns,
        channels: channels.iter().copied().map(label).collect(),
        limit: 100,
    })
}

/// A robot that goes 4 m ahead in 4 s, feels something at 2 m, and goes back.
fn there_and_back() -> (CognitiveMap, Robot) {
    let mut map = CognitiveMap::new(settings(|_| ()));
    let mut robot = Robot::enrol(&mut map);
    for k in 0..80 {
        let step = if k < 40 { 0.1 } else { -0.1 };
        robot.go(&mut map, [step, 0.0, 0.0], [0.0; 3]);
        if k == 20 {
            robot.sample(&mut map, level("touch", 0.5, [0.0; 3]));
            robot.sample(&mut map, level("touch", 0.7, [0.0; 3]));
        }
    }
    (map, robot)
}

#[test]
fn never_looked_is_told_from_nothing_felt() {
    let (map, _) = there_and_back();
    let here = felt(&map, 2.0, None, &[]);
    assert_eq!(here.looked, Looked::Felt);
    // Two stamps of a tenth of a second after the twenty-one steps before.
    assert_eq!(here.last_felt_ns, Some(23 * S / 10));
    let percepts: Vec<_> = here.places.iter().flat_map(|at| &at.percepts).collect();
    assert_eq!((percepts.len(), percepts[0].percepts), (1, 2));
    let (mean, sd) = percepts[0].level.unwrap();
    assert!(
        (mean - 0.6).abs() < 1e-9 && (sd - 0.1).abs() < 0.05,
        "{mean} {sd}"
    );

    let beside = felt(&map, 3.0, None, &[]);
    assert_eq!(
        (beside.looked, beside.last_felt_ns),
        (Looked::NothingFelt, None)
    );
    // It came by again on its way back.
    let back_ns = beside.last_seen_ns.unwrap();
    assert!((40 * S / 10..60 * S / 10).contains(&back_ns), "{back_ns}");

    let far = felt(&map, 9.0, None, &[]);
    assert_eq!(
        (far.looked, far.last_seen_ns, far.near),
        (Looked::Never, None, 0)
    );
}

#[test]
fn what_was_before_the_stamp_does_not_count() {
    let (mut map, mut robot) = there_and_back();
    let later = felt(&map, 2.0, Some(23 * S / 10 + 1), &[]);
    assert_eq!(
        later.looked,
        Looked::NothingFelt,
        "it came by again, and felt nothing"
    );
    assert!(felt(&map, 2.0, Some(23 * S / 10), &[]).looked == Looked::Felt);
    let today = felt(&map, 2.0, Some(10 * S), &[]);
    assert_eq!(today.looked, Looked::Never);
    assert_eq!(
        today.last_seen_ns, later.last_seen_ns,
        "the last visit is told all the same"
    );

    // It stays where it is, without coming anywhere.
    let stayed_since = robot.stamp_ns;
    let at = robot.position(&map).x;
    for _ in 0..20 {
        robot.go(&mut map, [0.0; 3], [0.0; 3]);
    }
    let here = felt(&map, at, Some(stayed_since + S), &[]);
    assert_eq!(here.looked, Looked::NothingFelt);
    assert_eq!(here.last_seen_ns, Some(robot.stamp_ns));
}

#[test]
fn channels_are_told_apart_and_outlive_a_checkpoint() {
    let (mut map, mut robot) = there_and_back();
    let at = robot.position(&map).x;
    let mut view = [0.0; 8];
    view[3] = 1.0;
    robot.sample(&mut map, descriptor("camera", &view));
    let seen_ns = robot.stamp_ns;
    let here = felt(&map, at, None, &["camera"]);
    assert_eq!(
        (here.looked, here.last_felt_ns),
        (Looked::Felt, Some(seen_ns))
    );
    assert_eq!(felt(&map, at, None, &["touch"]).looked, Looked::NothingFelt);
    assert_eq!(
        felt(&map, 2.0, None, &["camera"]).looked,
        Looked::NothingFelt
    );

    let restored = CognitiveMap::restore(map.settings().clone(), map.checkpoint(0)).unwrap();
    for x in [at, 2.0, 3.0] {
        assert_eq!(felt(&restored, x, None, &[]), felt(&map, x, None, &[]));
    }
}

#[test]
fn the_nearest_places_are_told_and_all_count() {
    let (map, _) = there_and_back();
    let cue = FeltCue {
        position: Point3::new(3.5, 0.0, 0.0),
        radius_m: 2.0,
        since_ns: None,
        channels: Vec::new(),
        limit: 2,
    };
    let few = map.felt(&cue);
    assert_eq!(few.places.len(), 2);
    assert!(few.near > 5 && few.looked == Looked::Felt, "{few:?}");
    assert!(few.places[0].distance_m <= few.places[1].distance_m);
}
