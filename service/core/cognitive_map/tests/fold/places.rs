//! Recruitment and revisits.

use cognitive_map::{CognitiveMap, EventKind, PlaceId, Recruitment, Settings};
use nalgebra::{Isometry3, Point3, Vector3};
use proptest::prelude::*;

use crate::journal::{Robot, motion, settings, sighting, start_pose};

fn recruited(events: &[EventKind]) -> usize {
    events
        .iter()
        .filter(|event| matches!(event, EventKind::PlaceRecruited { .. }))
        .count()
}

fn entered(events: &[EventKind]) -> Vec<PlaceId> {
    let place = |event: &EventKind| match event {
        EventKind::PlaceEntered { place, .. } => Some(*place),
        _ => None,
    };
    events.iter().filter_map(place).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// With any walk, no two places are closer than a field radius, and where the agent has been in
    /// small steps some place is near.
    #[test]
    fn places_are_spaced_and_cover_the_way(
        turns in prop::collection::vec((-0.5..0.5f64, -0.2..0.2f64), 1..300),
        field_radius_m in 0.1..1.0f64,
    ) {
        let mut map = CognitiveMap::new(settings(|values| values.field_radius_m = field_radius_m));
        let mut robot = Robot::enrol(&mut map);
        for (yaw, pitch) in turns {
            robot.go(&mut map, [0.1, 0.0, 0.0], [0.0, pitch, yaw]);
            let here = robot.position(&map);
            let (place, distance_m) = map.nearest_place(&here).unwrap();
            prop_assert!(distance_m <= field_radius_m * 1.125 + 0.1, "{place:?} {distance_m}");
        }
        let positions: Vec<_> = map.places().map(|(_, place)| *place.position()).collect();
        for (index, a) in positions.iter().enumerate() {
            for b in &positions[..index] {
                prop_assert!((a - b).norm() > field_radius_m);
            }
        }
    }
}

#[test]
fn a_second_lap_enters_the_places_of_the_first() {
    let mut map = CognitiveMap::new(Settings::default());
    let mut robot = Robot::enrol(&mut map);
    // A circle of 100 steps, left round: radius 0.05 / (2 sin(π/100)) ≈ 0.8 m.
    let lap = |map: &mut CognitiveMap, robot: &mut Robot| -> Vec<EventKind> {
        let turn = [0.0, 0.0, std::f64::consts::TAU / 100.0];
        (0..100)
            .flat_map(|_| robot.go(map, [0.05, 0.0, 0.0], turn))
            .collect()
    };
    let first = recruited(&lap(&mut map, &mut robot));
    assert!(
        (10..=20).contains(&first),
        "one per field radius of five metres of path: {first}"
    );
    let second = lap(&mut map, &mut robot);
    assert_eq!(recruited(&second), 0);
    assert_eq!(entered(&second).len(), first, "each of them once");
    let third = lap(&mut map, &mut robot);
    assert_eq!(entered(&third).len(), first);
    assert!(
        map.places()
            .all(|(_, place)| (2..=4).contains(&place.visits()))
    );
    assert!(
        map.places()
            .all(|(_, place)| place.last_stamp_ns() > place.first_stamp_ns())
    );
}

