//! What sightings teach.

use cognitive_map::{
    CognitiveMap, EventKind, LandmarkId, Relation, RelativePosition, SampleBody, Settings,
    Sighting, Target,
};
use nalgebra::Point3;

use crate::journal::{Robot, label, sighting, start_pose};

fn new_map() -> (CognitiveMap, Robot) {
    let mut map = CognitiveMap::new(Settings::default());
    let robot = Robot::enrol(&mut map);
    (map, robot)
}

#[test]
fn a_landmark_is_learned_where_it_stands() {
    let (mut map, mut robot) = new_map();
    robot.sample(
        &mut map,
        start_pose([1.0, 2.0, 3.0], [0.0, 0.0, std::f64::consts::FRAC_PI_2]),
    );
    let events = robot.sample(&mut map, sighting("dock", [4.0, 0.0, 1.0], 0.1));
    let [
        EventKind::LandmarkLearned {
            landmark: LandmarkId(0),
            position,
        },
    ] = events[..]
    else {
        panic!("{events:?}")
    };
    assert!(
        (position - Point3::new(1.0, 6.0, 4.0)).norm() < 1e-9,
        "four metres to the left: {position}"
    );
    let (id, landmark) = map.landmark_by_label("dock").unwrap();
    assert_eq!((id, landmark.sightings()), (LandmarkId(0), 1));
    assert_eq!(*landmark.position(), position);
    assert!((landmark.covariance().trace() - 0.03).abs() < 1e-9);
    assert_eq!(landmark.first_stamp_ns(), robot.stamp_ns);
}

#[test]
fn a_better_sighting_counts_more_and_none_harms() {
    let (mut map, mut robot) = new_map();
    robot.sample(&mut map, start_pose([0.0; 3], [0.0; 3]));
    robot.sample(&mut map, sighting("dock", [5.0, 0.0, 0.0], 1.0));
    let events = robot.sample(&mut map, sighting("dock", [5.5, 0.0, 0.0], 0.1));
    assert_eq!(events, [], "it is learned only once");
    let landmark = map.landmark(LandmarkId(0)).unwrap();
    assert!(
        (landmark.position().x - 5.5).abs() < 0.05,
        "{}",
        landmark.position()
    );
    let before = landmark.covariance().trace();
    robot.sample(&mut map, sighting("dock", [9.0, 0.0, 0.0], 5.0));
    let landmark = map.landmark(LandmarkId(0)).unwrap();
    assert!(
        (landmark.position().x - 5.5).abs() < 0.05,
        "a vague one moves nothing"
    );
    assert!(landmark.covariance().trace() <= before);
    assert_eq!(landmark.sightings(), 3);
    assert_eq!(landmark.last_stamp_ns(), robot.stamp_ns);
}

/// The same error again and again teaches nothing new: a drifting robot that sees a landmark a
/// thousand times must not become sure of it.
#[test]
fn repetition_does_not_make_sure() {
    let (mut map, mut robot) = new_map();
    robot.ahead(&mut map, 0.5, 100);
    robot.sample(&mut map, sighting("dock", [1.0, 0.0, 0.0], 0.1));
    let once = map.landmark(LandmarkId(0)).unwrap().covariance().trace();
    for _ in 0..1_000 {
        robot.sample(&mut map, sighting("dock", [1.0, 0.0, 0.0], 0.1));
    }
    let often = map.landmark(LandmarkId(0)).unwrap().covariance().trace();
    assert!(
        often <= once && often > 0.99 * once,
        "{once} became {often}"
    );
}

#[test]
fn two_bearings_from_different_sides_fix_a_landmark() {
    let (mut map, mut robot) = new_map();
    let elongated = |map: &mut CognitiveMap, robot: &mut Robot, x: f64, y: f64| {
        // Far along the line of sight it is vague, across it is not.
        let seen = RelativePosition::new([10.0, 0.0, 0.0], [2.0, 0.05, 0.05]).unwrap();
        let heading = if y.abs() > 1.0 {
            -std::f64::consts::FRAC_PI_2 * y.signum()
        } else {
            0.0
        };
        robot.sample(map, start_pose([x, y, 0.0], [0.0, 0.0, heading]));
        let target = Target::Landmark(label("mast"));
        let relation = Relation::Position(seen);
        robot.sample(map, SampleBody::Sighting(Sighting { target, relation }));
    };
    elongated(&mut map, &mut robot, 0.0, 0.0);
    let vague = map.landmark(LandmarkId(0)).unwrap().covariance().trace();
    elongated(&mut map, &mut robot, 10.0, 10.0);
    let landmark = map.landmark(LandmarkId(0)).unwrap();
    assert!(landmark.covariance().trace() < vague / 100.0);
    assert!((landmark.position() - Point3::new(10.0, 0.0, 0.0)).norm() < 1e-9);
}

#[test]
fn whoever_sees_a_landmark_first_defines_the_frame() {
    let (mut map, mut robot) = new_map();
    robot.sample(&mut map, sighting("dock", [1.0, 0.0, 0.0], 0.1));
    assert!(map.agent(robot.id).unwrap().placed());
    assert_eq!(map.landmark_count(), 1);
}

#[test]
fn sightings_of_the_unknown_are_counted() {
    let (mut map, mut robot) = new_map();
    robot.ahead(&mut map, 0.1, 1);
    for target in [Target::Agent(label("robot-7")), Target::OwnSample(0)] {
        let relation = Relation::Position(RelativePosition::new([1.0; 3], [0.1; 3]).unwrap());
        let events = robot.sample(
            &mut map,
            SampleBody::Sighting(Sighting { target, relation }),
        );
        assert_eq!(events, []);
    }
    let agent = map.agent(robot.id).unwrap();
    assert_eq!(
        (agent.sightings(), agent.percepts(), agent.next_seq()),
        (2, 0, 3)
    );
    assert_eq!(map.landmark_count(), 0);
}

#[test]
fn landmarks_are_paged_by_label() {
    let (mut map, mut robot) = new_map();
    for text in ["oak", "ash", "yew", "elm"] {
        robot.sample(&mut map, sighting(text, [1.0; 3], 0.1));
    }
    let labels = |after| -> Vec<_> {
        let landmarks = map.landmarks_after(after);
        landmarks
            .map(|(_, landmark)| landmark.label().as_str())
            .collect()
    };
    assert_eq!(labels(None), ["ash", "elm", "oak", "yew"]);
    assert_eq!(labels(Some("elm")), ["oak", "yew"]);
    assert_eq!(labels(Some("fir")), ["oak", "yew"]);
    assert_eq!(labels(Some("zzz")), [""; 0]);
}