/// Odometry turns too much, so that places are founded beside where the robot is. When it sees the
/// landmarks of the start again, they move with its past.
#[test]
fn places_move_when_landmarks_correct_the_past() {
    const LAP: usize = 100;
    let mut map = CognitiveMap::new(Settings::default());
    let mut robot = Robot::enrol(&mut map);
    robot.sample(&mut map, start_pose([0.0; 3], [0.0; 3]));
    let turn = std::f64::consts::TAU / LAP as f64;
    let step = Isometry3::new(Vector3::new(0.2, 0.0, 0.0), Vector3::new(0.0, 0.0, turn));
    let (mut truth, mut founded) = (Isometry3::identity(), Vec::new());
    for at in 0..LAP + LAP / 2 {
        let events = robot.go(&mut map, [0.2, 0.0, 0.0], [0.0, 0.0, turn * 1.03]);
        truth *= step;
        founded.extend(events.iter().filter_map(|event| match event {
            EventKind::PlaceRecruited { place, position } if (10..LAP - 10).contains(&at) => {
                Some((
                    *place,
                    (position.coords - truth.translation.vector).norm(),
                    truth,
                ))
            }
            _ => None,
        }));
        if !(10..LAP - 10).contains(&(at % LAP)) {
            for (name, stands) in [("door", [1.0, 2.0, 0.0]), ("lamp", [3.0, -1.0, 1.0])] {
                let seen = truth.inverse() * Point3::from(stands);
                robot.sample(&mut map, sighting(name, seen.coords.into(), 0.02));
            }
        }
    }
    let n = founded.len() as f64;
    let before_m = founded.iter().map(|(_, off_m, _)| off_m).sum::<f64>() / n;
    let off_m = |(place, _, truth): &(PlaceId, f64, Isometry3<f64>)| {
        let place = map.place(*place).expect("remembered");
        (place.position().coords - truth.translation.vector).norm()
    };
    let after_m = founded.iter().map(off_m).sum::<f64>() / n;
    assert!(
        n > 30.0 && before_m > 0.05 && after_m < 0.5 * before_m,
        "{n} {before_m} {after_m}"
    );
}

#[test]
fn another_agent_enters_the_places_of_the_first() {
    let mut map = CognitiveMap::new(Settings::default());
    let mut founder = Robot::enrol(&mut map);
    founder.ahead(&mut map, 0.1, 30);
    let places = map.place_count();
    let mut visitor = Robot::enrol(&mut map);
    visitor.sample(&mut map, start_pose([0.0; 3], [0.0; 3]));
    let events = visitor.ahead(&mut map, 0.1, 30);
    assert_eq!(recruited(&events), 0);
    assert_eq!(entered(&events).len(), places);
    assert!(
        map.places()
            .all(|(_, place)| place.founder() == founder.id && place.visits() == 2)
    );
}

#[test]
fn a_founded_place_says_where_when_and_by_whom() {
    let mut map = CognitiveMap::new(Settings::default());
    let mut robot = Robot::enrol(&mut map);
    robot.sample(&mut map, start_pose([3.0, 4.0, 5.0], [0.0, 0.0, 1.0]));
    let events = robot.go(&mut map, [0.0; 3], [0.0; 3]);
    let position = Point3::new(3.0, 4.0, 5.0);
    assert_eq!(
        events,
        [EventKind::PlaceRecruited {
            place: PlaceId(0),
            position
        }]
    );
    let place = map.place(PlaceId(0)).unwrap();
    assert_eq!(*place.position(), position);
    assert!((place.rotation().angle() - 1.0).abs() < 1e-12);
    assert!(
        place.position_sd_m().norm() < f64::MIN_POSITIVE,
        "the start pose was exact"
    );
    assert_eq!(
        (place.first_stamp_ns(), place.visits()),
        (robot.stamp_ns, 1)
    );
    assert_eq!(place.code(map.modules()), map.modules().code_at(&position));
    assert_eq!(
        map.agent(robot.id).unwrap().place(),
        Some((PlaceId(0), 1.0))
    );
}

/// The deviation of a place is that of the founder's position, turned into the axes of the map.
#[test]
fn uncertainty_of_a_place_lies_along_the_axes_of_the_map() {
    let mut map = CognitiveMap::new(Settings::default());
    let mut robot = Robot::enrol(&mut map);
    let noise = cognitive_map::PoseNoise::new([0.1, 0.2, 0.3], [0.0; 3]).unwrap();
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let start = cognitive_map::StartPose::new([0.0; 3], [0.0, 0.0, half, half], noise).unwrap();
    robot.sample(&mut map, cognitive_map::SampleBody::StartPose(start));
    robot.go(&mut map, [0.0; 3], [0.0; 3]);
    let sd_m = map.place(PlaceId(0)).unwrap().position_sd_m();
    assert!((sd_m - Vector3::new(0.2, 0.1, 0.3)).norm() < 1e-12);
}

#[test]
fn standing_and_hovering_are_no_visits() {
    let mut map = CognitiveMap::new(Settings::default());
    let mut robot = Robot::enrol(&mut map);
    robot.ahead(&mut map, 0.01, 1);
    for _ in 0..300 {
        assert_eq!(robot.go(&mut map, [0.01, 0.0, 0.0], [0.0; 3]), []);
        assert_eq!(robot.go(&mut map, [-0.01, 0.0, 0.0], [0.0; 3]), []);
    }
    assert_eq!(
        (map.place_count(), map.place(PlaceId(0)).unwrap().visits()),
        (1, 1)
    );
}

#[test]
fn draws_recruit_as_often_as_their_probability_says() {
    let places = |probability| {
        let recruitment = Recruitment::Bernoulli { probability };
        let mut map = CognitiveMap::new(settings(|values| values.recruitment = recruitment));
        let mut robot = Robot::enrol(&mut map);
        robot.ahead(&mut map, 0.1, 2_000);
        map.place_count()
    };
    assert_eq!(places(0.0), 0);
    assert_eq!(places(1.0), 2_000);
    // 2000 draws of 0.05: a mean of 100, a deviation of 9.7.
    assert!((60..140).contains(&places(0.05)), "{}", places(0.05));
}

#[test]
fn draws_do_not_depend_on_other_agents() {
    let recruitment = Recruitment::Bernoulli { probability: 0.2 };
    let events = |company: bool| {
        let mut map = CognitiveMap::new(settings(|values| values.recruitment = recruitment));
        let (mut robot, mut other) = (Robot::enrol(&mut map), Robot::enrol(&mut map));
        let mut recruited_at = Vec::new();
        for step in 0..200 {
            if recruited(&robot.ahead(&mut map, 0.1, 1)) > 0 {
                recruited_at.push(step);
            }
            if company {
                let far = if step == 0 {
                    start_pose([0.0, 9e3, 0.0], [0.0; 3])
                } else {
                    motion([0.1; 3], [0.0; 3])
                };
                other.sample(&mut map, far);
            }
        }
        recruited_at
    };
    assert_eq!(events(true), events(false));
    assert!(!events(false).is_empty());
}

#[test]
fn a_robot_at_rest_is_not_drawn_into_founding_the_same_place_again() {
    let recruitment = Recruitment::Bernoulli { probability: 1.0 };
    let mut map = CognitiveMap::new(settings(|values| values.recruitment = recruitment));
    let mut robot = Robot::enrol(&mut map);
    for _ in 0..100 {
        robot.go(&mut map, [0.0; 3], [0.0; 3]);
    }
    assert_eq!(map.place_count(), 1);
}

#[test]
fn confidence_falls_with_distance() {
    let recruitment = Recruitment::Bernoulli { probability: 0.0 };
    let mut map = CognitiveMap::new(settings(|values| {
        values.recruitment = recruitment;
        values.field_radius_m = 1.0;
    }));
    let mut robot = Robot::enrol(&mut map);
    robot.ahead(&mut map, 0.5, 1);
    assert_eq!(
        map.agent(robot.id).unwrap().place(),
        None,
        "nothing is recruited, nothing answers"
    );

    let mut map = CognitiveMap::new(settings(|values| values.field_radius_m = 1.0));
    let mut robot = Robot::enrol(&mut map);
    robot.go(&mut map, [0.0; 3], [0.0; 3]);
    for step in 1..=4 {
        robot.go(&mut map, [0.25, 0.0, 0.0], [0.0; 3]);
        let (place, confidence) = map.agent(robot.id).unwrap().place().unwrap();
        let expected = 0.5f64.powf((f64::from(step) * 0.25).powi(2));
        assert_eq!(place, PlaceId(0));
        assert!((confidence - expected).abs() < 1e-12);
    }
}
